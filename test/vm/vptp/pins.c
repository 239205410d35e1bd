// SPDX-License-Identifier: GPL-2.0
/*
 * vptp: a periodic output of each clock, wired to the external time stamp
 * input of the pair's other clock.
 *
 * The timer only decides when an edge is looked for; its stamp is computed
 * from the raw time at which the output's clock showed the edge's time, so a
 * timer that is late makes no stamp late.
 */
#include <linux/math64.h>
#include <linux/timekeeping.h>

#include "vptp.h"

static void arm(struct vptp_clock *c)
{
	u64 now = ktime_get_raw_ns();
	s64 wait = vptp_clock_reaches(c, c->next_edge) - now;

	hrtimer_start(&c->timer, ns_to_ktime(max_t(s64, wait, 1000)),
		      HRTIMER_MODE_REL);
}

static void next_edge_after(struct vptp_clock *c, s64 now)
{
	c->next_edge = (div64_s64(now, c->period) + 1) * c->period;
}

static void deliver(struct vptp_clock *c)
{
	u64 raw = vptp_clock_reaches(c, c->next_edge);
	struct ptp_clock_event event = {};

	if (c->pps) {
		event.type = PTP_CLOCK_PPS;
		ptp_clock_event(c->ptp, &event);
	}
	if (c->wired_to->extts) {
		event.type = PTP_CLOCK_EXTTS;
		event.timestamp = vptp_clock_at(c->wired_to, raw);
		ptp_clock_event(c->wired_to->ptp, &event);
	}
}

static enum hrtimer_restart edge(struct hrtimer *timer)
{
	struct vptp_clock *c = container_of(timer, struct vptp_clock, timer);
	s64 now;

	if (!c->period)
		return HRTIMER_NORESTART;
	now = vptp_clock_at(c, ktime_get_raw_ns());
	if (now >= c->next_edge) {
		deliver(c);
		next_edge_after(c, now);
	}
	arm(c);
	return HRTIMER_NORESTART;
}

/* The clock was set or has another rate: the next edge is elsewhere. */
void vptp_pins_changed(struct vptp_clock *c)
{
	if (!c->period)
		return;
	hrtimer_cancel(&c->timer);
	next_edge_after(c, vptp_clock_at(c, ktime_get_raw_ns()));
	arm(c);
}

static void set_output(struct vptp_clock *c, s64 period)
{
	hrtimer_cancel(&c->timer);
	c->period = period;
	vptp_pins_changed(c);
}

static int enable_output(struct vptp_clock *c, struct ptp_perout_request *rq,
			 int on)
{
	s64 period = rq->period.sec * NSEC_PER_SEC + rq->period.nsec;

	if (rq->index || rq->flags)
		return -EOPNOTSUPP;
	if (on && period < NSEC_PER_MSEC)
		return -EINVAL;
	set_output(c, on ? period : 0);
	return 0;
}

int vptp_pins_enable(struct ptp_clock_info *info, struct ptp_clock_request *rq,
		     int on)
{
	struct vptp_clock *c = container_of(info, struct vptp_clock, info);

	switch (rq->type) {
	case PTP_CLK_REQ_EXTTS:
		if (rq->extts.flags &
		    ~(PTP_ENABLE_FEATURE | PTP_RISING_EDGE | PTP_STRICT_FLAGS))
			return -EOPNOTSUPP;
		c->extts = on;
		return 0;
	case PTP_CLK_REQ_PEROUT:
		return enable_output(c, &rq->perout, on);
	case PTP_CLK_REQ_PPS:
		c->pps = on;
		if (on && !c->period)
			set_output(c, NSEC_PER_SEC);
		return 0;
	default:
		return -EOPNOTSUPP;
	}
}

void vptp_pins_init(struct vptp_clock *c, struct vptp_clock *wired_to)
{
	c->wired_to = wired_to;
	hrtimer_init(&c->timer, CLOCK_MONOTONIC, HRTIMER_MODE_REL);
	c->timer.function = edge;
}

void vptp_pins_stop(struct vptp_clock *c)
{
	c->period = 0;
	c->extts = false;
	if (c->timer.function)
		hrtimer_cancel(&c->timer);
}
