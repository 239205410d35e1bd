// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <gtest/gtest.h>

#include "addend_plant.h"

namespace ftcs::addend_test {

constexpr std::int64_t kInterval = 125'000'000;
constexpr std::int64_t kLatency = 1'000'000;

/// A servo that steers a plant as a program would: sample, command, register, next Sync.
struct Node {
  explicit Node(const ftcs_addend_config& wanted) : config(wanted) {
    EXPECT_EQ(ftcs_addend_init(&servo, &config, config.nominal_addend), FTCS_ADDEND_OK);
  }
  ftcs_addend_command step(Plant& plant) {
    const ftcs_addend_sample sample = plant.sample(kLatency);
    const ftcs_addend_command command = ftcs_addend_update(&servo, &sample);
    plant.obey(command, sample.now_ns);
    plant.next();
    return command;
  }
  void run(Plant& plant, int samples) {
    for (int n = 0; n < samples; ++n) step(plant);
  }
  ftcs_addend_config config;
  ftcs_addend_servo servo{};
};

[[nodiscard]] inline ftcs_addend_config plain() {
  return ftcs_addend_default_config(Plant::kNominal);
}
[[nodiscard]] inline ftcs_addend_config quiet() {
  return ftcs_addend_quiet_config(Plant::kNominal);
}

}  // namespace ftcs::addend_test
