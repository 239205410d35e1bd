// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ftcs/platform/os_error.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// Hears every frame that comes to a network interface, whomever it is for, before any firewall.
/// Sends nothing. Needs CAP_NET_RAW.
class FrameListener {
 public:
  [[nodiscard]] static Result<FrameListener, OsError> open(const std::string& interface);
  FrameListener(FrameListener&& other) noexcept;
  FrameListener& operator=(FrameListener&&) = delete;
  FrameListener(const FrameListener&) = delete;
  FrameListener& operator=(const FrameListener&) = delete;
  ~FrameListener();

  /// The next frame with its 802.1Q tag in its place, valid until the next call; none: nothing came
  /// for so long. Frames that this host sends are left out.
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> next(std::chrono::milliseconds wait);

 private:
  explicit FrameListener(int fd) : fd_(fd) {}

  int fd_ = -1;
  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(2048);
};

}  // namespace ftcs::platform
