// SPDX-License-Identifier: MIT
//
// The world: every message that a receiver and a transmitter send, with extreme field values,
// written as one capture. tshark, which shares no code with us, must find no malformed one and must
// read the fields that we meant. Skipped where tshark or text2pcap is not installed.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ptp/security_association.h"
#include "ftcs/ptp/time_receiver.h"
#include "ftcs/ptp/time_transmitter.h"
#include "test/support/shell_lines.h"

namespace ftcs::ptp {
namespace {
using namespace std::chrono_literals;
using test::lines_of;

/// A folder of its own that is removed with its content.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "ftcs-tshark-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// As text2pcap reads it: an offset and the octets.
void write_dump(const std::string& path, const std::vector<MessageBytes>& messages) {
  std::ofstream dump(path);
  for (const auto& message : messages) {
    dump << "000000";
    for (const auto octet : message.view()) {
      char text[4];
      std::snprintf(text, sizeof text, " %02x", octet);
      dump << text;
    }
    dump << "\n";
  }
}

/// What tshark reads, one line a message, fields separated by '|'.
std::vector<std::string> tshark(const std::vector<MessageBytes>& messages,
                                const std::string& fields) {
  const TemporaryFolder folder;
  write_dump(folder.file("dump"), messages);
  const auto pcap = folder.file("pcap");
  lines_of("text2pcap -q -u 319,319 " + folder.file("dump") + " " + pcap + " 2>/dev/null");
  return lines_of("tshark -r " + pcap + " -T fields -E separator='|' " + fields + " 2>/dev/null");
}

class Tshark : public testing::Test {
 protected:
  void SetUp() override {
    if (lines_of("command -v tshark; command -v text2pcap").size() != 2) {
      GTEST_SKIP() << "tshark is not installed";
    }
  }
};

const PortIdentity kTransmitterPort{ClockIdentity::from_mac({2, 0, 0, 0, 0, 0xA}), 1};
const PortIdentity kReceiverPort{ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 2};

/// What is sent, which is added to `all`.
std::vector<SendMessage> kept(const ActionList& actions, std::vector<MessageBytes>& all) {
  std::vector<SendMessage> sent;
  for (const Action& action : actions) {
    if (const auto* send = std::get_if<SendMessage>(&action)) {
      sent.push_back(*send);
      all.push_back(send->bytes);
    }
  }
  return sent;
}

/// One of each message that we can send, in a conversation.
std::vector<MessageBytes> conversation(bool unicast, std::uint8_t minor_version) {
  TimeTransmitterConfig transmitter_config;
  transmitter_config.port = kTransmitterPort;
  transmitter_config.unicast = unicast;
  transmitter_config.minor_version = minor_version;
  transmitter_config.log_sync_interval = -3;
  TimeReceiverConfig receiver_config;
  receiver_config.port = kReceiverPort;
  receiver_config.unicast = unicast;
  receiver_config.minor_version = minor_version;
  TimeTransmitter transmitter(transmitter_config);
  TimeReceiver receiver(receiver_config);
  std::vector<MessageBytes> all;
  const auto keep = [&all](const ActionList& actions) { return kept(actions, all); };
  const auto reference = ReferenceTime{Duration{1'800'000'000s} + Duration::from_ns(5.5)};
  FreeRunningTime now;
  keep(transmitter.start(now));
  keep(receiver.start(now));
  const auto first = keep(transmitter.on_timer(now));
  for (int i = 0; i < 2; ++i) keep(receiver.on_general_message(first.at(0).bytes.view(), now));
  keep(transmitter.on_transmit_timestamp(first.at(1).id(), reference, now));
  const auto request = keep(receiver.on_event_message(first.at(1).bytes.view(), now, now));
  keep(transmitter.on_event_message(request.at(0).bytes.view(), reference, now));
  return all;
}

TEST_F(Tshark, finds_no_message_of_a_conversation_malformed) {
  for (const bool unicast : {false, true}) {
    for (const std::uint8_t minor : {std::uint8_t{0}, std::uint8_t{1}}) {
      const auto lines = tshark(conversation(unicast, minor),
                                "-e ptp.v2.messagetype -e ptp.v2.minorversionptp -e _ws.malformed "
                                "-e ptp.v2.flags.unicast");
      const std::string rest = "|" + std::to_string(minor) + "||" + (unicast ? "1" : "0");
      EXPECT_EQ(lines, (std::vector<std::string>{"0x0b" + rest, "0x00" + rest, "0x08" + rest,
                                                 "0x01" + rest, "0x09" + rest}));
    }
  }
}

TEST_F(Tshark, reads_the_stamp_and_the_half_nanosecond_of_a_follow_up) {
  const auto lines =
      tshark({conversation(false, 1).at(2)},
             "-e ptp.v2.fu.preciseorigintimestamp.seconds "
             "-e ptp.v2.fu.preciseorigintimestamp.nanoseconds "
             "-e ptp.v2.correction.ns -e ptp.v2.correction.subns "
             "-e ptp.v2.clockidentity -e ptp.v2.sourceportid -e ptp.v2.logmessageperiod");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0], "1800000000|5|0|0.5|0x020000fffe00000a|1|-3");
}

TEST_F(Tshark, reads_the_authentication_behind_an_announce) {
  class Code final : public MessageAuthenticationCode {
    bool compute(std::span<const std::span<const std::uint8_t>>,
                 std::span<std::uint8_t> code) noexcept override {
      std::fill(code.begin(), code.end(), std::uint8_t{0xC0});
      return true;
    }
  };
  Code code;
  SecurityAssociation association;
  association.spp = 5;
  association.active_key_id = 0x01020304;
  association.add({0x01020304, 16, &code});
  std::vector<MessageBytes> messages = conversation(false, 1);
  for (MessageBytes& message : messages) ASSERT_TRUE(seal(association, message));
  const auto lines = tshark(messages,
                            "-e ptp.v2.messagelength -e ptp.v2.an.tlvType -e ptp.v2.an.tlv.data "
                            "-e _ws.malformed");
  // Of the others tshark shows the length alone.
  EXPECT_EQ(lines,
            (std::vector<std::string>{"90|32777|050001020304c0c0c0c0c0c0c0c0c0c0c0c0c0c0c0c0|",
                                      "70|||", "70|||", "70|||", "80|||"}));
}

TEST_F(Tshark, would_find_a_malformed_message) {
  MessageBytes cut = conversation(false, 1).at(0);
  cut.size = 50;
  const auto lines = tshark({cut}, "-e _ws.malformed");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0], "");
}

TEST_F(Tshark, finds_no_type_malformed) {
  std::vector<MessageBytes> messages;
  const auto time = ReferenceTime::from_ns(1'700'000'000'999'999'999);
  for (const Body& body :
       {Body{PdelayReq{time}}, Body{PdelayResp{time, kReceiverPort}},
        Body{PdelayRespFollowUp{time, kReceiverPort}}, Body{Signaling{kReceiverPort}}}) {
    Message message;
    message.header.source = kTransmitterPort;
    message.header.correction = Duration::from_scaled_ns(std::numeric_limits<std::int64_t>::min());
    message.body = body;
    messages.push_back(*encode(message));
  }
  EXPECT_EQ(tshark(messages, "-e ptp.v2.messagetype -e _ws.malformed"),
            (std::vector<std::string>{"0x02|", "0x03|", "0x0a|", "0x0c|"}));
}

/// What a gPTP transmitter and a peer-to-peer receiver tell each other.
std::vector<MessageBytes> peer_conversation() {
  TimeTransmitterConfig transmitter_config;
  transmitter_config.port = kTransmitterPort;
  transmitter_config.major_sdo_id = 1;
  transmitter_config.delay_mechanism = DelayMechanism::kPeerToPeer;
  transmitter_config.follow_up_info = true;
  transmitter_config.path_trace = true;
  TimeReceiverConfig receiver_config;
  receiver_config.port = kReceiverPort;
  receiver_config.major_sdo_id = 1;
  receiver_config.delay_mechanism = DelayMechanism::kPeerToPeer;
  TimeTransmitter transmitter(transmitter_config);
  TimeReceiver receiver(receiver_config);
  std::vector<MessageBytes> all;
  const auto keep = [&all](const ActionList& actions) { return kept(actions, all); };
  const auto reference = ReferenceTime{Duration{1'800'000'000s} + Duration::from_ns(5.5)};
  const FreeRunningTime now{Duration{1s} + Duration::from_ns(0.25)};
  keep(transmitter.start(now));
  keep(receiver.start(now));
  const auto first = keep(transmitter.on_timer(now));  // Pdelay_Req, Announce, Sync
  keep(transmitter.on_transmit_timestamp(first.at(2).id(), reference, now));
  const auto answer = keep(receiver.on_event_message(first.at(0).bytes.view(), now, now));
  keep(receiver.on_transmit_timestamp(answer.at(0).id(), now, now));
  return all;
}

TEST_F(Tshark, reads_peer_delay_messages_and_the_tlvs_of_802_1as) {
  const auto lines = tshark(peer_conversation(),
                            "-e ptp.v2.messagetype -e ptp.v2.majorsdoid -e _ws.malformed "
                            "-e ptp.v2.messagelength");
  EXPECT_EQ(lines, (std::vector<std::string>{"0x02|0x01||54", "0x0b|0x01||76", "0x00|0x01||44",
                                             "0x08|0x01||76", "0x03|0x01||54", "0x0a|0x01||54"}));
  const auto answers = tshark(
      {peer_conversation().at(4), peer_conversation().at(5)},
      "-e ptp.v2.pdrs.requestreceipttimestamp.seconds -e ptp.v2.pdrs.requestingportidentity "
      "-e ptp.v2.pdfu.responseorigintimestamp.seconds -e ptp.v2.pdfu.requestingportidentity");
  EXPECT_EQ(answers,
            (std::vector<std::string>{"1|0x020000fffe00000a||", "||1|0x020000fffe00000a"}));
}

}  // namespace
}  // namespace ftcs::ptp
