// SPDX-License-Identifier: GPL-2.0
/* vptp: parameters, randomness, loading and unloading. */
#include <linux/module.h>
#include <linux/prandom.h>

#include "vptp.h"

static unsigned int pairs = 1;
module_param(pairs, uint, 0444);
MODULE_PARM_DESC(pairs, "pairs of devices, 1 to 4");

static unsigned int seed = 1;
module_param(seed, uint, 0444);
MODULE_PARM_DESC(seed, "of everything random");

bool vptp_cross = true;
module_param_named(cross, vptp_cross, bool, 0444);
MODULE_PARM_DESC(cross, "PTP_SYS_OFFSET_PRECISE");

bool vptp_extended = true;
module_param_named(extended, vptp_extended, bool, 0444);
MODULE_PARM_DESC(extended, "PTP_SYS_OFFSET_EXTENDED");

int vptp_max_adj = 62499999;
module_param_named(max_adj, vptp_max_adj, int, 0444);
MODULE_PARM_DESC(max_adj, "largest adjustment, ppb");

module_param_named(sleep_extra_ns, vptp_sleep_extra_ns, int, 0644);
MODULE_PARM_DESC(sleep_extra_ns, "a sleep is so much longer than it is taken for");

struct vptp_port vptp_ports[VPTP_MAX_PORTS];
unsigned int vptp_num_ports;

static struct rnd_state state;
static DEFINE_SPINLOCK(state_lock);

u32 vptp_random(void)
{
	unsigned long flags;
	u32 value;

	spin_lock_irqsave(&state_lock, flags);
	value = prandom_u32_state(&state);
	spin_unlock_irqrestore(&state_lock, flags);
	return value;
}

/* Twelve uniform numbers, their mean taken off, have a variance of one. */
s64 vptp_gauss(u32 sigma)
{
	s64 sum = -6LL << 20;
	int i;

	if (!sigma)
		return 0;
	for (i = 0; i < 12; i++)
		sum += vptp_random() >> 12;
	return (sum * sigma + (1 << 19)) >> 20;
}

static void remove_all(void)
{
	unsigned int i;

	vptp_sleep_end();
	vptp_truth_remove();
	for (i = 0; i < vptp_num_ports; i++)
		vptp_port_unregister(&vptp_ports[i]);
	for (i = 0; i < vptp_num_ports; i++)
		vptp_port_free(&vptp_ports[i]);
	for (i = 0; i < vptp_num_ports; i++)
		vptp_pins_stop(&vptp_ports[i].clock);
	for (i = 0; i < vptp_num_ports; i++)
		vptp_clock_unregister(&vptp_ports[i].clock);
}

static void init_port(unsigned int i)
{
	struct vptp_port *p = &vptp_ports[i];

	p->index = i;
	p->peer = &vptp_ports[i ^ 1];
	p->delay_ns = 1000;
	p->resolution_ns = 1;
	p->late_ns = 100000;
	vptp_pins_init(&p->clock, &p->peer->clock);
}

static int __init vptp_init(void)
{
	unsigned int i;
	int error = 0;

	if (pairs < 1 || pairs > VPTP_MAX_PORTS / 2) {
		pr_err("vptp: pairs is %u, expected 1 to %d\n", pairs,
		       VPTP_MAX_PORTS / 2);
		return -EINVAL;
	}
	prandom_seed_state(&state, seed);
	vptp_sleep_begin();
	vptp_num_ports = 2 * pairs;
	for (i = 0; i < vptp_num_ports; i++)
		init_port(i);
	for (i = 0; i < vptp_num_ports && !error; i++)
		error = vptp_clock_register(&vptp_ports[i].clock, i);
	for (i = 0; i < vptp_num_ports && !error; i++)
		error = vptp_port_register(&vptp_ports[i]);
	if (error) {
		remove_all();
		return error;
	}
	vptp_truth_create();
	return 0;
}
module_init(vptp_init);

static void __exit vptp_exit(void)
{
	remove_all();
}
module_exit(vptp_exit);

MODULE_LICENSE("GPL");
MODULE_DESCRIPTION(
	"pairs of network devices with simulated PTP hardware clocks");
