/* SPDX-License-Identifier: GPL-2.0 */
/*
 * vptp: pairs of Ethernet devices, each with a PTP hardware clock and hardware
 * timestamps of its own, for tests in a virtual machine. See README.md.
 */
#ifndef VPTP_H
#define VPTP_H

#include <linux/hrtimer.h>
#include <linux/net_tstamp.h>
#include <linux/netdevice.h>
#include <linux/ptp_clock_kernel.h>
#include <linux/spinlock.h>

#define VPTP_MAX_PORTS 8

struct dentry;

/**
 * struct vptp_clock - a clock that is arithmetic on CLOCK_MONOTONIC_RAW
 *
 * Its time at the raw time r >= @raw is
 *
 *	ns + (r - raw) (1 + osc) (1 + adj)
 *
 * where osc is the error of the oscillator and adj the adjustment by the PTP
 * core. Both are fractions in units of 2^-48, time is in units of 2^-32 ns.
 *
 * @raw:	CLOCK_MONOTONIC_RAW of the last change, ns
 * @ns:		the clock's time at @raw
 * @frac:	and its fraction, 2^-32 ns
 * @osc_ppt:	error of the oscillator as it was told, 1e-12
 * @osc:	the same with the wander so far, 2^-48
 * @adj:	adjustment, 2^-48
 * @next_walk:	raw time of the next step of the wander
 */
struct vptp_clock {
	struct ptp_clock_info info;
	struct ptp_clock *ptp;
	spinlock_t lock; /* of the time's state, below */
	u64 raw;
	s64 ns;
	u32 frac;
	s64 osc_ppt;
	s64 osc;
	s64 adj;
	u64 next_walk;
	u64 adjfines, adjtimes, settimes;

	/* debugfs */
	u32 wander_ppt; /* standard deviation of a step every 100 ms */
	u32 granularity_ppt; /* the adjustment is a multiple of it; 0: any */
	u32 read_ns; /* a reading takes so long before, and after */
	u32 read_skew_ns; /* the instant of a reading is so much later */
	u32 wide_permille; /* of readings: interrupted, on either side */
	u32 wide_us; /* for so long */
	u32 unreadable; /* readings fail with -EIO */
	u32 busy_permille; /* of readings and settings: fail with -EBUSY */

	/* pins.c: one output, wired to the input of the pair's other clock */
	struct hrtimer timer;
	struct vptp_clock *wired_to;
	s64 period; /* ns; 0: off */
	s64 next_edge; /* in this clock's time, ns */
	bool pps; /* PPS events of the PTP core */
	bool extts; /* this clock's input is enabled */
};

/**
 * struct vptp_port - a network device
 *
 * The parameters of a message's way are those of the port that sends it, those
 * of a stamp those of the port that takes it.
 */
struct vptp_port {
	struct net_device *dev;
	struct vptp_port *peer;
	struct vptp_clock clock;
	struct kernel_hwtstamp_config config;
	u64 tx_stamps, rx_stamps;
	int index;
	bool registered;

	/* debugfs */
	u32 delay_ns; /* to the peer */
	u32 lose_permille; /* messages that do not arrive */
	u32 noise_ns; /* of each stamp, standard deviation */
	u32 resolution_ns; /* stamps are multiples of it */
	u32 late_permille, late_ns; /* received stamps that are late */
	u32 tx_stamp_us; /* transmit stamps come so much later */
	u32 lose_tx_permille; /* stamps that never come */
	u32 lose_rx_permille;
	u32 l2_only; /* stamps IEEE 802.3 alone */
};

/* main.c */
extern struct vptp_port vptp_ports[VPTP_MAX_PORTS];
extern unsigned int vptp_num_ports;
extern bool vptp_cross, vptp_extended;
extern int vptp_max_adj, vptp_sleep_extra_ns;
u32 vptp_random(void);
s64 vptp_gauss(u32 sigma);
static inline bool vptp_chance(u32 permille)
{
	return permille && vptp_random() % 1000 < permille;
}

/* clock.c */
int vptp_clock_register(struct vptp_clock *c, int index);
void vptp_clock_unregister(struct vptp_clock *c);
s64 vptp_clock_at(struct vptp_clock *c, u64 raw);
u64 vptp_clock_reaches(struct vptp_clock *c, s64 ns);
void vptp_clock_jump(struct vptp_clock *c, s64 ns);
void vptp_clock_slept(struct vptp_clock *c, s64 ns);
void vptp_clock_set_osc(struct vptp_clock *c, s64 ppt);
s64 vptp_clock_adj_ppt(struct vptp_clock *c);

/* pins.c */
void vptp_pins_init(struct vptp_clock *c, struct vptp_clock *wired_to);
void vptp_pins_stop(struct vptp_clock *c);
void vptp_pins_changed(struct vptp_clock *c);
int vptp_pins_enable(struct ptp_clock_info *info, struct ptp_clock_request *rq,
		     int on);

/* sleep.c */
void vptp_sleep_begin(void);
void vptp_sleep_end(void);

/* stamps.c */
bool vptp_is_event_message(const struct sk_buff *skb, bool l2_only);
ktime_t vptp_stamp(struct vptp_port *p, u64 raw);
void vptp_deliver_tx_stamp(struct vptp_port *p, struct sk_buff *skb, u64 raw);

/* port.c */
int vptp_port_register(struct vptp_port *p);
void vptp_port_unregister(struct vptp_port *p);
void vptp_port_free(struct vptp_port *p);

/* truth.c */
void vptp_truth_create(void);
void vptp_truth_remove(void);

#endif
