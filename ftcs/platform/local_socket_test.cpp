// SPDX-License-Identifier: MIT
//
// The world: real UNIX sockets in a temporary folder.
#include "ftcs/platform/local_socket.h"

#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <grp.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
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
  /// The file of a server that ended without removing it.
  void leave_dead_socket() const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    file("server").copy(address.sun_path, sizeof address.sun_path - 1);
    const int dead = ::socket(AF_UNIX, SOCK_DGRAM, 0);
    ASSERT_EQ(::bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ::close(dead);
  }

  std::filesystem::path folder;
};

TEST_F(LocalSockets, a_client_is_beside_its_server_where_it_may_be) {
  const auto beside = LocalSocket::client(file("server"));
  ASSERT_TRUE(beside.ok());
  EXPECT_TRUE(beside->path().starts_with(folder.string() + "/ftcs-")) << beside->path();
  const auto elsewhere = LocalSocket::client("/nowhere/server");
  ASSERT_TRUE(elsewhere.ok());
  EXPECT_TRUE(
      elsewhere->path().starts_with(std::filesystem::temp_directory_path().string() + "/ftcs-"))
      << elsewhere->path();
}

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
  leave_dead_socket();
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

TEST_F(LocalSockets, OthersMayNotWriteEvenWithoutAnyUmask) {
  const mode_t usual = ::umask(0);
  const auto server = LocalSocket::bind(file("server"));
  EXPECT_EQ(::umask(usual), 0U) << "it is put back";
  struct stat status {};
  ASSERT_EQ(::stat(file("server").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0660U);
}

TEST_F(LocalSockets, ALeftOverThatAnotherProgramIsReplacingIsLeftToIt) {
  leave_dead_socket();
  const int other = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(::flock(other, LOCK_EX), 0);
  EXPECT_EQ(LocalSocket::bind(file("server")).error().kind, OsErrorKind::kAddressInUse);
  ::close(other);
  EXPECT_TRUE(LocalSocket::bind(file("server")).ok());
}

TEST_F(LocalSockets, AServerOfAnotherUserAnswersByItsGroup) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to be another user";
  constexpr gid_t kSomebody = 54321;
  std::filesystem::permissions(folder, std::filesystem::perms::all);
  auto client = LocalSocket::client();
  ASSERT_TRUE(client.ok());
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    bool good =
        ::setgroups(0, nullptr) == 0 && ::setgid(kSomebody) == 0 && ::setuid(kSomebody) == 0;
    auto server = LocalSocket::bind(file("server"));
    good = good && server.ok() && ::write(ready[1], "x", 1) == 1;
    if (good) server->wait(2000);
    const auto question = good ? server->receive() : std::nullopt;
    good = question && !server->send(question->sender, octets("answer"));
    ::_exit(good ? 0 : 1);
  }
  char started = 0;
  ASSERT_EQ(::read(ready[0], &started, 1), 1);
  EXPECT_FALSE(client->send(file("server"), octets("question")).has_value());
  int status = 1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0) << "it could not answer";
  client->wait(1000);
  const auto answer = client->receive();
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(text(*answer), "answer");
  struct stat seen {};
  ASSERT_EQ(::stat(std::filesystem::path(client->path()).parent_path().c_str(), &seen), 0);
  EXPECT_EQ(seen.st_mode & 0777U, 0710U) << "and nobody else";
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
