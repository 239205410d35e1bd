// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "ftcs/time/result.h"

namespace ftcs::platform {

/// Where to listen, or whom to ask.
struct HttpAddress {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;
};
/// "HOST:PORT", "[::1]:PORT", ":PORT" or "PORT" (loopback). No value: none of these.
[[nodiscard]] std::optional<HttpAddress> parse_http_address(std::string_view text);
[[nodiscard]] std::string to_string(const HttpAddress& address);

struct HttpRequest {
  std::string accept;  ///< header Accept
  std::string origin;  ///< header Origin; empty: not from another page
  std::string host;    ///< header Host
};
struct HttpAnswer {
  std::string body;
  std::string type = "text/plain; charset=utf-8";
  std::string allow_origin{};  ///< Access-Control-Allow-Origin; empty: none
};

/// A small web server that is only read: GET and HEAD. It runs in threads of its own, in which
/// every signal is blocked and which have the ordinary scheduling of the thread that opened it;
/// handlers are called there.
class HttpServer {
 public:
  using Handler = std::function<HttpAnswer(const HttpRequest&)>;
  /// Called again and again for one listener: the next piece for it, which may be waited for.
  /// `number` counts the pieces from zero. No value: the end.
  using Pieces =
      std::function<std::optional<std::string>(std::uint64_t listener, std::uint64_t number)>;

  HttpServer();
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Before open().
  void serve(const std::string& path, Handler handler);
  /// Server-sent events, to a few listeners at a time; more are refused (503). `allow` says whose
  /// pages may listen: the value of Access-Control-Allow-Origin, empty for none.
  void serve_events(const std::string& path, Pieces pieces,
                    std::function<std::string(const HttpRequest&)> allow);
  /// Listens and begins to serve. Returns what is wrong, or nothing. Port 0: any that is free.
  [[nodiscard]] std::optional<std::string> open(const HttpAddress& address);
  [[nodiscard]] const HttpAddress& address() const { return address_; }
  /// No new requests; pieces must come to their end by themselves.
  void close();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
  HttpAddress address_{};
};

/// The body of an answer 200; none: nobody answers so within `patience`.
[[nodiscard]] std::optional<std::string> http_get(const HttpAddress& address,
                                                  const std::string& path,
                                                  std::chrono::milliseconds patience);

}  // namespace ftcs::platform
