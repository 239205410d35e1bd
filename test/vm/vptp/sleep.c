// SPDX-License-Identifier: GPL-2.0
/*
 * vptp: while the machine sleeps CLOCK_MONOTONIC_RAW stands still. The clock
 * of an adapter that keeps its power does not.
 */
#include <linux/syscore_ops.h>
#include <linux/timekeeping.h>

#include "vptp.h"

int vptp_sleep_extra_ns;

static s64 slept_before;

/* As the kernel counts it, by a calendar clock of whole seconds. */
static s64 slept(void)
{
	return ktime_get_boottime_ns() - ktime_get_ns();
}

static int vptp_suspend(void)
{
	slept_before = slept();
	return 0;
}

static void vptp_resume(void)
{
	s64 ns = slept() - slept_before + vptp_sleep_extra_ns;
	unsigned int i;

	for (i = 0; i < vptp_num_ports; i++)
		vptp_clock_slept(&vptp_ports[i].clock, ns);
}

/* The kernel's own clocks, registered before, are up by then. */
static struct syscore_ops sleep_ops = {
	.suspend = vptp_suspend,
	.resume = vptp_resume,
};

void vptp_sleep_begin(void)
{
	register_syscore_ops(&sleep_ops);
}

void vptp_sleep_end(void)
{
	unregister_syscore_ops(&sleep_ops);
}
