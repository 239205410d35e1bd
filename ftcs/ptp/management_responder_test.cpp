// SPDX-License-Identifier: MIT
//
// The world: a port with known data sets, asked by well-formed and other requests.
#include "ftcs/ptp/management_responder.h"

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"

namespace ftcs::ptp {
namespace {

const ClockIdentity kUs = ClockIdentity::from_mac({2, 0, 0, 0, 0, 1});
const ClockIdentity kSomebody = ClockIdentity::from_mac({2, 0, 0, 0, 0, 2});
const ClockIdentity kEverybody{{255, 255, 255, 255, 255, 255, 255, 255}};

ManagedPort managed_port() {
  ManagedPort port;
  port.identity = {kUs, 1};
  port.domain = 3;
  port.current.offset = Nanoseconds{-42};
  port.port.state = PortState::kTimeReceiver;
  return port;
}

ManagementMessage request(ManagementId id, ManagementAction action = ManagementAction::kGet) {
  ManagementMessage message;
  message.header.domain = 3;
  message.header.source = {{}, 4711};
  message.header.sequence_id = 7;
  message.body.target = {kEverybody, 0xFFFF};
  message.body.action = static_cast<std::uint8_t>(action);
  message.id = id;
  return message;
}

class Responder : public testing::Test {
 protected:
  std::optional<ManagementMessage> ask(const ManagementMessage& message) {
    const auto bytes = responder.answer(encode_management(message).view(), managed_port());
    if (!bytes) return std::nullopt;
    const auto decoded = decode_management(bytes->view());
    EXPECT_TRUE(decoded.ok());
    return *decoded;
  }
  ManagementResponder responder;
};

TEST_F(Responder, AnswersAGetToWhoAsked) {
  auto asked = request(ManagementId::kCurrentDataSet);
  asked.body.starting_boundary_hops = 3;
  asked.body.boundary_hops = 1;
  const auto answer = ask(asked);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->action(), ManagementAction::kResponse);
  EXPECT_EQ(answer->header.sequence_id, 7);
  EXPECT_EQ(answer->header.domain, 3);
  EXPECT_EQ(answer->body.target, asked.header.source);
  EXPECT_EQ(answer->header.source, (PortIdentity{kUs, 0}));
  EXPECT_EQ(answer->body.starting_boundary_hops, 2);
  EXPECT_EQ(std::get<CurrentDataSet>(*answer->data).offset, Duration{Nanoseconds{-42}});
  EXPECT_EQ(responder.counters().answered, 1U);
}

TEST_F(Responder, DataOfThePortComesFromThePort) {
  const auto answer = ask(request(ManagementId::kPortDataSet));
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->header.source, (PortIdentity{kUs, 1}));
  EXPECT_EQ(std::get<PortDataSet>(*answer->data).state, PortState::kTimeReceiver);
}

TEST_F(Responder, EachIdentifierHasItsData) {
  for (const auto id :
       {ManagementId::kNullManagement, ManagementId::kClockDescription,
        ManagementId::kUserDescription, ManagementId::kDefaultDataSet,
        ManagementId::kCurrentDataSet, ManagementId::kParentDataSet,
        ManagementId::kTimePropertiesDataSet, ManagementId::kPortDataSet, ManagementId::kDomain,
        ManagementId::kTimeStatusNp, ManagementId::kPortDataSetNp, ManagementId::kPortPropertiesNp,
        ManagementId::kPortStatsNp, ManagementId::kSubscribeEventsNp}) {
    const auto answer = ask(request(id));
    ASSERT_TRUE(answer.has_value());
    EXPECT_EQ(answer->id, id);
    EXPECT_EQ(id_of(*answer->data), id);
  }
}

TEST_F(Responder, RefusesWhatItDoesNotHaveOrDo) {
  EXPECT_EQ(ask(request(ManagementId{0x3333}))->error, ManagementError::kNoSuchId);
  EXPECT_EQ(ask(request(ManagementId::kDomain, ManagementAction::kSet))->error,
            ManagementError::kNotSetable);
  const auto command = ask(request(ManagementId::kDomain, ManagementAction::kCommand));
  EXPECT_EQ(command->error, ManagementError::kNotSupported);
  EXPECT_EQ(command->action(), ManagementAction::kAcknowledge);
  auto other_port = request(ManagementId::kPortDataSet);
  other_port.body.target = {kUs, 2};
  EXPECT_EQ(ask(other_port)->error, ManagementError::kWrongValue);
  EXPECT_EQ(responder.counters().refused, 4U);
}

SubscribeEventsNp every_event(std::uint16_t duration_s) {
  SubscribeEventsNp wanted;
  wanted.duration_s = duration_s;
  wanted.events.fill(0xFF);
  return wanted;
}

TEST_F(Responder, TakesASubscriptionToWhatItTells) {
  auto asked = request(ManagementId::kSubscribeEventsNp, ManagementAction::kSet);
  asked.data = every_event(180);
  const auto answer = ask(asked);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->action(), ManagementAction::kResponse);
  const auto& granted = std::get<SubscribeEventsNp>(*answer->data);
  EXPECT_EQ(granted.duration_s, 180);
  EXPECT_EQ(granted.events[0], 1U) << "the state of the port";
  EXPECT_EQ(granted.events[1], 0U);
  const auto taken = responder.take_subscription();
  ASSERT_TRUE(taken.has_value());
  EXPECT_EQ(taken->subscriber, asked.header.source);
  EXPECT_EQ(taken->wanted, granted);
  EXPECT_FALSE(responder.take_subscription()) << "once";
}

TEST_F(Responder, TakesNoSubscriptionThatIsForSomebodyElseOrCutShort) {
  auto asked = request(ManagementId::kSubscribeEventsNp, ManagementAction::kSet);
  asked.data = every_event(180);
  asked.body.target = {kSomebody, 1};
  EXPECT_FALSE(ask(asked));
  asked.data.reset();
  asked.body.target = {kEverybody, 0xFFFF};
  EXPECT_FALSE(ask(asked));
  EXPECT_EQ(responder.counters().malformed, 1U);
  EXPECT_FALSE(responder.take_subscription());
}

TEST_F(Responder, ANoticeIsTheStateOfThePortAddressedToTheSubscriber) {
  const PortIdentity subscriber{kSomebody, 9};
  const auto bytes = ManagementResponder::port_state_notice(managed_port(), subscriber, 5);
  const auto notice = decode_management(bytes.view());
  ASSERT_TRUE(notice.ok());
  EXPECT_EQ(notice->action(), ManagementAction::kResponse);
  EXPECT_EQ(notice->body.target, subscriber);
  EXPECT_EQ(notice->header.sequence_id, 5);
  EXPECT_EQ(notice->header.domain, 3);
  EXPECT_EQ(notice->header.source, (PortIdentity{kUs, 1}));
  EXPECT_EQ(std::get<PortDataSet>(*notice->data).state, PortState::kTimeReceiver);
}

TEST_F(Responder, IsSilentToWhatIsNotForIt) {
  auto other_domain = request(ManagementId::kDomain);
  other_domain.header.domain = 4;
  EXPECT_FALSE(ask(other_domain));
  auto other_profile = request(ManagementId::kDomain);
  other_profile.header.major_sdo_id = 1;
  EXPECT_FALSE(ask(other_profile));
  auto other_clock = request(ManagementId::kDomain);
  other_clock.body.target = {kSomebody, 1};
  EXPECT_FALSE(ask(other_clock));
  EXPECT_FALSE(ask(request(ManagementId::kDomain, ManagementAction::kAcknowledge)));
  auto refusal = request(ManagementId::kDomain);
  refusal.error = ManagementError::kGeneral;
  EXPECT_FALSE(ask(refusal));  // an error answered by an error would never end
  EXPECT_EQ(responder.counters().ignored, 5U);
}

TEST_F(Responder, CountsWhatIsNoManagementMessage) {
  EXPECT_FALSE(responder.answer({}, managed_port()));
  const std::array<std::uint8_t, 4> text{'p', 'i', 'n', 'g'};
  EXPECT_FALSE(responder.answer(text, managed_port()));
  EXPECT_EQ(responder.counters().malformed, 2U);
}

TEST_F(Responder, NeedsNoHeap) {
  const auto bytes = encode_management(request(ManagementId::kClockDescription));
  const ManagedPort port = managed_port();
  const test::ForbidAllocation forbidden;
  EXPECT_TRUE(responder.answer(bytes.view(), port).has_value());
}

}  // namespace
}  // namespace ftcs::ptp
