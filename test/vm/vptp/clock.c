// SPDX-License-Identifier: GPL-2.0
/* vptp: the clocks and what the PTP core asks of them. */
#include <linux/delay.h>
#include <linux/math64.h>
#include <linux/timekeeping.h>

#include "vptp.h"

#define WALK_NS (100 * NSEC_PER_MSEC)

/* 1e-12 to 2^-48: 2^48 / 1e12 is 281.47..., here with 32 bits of fraction. */
static s64 from_ppt(s64 ppt)
{
	return (s64)(((__int128)ppt * 1208925819615LL) >> 32);
}

static s64 to_ppt(s64 fraction)
{
	return (s64)(((__int128)fraction * 1000000000000LL) >> 48);
}

/* The time at @raw in units of 2^-32 ns; the lock is held. */
static __int128 time_at(const struct vptp_clock *c, u64 raw)
{
	s64 elapsed = raw - c->raw;
	s64 rate = c->osc + c->adj + (s64)(((__int128)c->osc * c->adj) >> 48);

	return ((__int128)c->ns << 32) + c->frac + ((__int128)elapsed << 32) +
	       (((__int128)elapsed * rate) >> 16);
}

static void rebase(struct vptp_clock *c, u64 raw)
{
	__int128 t = time_at(c, raw);

	c->raw = raw;
	c->ns = (s64)(t >> 32);
	c->frac = (u32)t;
}

/*
 * The oscillator's random walk has its steps on a grid of raw time, not where
 * somebody happens to read: what is read does not depend on who else reads.
 */
static void walk(struct vptp_clock *c, u64 raw)
{
	while (c->wander_ppt && (s64)(raw - c->next_walk) >= 0) {
		rebase(c, c->next_walk);
		c->osc += from_ppt(vptp_gauss(c->wander_ppt));
		c->next_walk += WALK_NS;
	}
	if (!c->wander_ppt)
		c->next_walk = (div64_u64(raw, WALK_NS) + 1) * WALK_NS;
}

s64 vptp_clock_at(struct vptp_clock *c, u64 raw)
{
	u64 now = ktime_get_raw_ns();
	unsigned long flags;
	s64 ns;

	spin_lock_irqsave(&c->lock, flags);
	walk(c, now); /* never ahead: @raw may be in the future */
	ns = (s64)(time_at(c, raw) >> 32);
	spin_unlock_irqrestore(&c->lock, flags);
	return ns;
}

/* The raw time at which the clock shows @ns, by its present rate. */
u64 vptp_clock_reaches(struct vptp_clock *c, s64 ns)
{
	u64 raw = ktime_get_raw_ns();
	int i;

	/* Each turn leaves max_adj, some percent, of what was missing. */
	for (i = 0; i < 8; i++)
		raw += ns - vptp_clock_at(c, raw);
	return raw;
}

static void set_adj(struct vptp_clock *c, s64 adj)
{
	unsigned long flags;
	u64 raw = ktime_get_raw_ns();

	spin_lock_irqsave(&c->lock, flags);
	walk(c, raw);
	rebase(c, raw);
	c->adj = adj;
	c->adjfines++;
	spin_unlock_irqrestore(&c->lock, flags);
	vptp_pins_changed(c);
}

void vptp_clock_set_osc(struct vptp_clock *c, s64 ppt)
{
	unsigned long flags;
	u64 raw = ktime_get_raw_ns();

	spin_lock_irqsave(&c->lock, flags);
	walk(c, raw);
	rebase(c, raw);
	c->osc_ppt = ppt;
	c->osc = from_ppt(ppt);
	spin_unlock_irqrestore(&c->lock, flags);
	vptp_pins_changed(c);
}

void vptp_clock_jump(struct vptp_clock *c, s64 ns)
{
	unsigned long flags;

	spin_lock_irqsave(&c->lock, flags);
	c->ns += ns;
	spin_unlock_irqrestore(&c->lock, flags);
	vptp_pins_changed(c);
}

/* Raw time stood still for so long, and this clock did not. */
void vptp_clock_slept(struct vptp_clock *c, s64 ns)
{
	unsigned long flags;
	u64 raw = ktime_get_raw_ns();

	spin_lock_irqsave(&c->lock, flags);
	walk(c, raw);
	rebase(c, raw);
	c->raw -= ns;
	spin_unlock_irqrestore(&c->lock, flags);
	vptp_pins_changed(c);
}

s64 vptp_clock_adj_ppt(struct vptp_clock *c)
{
	return to_ppt(c->adj);
}

static int adjfine(struct ptp_clock_info *info, long scaled_ppm)
{
	struct vptp_clock *c = container_of(info, struct vptp_clock, info);
	/* 2^-16 ppm to 2^-48: 2^32 / 1e6 is 4294.97, with 32 bits of fraction.
	 */
	s64 adj = (s64)(((__int128)scaled_ppm * 18446744073710LL) >> 32);

	if (vptp_chance(c->busy_permille))
		return -EBUSY;
	if (c->granularity_ppt) {
		s64 unit = from_ppt(c->granularity_ppt);
		s64 half = adj < 0 ? -unit / 2 : unit / 2;

		adj = div64_s64(adj + half, unit) * unit;
	}
	set_adj(c, adj);
	return 0;
}

static int adjtime(struct ptp_clock_info *info, s64 delta)
{
	struct vptp_clock *c = container_of(info, struct vptp_clock, info);

	if (vptp_chance(c->busy_permille))
		return -EBUSY;
	c->adjtimes++;
	vptp_clock_jump(c, delta);
	return 0;
}

static int settime(struct ptp_clock_info *info, const struct timespec64 *ts)
{
	struct vptp_clock *c = container_of(info, struct vptp_clock, info);
	unsigned long flags;
	u64 raw = ktime_get_raw_ns();

	spin_lock_irqsave(&c->lock, flags);
	walk(c, raw);
	c->raw = raw;
	c->ns = timespec64_to_ns(ts);
	c->frac = 0;
	c->settimes++;
	spin_unlock_irqrestore(&c->lock, flags);
	vptp_pins_changed(c);
	return 0;
}

/* One that is interrupted: by half of the chances before, else after. */
static void interrupted(struct vptp_clock *c, bool before, u32 dice)
{
	if (c->wide_us && (dice >> 31) == before &&
	    dice % 1000 < c->wide_permille)
		usleep_range(c->wide_us, c->wide_us + 1);
}

static int gettimex(struct ptp_clock_info *info, struct timespec64 *ts,
		    struct ptp_system_timestamp *sts)
{
	struct vptp_clock *c = container_of(info, struct vptp_clock, info);
	u32 dice = c->wide_permille ? vptp_random() : 0;
	u64 raw;

	if (c->unreadable)
		return -EIO;
	if (vptp_chance(c->busy_permille))
		return -EBUSY;
	ptp_read_system_prets(sts);
	interrupted(c, true, dice);
	ndelay(c->read_ns);
	raw = ktime_get_raw_ns() + c->read_skew_ns;
	ndelay(c->read_ns);
	interrupted(c, false, dice);
	ptp_read_system_postts(sts);
	*ts = ns_to_timespec64(vptp_clock_at(c, raw));
	return 0;
}

static int gettime(struct ptp_clock_info *info, struct timespec64 *ts)
{
	return gettimex(info, ts, NULL);
}

static int read_with_counter(ktime_t *device,
			     struct system_counterval_t *system, void *context)
{
	struct system_time_snapshot snapshot;

	ktime_get_snapshot(&snapshot);
	*device =
		ns_to_ktime(vptp_clock_at(context, ktime_to_ns(snapshot.raw)));
	system->cycles = snapshot.cycles;
	system->cs_id = snapshot.cs_id;
	system->use_nsecs = false;
	return 0;
}

static int getcrosststamp(struct ptp_clock_info *info,
			  struct system_device_crosststamp *stamps)
{
	struct vptp_clock *c = container_of(info, struct vptp_clock, info);

	if (c->unreadable)
		return -EIO;
	if (vptp_chance(c->busy_permille))
		return -EBUSY;
	return get_device_system_crosststamp(read_with_counter, c, NULL,
					     stamps);
}

int vptp_clock_register(struct vptp_clock *c, int index)
{
	spin_lock_init(&c->lock);
	c->raw = ktime_get_raw_ns();
	c->ns = ktime_get_real_ns();
	c->info = (struct ptp_clock_info){
		.owner = THIS_MODULE,
		.max_adj = vptp_max_adj,
		.n_ext_ts = 1,
		.n_per_out = 1,
		.pps = 1,
		.adjfine = adjfine,
		.adjtime = adjtime,
		.settime64 = settime,
		.enable = vptp_pins_enable,
	};
	if (vptp_extended)
		c->info.gettimex64 = gettimex;
	else
		c->info.gettime64 = gettime;
	if (vptp_cross)
		c->info.getcrosststamp = getcrosststamp;
	snprintf(c->info.name, sizeof(c->info.name), "vptp%d", index);
	c->ptp = ptp_clock_register(&c->info, NULL);
	return PTR_ERR_OR_ZERO(c->ptp);
}

void vptp_clock_unregister(struct vptp_clock *c)
{
	vptp_pins_stop(c);
	if (!IS_ERR_OR_NULL(c->ptp))
		ptp_clock_unregister(c->ptp);
	c->ptp = NULL;
}
