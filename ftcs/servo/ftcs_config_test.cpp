// SPDX-License-Identifier: MIT
#include <chrono>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "ftcs/servo/ftcs_servo.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;

TEST(FtcsConfig, names_what_is_wrong) {
  const auto error_of = [](auto change) {
    FtcsConfig config;
    config.sync_interval = 125ms;
    config.offset_gain = 1.0;
    change(config);
    return validate(config);
  };
  EXPECT_EQ(error_of([](FtcsConfig&) {}), std::nullopt);
  EXPECT_EQ(validate(FtcsConfig{}), std::nullopt);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.sync_interval = -1ns; }),
            ServoConfigError::kSyncInterval);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.correction_time = -1ns; }),
            ServoConfigError::kCorrectionTime);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.correction_time = 126ms; }),
            ServoConfigError::kCorrectionTime);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.correction_time = 125ms; }), std::nullopt);
  EXPECT_EQ(error_of([](FtcsConfig& c) {
              c.sync_interval = 0ns;
              c.correction_time = 126ms;
            }),
            std::nullopt);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.offset_gain = -1e-9; }), ServoConfigError::kOffsetGain);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.offset_gain = 1.0 + 1e-9; }),
            ServoConfigError::kOffsetGain);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.offset_gain = std::nan(""); }),
            ServoConfigError::kOffsetGain);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.offset_gain = 0.0; }), std::nullopt);
  EXPECT_EQ(error_of([](FtcsConfig& c) {
              c.converged_band = {Nanoseconds{2}, Nanoseconds{1}};
            }),
            ServoConfigError::kConvergedBand);
  EXPECT_EQ(error_of([](FtcsConfig& c) {
              c.converged_band = {Nanoseconds{-1}, Nanoseconds{1}};
            }),
            ServoConfigError::kConvergedBand);
  EXPECT_EQ(error_of([](FtcsConfig& c) {
              c.converged_band = {Nanoseconds{0}, Nanoseconds{0}};
            }),
            std::nullopt);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.limits.slowest = Rate::from_ratio(0.0); }),
            ServoConfigError::kRateLimits);
  EXPECT_EQ(error_of([](FtcsConfig& c) { c.plausible_ratio.fastest = Rate::from_ratio(0.9); }),
            ServoConfigError::kPlausibleRatio);
}

}  // namespace
}  // namespace ftcs
