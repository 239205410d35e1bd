// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "ftcs/daemon/watch/watch.h"
#include "ftcs/diagnosis/cycle_diagnosis.h"
#include "ftcs/experiment/cycle_figures.h"
#include "ftcs/fieldbus/run_options.h"
#include "ftcs/node/cycle_node.h"

namespace ftcs::daemon {

/// What a cycle has met lately, as one sentence and for those who watch. After open() the cyclic
/// path touches no heap here.
class CycleObserver {
 public:
  explicit CycleObserver(const RunOptions& options);

  /// Before the process becomes one of real time: the threads of the watch are not to be.
  [[nodiscard]] std::optional<std::string> open();
  /// After each cycle.
  void note(const node::CycleNode& node, const experiment::CycleFigures& figures,
            FreeRunningTime now);
  [[nodiscard]] diagnosis::CycleSeen seen(const node::CycleNode& node,
                                          const experiment::CycleFigures& figures) const;
  /// "locked: ..." or "not locked: ...", into `text`.
  [[nodiscard]] std::string_view sentence(std::span<char> text, const node::CycleNode& node,
                                          const experiment::CycleFigures& figures) const;
  /// "page http://...": empty without.
  [[nodiscard]] std::string where() const { return watch_ ? watch_->where() : std::string{}; }

 private:
  struct Mark {
    std::uint64_t cycles = 0;
    std::uint64_t lost = 0;
    std::uint64_t late = 0;
  };
  void publish(const node::CycleNode& node, const experiment::CycleFigures& figures);
  void describe_drives(const node::CycleNode& node, double margin_ns);

  RunOptions options_;
  std::unique_ptr<Watch> watch_;
  std::uint64_t window_;  ///< cycles
  Mark older_;
  Mark newer_;
  std::optional<FreeRunningTime> start_{};
  FreeRunningTime next_state_{};
  FreeRunningTime now_{};
  WatchState state_{};
};

}  // namespace ftcs::daemon
