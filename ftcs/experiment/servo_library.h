// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "ftcs/servo/any_servo.h"

namespace ftcs::experiment {

/// A servo that somebody else wrote: a shared library with ftcs_servo_plugin.h's entry, or a Python
/// script that fills the same table over ctypes. It runs in this process, with its rights and its
/// mistakes. Loaded once and never unloaded: its threads and its interpreter may still be there.
class ServoLibrary {
 public:
  /// `path` ends in .py for a script; anything else is a shared library. Throws std::runtime_error
  /// with one sentence: what was expected, what came. A script is run by the libpython that the
  /// environment variable FTCS_LIBPYTHON names, else by the newest one that is found.
  explicit ServoLibrary(const std::string& path);

  /// Is it a file rather than the name of one of our servos?
  [[nodiscard]] static bool is_path(const std::string& servo);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const ftcs_servo_functions& functions() const noexcept { return functions_; }

  /// Why the figures of its finished runs are not those of a servo, in a sentence; empty: it gave
  /// commands, and all could be obeyed.
  [[nodiscard]] std::string doubt() const;
  /// What came of a finished run; any thread.
  void add(const ExternalTally& tally) const noexcept;

 private:
  void check(const std::string& path) const;

  ftcs_servo_functions functions_{};
  std::string name_;
  mutable std::atomic<std::uint64_t> messages_ = 0;
  mutable std::atomic<std::uint64_t> commands_ = 0;
  mutable std::atomic<std::uint64_t> unsound_ = 0;
};

/// One instance, for one run of one clock; ends with this object. The library must outlive it.
class ServoInstance {
 public:
  /// Throws std::runtime_error if the library makes none.
  ServoInstance(const ServoLibrary& library, const ServoConfig& common);
  ServoInstance(ServoInstance&&) noexcept = default;
  ServoInstance& operator=(ServoInstance&&) = delete;
  ~ServoInstance();

  [[nodiscard]] ExternalConfig config() const noexcept {
    ExternalConfig config;
    config.functions = &library_->functions();
    config.instance = instance_.get();
    config.tally = tally_.get();
    return config;
  }

 private:
  const ServoLibrary* library_;
  std::unique_ptr<void, void (*)(void*)> instance_;
  std::unique_ptr<ExternalTally> tally_ = std::make_unique<ExternalTally>();
};

}  // namespace ftcs::experiment
