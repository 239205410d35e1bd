// SPDX-License-Identifier: MIT
#include "ftcs/daemon/watch/watch.h"

#include <chrono>
#include <csignal>
#include <utility>

#include <fmt/format.h>

#include "ftcs/daemon/watch/watch_json.h"
#include "ftcs/daemon/watch/watch_page.h"
#include "ftcs/platform/durable_file.h"

namespace ftcs::daemon {
namespace {

using platform::HttpAddress;
using platform::HttpAnswer;
using platform::HttpRequest;
using std::chrono::milliseconds;

constexpr milliseconds kTurn{100};
constexpr int kTurnsPerState = 10;  // once a second, and when the mode changes
constexpr int kTurnsPerFile = 100;  // ten seconds, below the usual scrape interval
constexpr std::size_t kKeptPieces = 200;
constexpr std::size_t kMostPositions = 64;
constexpr std::uint16_t kNeighbours = 8;  // daemons of one host on one page
constexpr milliseconds kNeighbourPatience{150};

std::string event(const char* name, const std::string& data) {
  return fmt::format("event: {}\ndata: {}\n\n", name, data);
}

std::string host_of(std::string_view text) {
  const std::size_t scheme = text.find("://");
  if (scheme != std::string_view::npos) text.remove_prefix(scheme + 3);
  const std::size_t end = text.starts_with('[') ? text.find(']') : text.find(':');
  return std::string(text.substr(0, end));
}

/// The page of one daemon may listen to the others of its host.
std::string allow(const HttpRequest& request) {
  const bool same = !request.origin.empty() && host_of(request.origin) == host_of(request.host);
  return same ? request.origin : std::string{};
}

}  // namespace

Result<std::unique_ptr<Watch>, std::string> Watch::open(const WatchOptions& options) {
  std::unique_ptr<Watch> watch(new Watch(options));  // the constructor is private
  if (auto wrong = watch->listen()) return *wrong;
  if (!options.metrics_file.empty()) {
    if (auto wrong =
            platform::write_durably(options.metrics_file, "", platform::Readers::kEverybody))
      return *wrong;
  }
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);  // signals are the loop's
  watch->thread_ = std::thread([self = watch.get()] { self->attend(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return watch;
}

Watch::~Watch() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  metrics_server_.reset();
  page_server_.reset();
}

std::optional<std::string> Watch::listen() {
  if (options_.web) {
    if (auto wrong = listen_for_page()) return "--web " + *wrong;
  }
  if (!options_.metrics) return std::nullopt;
  metrics_server_ = std::make_unique<platform::HttpServer>();
  serve_metrics(*metrics_server_);
  if (auto wrong = metrics_server_->open(*options_.metrics)) return "--metrics " + *wrong;
  return std::nullopt;
}

std::optional<std::string> Watch::listen_for_page() {
  std::optional<std::string> wrong;
  for (std::uint16_t i = 0; i < kNeighbours; ++i) {
    HttpAddress address = *options_.web;
    address.port = static_cast<std::uint16_t>(address.port + i);
    page_server_ = std::make_unique<platform::HttpServer>();
    serve_page(*page_server_);
    const auto error = page_server_->open(address);
    if (!error) return std::nullopt;
    if (!wrong) wrong = error;
    if (address.port == 0) break;
  }
  return wrong;
}

void Watch::serve_metrics(platform::HttpServer& server) {
  server.serve("/metrics", [this](const HttpRequest& request) {
    const auto format = request.accept.find("openmetrics") != std::string::npos
                            ? MetricsFormat::kOpenMetrics
                            : MetricsFormat::kPrometheus;
    return HttpAnswer{metrics(format), metrics_type(format)};
  });
}

void Watch::serve_page(platform::HttpServer& server) {
  server.serve("/", [](const HttpRequest&) {
    return HttpAnswer{watch_page(), "text/html; charset=utf-8"};
  });
  server.serve("/state", [this](const HttpRequest& request) {
    const std::lock_guard lock(mutex_);
    return HttpAnswer{state_json_, "application/json", allow(request)};
  });
  server.serve("/others", [this](const HttpRequest&) {
    return HttpAnswer{others(), "application/json"};
  });
  server.serve_events(
      "/events",
      [this](std::uint64_t listener, std::uint64_t number) { return next_piece(listener, number); },
      allow);
  serve_metrics(server);
}

std::string Watch::where() const {
  std::string text;
  if (page_server_) text += fmt::format("page http://{}/", to_string(page_server_->address()));
  if (metrics_server_) {
    text += fmt::format("{}metrics http://{}/metrics", text.empty() ? "" : ", ",
                        to_string(metrics_server_->address()));
  }
  if (!options_.metrics_file.empty()) {
    text += fmt::format("{}metrics in {}", text.empty() ? "" : ", ", options_.metrics_file);
  }
  return text;
}

void Watch::attend() {
  for (int turn = 0;; ++turn) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kTurn, [this] { return stopping_; });
    const WatchMode before = state_.mode;
    drain();
    if (turn % kTurnsPerState == 0 || state_.mode != before) {
      adev_ = history_.deviations(Deviation::kOverlappingAllan);
      tdev_ = history_.deviations(Deviation::kTime);
      state_json_ = state_json(state_, history_.histogram(), adev_, tdev_);
      push(event("state", state_json_));
    }
    const bool last = stopping_;
    lock.unlock();
    changed_.notify_all();
    if (turn % kTurnsPerFile == 0 || last) write_file();
    if (last) return;
  }
}

/// Of all points of a twentieth of a second the one that is farthest off is shown.
void Watch::drain() {
  constexpr double kShortestS = 0.02;
  state_ = feed_.state();
  std::vector<WatchPoint> shown;
  WatchPoint point;
  while (feed_.next(point)) {
    history_.add(point);
    const bool same = !shown.empty() && point.time_s - shown.back().time_s < kShortestS &&
                      shown.back().used == point.used;
    if (!same) {
      shown.push_back(point);
    } else if (std::abs(point.offset_ns) > std::abs(shown.back().offset_ns)) {
      const double time_s = shown.back().time_s;
      shown.back() = point;
      shown.back().time_s = time_s;
    }
  }
  if (!shown.empty()) push(event("points", points_json(shown)));
}

void Watch::push(std::string piece) {
  pieces_.push_back(std::move(piece));
  if (pieces_.size() <= kKeptPieces) return;
  pieces_.pop_front();
  ++first_piece_;
}

std::optional<std::string> Watch::next_piece(std::uint64_t listener, std::uint64_t number) {
  constexpr std::chrono::seconds kSignOfLife{1};
  std::unique_lock lock(mutex_);
  if (number == 0) {
    if (listeners_.size() == kMostPositions) listeners_.erase(listeners_.begin());
    listeners_[listener] = first_piece_ + pieces_.size();
    return event("state", state_json_) + event("points", points_json(history_.recent()));
  }
  std::uint64_t& next = listeners_[listener];
  changed_.wait_for(lock, kSignOfLife,
                    [&] { return stopping_ || first_piece_ + pieces_.size() > next; });
  if (stopping_) return std::nullopt;
  next = std::max(next, first_piece_);  // who is too slow misses some
  std::string text;
  for (; next < first_piece_ + pieces_.size(); ++next) text += pieces_[next - first_piece_];
  return text.empty() ? ": still here\n\n" : text;
}

std::string Watch::metrics(MetricsFormat format) {
  const std::lock_guard lock(mutex_);
  return metrics_text({state_, history_.largest_ns().value_or(0.0), tdev_}, options_.names, format);
}

void Watch::write_file() {
  if (options_.metrics_file.empty()) return;
  // A disk that is full now may not be in ten seconds; the file's age tells.
  (void)platform::write_durably(options_.metrics_file, metrics(MetricsFormat::kPrometheus),
                                platform::Readers::kEverybody);
}

/// Ports of this host at which another daemon shows itself.
std::string Watch::others() const {
  HttpAddress address = page_server_->address();
  const std::uint16_t own = address.port;
  const std::uint16_t first = options_.web->port == 0 ? own : options_.web->port;
  std::string ports;
  for (std::uint16_t i = 0; i < kNeighbours; ++i) {
    address.port = static_cast<std::uint16_t>(first + i);
    if (address.port == own) continue;
    const auto answer = platform::http_get(address, "/state", kNeighbourPatience);
    if (!answer || answer->find("\"program\":\"ftcs\"") == std::string::npos) continue;
    ports += fmt::format("{}{}", ports.empty() ? "" : ",", address.port);
  }
  return "[" + ports + "]";
}

}  // namespace ftcs::daemon
