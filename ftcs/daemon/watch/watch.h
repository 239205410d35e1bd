// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "ftcs/daemon/watch/metrics_text.h"
#include "ftcs/daemon/watch/watch_feed.h"
#include "ftcs/daemon/watch/watch_history.h"
#include "ftcs/platform/http_server.h"
#include "ftcs/time/result.h"

namespace ftcs::daemon {

struct WatchOptions {
  std::optional<platform::HttpAddress> metrics{};
  std::optional<platform::HttpAddress> web{};
  std::string metrics_file{};  ///< for node_exporter's textfile collector; empty: none
  MetricsNames names = MetricsNames::kFtcs;
  [[nodiscard]] bool is_wanted() const { return metrics || web || !metrics_file.empty(); }
};

/// Shows a running daemon to those who watch it: metrics, a file of metrics, a live page. In
/// threads of its own; what the loop has to do with it is feed(), which waits for nobody.
class Watch {
 public:
  /// Listens. Where another daemon has the page's port already, one of the next seven is taken.
  /// The error is one line for the user.
  [[nodiscard]] static Result<std::unique_ptr<Watch>, std::string> open(
      const WatchOptions& options);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  [[nodiscard]] WatchFeed& feed() { return feed_; }
  /// "page http://..., metrics http://...": for the log.
  [[nodiscard]] std::string where() const;

 private:
  explicit Watch(const WatchOptions& options) : options_(options) {}

  [[nodiscard]] std::optional<std::string> listen();
  [[nodiscard]] std::optional<std::string> listen_for_page();
  void serve_metrics(platform::HttpServer& server);
  void serve_page(platform::HttpServer& server);
  void attend();
  void drain();
  void write_file();
  void push(std::string piece);
  [[nodiscard]] std::optional<std::string> next_piece(std::uint64_t listener, std::uint64_t number);
  [[nodiscard]] std::string metrics(MetricsFormat format);
  [[nodiscard]] std::string others() const;

  WatchOptions options_;
  WatchFeed feed_;
  std::unique_ptr<platform::HttpServer> metrics_server_;
  std::unique_ptr<platform::HttpServer> page_server_;

  std::mutex mutex_;  ///< of all below; the loop never takes it
  std::condition_variable changed_;
  bool stopping_ = false;
  WatchState state_{};
  WatchHistory history_;
  std::vector<StabilityPoint> adev_;
  std::vector<StabilityPoint> tdev_;
  std::string state_json_ = "{}";
  std::deque<std::string> pieces_;                    ///< the last ones
  std::uint64_t first_piece_ = 0;                     ///< number of pieces_.front()
  std::map<std::uint64_t, std::uint64_t> listeners_;  ///< number of the next piece of each
  std::thread thread_;
};

}  // namespace ftcs::daemon
