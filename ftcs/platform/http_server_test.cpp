// SPDX-License-Identifier: MIT
// World: this process's own loopback address.
#include "ftcs/platform/http_server.h"

#include <arpa/inet.h>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <netinet/in.h>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

/// A connection, or -1; with SOCK_NONBLOCK one that may be on its way.
int connect_to(std::uint16_t port, int kind = 0) {
  const int fd = socket(AF_INET, SOCK_STREAM | kind, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  if (errno == EINPROGRESS) return fd;
  close(fd);
  return -1;
}

/// What comes back for these octets, up to `most` of them.
std::string talk(std::uint16_t port, const std::string& said, std::size_t most = 100'000) {
  const int fd = connect_to(port);
  if (fd < 0) return {};
  (void)!write(fd, said.data(), said.size());
  std::string answer;
  char buffer[1000];
  for (ssize_t size = 0; answer.size() < most && (size = read(fd, buffer, sizeof buffer)) > 0;) {
    answer.append(buffer, static_cast<std::size_t>(size));
  }
  close(fd);
  return answer;
}

std::string request(const std::string& method, const std::string& path) {
  return method + " " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n";
}

TEST(HttpAddress, a_port_alone_is_loopbacks) {
  EXPECT_EQ(to_string(*parse_http_address("9320")), "127.0.0.1:9320");
  EXPECT_EQ(to_string(*parse_http_address(":9320")), "127.0.0.1:9320");
  EXPECT_EQ(to_string(*parse_http_address("0.0.0.0:80")), "0.0.0.0:80");
  EXPECT_EQ(to_string(*parse_http_address("[::1]:9320")), "[::1]:9320");
  for (const char* wrong : {"", "host", "host:", "1:2:3", "host:99999", "host:1x", "::1"}) {
    EXPECT_FALSE(parse_http_address(wrong)) << wrong;
  }
}

TEST(HttpServer, answers_what_it_serves_and_only_to_those_who_read) {
  HttpServer server;
  server.serve("/here", [](const HttpRequest&) { return HttpAnswer{"hello", "text/plain"}; });
  ASSERT_FALSE(server.open({"127.0.0.1", 0}));
  const std::uint16_t port = server.address().port;
  EXPECT_EQ(http_get(server.address(), "/here", std::chrono::seconds(2)), "hello");
  EXPECT_FALSE(http_get(server.address(), "/there", std::chrono::seconds(2)));
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH"}) {
    EXPECT_TRUE(talk(port, request(method, "/here")).starts_with("HTTP/1.1 405")) << method;
  }
}

TEST(HttpServer, a_port_that_is_taken_is_an_error) {
  HttpServer one;
  ASSERT_FALSE(one.open({"127.0.0.1", 0}));
  HttpServer other;
  const auto wrong = other.open(one.address());
  ASSERT_TRUE(wrong);
  EXPECT_NE(wrong->find("in use"), std::string::npos) << *wrong;
}

TEST(HttpServer, streams_events_until_there_are_no_more) {
  HttpServer server;
  server.serve_events(
      "/events",
      [](std::uint64_t, std::uint64_t number) {
        return number < 3 ? std::optional("data: " + std::to_string(number) + "\n\n")
                          : std::nullopt;
      },
      [](const HttpRequest& asked) { return asked.origin; });
  ASSERT_FALSE(server.open({"127.0.0.1", 0}));
  const std::string answer = talk(server.address().port, request("GET", "/events"));
  EXPECT_NE(answer.find("text/event-stream"), std::string::npos) << answer;
  EXPECT_NE(answer.find("data: 2"), std::string::npos) << answer;
}

/// Each connection is a descriptor of the process, which needs them for its sockets and files.
TEST(HttpServer, a_flood_of_connections_takes_few_descriptors) {
  HttpServer server;
  ASSERT_FALSE(server.open({"127.0.0.1", 0}));
  const auto open_descriptors = [] {
    const std::filesystem::directory_iterator all("/proc/self/fd");
    return std::distance(begin(all), end(all));
  };
  const auto before = open_descriptors();
  constexpr int kFlood = 100;
  std::vector<int> clients;
  for (int i = 0; i < kFlood; ++i)
    clients.push_back(connect_to(server.address().port, SOCK_NONBLOCK));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_LT(open_descriptors() - before, kFlood + 25);
  for (const int fd : clients) close(fd);
}

TEST(HttpServer, a_client_that_never_ends_its_request_does_not_hold_up_the_end) {
  using std::chrono::steady_clock;
  HttpServer server;
  ASSERT_FALSE(server.open({"127.0.0.1", 0}));
  std::atomic<bool> over = false;
  std::thread trickle([&over, port = server.address().port] {
    const int fd = connect_to(port);
    for (int i = 0; i < 40 && !over; ++i) {
      (void)!send(fd, "G", 1, MSG_NOSIGNAL);
      std::this_thread::sleep_for(std::chrono::milliseconds(250));
    }
    close(fd);
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  const auto begin = steady_clock::now();
  server.close();
  EXPECT_LT(steady_clock::now() - begin, std::chrono::seconds(4));
  over = true;
  trickle.join();
}

TEST(HttpServer, what_is_no_request_does_no_harm) {
  HttpServer server;
  server.serve("/here", [](const HttpRequest&) { return HttpAnswer{"hello", "text/plain"}; });
  ASSERT_FALSE(server.open({"127.0.0.1", 0}));
  const std::uint16_t port = server.address().port;
  (void)talk(port, "\xff\x00garbage\r\n\r\n", 1);
  (void)talk(port, "GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\n\r\n", 1);
  EXPECT_EQ(http_get(server.address(), "/here", std::chrono::seconds(2)), "hello");
}

}  // namespace
}  // namespace ftcs::platform
