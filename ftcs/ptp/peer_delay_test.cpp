// SPDX-License-Identifier: MIT
//
// The world: peer_delay_fixture.h.
#include "ftcs/ptp/peer_delay.h"

#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/peer_delay_fixture.h"

namespace ftcs::ptp::peer_delay_test {
namespace {

TEST_F(PeerDelayTest, first_exchange_takes_the_turn_around_as_it_is_the_second_knows_the_rate) {
  const auto first = exchange(0s);
  ASSERT_EQ(first.size(), 1U);
  EXPECT_TRUE(first[0].first);
  // 10 ms of the neighbour's clock, 100 ppm fast, are 1 us too long: half of it is missing.
  EXPECT_NEAR(first[0].mean_link_delay.ns(), 700.0 - 500.0, 1.0);
  const auto second = exchange(1s);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_FALSE(second[0].first);
  EXPECT_NEAR(second[0].neighbor_rate_ratio.ppm(), 100.0, 1e-3);
  EXPECT_NEAR(second[0].mean_link_delay.ns(), 700.0, 0.5);
  EXPECT_EQ(count(Counter::kPeerDelays), 2U);
}

TEST_F(PeerDelayTest, a_one_step_answer_has_its_turn_around_in_the_correction) {
  const auto id = ask(0s);
  static_cast<void>(stamp(id, 0s));
  Message answer = message(id, PdelayResp{ReferenceTime{}, kUs});
  answer.header.correction = Duration{kTurnAround};
  const auto delays = of<EmitPeerDelay>(hand_over(answer, kTurnAround + 2 * kLink));
  ASSERT_EQ(delays.size(), 1U);
  EXPECT_EQ(delays[0].mean_link_delay, Duration{kLink});
  EXPECT_EQ(delays[0].neighbor_rate_ratio, Rate{});
}

TEST_F(PeerDelayTest, a_two_step_answer_may_tell_the_difference_alone) {
  const auto id = ask(0s);
  static_cast<void>(stamp(id, 0s));
  Message answer = message(id, PdelayResp{ReferenceTime{}, kUs});
  answer.header.flags = flag::kTwoStep;
  static_cast<void>(hand_over(answer, kTurnAround + 2 * kLink));
  Message last = message(id, PdelayRespFollowUp{ReferenceTime{}, kUs});
  last.header.correction = Duration{kTurnAround};
  const auto delays = of<EmitPeerDelay>(hand_over(last, 20ms));
  ASSERT_EQ(delays.size(), 1U);
  EXPECT_EQ(delays[0].mean_link_delay, Duration{kLink});
}

TEST_F(PeerDelayTest, the_transmitters_own_stamps_are_told_and_nobody_elses) {
  EXPECT_FALSE(exchange(0s).at(0).stamps);
  peer_.set_transmitter(kStranger);
  EXPECT_FALSE(exchange(1s).at(0).stamps);
  peer_.set_transmitter(kNeighbour);
  const auto told = exchange(2s);
  ASSERT_EQ(told.size(), 1U);
  ASSERT_TRUE(told[0].stamps);
  const auto& [request, response] = *told[0].stamps;
  EXPECT_EQ(request.direction, Direction::kBackward);
  EXPECT_EQ(request.free_running, ours(2s));
  EXPECT_NEAR((request.reference - neighbours(2s + kLink)).ns(), 0.0, 1.0);  // whole ns on the wire
  EXPECT_EQ(response.direction, Direction::kForward);
  EXPECT_EQ(response.free_running, ours(2s + 2 * kLink + kTurnAround));
  EXPECT_NEAR((response.reference - neighbours(2s + kLink + kTurnAround)).ns(), 0.0, 1.0);
}

TEST_F(PeerDelayTest, both_stamps_must_be_told) {
  peer_.set_transmitter(kNeighbour);
  for (const bool receipt : {false, true}) {
    const Nanoseconds at = receipt ? 1s : 0s;
    const auto id = ask(at);
    static_cast<void>(stamp(id, at));
    Message answer = response(id, at + kLink);
    std::get<PdelayResp>(answer.body).request_receipt =
        receipt ? neighbours(at + kLink) : ReferenceTime{};
    static_cast<void>(hand_over(answer, at + 2 * kLink + kTurnAround));
    Message last = message(id, PdelayRespFollowUp{ReferenceTime{}, kUs});
    last.header.correction = Duration{receipt ? 0ms : kTurnAround};
    for (const EmitPeerDelay& delay : of<EmitPeerDelay>(hand_over(last, at + 20ms))) {
      EXPECT_FALSE(delay.stamps);
    }
  }
}

TEST_F(PeerDelayTest, stamps_have_the_corrections_and_the_asymmetry) {
  PeerDelayConfig config;
  config.asymmetry = Duration{30ns};
  peer_ = PeerDelay{config};
  peer_.start(ours(0s));
  peer_.set_transmitter(kNeighbour);
  const auto id = ask(0s);
  static_cast<void>(stamp(id, 0s));
  Message answer = response(id, kLink);
  answer.header.correction = Duration::from_ns(-0.5);  // t2 is half a nanosecond later
  static_cast<void>(hand_over(answer, 2 * kLink));
  Message last = follow_up(id, kLink);
  last.header.correction = Duration::from_ns(0.25);
  const auto told = of<EmitPeerDelay>(hand_over(last, 3 * kLink));
  ASSERT_EQ(told.size(), 1U);
  ASSERT_TRUE(told[0].stamps);
  const ReferenceTime on_wire{Duration{Nanoseconds{neighbours(kLink).since_epoch().floor_ns()}}};
  EXPECT_EQ(told[0].stamps->request.reference - on_wire, Duration::from_ns(30.5));
  EXPECT_EQ(told[0].stamps->response.reference - on_wire, Duration::from_ns(30.25));
}

TEST_F(PeerDelayTest, an_abandoned_exchange_says_nothing) {
  const auto id = ask(0s);
  static_cast<void>(stamp(id, 0s));
  static_cast<void>(hand_over(response(id, kLink), 2 * kLink));
  peer_.abandon_exchange();
  EXPECT_TRUE(of<EmitPeerDelay>(hand_over(follow_up(id, kLink), 3 * kLink)).empty());
  EXPECT_EQ(exchange(1s).size(), 1U);
}

TEST_F(PeerDelayTest, stamp_answer_and_follow_up_may_come_in_any_order) {
  const auto complete = [this](int order, Nanoseconds at) {
    const auto id = ask(at);
    const Nanoseconds left = at + kLink + kTurnAround;
    std::size_t emitted = 0;
    for (const int part : {order / 100, order / 10 % 10, order % 10}) {
      ActionList actions;
      if (part == 1) actions = stamp(id, at);
      if (part == 2) actions = hand_over(response(id, at + kLink), left + kLink);
      if (part == 3) actions = hand_over(follow_up(id, left), left + kLink);
      emitted += of<EmitPeerDelay>(actions).size();
    }
    return emitted;
  };
  Nanoseconds at = 0s;
  for (const int order : {123, 132, 213, 231, 312, 321}) {
    SCOPED_TRACE(order);
    EXPECT_EQ(complete(order, at), 1U);
    EXPECT_NEAR(peer_.mean_link_delay()->ns(), 700.0, 501.0);
    at += 1s;
  }
}

TEST_F(PeerDelayTest, keeps_its_interval_and_counts_what_was_lost) {
  const auto first = ask(0s);
  EXPECT_EQ(peer_.deadline(), ours(1s));
  static_cast<void>(stamp(first, 0s));
  const auto second = ask(1s);  // nobody answered the first
  EXPECT_EQ(count(Counter::kLostPdelayResp), 1U);
  static_cast<void>(stamp(second, 1s));
  static_cast<void>(hand_over(response(second, 1s + kLink), 1s + kTurnAround));
  const auto third = ask(2s);  // the answer to the second was never completed
  EXPECT_EQ(count(Counter::kLostPdelayRespFollowUp), 1U);
  EXPECT_TRUE(hand_over(follow_up(second, 1s + kTurnAround), 2s).empty());
  EXPECT_EQ(count(Counter::kStalePdelayResp), 1U);
  peer_.on_stamp_missing({MessageType::kPdelayReq, third, {}}, port_);
  EXPECT_EQ(count(Counter::kMissingTransmitStamp), 1U);
  EXPECT_TRUE(hand_over(response(third, 2s), 2s + kTurnAround).empty());
  EXPECT_EQ(exchange(3s).size(), 1U) << "and none of it does harm to the next";
}

TEST_F(PeerDelayTest, answers_to_others_and_to_nothing_are_dropped) {
  EXPECT_TRUE(hand_over(response(0, 0s), 1ms).empty()) << "nothing was asked";
  const auto id = ask(0s);
  static_cast<void>(stamp(id, 0s));
  Message foreign = response(id, kLink);
  std::get<PdelayResp>(foreign.body).requesting_port = kStranger;
  EXPECT_TRUE(hand_over(foreign, 1ms).empty());
  EXPECT_EQ(count(Counter::kWrongRequestingPort), 1U);
  EXPECT_TRUE(hand_over(response(static_cast<std::uint16_t>(id + 7), kLink), 1ms).empty());
  EXPECT_EQ(count(Counter::kStalePdelayResp), 2U);
  Message absurd = response(id, kLink);
  absurd.header.correction = Duration{2s};
  EXPECT_TRUE(hand_over(absurd, 1ms).empty());
  EXPECT_EQ(count(Counter::kAbsurdCorrection), 1U);
  EXPECT_EQ(count(Counter::kPdelayRespReceived), 0U);
}

TEST_F(PeerDelayTest, two_ports_that_answer_are_no_link_between_two_ports) {
  EXPECT_EQ(exchange(0s).size(), 1U);
  const auto id = ask(1s);
  static_cast<void>(stamp(id, 1s));
  const Nanoseconds left = 1s + kLink + kTurnAround;
  static_cast<void>(hand_over(response(id, 1s + kLink), left + kLink));
  static_cast<void>(hand_over(response(id, 1s + kLink, kStranger), left + 2 * kLink));
  EXPECT_EQ(count(Counter::kSeveralResponders), 1U);
  EXPECT_TRUE(hand_over(follow_up(id, left), left + 3 * kLink).empty());
  EXPECT_TRUE(hand_over(follow_up(id, left, kStranger), left + 3 * kLink).empty());
  EXPECT_EQ(count(Counter::kWrongPeer), 1U);
  // Three requests with one answer each, then it is believed again.
  EXPECT_TRUE(exchange(2s).empty());
  EXPECT_TRUE(exchange(3s).empty());
  EXPECT_TRUE(exchange(4s).empty());
  EXPECT_EQ(exchange(5s).size(), 1U);
}

TEST_F(PeerDelayTest, a_second_answer_is_noticed_even_after_the_first_exchange_is_over) {
  EXPECT_EQ(exchange(0s).size(), 1U);
  static_cast<void>(hand_over(response(0, kLink, kStranger), 50ms));
  EXPECT_EQ(count(Counter::kSeveralResponders), 1U);
  EXPECT_TRUE(exchange(1s).empty());
}

TEST_F(PeerDelayTest, a_follow_up_of_another_port_completes_nothing) {
  const auto id = ask(0s);
  static_cast<void>(stamp(id, 0s));
  const Nanoseconds left = kLink + kTurnAround;
  static_cast<void>(hand_over(follow_up(id, left, kStranger), left));  // before the answer
  EXPECT_TRUE(of<EmitPeerDelay>(hand_over(response(id, kLink), left + kLink)).empty());
  EXPECT_EQ(count(Counter::kWrongPeer), 1U);
  EXPECT_EQ(of<EmitPeerDelay>(hand_over(follow_up(id, left), left + 2 * kLink)).size(), 1U);
  EXPECT_TRUE(hand_over(follow_up(id, left), left + 3 * kLink).empty()) << "a duplicate";
}

TEST_F(PeerDelayTest, a_neighbour_whose_clock_is_stepped_is_measured_anew) {
  for (int i = 0; i < 4; ++i) EXPECT_EQ(exchange(1s * i).size(), 1U);
  const auto id = ask(4s);
  static_cast<void>(stamp(id, 4s));
  const Nanoseconds left = 4s + kLink + kTurnAround;
  static_cast<void>(hand_over(response(id, 4s + kLink + 37s), left + kLink));
  const auto delays = of<EmitPeerDelay>(hand_over(follow_up(id, left + 37s), left + 2 * kLink));
  ASSERT_EQ(delays.size(), 1U) << "the delay needs no rate";
  EXPECT_EQ(delays[0].neighbor_rate_ratio, Rate{});
  EXPECT_EQ(count(Counter::kPeerRateRestarts), 1U);
}

TEST_F(PeerDelayTest, another_neighbour_is_another_link) {
  EXPECT_TRUE(exchange(0s)[0].first);
  EXPECT_FALSE(exchange(1s)[0].first);
  EXPECT_TRUE(exchange(2s, kStranger)[0].first);
  peer_.stop();
  EXPECT_FALSE(peer_.deadline().has_value());
  EXPECT_FALSE(peer_.mean_link_delay().has_value());
  peer_.start(ours(9s));
  EXPECT_TRUE(exchange(9s, kStranger)[0].first) << "the cable was out";
}

TEST_F(PeerDelayTest, a_delay_beyond_a_second_is_none) {
  const auto id = ask(0s);
  static_cast<void>(stamp(id, 0s));
  static_cast<void>(hand_over(response(id, 10s), 1ms));
  EXPECT_TRUE(hand_over(follow_up(id, 0s), 2ms).empty());
  EXPECT_EQ(count(Counter::kAbsurdPeerDelay), 1U);
}

TEST_F(PeerDelayTest, answers_what_the_neighbour_asks_with_both_stamps_and_their_fractions) {
  Message request = message(4711, PdelayReq{});
  request.header.correction = Duration::from_ns(3.0);
  const auto bytes = encode(request);
  const auto read = port_.read(bytes->view());
  ASSERT_TRUE(read.has_value());
  ActionList actions;
  peer_.on_message(*read, ours(1s) + Duration::from_ns(0.25), port_, actions);
  const auto answers = of<SendMessage>(actions);
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].destination, Destination::kNeighbour);
  const auto answer = decode(answers[0].bytes.view());
  const auto& body = std::get<PdelayResp>(answer->body);
  EXPECT_TRUE(answer->header.has(flag::kTwoStep));
  EXPECT_EQ(answer->header.sequence_id, 4711);
  EXPECT_EQ(body.requesting_port, kNeighbour);
  EXPECT_EQ(body.request_receipt.since_epoch(), ours(1s).since_epoch());
  EXPECT_EQ(answer->header.correction, Duration::from_ns(-0.25));

  ActionList after;
  peer_.on_sent(answers[0].id(), ours(1s + 2ms) + Duration::from_ns(0.5), port_, after);
  const auto last = of<SendMessage>(after);
  ASSERT_EQ(last.size(), 1U);
  EXPECT_EQ(last[0].channel, Channel::kGeneral);
  const auto follow_up = decode(last[0].bytes.view());
  const auto& origin = std::get<PdelayRespFollowUp>(follow_up->body);
  EXPECT_EQ(origin.requesting_port, kNeighbour);
  EXPECT_EQ(origin.response_origin.since_epoch(), ours(1s + 2ms).since_epoch());
  EXPECT_EQ(follow_up->header.correction, Duration::from_ns(3.5));
}

TEST_F(PeerDelayTest, two_neighbours_with_one_sequence_id_are_kept_apart) {
  const auto first = of<SendMessage>(hand_over(message(5, PdelayReq{}), 1s));
  const auto second = of<SendMessage>(hand_over(message(5, PdelayReq{}, kStranger), 1s));
  ASSERT_EQ(first.size(), 1U);
  ASSERT_EQ(second.size(), 1U);
  ActionList actions;
  peer_.on_sent(second[0].id(), ours(2s), port_, actions);
  const auto sent = of<SendMessage>(actions);
  ASSERT_EQ(sent.size(), 1U);
  const auto read = decode(sent[0].bytes.view());
  EXPECT_EQ(std::get<PdelayRespFollowUp>(read->body).requesting_port, kStranger);
  peer_.on_stamp_missing(first[0].id(), port_);
  EXPECT_EQ(count(Counter::kMissingTransmitStamp), 1U);
  peer_.on_stamp_missing(first[0].id(), port_);
  EXPECT_EQ(count(Counter::kUnexpectedTransmitStamp), 1U);
}

TEST_F(PeerDelayTest, a_transmit_stamp_that_comes_after_its_timeout_is_used) {
  const auto id = ask(0s);
  peer_.on_stamp_missing({MessageType::kPdelayReq, id, {}}, port_);
  static_cast<void>(hand_over(response(id, kLink), kTurnAround));
  static_cast<void>(hand_over(follow_up(id, kLink + kTurnAround), kTurnAround));
  EXPECT_EQ(of<EmitPeerDelay>(stamp(id, 0s)).size(), 1U);
  const auto answer = of<SendMessage>(hand_over(message(5, PdelayReq{}), 1s));
  ASSERT_EQ(answer.size(), 1U);
  peer_.on_stamp_missing(answer[0].id(), port_);
  ActionList actions;
  peer_.on_sent(answer[0].id(), ours(1s), port_, actions);
  EXPECT_EQ(of<SendMessage>(actions).size(), 1U) << "the Pdelay_Resp_Follow_Up";
  EXPECT_EQ(count(Counter::kMissingTransmitStamp), 2U);
  EXPECT_EQ(count(Counter::kUnexpectedTransmitStamp), 0U);
}

TEST_F(PeerDelayTest, a_copy_of_a_request_is_answered_once) {
  EXPECT_EQ(of<SendMessage>(hand_over(message(5, PdelayReq{}), 1s)).size(), 1U);
  EXPECT_TRUE(hand_over(message(5, PdelayReq{}), 1s + 3ms).empty());
  EXPECT_EQ(count(Counter::kDuplicatePdelayReq), 1U);
  EXPECT_EQ(of<SendMessage>(hand_over(message(6, PdelayReq{}), 2s)).size(), 1U);
}

TEST_F(PeerDelayTest, a_flood_of_requests_takes_no_answers_from_the_neighbour) {
  std::size_t answers = 0;
  std::size_t answers_to_flood = 0;
  for (unsigned i = 0; i < 50'000; ++i) {
    const Nanoseconds now = i * 100us;
    // By 1,000 names, or by one.
    PortIdentity forged = kStranger;
    if (i % 2 == 0) forged.port = static_cast<std::uint16_t>(i % 1000);
    const bool true_one = i % 125 == 0;
    const auto request =
        message(static_cast<std::uint16_t>(i), PdelayReq{}, true_one ? kNeighbour : forged);
    const auto sent = of<SendMessage>(hand_over(request, now));
    (true_one ? answers : answers_to_flood) += sent.size();
  }
  EXPECT_EQ(answers, 400U);
  EXPECT_GT(answers_to_flood, 256U);
  EXPECT_LE(answers_to_flood, 6U * (3U * 256U + 1024U));
  EXPECT_EQ(count(Counter::kAnswersRefused) + answers + answers_to_flood, 50'000U);
}

TEST_F(PeerDelayTest, of_two_answers_with_different_stamps_none_counts) {
  const auto id = ask(0s);
  static_cast<void>(stamp(id, 0s));
  static_cast<void>(hand_over(response(id, kLink), 1ms));
  static_cast<void>(hand_over(response(id, kLink), 2ms));  // a copy does no harm
  static_cast<void>(hand_over(response(id, kLink + 3ms), 4ms));
  EXPECT_TRUE(hand_over(follow_up(id, kLink + 3ms), 4ms).empty());
  EXPECT_EQ(count(Counter::kStalePdelayResp), 3U);
}

TEST_F(PeerDelayTest, a_port_that_measures_end_to_end_answers_nothing) {
  peer_.stop();
  EXPECT_TRUE(hand_over(message(1, PdelayReq{}), 1s).empty());
  EXPECT_EQ(count(Counter::kPdelayIgnored), 1U);
}

TEST_F(PeerDelayTest, allocates_nothing) {
  const test::ForbidAllocation guard;
  for (int i = 0; i < 20; ++i) {
    ActionList actions;
    peer_.on_timer(ours(1s * i), port_, actions);
    peer_.on_sent({MessageType::kPdelayReq, static_cast<std::uint16_t>(i), {}}, ours(1s * i), port_,
                  actions);
    const auto answer = encode(response(static_cast<std::uint16_t>(i), 1s * i + kLink));
    const auto last = encode(follow_up(static_cast<std::uint16_t>(i), 1s * i + kTurnAround));
    for (const auto* bytes : {&*answer, &*last}) {
      if (const auto read = port_.read(bytes->view())) {
        peer_.on_message(*read, ours(1s * i + kTurnAround + kLink), port_, actions);
      }
    }
  }
}

}  // namespace
}  // namespace ftcs::ptp::peer_delay_test
