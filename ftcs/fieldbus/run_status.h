// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "ftcs/diagnosis/cycle_diagnosis.h"
#include "ftcs/fieldbus/run_options.h"
#include "ftcs/node/cycle_node.h"
#include "ftcs/platform/local_socket.h"

namespace ftcs::daemon {

/// The usual name of the status socket of `ftcs ethercat run`, in /var/run or $XDG_RUNTIME_DIR.
inline constexpr const char* kEthercatSocketName = "ftcs-ethercat";

/// What `ftcs status` is told of a run: plain, so that the cycle copies it without touching the
/// heap.
struct RunSnapshot {
  CycleState state = CycleState::kWaiting;
  BusClockDecision bus;
  std::uint64_t cycles = 0;
  std::uint64_t lost_frames = 0;
  double phase_ns = 0.0;
  double rate_ppb = 0.0;
  double margin_ns = 0.0;
  std::uint16_t working_counter = 0;
  std::uint16_t expected = 0;
  bool all_operational = false;
  std::size_t drives = 0;
  std::array<node::DriveClocks::Seen, ethercat::kMaxSubDevices> clocks{};
  diagnosis::CycleSeen seen{};  ///< what the sentence is made of

  [[nodiscard]] static RunSnapshot of(const node::CycleNode& node,
                                      const diagnosis::CycleSeen& seen);
};

/// The same as one JSON object; docs/plant-time.md lists the fields.
[[nodiscard]] std::string run_status(const RunOptions& options, const RunSnapshot& snapshot);

/// Answers status queries of a run in a thread of ordinary priority. The cycle leaves a snapshot
/// once a second, unless an answer is being written just then: it never waits.
class RunStatus {
 public:
  [[nodiscard]] static Result<std::unique_ptr<RunStatus>, platform::OsError> open(
      const RunOptions& options);
  ~RunStatus();
  RunStatus(const RunStatus&) = delete;
  RunStatus& operator=(const RunStatus&) = delete;

  void publish(const RunSnapshot& snapshot) {
    const std::unique_lock lock(guard_, std::try_to_lock);
    if (lock) snapshot_ = snapshot;
  }

 private:
  RunStatus(const RunOptions& options, platform::LocalSocket socket);
  void serve();

  RunOptions options_;
  platform::LocalSocket socket_;
  std::mutex guard_;
  RunSnapshot snapshot_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace ftcs::daemon
