// SPDX-License-Identifier: GPL-2.0
/* vptp: the network devices; what one sends its peer receives. */
#include <linux/etherdevice.h>
#include <linux/ethtool.h>
#include <linux/timekeeping.h>

#include "vptp.h"

struct vptp_priv {
	struct vptp_port *port;
};

static struct vptp_port *port_of(struct net_device *dev)
{
	return ((struct vptp_priv *)netdev_priv(dev))->port;
}

static bool stamps_sent(const struct vptp_port *p, const struct sk_buff *skb)
{
	return (skb_shinfo(skb)->tx_flags & SKBTX_HW_TSTAMP) &&
	       p->config.tx_type == HWTSTAMP_TX_ON &&
	       (!p->l2_only || vptp_is_event_message(skb, true));
}

static bool stamps_received(const struct vptp_port *p, bool event)
{
	return p->config.rx_filter == HWTSTAMP_FILTER_ALL ||
	       (p->config.rx_filter != HWTSTAMP_FILTER_NONE && event);
}

/*
 * A message that was sent at @sent arrives. Its software stamp is computed as
 * well: the time that this code takes belongs to no network.
 */
static void receive(struct vptp_port *p, struct sk_buff *skb, u32 delay,
		    const struct system_time_snapshot *sent)
{
	bool event = vptp_is_event_message(skb, p->l2_only);
	unsigned int length = skb->len;
	u64 arrived = ktime_to_ns(sent->raw) + delay;

	if (__dev_forward_skb(p->dev, skb) != NET_RX_SUCCESS)
		return;
	dev_sw_netstats_rx_add(p->dev, length);
	memset(skb_hwtstamps(skb), 0, sizeof(*skb_hwtstamps(skb)));
	skb->tstamp = ktime_add_ns(sent->real, delay);
	if (stamps_received(p, event) && !vptp_chance(p->lose_rx_permille)) {
		if (vptp_chance(p->late_permille))
			arrived += p->late_ns;
		skb_hwtstamps(skb)->hwtstamp = vptp_stamp(p, arrived);
		p->rx_stamps++;
	}
	netif_rx(skb);
}

static netdev_tx_t start_xmit(struct sk_buff *skb, struct net_device *dev)
{
	struct vptp_port *p = port_of(dev);
	struct system_time_snapshot sent;
	struct sk_buff *copy;

	if (skb_put_padto(skb, ETH_ZLEN))
		return NETDEV_TX_OK;
	copy = skb_copy(skb, GFP_ATOMIC);
	skb_tx_timestamp(skb); /* before it is sent, as in other drivers */
	ktime_get_snapshot(&sent);
	if (stamps_sent(p, skb) && !vptp_chance(p->lose_tx_permille)) {
		skb_shinfo(skb)->tx_flags |= SKBTX_IN_PROGRESS;
		vptp_deliver_tx_stamp(p, skb, ktime_to_ns(sent.raw));
	}
	dev_sw_netstats_tx_add(dev, 1, skb->len);
	dev_consume_skb_any(skb);
	if (!copy)
		return NETDEV_TX_OK;
	if (netif_running(p->peer->dev) && !vptp_chance(p->lose_permille))
		receive(p->peer, copy, p->delay_ns, &sent);
	else
		dev_kfree_skb(copy);
	return NETDEV_TX_OK;
}

static int open(struct net_device *dev)
{
	struct vptp_port *p = port_of(dev);

	netif_start_queue(dev);
	if (netif_running(p->peer->dev)) {
		netif_carrier_on(dev);
		netif_carrier_on(p->peer->dev);
	}
	return 0;
}

static int stop(struct net_device *dev)
{
	netif_stop_queue(dev);
	netif_carrier_off(dev);
	netif_carrier_off(port_of(dev)->peer->dev);
	return 0;
}

static int hwtstamp_get(struct net_device *dev,
			struct kernel_hwtstamp_config *config)
{
	struct vptp_port *p = port_of(dev);

	config->flags = 0;
	config->tx_type = p->config.tx_type;
	config->rx_filter = p->config.rx_filter;
	return 0;
}

static int hwtstamp_set(struct net_device *dev,
			struct kernel_hwtstamp_config *config,
			struct netlink_ext_ack *extack)
{
	struct vptp_port *p = port_of(dev);

	if (config->tx_type != HWTSTAMP_TX_OFF &&
	    config->tx_type != HWTSTAMP_TX_ON)
		return -ERANGE;
	if (config->rx_filter >= HWTSTAMP_FILTER_NTP_ALL)
		return -ERANGE;
	if (config->rx_filter == HWTSTAMP_FILTER_ALL && p->l2_only)
		return -ERANGE;
	if (config->rx_filter != HWTSTAMP_FILTER_NONE &&
	    config->rx_filter != HWTSTAMP_FILTER_ALL)
		config->rx_filter = p->l2_only ? HWTSTAMP_FILTER_PTP_V2_L2_EVENT
					       : HWTSTAMP_FILTER_PTP_V2_EVENT;
	p->config = *config;
	return 0;
}

static int get_ts_info(struct net_device *dev,
		       struct kernel_ethtool_ts_info *info)
{
	struct vptp_port *p = port_of(dev);

	info->so_timestamping =
		SOF_TIMESTAMPING_TX_SOFTWARE | SOF_TIMESTAMPING_RX_SOFTWARE |
		SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_TX_HARDWARE |
		SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
	info->phc_index = ptp_clock_index(p->clock.ptp);
	info->tx_types = BIT(HWTSTAMP_TX_OFF) | BIT(HWTSTAMP_TX_ON);
	info->rx_filters = BIT(HWTSTAMP_FILTER_NONE);
	if (p->l2_only)
		info->rx_filters |= BIT(HWTSTAMP_FILTER_PTP_V2_L2_EVENT);
	else
		info->rx_filters |= BIT(HWTSTAMP_FILTER_ALL) |
				    BIT(HWTSTAMP_FILTER_PTP_V2_EVENT);
	return 0;
}

static void get_drvinfo(struct net_device *dev, struct ethtool_drvinfo *info)
{
	strscpy(info->driver, "vptp", sizeof(info->driver));
}

static int get_link_ksettings(struct net_device *dev,
			      struct ethtool_link_ksettings *settings)
{
	settings->base.speed = SPEED_1000;
	settings->base.duplex = DUPLEX_FULL;
	settings->base.port = PORT_TP;
	settings->base.autoneg = AUTONEG_DISABLE;
	return 0;
}

static const struct ethtool_ops ethtool_ops = {
	.get_drvinfo = get_drvinfo,
	.get_link = ethtool_op_get_link,
	.get_ts_info = get_ts_info,
	.get_link_ksettings = get_link_ksettings,
};

static const struct net_device_ops net_device_ops = {
	.ndo_open = open,
	.ndo_stop = stop,
	.ndo_start_xmit = start_xmit,
	.ndo_hwtstamp_get = hwtstamp_get,
	.ndo_hwtstamp_set = hwtstamp_set,
	.ndo_set_mac_address = eth_mac_addr,
	.ndo_validate_addr = eth_validate_addr,
	.ndo_get_stats64 = dev_get_tstats64,
};

static void setup(struct net_device *dev)
{
	ether_setup(dev);
	dev->netdev_ops = &net_device_ops;
	dev->ethtool_ops = &ethtool_ops;
	dev->pcpu_stat_type = NETDEV_PCPU_STAT_TSTATS;
	dev->priv_flags &= ~IFF_TX_SKB_SHARING;
}

int vptp_port_register(struct vptp_port *p)
{
	const u8 address[ETH_ALEN] = {2, 0, 0, 0, 1, p->index};
	int error;

	p->dev = alloc_netdev(sizeof(struct vptp_priv), "vptp%d", NET_NAME_ENUM,
			      setup);
	if (!p->dev)
		return -ENOMEM;
	((struct vptp_priv *)netdev_priv(p->dev))->port = p;
	eth_hw_addr_set(p->dev, address);
	netif_carrier_off(p->dev);
	error = register_netdev(p->dev);
	p->registered = !error;
	return error;
}

/* The device goes, its memory stays: the peer may still look at it. */
void vptp_port_unregister(struct vptp_port *p)
{
	if (p->registered)
		unregister_netdev(p->dev);
	p->registered = false;
}

void vptp_port_free(struct vptp_port *p)
{
	if (p->dev)
		free_netdev(p->dev);
	p->dev = NULL;
}
