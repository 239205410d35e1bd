// SPDX-License-Identifier: MIT
// World: a ptp4l on a socket in a temporary folder, which answers late.
#include "ftcs/daemon/management_client.h"

#include <chrono>
#include <filesystem>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

namespace ftcs::daemon {
namespace {

using platform::LocalSocket;

constexpr int kPatienceMs = 20;

struct Question {
  std::string sender;
  std::uint16_t sequence_id = 0;
};

Question receive_question(LocalSocket& ptp4l) {
  ptp4l.wait(10'000);
  const auto datagram = ptp4l.receive();
  if (!datagram) return {};
  const auto message = ptp::decode_management(datagram->bytes);
  return {datagram->sender, message ? message->header.sequence_id : std::uint16_t{0}};
}

void answer(LocalSocket& ptp4l, const Question& question, ptp::ManagementId id,
            const ptp::ManagementData& data) {
  ptp::ManagementMessage message;
  message.header.sequence_id = question.sequence_id;
  message.body.action = static_cast<std::uint8_t>(ptp::ManagementAction::kResponse);
  message.id = id;
  message.data = data;
  EXPECT_FALSE(ptp4l.send(question.sender, ptp::encode_management(message).view()));
}

TEST(ManagementClient, finds_the_sockets_of_old_and_of_new_linuxptp) {
  for (const char* name : {"/ptp4l", "/ptp/ptp4l", "/ptp4lro", "/ptp/ptp4lro"}) {
    std::string folder = (std::filesystem::temp_directory_path() / "ftcs-client-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    std::filesystem::create_directory(folder + "/ptp");
    auto ptp4l = LocalSocket::bind(folder + name);
    ASSERT_TRUE(ptp4l.ok());
    PortAddress address;
    address.socket = folder + "/ptp4l";  // as --ptp4l-socket and -z have it
    auto client = ManagementClient::open(address);
    ASSERT_TRUE(client.ok());
    client->ask(ptp::ManagementId::kPortDataSet);
    const Question question = receive_question(*ptp4l);
    EXPECT_FALSE(question.sender.empty()) << name;
    answer(*ptp4l, question, ptp::ManagementId::kPortDataSet, ptp::PortDataSet{});
    EXPECT_TRUE(client->next_answer()) << name;
    std::filesystem::remove_all(folder);
  }
}

TEST(ManagementClient, an_answer_that_comes_late_is_not_taken_for_the_next_one) {
  std::string folder = (std::filesystem::temp_directory_path() / "ftcs-client-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  PortAddress address;
  address.socket = folder + "/ptp4l";
  auto ptp4l = LocalSocket::bind(address.socket);
  ASSERT_TRUE(ptp4l.ok());
  auto client = ManagementClient::open(address);
  ASSERT_TRUE(client.ok());
  EXPECT_FALSE(client->ask_and_wait<ptp::PortPropertiesNp>(ptp::ManagementId::kPortPropertiesNp,
                                                           kPatienceMs));

  std::thread late([&] {
    const Question first = receive_question(*ptp4l);
    const Question second = receive_question(*ptp4l);
    EXPECT_EQ(second.sender, first.sender);
    answer(*ptp4l, first, ptp::ManagementId::kPortPropertiesNp, ptp::PortPropertiesNp{});
    std::this_thread::sleep_for(std::chrono::milliseconds{kPatienceMs});
    ptp::PortDataSet port;
    port.delay_mechanism = ptp::kPeerToPeerMechanism;
    // Anybody can write to a socket: what was not asked is no answer.
    answer(*ptp4l, {second.sender, 999}, ptp::ManagementId::kPortDataSet, ptp::PortDataSet{});
    answer(*ptp4l, second, ptp::ManagementId::kPortDataSet, port);
  });
  const auto port =
      client->ask_and_wait<ptp::PortDataSet>(ptp::ManagementId::kPortDataSet, 50 * kPatienceMs);
  late.join();
  ASSERT_TRUE(port.has_value());
  EXPECT_EQ(port->delay_mechanism, ptp::kPeerToPeerMechanism);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace ftcs::daemon
