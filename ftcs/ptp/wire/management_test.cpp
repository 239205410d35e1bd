// SPDX-License-Identifier: MIT
//
// The world: management messages as Debian's ptp4l 3.1.1 and its pmc put them on their UNIX socket
// (recorded), and our own.
#include "ftcs/ptp/wire/management.h"

#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"

namespace ftcs::ptp {
namespace {

std::vector<std::uint8_t> octets(std::string_view hex) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(
        static_cast<std::uint8_t>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  }
  return bytes;
}

const ClockIdentity kReceiver = ClockIdentity::from_mac({0x2e, 0xd4, 0x68, 0xbe, 0x9c, 0x91});
const ClockIdentity kGrandmaster = ClockIdentity::from_mac({0x5e, 0x82, 0x7f, 0xd4, 0xca, 0x0a});

// What precedes the TLV in ptp4l's answer to the process 0x3588, after messageLength.
std::string answer(const char* length, const char* port, const char* tlv) {
  return std::string("0d02") + length + "000000000000000000000000000000002ed468fffebe9c91" + port +
         "0000047f0000000000000000358800000200" + tlv;
}

struct Recorded {
  const char* name;
  std::string hex;
  ManagementData data;
};

std::vector<Recorded> recorded() {
  ClockDescription description;
  description.physical_layer = PtpText<32>("IEEE 802.3");
  description.physical_address = {{0x2e, 0xd4, 0x68, 0xbe, 0x9c, 0x91}, 6};
  description.protocol_address = {{10, 78, 0, 1}, 4};
  description.product = PtpText<64>(";;");
  description.revision = PtpText<32>(";;");
  description.profile = {0x00, 0x1b, 0x19, 0x00, 0x01, 0x00};
  DefaultDataSet default_set;
  default_set.flags = 3;
  default_set.quality.clock_class = 255;
  default_set.identity = kReceiver;
  ParentDataSet parent;
  parent.parent = {kGrandmaster, 1};
  parent.grandmaster = kGrandmaster;
  PortDataSet port;
  port.port = {kReceiver, 1};
  port.state = PortState::kUncalibrated;
  TimeStatusNp status;
  status.offset_ns = -68;
  status.ingress_ns = 1795299278165595309;
  status.grandmaster_present = 1;
  status.grandmaster = kGrandmaster;
  PortPropertiesNp properties{{kReceiver, 1}, PortState::kUncalibrated, 0, PtpText<32>("sa13621")};
  return {
      {"DEFAULT_DATA_SET",
       answer("004a", "0000", "0001001620000300000180fffeffff802ed468fffebe9c910000"), default_set},
      {"CURRENT_DATA_SET",
       answer("0048", "0000",
              "00010014200100010000000003440000"
              "0000000004240000"),
       CurrentDataSet{1, Nanoseconds{836}, Nanoseconds{1060}}},
      {"PARENT_DATA_SET",
       answer("0056", "0000",
              "0001002220025e827ffffed4ca0a00010000ffff7fffffff80f8feffff805e827ffffed4ca0a"),
       parent},
      {"TIME_PROPERTIES_DATA_SET", answer("003a", "0000", "000100062003002500a0"),
       TimePropertiesDataSet{}},
      {"PORT_DATA_SET",
       answer("0050", "0001", "0001001c20042ed468fffebe9c91000108000000000000000000010300010002"),
       port},
      {"TIME_STATUS_NP",
       answer(
           "0068", "0000",
           "00010034c000ffffffffffffffbc18ea2f2e7c9354ad000000000000000000000000000000000000000000"
           "00000000015e827ffffed4ca0a"),
       status},
      {"NULL_MANAGEMENT", answer("0036", "0001", "000100020000"), NullManagement{}},
      {"CLOCK_DESCRIPTION",
       answer("0064", "0001",
              "00010030000180000a49454545203830322e3300062ed468be9c91000100040a4e000100000000023b3b"
              "023b3b00001b19000100"),
       description},
      {"USER_DESCRIPTION", answer("0038", "0000", "0001000400020000"), UserDescription{}},
      {"PORT_DATA_SET_NP", answer("003e", "0001", "0001000ac00201312d0000000001"), PortDataSetNp{}},
      {"DOMAIN", answer("0038", "0000", "0001000420070000"), Domain{}},
      {"PORT_PROPERTIES_NP",
       answer("004a", "0001", "00010016c0042ed468fffebe9c91000108000773613133363231"), properties},
  };
}

TEST(Management, ReadsAndWritesWhatPtp4lWrote) {
  for (const Recorded& one : recorded()) {
    SCOPED_TRACE(one.name);
    const auto bytes = octets(one.hex);
    const auto message = decode_management(bytes);
    ASSERT_TRUE(message.ok());
    EXPECT_EQ(message->action(), ManagementAction::kResponse);
    EXPECT_EQ(message->body.target.port, 0x3588);
    EXPECT_EQ(message->id, id_of(one.data));
    ASSERT_TRUE(message->data.has_value());
    EXPECT_EQ(*message->data, one.data);
    const auto written = encode_management(*message);
    EXPECT_EQ(std::vector<std::uint8_t>(written.view().begin(), written.view().end()), bytes);
  }
}

TEST(Management, ReadsARequestWithDummyDataAndOneWithout) {
  for (const char* hex : {"0d02004a0000000000000000000000000000000000000000000000002b380000047fffff"
                          "ffffffffffffffff0000"
                          "00000001001620000000000000000000000000000000000000000000",
                          "0d0200360000000000000000000000000000000000000000000000002b380001047fffff"
                          "ffffffffffffffff0000"
                          "0000000100022000"}) {
    const auto message = decode_management(octets(hex));
    ASSERT_TRUE(message.ok());
    EXPECT_EQ(message->action(), ManagementAction::kGet);
    EXPECT_EQ(message->id, ManagementId::kDefaultDataSet);
    EXPECT_EQ(message->body.target.port, 0xFFFF);
    EXPECT_FALSE(message->data.has_value());
  }
}

TEST(Management, ReadsAndWritesAnErrorStatus) {
  const auto bytes = octets(answer("003c", "0001", "000200080002333300000000"));
  const auto message = decode_management(bytes);
  ASSERT_TRUE(message.ok());
  EXPECT_EQ(message->error, ManagementError::kNoSuchId);
  EXPECT_EQ(static_cast<std::uint16_t>(message->id), 0x3333);
  const auto written = encode_management(*message);
  EXPECT_EQ(std::vector<std::uint8_t>(written.view().begin(), written.view().end()), bytes);
}

TEST(Management, StatisticsAreLittleEndian) {
  ManagementMessage message;
  message.body.action = static_cast<std::uint8_t>(ManagementAction::kResponse);
  PortStatsNp stats;
  stats.received[0] = 27;
  stats.sent[1] = 0x0102030405060708;
  message.data = stats;
  const auto bytes = encode_management(message);
  EXPECT_EQ(bytes.size, 0x140);  // as ptp4l's
  EXPECT_EQ(bytes.octets[64], 27);
  EXPECT_EQ(bytes.octets[64 + 17 * 8], 8);
  const auto again = decode_management(bytes.view());
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->data, message.data);
}

TEST(Management, RefusesEachLengthButTheRightOne) {
  for (const Recorded& one : recorded()) {
    SCOPED_TRACE(one.name);
    auto bytes = octets(one.hex);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      EXPECT_FALSE(decode_management(std::span(bytes).first(size)).ok()) << size;
    }
    // Two octets more in TLV and message: not what the identifier promises.
    bytes.insert(bytes.end(), {0, 0});
    bytes[3] = static_cast<std::uint8_t>(bytes[3] + 2);
    bytes[51] = static_cast<std::uint8_t>(bytes[51] + 2);
    const auto longer = decode_management(bytes);
    ASSERT_FALSE(longer.ok());
    EXPECT_EQ(longer.error().reason, DecodeReason::kMalformedTlv);
  }
}

TEST(Management, RefusesTextThatEndsBehindTheTlv) {
  auto bytes = octets(answer("0038", "0000", "0001000400020000"));
  bytes[54] = 200;
  EXPECT_FALSE(decode_management(bytes).ok());
}

TEST(Management, RefusesOtherMessagesAndTlvs) {
  Message sync;
  sync.body = Sync{};
  const auto other = decode_management(encode(sync)->view());
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().reason, DecodeReason::kUnknownType);
  auto bytes = octets(answer("0038", "0000", "0001000400020000"));
  bytes[49] = 3;  // ORGANIZATION_EXTENSION
  ASSERT_FALSE(decode_management(bytes).ok());
}

TEST(Management, LongTextIsCutAndEvenThenTheLengthIsEven) {
  const std::string longest(200, 'x');
  ManagementMessage message;
  message.body.action = static_cast<std::uint8_t>(ManagementAction::kResponse);
  message.data = UserDescription{PtpText<128>(longest)};
  const auto bytes = encode_management(message);
  EXPECT_EQ(bytes.size, 48 + 4 + 2 + 130);
  const auto again = decode_management(bytes.view());
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(std::get<UserDescription>(*again->data).text.view().size(), 128U);
}

TEST(Management, OffsetsBeyondTheIntervalAreHeldAtItsEnds) {
  ManagementMessage message;
  message.body.action = static_cast<std::uint8_t>(ManagementAction::kResponse);
  message.data = CurrentDataSet{0, Duration::from_ns(-1e18), Duration::from_ns(1e18)};
  const auto again = decode_management(encode_management(message).view());
  ASSERT_TRUE(again.ok());
  const auto& data = std::get<CurrentDataSet>(*again->data);
  EXPECT_EQ(data.offset.floor_ns(), -(std::int64_t{1} << 47));
  EXPECT_EQ(data.mean_path_delay.floor_ns(), (std::int64_t{1} << 47) - 1);
}

TEST(Management, NeedsNoHeap) {
  const auto bytes = octets(recorded()[7].hex);
  const test::ForbidAllocation forbidden;
  const auto message = decode_management(bytes);
  ASSERT_TRUE(message.ok());
  EXPECT_EQ(encode_management(*message).size, bytes.size());
}

}  // namespace
}  // namespace ftcs::ptp
