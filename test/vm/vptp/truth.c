// SPDX-License-Identifier: GPL-2.0
/* vptp: debugfs, where the truth is read and the world is changed. */
#include <linux/debugfs.h>
#include <linux/seq_file.h>
#include <linux/timekeeping.h>

#include "vptp.h"

static struct dentry *folder;

/* All clocks at one instant. */
static int truth_show(struct seq_file *m, void *unused)
{
	struct system_time_snapshot now;
	unsigned int i;

	ktime_get_snapshot(&now);
	seq_printf(m, "raw %lld real %lld", ktime_to_ns(now.raw),
		   ktime_to_ns(now.real));
	for (i = 0; i < vptp_num_ports; i++)
		seq_printf(m, " phc%u %lld", i,
			   vptp_clock_at(&vptp_ports[i].clock,
					 ktime_to_ns(now.raw)));
	seq_putc(m, '\n');
	return 0;
}
DEFINE_SHOW_ATTRIBUTE(truth);

static int stat_show(struct seq_file *m, void *unused)
{
	struct vptp_port *p;

	for (p = vptp_ports; p < vptp_ports + vptp_num_ports; p++)
		seq_printf(
			m,
			"phc%d osc_ppt %lld adj_ppt %lld adjfine %llu adjtime "
			"%llu settime %llu tx_stamps %llu rx_stamps %llu\n",
			p->index, p->clock.osc_ppt,
			vptp_clock_adj_ppt(&p->clock), p->clock.adjfines,
			p->clock.adjtimes, p->clock.settimes, p->tx_stamps,
			p->rx_stamps);
	return 0;
}
DEFINE_SHOW_ATTRIBUTE(stat);

static int osc_get(void *data, u64 *value)
{
	*value = ((struct vptp_clock *)data)->osc_ppt;
	return 0;
}

static int osc_set(void *data, u64 value)
{
	vptp_clock_set_osc(data, (s64)value);
	return 0;
}
DEFINE_DEBUGFS_ATTRIBUTE_SIGNED(osc_fops, osc_get, osc_set, "%lld\n");

static int jump_set(void *data, u64 value)
{
	vptp_clock_jump(data, (s64)value);
	return 0;
}
DEFINE_DEBUGFS_ATTRIBUTE_SIGNED(jump_fops, NULL, jump_set, "%lld\n");

static void create_clock(struct dentry *dir, struct vptp_clock *c)
{
	debugfs_create_file("osc_ppt", 0644, dir, c, &osc_fops);
	debugfs_create_file("jump_ns", 0200, dir, c, &jump_fops);
	debugfs_create_u32("wander_ppt", 0644, dir, &c->wander_ppt);
	debugfs_create_u32("granularity_ppt", 0644, dir, &c->granularity_ppt);
	debugfs_create_u32("read_ns", 0644, dir, &c->read_ns);
	debugfs_create_u32("read_skew_ns", 0644, dir, &c->read_skew_ns);
	debugfs_create_u32("wide_permille", 0644, dir, &c->wide_permille);
	debugfs_create_u32("wide_us", 0644, dir, &c->wide_us);
	debugfs_create_u32("unreadable", 0644, dir, &c->unreadable);
	debugfs_create_u32("busy_permille", 0644, dir, &c->busy_permille);
}

static void create_port(struct dentry *dir, struct vptp_port *p)
{
	debugfs_create_u32("delay_ns", 0644, dir, &p->delay_ns);
	debugfs_create_u32("lose_permille", 0644, dir, &p->lose_permille);
	debugfs_create_u32("noise_ns", 0644, dir, &p->noise_ns);
	debugfs_create_u32("resolution_ns", 0644, dir, &p->resolution_ns);
	debugfs_create_u32("late_permille", 0644, dir, &p->late_permille);
	debugfs_create_u32("late_ns", 0644, dir, &p->late_ns);
	debugfs_create_u32("tx_stamp_us", 0644, dir, &p->tx_stamp_us);
	debugfs_create_u32("lose_tx_permille", 0644, dir, &p->lose_tx_permille);
	debugfs_create_u32("lose_rx_permille", 0644, dir, &p->lose_rx_permille);
	debugfs_create_u32("l2_only", 0644, dir, &p->l2_only);
}

void vptp_truth_create(void)
{
	unsigned int i;

	folder = debugfs_create_dir("vptp", NULL);
	debugfs_create_file("truth", 0444, folder, NULL, &truth_fops);
	debugfs_create_file("stat", 0444, folder, NULL, &stat_fops);
	for (i = 0; i < vptp_num_ports; i++) {
		char name[8];
		struct dentry *dir;

		snprintf(name, sizeof(name), "%u", i);
		dir = debugfs_create_dir(name, folder);
		create_clock(dir, &vptp_ports[i].clock);
		create_port(dir, &vptp_ports[i]);
	}
}

void vptp_truth_remove(void)
{
	debugfs_remove(folder);
}
