// SPDX-License-Identifier: MIT
#include "ftcs/ptp/counters.h"

namespace ftcs::ptp {

namespace {

// In the order of Counter.
constexpr std::array<std::string_view, kCounters> kNames = {"announce_received",
                                                            "sync_received",
                                                            "follow_up_received",
                                                            "delay_req_received",
                                                            "delay_resp_received",
                                                            "pdelay_req_received",
                                                            "pdelay_resp_received",
                                                            "pdelay_resp_follow_up_received",
                                                            "authenticated",
                                                            "announce_sent",
                                                            "sync_sent",
                                                            "follow_up_sent",
                                                            "delay_req_sent",
                                                            "delay_resp_sent",
                                                            "pdelay_req_sent",
                                                            "pdelay_resp_sent",
                                                            "pdelay_resp_follow_up_sent",
                                                            "forward_pairs",
                                                            "backward_pairs",
                                                            "peer_delays",
                                                            "truncated",
                                                            "oversized",
                                                            "wrong_version",
                                                            "unknown_type",
                                                            "wrong_length",
                                                            "bad_timestamp",
                                                            "malformed_tlv",
                                                            "authentication_missing",
                                                            "authentication_unsupported",
                                                            "authentication_unknown_key",
                                                            "authentication_wrong_code",
                                                            "replayed",
                                                            "wrong_sdo",
                                                            "wrong_domain",
                                                            "own_message",
                                                            "wrong_transmitter",
                                                            "wrong_requesting_port",
                                                            "not_for_this_role",
                                                            "alternate_transmitter",
                                                            "management_ignored",
                                                            "signaling_ignored",
                                                            "pdelay_ignored",
                                                            "delay_ignored",
                                                            "wrong_channel",
                                                            "not_listening",
                                                            "missed_sync",
                                                            "duplicate_sync",
                                                            "duplicate_follow_up",
                                                            "early_follow_up",
                                                            "contradicting_follow_up",
                                                            "stale_sync",
                                                            "stale_follow_up",
                                                            "sequence_restarts",
                                                            "lost_follow_up",
                                                            "lost_sync",
                                                            "answers_refused",
                                                            "stale_delay_resp",
                                                            "lost_delay_resp",
                                                            "missing_transmit_stamp",
                                                            "unexpected_transmit_stamp",
                                                            "lost_pdelay_resp",
                                                            "lost_pdelay_resp_follow_up",
                                                            "stale_pdelay_resp",
                                                            "duplicate_pdelay_req",
                                                            "wrong_peer",
                                                            "several_responders",
                                                            "absurd_peer_delay",
                                                            "peer_rate_restarts",
                                                            "not_capable",
                                                            "negative_correction",
                                                            "absurd_correction",
                                                            "bad_interval",
                                                            "doubted_time",
                                                            "reference_jumps",
                                                            "unusable_time",
                                                            "not_sealed",
                                                            "transmitter_changes",
                                                            "announce_timeouts",
                                                            "doubted_transmitters",
                                                            "foreign_table_full",
                                                            "sync_timeouts",
                                                            "unacceptable_transmitter",
                                                            "unusable_announce",
                                                            "link_down",
                                                            "actions_dropped"};

}  // namespace

std::string_view to_string(Counter counter) noexcept {
  return kNames[static_cast<std::size_t>(counter)];
}

Counter counter_of(DecodeReason reason) noexcept {
  constexpr Counter kOf[kDecodeReasons] = {
      Counter::kTruncated,   Counter::kOversized,    Counter::kWrongVersion, Counter::kUnknownType,
      Counter::kWrongLength, Counter::kBadTimestamp, Counter::kMalformedTlv};
  return kOf[static_cast<std::size_t>(reason)];
}

}  // namespace ftcs::ptp
