// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "ftcs/node/cycle_node.h"
#include "ftcs/report/write_file.h"

namespace ftcs::daemon {

/// One line for each cycle of a run. A disk that is full ends the record, not the run: drives are
/// moving.
class CycleCsv {
 public:
  /// Before the drives are touched: what the file holds stays until begin().
  [[nodiscard]] std::optional<WriteError> open(const std::string& path);
  /// Before the first cycle, of a record that is open.
  void begin();
  [[nodiscard]] bool is_open() const { return file_ != nullptr; }
  void write(std::uint64_t cycle, const node::CycleNode& node);
  /// What is still in the buffer goes out. No value: every line is there.
  [[nodiscard]] std::optional<WriteError> finish();

 private:
  void check(bool good);

  std::string path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, std::fclose};
  std::optional<WriteError> error_;
};

}  // namespace ftcs::daemon
