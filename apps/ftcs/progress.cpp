// SPDX-License-Identifier: MIT
#include "apps/ftcs/progress.h"

#include <cstdio>
#include <string>
#include <unistd.h>

#include <fmt/core.h>

namespace ftcs::app {
namespace {

constexpr std::size_t kWidth = 40;
/// Ten pictures a second are smooth enough.
constexpr std::chrono::milliseconds kBetweenPictures{100};

}  // namespace

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1), start_(Clock::now()), last_(start_) {}

Progress::~Progress() {
  if (drawn_) fmt::print(stderr, "\r{}\r", std::string(kWidth + 40, ' '));
}

void Progress::show(std::size_t done, std::size_t total) {
  const auto now = Clock::now();
  if (!terminal_ || total == 0 || now - last_ < kBetweenPictures) return;
  last_ = now;
  drawn_ = true;
  const double share = static_cast<double>(done) / static_cast<double>(total);
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  const auto filled = static_cast<std::size_t>(share * static_cast<double>(kWidth));
  fmt::print(stderr, "\r[{}{}] {}/{} runs, {:.0f} s left   ", std::string(filled, '#'),
             std::string(kWidth - filled, '.'), done, total, elapsed_s / share - elapsed_s);
  std::fflush(stderr);
}

}  // namespace ftcs::app
