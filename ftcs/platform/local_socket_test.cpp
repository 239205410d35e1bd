// SPDX-License-Identifier: MIT
//
// The world: real UNIX sockets in a temporary folder.
#include "ftcs/platform/local_socket.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

std::span<const std::uint8_t> octets(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}
std::string text(const LocalSocket::Datagram& datagram) {
  return {datagram.bytes.begin(), datagram.bytes.end()};
}

class LocalSockets : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "ftcs-test-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder); }
  [[nodiscard]] std::string file(const char* name) const { return (folder / name).string(); }

  std::filesystem::path folder;
};

TEST_F(LocalSockets, AClientIsAnswered) {
  auto server = LocalSocket::bind(file("server"));
  ASSERT_TRUE(server.ok());
  auto client = LocalSocket::client();
  ASSERT_TRUE(client.ok());
  EXPECT_FALSE(server->receive().has_value());
  EXPECT_FALSE(client->send(file("server"), octets("question")).has_value());
  const auto question = server->receive();
  ASSERT_TRUE(question.has_value());
  EXPECT_EQ(text(*question), "question");
  EXPECT_EQ(question->sender, client->path());
  EXPECT_FALSE(server->send(question->sender, octets("answer")).has_value());
  client->wait(1000);
  EXPECT_EQ(text(client->receive().value()), "answer");
}

TEST_F(LocalSockets, FilesGoWithTheObjects) {
  std::string client_path;
  {
    auto server = LocalSocket::bind(file("server"));
    auto client = LocalSocket::client();
    ASSERT_TRUE(server.ok() && client.ok());
    client_path = client->path();
    const auto moved = std::move(*server);
    EXPECT_TRUE(std::filesystem::exists(file("server")));
    EXPECT_TRUE(std::filesystem::exists(client_path));
  }
  EXPECT_FALSE(std::filesystem::exists(file("server")));
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::path(client_path).parent_path()));
}

TEST_F(LocalSockets, ASecondServerIsRefused) {
  const auto first = LocalSocket::bind(file("server"));
  const auto second = LocalSocket::bind(file("server"));
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().kind, OsErrorKind::kAddressInUse);
  EXPECT_NE(second.error().message().find(file("server")), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(file("server")));
}

TEST_F(LocalSockets, WhatADeadServerLeftIsReplaced) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  file("server").copy(address.sun_path, sizeof address.sun_path - 1);
  const int dead = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  ASSERT_EQ(::bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::close(dead);
  ASSERT_TRUE(std::filesystem::exists(file("server")));
  auto client = LocalSocket::client();
  EXPECT_EQ(client->send(file("server"), octets("?"))->number, ECONNREFUSED);
  const auto server = LocalSocket::bind(file("server"));
  ASSERT_TRUE(server.ok());
  EXPECT_FALSE(client->send(file("server"), octets("?")).has_value());
}

TEST_F(LocalSockets, AFileThatIsNoSocketIsNotTouched) {
  std::ofstream(file("notes")) << "precious";
  const auto server = LocalSocket::bind(file("notes"));
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.error().kind, OsErrorKind::kAddressInUse);
  EXPECT_EQ(std::filesystem::file_size(file("notes")), 8U);
}

TEST_F(LocalSockets, AReplacedFileIsLeftAlone) {
  {
    const auto server = LocalSocket::bind(file("server"));
    std::filesystem::remove(file("server"));
    std::ofstream(file("server")) << "somebody else's";
  }
  EXPECT_TRUE(std::filesystem::exists(file("server")));
}

TEST_F(LocalSockets, ErrorsNameTheFile) {
  const auto nowhere = LocalSocket::bind(file("no/such/folder"));
  ASSERT_FALSE(nowhere.ok());
  EXPECT_EQ(nowhere.error().number, ENOENT);
  const auto long_name = LocalSocket::bind(file(std::string(200, 'x').c_str()));
  ASSERT_FALSE(long_name.ok());
  EXPECT_EQ(long_name.error().number, ENAMETOOLONG);
  EXPECT_FALSE(LocalSocket::bind("").ok());
  auto client = LocalSocket::client();
  const auto nobody = client->send(file("nobody"), octets("?"));
  ASSERT_TRUE(nobody.has_value());
  EXPECT_EQ(nobody->number, ENOENT);
}

TEST_F(LocalSockets, OthersMayNotWrite) {
  const auto server = LocalSocket::bind(file("server"));
  struct stat status {};
  ASSERT_EQ(::stat(file("server").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0660U);
}

TEST_F(LocalSockets, AFullQueueDoesNotBlock) {
  const auto server = LocalSocket::bind(file("server"));
  auto client = LocalSocket::client();
  std::optional<OsError> error;
  for (int i = 0; i < 100'000 && !error; ++i) error = client->send(file("server"), octets("flood"));
  ASSERT_TRUE(error.has_value());
  EXPECT_TRUE(error->number == EAGAIN || error->number == ENOBUFS);
}

}  // namespace
}  // namespace ftcs::platform
