// SPDX-License-Identifier: GPL-2.0
/* vptp: which messages get hardware stamps, what they say and when they come.
 */
#include <linux/etherdevice.h>
#include <linux/if_ether.h>
#include <linux/in.h>
#include <linux/ip.h>
#include <linux/ipv6.h>
#include <linux/slab.h>
#include <linux/udp.h>
#include <linux/workqueue.h>

#include "vptp.h"

#define PTP_EVENT_PORT	319
#define PTP_HEADER	34
#define PTP_EVENT_TYPES 4 /* Sync, Delay_Req, Pdelay_Req, Pdelay_Resp */

static int udp_payload(const struct sk_buff *skb, int udp)
{
	const struct udphdr *header = (const void *)(skb->data + udp);

	if (skb_headlen(skb) < udp + (int)sizeof(*header) + PTP_HEADER ||
	    header->dest != htons(PTP_EVENT_PORT))
		return -1;
	return udp + sizeof(*header);
}

/* Where the PTP header of an untagged frame begins, or -1. */
static int ptp_header(const struct sk_buff *skb, bool l2_only)
{
	const struct ethhdr *eth = (const void *)skb->data;
	const struct ipv6hdr *ip6 = (const void *)(skb->data + ETH_HLEN);
	const struct iphdr *ip = (const void *)(skb->data + ETH_HLEN);

	if (skb_headlen(skb) < ETH_HLEN + PTP_HEADER)
		return -1;
	if (eth->h_proto == htons(ETH_P_1588))
		return ETH_HLEN;
	if (l2_only)
		return -1;
	if (eth->h_proto == htons(ETH_P_IP) && ip->protocol == IPPROTO_UDP)
		return udp_payload(skb, ETH_HLEN + ip->ihl * 4);
	if (eth->h_proto == htons(ETH_P_IPV6) && ip6->nexthdr == IPPROTO_UDP)
		return udp_payload(skb, ETH_HLEN + sizeof(*ip6));
	return -1;
}

/* @skb begins with its Ethernet header. */
bool vptp_is_event_message(const struct sk_buff *skb, bool l2_only)
{
	int header = ptp_header(skb, l2_only);

	return header >= 0 && (skb->data[header] & 15) < PTP_EVENT_TYPES;
}

/* What the port's clock says at @raw, with the port's noise and resolution. */
ktime_t vptp_stamp(struct vptp_port *p, u64 raw)
{
	s64 ns = vptp_clock_at(&p->clock, raw + vptp_gauss(p->noise_ns));

	return ns_to_ktime(ns - (s64)((u64)ns % max(p->resolution_ns, 1U)));
}

struct late_stamp {
	struct delayed_work work;
	struct sk_buff *skb;
	struct net_device *dev;
	struct skb_shared_hwtstamps stamps;
};

static void deliver_late(struct work_struct *work)
{
	struct late_stamp *late =
		container_of(work, struct late_stamp, work.work);

	skb_tstamp_tx(late->skb, &late->stamps);
	dev_kfree_skb(late->skb);
	dev_put(late->dev);
	kfree(late);
}

static void schedule_late(struct vptp_port *p, struct sk_buff *skb,
			  struct skb_shared_hwtstamps stamps)
{
	struct late_stamp *late = kmalloc(sizeof(*late), GFP_ATOMIC);

	if (!late)
		return;
	INIT_DELAYED_WORK(&late->work, deliver_late);
	late->skb = skb_get(skb);
	late->dev = p->dev;
	late->stamps = stamps;
	dev_hold(p->dev);
	schedule_delayed_work(&late->work, usecs_to_jiffies(p->tx_stamp_us));
}

void vptp_deliver_tx_stamp(struct vptp_port *p, struct sk_buff *skb, u64 raw)
{
	struct skb_shared_hwtstamps stamps = {.hwtstamp = vptp_stamp(p, raw)};

	p->tx_stamps++;
	if (p->tx_stamp_us)
		schedule_late(p, skb, stamps);
	else
		skb_tstamp_tx(skb, &stamps);
}
