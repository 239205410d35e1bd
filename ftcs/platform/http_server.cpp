// SPDX-License-Identifier: MIT
#include "ftcs/platform/http_server.h"

#include <atomic>
#include <charconv>
#include <csignal>
#include <cstring>
#include <functional>
#include <netinet/in.h>
#include <semaphore>
#include <sys/socket.h>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <httplib.h>

namespace ftcs::platform {
namespace {

constexpr std::size_t kWorkers = 8;
constexpr int kMostWaiting =
    8;  // connections that no worker has time for; further ones are the kernel's
constexpr int kMostListeners = 4;  // of events: each keeps a worker
constexpr time_t kPatienceS = 2;
constexpr time_t kIdleS = 1;  // a connection that is kept open keeps a worker

/// The library's own pool takes whatever comes, a descriptor each.
class Workers final : public httplib::TaskQueue {
 public:
  void enqueue(std::function<void()> work) override {
    places_.acquire();
    pool_.enqueue([this, work = std::move(work)] {
      work();
      places_.release();
    });
  }
  void shutdown() override { pool_.shutdown(); }

 private:
  std::counting_semaphore<> places_{static_cast<std::ptrdiff_t>(kWorkers) + kMostWaiting};
  httplib::ThreadPool pool_{kWorkers};
};

std::uint16_t port_of(const sockaddr_storage& address) {
  sockaddr_in6 ipv6{};  // its port stands where that of IPv4 does
  std::memcpy(&ipv6, &address, sizeof ipv6);
  const bool internet = address.ss_family == AF_INET || address.ss_family == AF_INET6;
  return internet ? ntohs(ipv6.sin6_port) : 0;
}

/// Ends the connections of this process that came in at `port`: the library waits for each client
/// as long as an octet comes now and then.
void hang_up(std::uint16_t port) {
  constexpr int kMostDescriptors = 4096;
  for (int fd = 0; fd < kMostDescriptors; ++fd) {
    int kind = 0;
    socklen_t size = sizeof kind;
    if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &kind, &size) != 0 || kind != SOCK_STREAM) continue;
    sockaddr_storage address{};
    size = sizeof address;
    if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) continue;
    if (port_of(address) == port) ::shutdown(fd, SHUT_RDWR);
  }
}

HttpRequest request_of(const httplib::Request& request) {
  return {request.get_header_value("Accept"), request.get_header_value("Origin"),
          request.get_header_value("Host")};
}

void no_store(httplib::Response& response, const std::string& allow_origin) {
  response.set_header("Cache-Control", "no-store");
  response.set_header("X-Content-Type-Options", "nosniff");
  response.set_header(
      "Content-Security-Policy",
      "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
      "connect-src 'self' http:; img-src data:; base-uri 'none'; form-action 'none'");
  if (!allow_origin.empty()) response.set_header("Access-Control-Allow-Origin", allow_origin);
}

}  // namespace

std::optional<HttpAddress> parse_http_address(std::string_view text) {
  HttpAddress address;
  const std::size_t colon = text.rfind(':');
  std::string_view port = text;
  if (colon != std::string_view::npos) {
    std::string_view host = text.substr(0, colon);
    port = text.substr(colon + 1);
    if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
      host = host.substr(1, host.size() - 2);
    } else if (host.find(':') != std::string_view::npos) {
      return std::nullopt;
    }
    if (!host.empty()) address.host = host;
  }
  const char* const end = port.data() + port.size();
  const auto [rest, error] = std::from_chars(port.data(), end, address.port);
  if (error != std::errc{} || rest != end || port.empty()) return std::nullopt;
  return address;
}

std::string to_string(const HttpAddress& address) {
  const bool ipv6 = address.host.find(':') != std::string::npos;
  return ipv6 ? fmt::format("[{}]:{}", address.host, address.port)
              : fmt::format("{}:{}", address.host, address.port);
}

struct HttpServer::Implementation {
  httplib::Server server;
  std::thread thread;
  std::atomic<int> listeners = 0;
  std::atomic<std::uint64_t> next_listener = 0;
};

HttpServer::HttpServer() : implementation_(std::make_unique<Implementation>()) {
  httplib::Server& server = implementation_->server;
  server.new_task_queue = [] { return new Workers; };
  // The library's own choice would let a second program have the same port unnoticed.
  server.set_socket_options([](socket_t socket) {
    const int one = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
  });
  server.set_payload_max_length(0);
  server.set_read_timeout(kPatienceS, 0);
  server.set_write_timeout(kPatienceS, 0);
  server.set_keep_alive_max_count(100);
  server.set_keep_alive_timeout(kIdleS);
  server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
    if (request.method == "GET" || request.method == "HEAD") {
      return httplib::Server::HandlerResponse::Unhandled;
    }
    response.status = 405;
    response.set_header("Allow", "GET, HEAD");
    return httplib::Server::HandlerResponse::Handled;
  });
}

HttpServer::~HttpServer() { close(); }

void HttpServer::serve(const std::string& path, Handler handler) {
  implementation_->server.Get(path, [handler = std::move(handler)](const httplib::Request& request,
                                                                   httplib::Response& response) {
    const HttpAnswer answer = handler(request_of(request));
    no_store(response, answer.allow_origin);
    response.set_content(answer.body, answer.type.c_str());
  });
}

void HttpServer::serve_events(const std::string& path, Pieces pieces,
                              std::function<std::string(const HttpRequest&)> allow) {
  implementation_->server.Get(
      path, [this, pieces = std::move(pieces), allow = std::move(allow)](
                const httplib::Request& request, httplib::Response& response) {
        no_store(response, allow(request_of(request)));
        if (implementation_->listeners.fetch_add(1) >= kMostListeners) {
          implementation_->listeners.fetch_sub(1);
          response.status = 503;
          return;
        }
        const std::uint64_t listener = implementation_->next_listener.fetch_add(1);
        response.set_chunked_content_provider(
            "text/event-stream",
            [pieces, listener, number = std::uint64_t{0}](std::size_t,
                                                          httplib::DataSink& sink) mutable {
              const auto piece = pieces(listener, number++);
              if (!piece) {
                sink.done();
                return true;
              }
              return sink.write(piece->data(), piece->size());
            },
            [this](bool) { implementation_->listeners.fetch_sub(1); });
      });
}

std::optional<std::string> HttpServer::open(const HttpAddress& address) {
  httplib::Server& server = implementation_->server;
  address_ = address;
  const int port = address.port == 0 ? server.bind_to_any_port(address.host.c_str())
                   : server.bind_to_port(address.host.c_str(), address.port) ? address.port
                                                                             : -1;
  if (port < 0) {
    return fmt::format("{}: cannot listen there: {}", to_string(address), std::strerror(errno));
  }
  address_.port = static_cast<std::uint16_t>(port);
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);  // inherited by the threads: signals are the loop's
  implementation_->thread = std::thread([&server] { server.listen_after_bind(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return std::nullopt;
}

void HttpServer::close() {
  if (!implementation_->thread.joinable()) return;
  while (!implementation_->server.is_running()) std::this_thread::yield();
  implementation_->server.stop();
  hang_up(address_.port);
  implementation_->thread.join();
}

std::optional<std::string> http_get(const HttpAddress& address, const std::string& path,
                                    std::chrono::milliseconds patience) {
  httplib::Client client(address.host, address.port);
  client.set_connection_timeout(patience);
  client.set_read_timeout(patience);
  const auto answer = client.Get(path.c_str());
  if (!answer || answer->status != 200) return std::nullopt;
  return answer->body;
}

}  // namespace ftcs::platform
