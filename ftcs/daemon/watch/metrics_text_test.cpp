// SPDX-License-Identifier: MIT
#include "ftcs/daemon/watch/metrics_text.h"

#include <gtest/gtest.h>

namespace ftcs::daemon {
namespace {

WatchState locked() {
  WatchState state;
  state.kind.set("ptp");
  state.target.set("eth0");
  state.servo.set("adaptive");
  state.mode = WatchMode::kLocked;
  state.cause = diagnosis::Cause::kLocked;
  state.offset_ns = -50.0;
  state.sigma_ns = 10.0;
  state.delay_ns = 1000.0;
  state.rate_ppb = 2000.0;
  state.outliers = 3;
  return state;
}

std::string text(const WatchState& state, MetricsNames names = MetricsNames::kFtcs,
                 MetricsFormat format = MetricsFormat::kPrometheus) {
  const std::vector<StabilityPoint> tdev{{.tau_s = 1.0, .deviation = 2e-9}};
  return metrics_text({state, 70.0, tdev}, names, format);
}

void expect_line(const std::string& text, const std::string& line) {
  EXPECT_NE(text.find(line + "\n"), std::string::npos) << line << " is not in\n" << text;
}

TEST(Metrics, of_a_port_with_keys_tell_why_messages_were_dropped) {
  WatchState state = locked();
  EXPECT_EQ(text(state).find("ftcs_messages"), std::string::npos);
  state.messages = {.present = true,
                    .authentic = 70,
                    .missing = 1,
                    .unknown_key = 2,
                    .wrong_code = 3,
                    .unsupported = 4,
                    .replayed = 5};
  const std::string said = text(state);
  expect_line(said, "ftcs_messages_authentic_total{clock=\"ptp:eth0\"} 70");
  expect_line(said, "ftcs_messages_dropped_total{clock=\"ptp:eth0\",reason=\"wrong_code\"} 3");
  expect_line(said, "ftcs_messages_dropped_total{clock=\"ptp:eth0\",reason=\"replayed\"} 5");
}

TEST(Metrics, figures_are_in_base_units) {
  const std::string said = text(locked());
  expect_line(said, "ftcs_offset_seconds{clock=\"ptp:eth0\"} -5.0000000000000004e-08");
  expect_line(said, "ftcs_frequency_ratio{clock=\"ptp:eth0\"} 2.0000000000000003e-06");
  expect_line(said, "ftcs_tdev_seconds{clock=\"ptp:eth0\",tau=\"1\"} 2e-09");
  expect_line(said, "ftcs_state{clock=\"ptp:eth0\",state=\"locked\"} 1");
  expect_line(said, "ftcs_state{clock=\"ptp:eth0\",state=\"holdover\"} 0");
  expect_line(said, "ftcs_samples_refused_total{clock=\"ptp:eth0\",reason=\"outlier\"} 3");
  expect_line(said, "# TYPE ftcs_samples_refused_total counter");
  EXPECT_EQ(said.find("ftcs_drives"), std::string::npos) << "it has none";
  EXPECT_NEAR(offset_bound_ns(locked()), 50.0 + 30.0 + 1000.0, 1e-9);
}

TEST(Metrics, open_metrics_names_counters_without_total_and_has_an_end) {
  const std::string said = text(locked(), MetricsNames::kFtcs, MetricsFormat::kOpenMetrics);
  expect_line(said, "# TYPE ftcs_samples_refused counter");
  expect_line(said, "ftcs_samples_refused_total{clock=\"ptp:eth0\",reason=\"outlier\"} 3");
  EXPECT_TRUE(said.ends_with("# EOF\n"));
}

TEST(Metrics, what_is_not_known_is_left_out) {
  WatchState state;
  state.kind.set("ptp");
  state.target.set("eth0");
  const std::string said = text(state);
  EXPECT_EQ(said.find("ftcs_offset"), std::string::npos);
  EXPECT_EQ(said.find("nan"), std::string::npos) << said;
  expect_line(said, "ftcs_state{clock=\"ptp:eth0\",state=\"freerun\"} 1");
}

TEST(Metrics, in_holdover_the_bound_grows_and_no_offset_is_told) {
  WatchState state = locked();
  state.mode = WatchMode::kHoldover;
  state.sigma_ns = 20.0;
  for (const auto names : {MetricsNames::kFtcs, MetricsNames::kOpenShift}) {
    EXPECT_EQ(text(state, names).find("offset_seconds{"), std::string::npos);
    EXPECT_EQ(text(state, names).find("ptp_offset_ns{"), std::string::npos);
  }
  expect_line(text(state), "ftcs_offset_bound_seconds{clock=\"ptp:eth0\"} 1.1100000000000002e-06");
  expect_line(text(state), "ftcs_state{clock=\"ptp:eth0\",state=\"holdover\"} 1");
}

TEST(Metrics, drives_are_counted_by_state) {
  WatchState state = locked();
  state.cycle.present = true;
  state.cycle.axes_in_fault = 1;
  state.cycle.drives = 3;
  state.cycle.drive[0] = state.cycle.drive[1] = {8, 400.0F};
  state.cycle.drive[2] = {0x14, 399.0F};  // SAFEOP with an error
  const std::string said = text(state);
  expect_line(said, "ftcs_drives{clock=\"ptp:eth0\",state=\"op\"} 2");
  expect_line(said, "ftcs_drives{clock=\"ptp:eth0\",state=\"safeop\"} 1");
  expect_line(said, "ftcs_axes_in_fault{clock=\"ptp:eth0\"} 1");
}

TEST(Metrics, openshift_calls_holdover_two) {
  WatchState state = locked();
  const auto said = [&state] { return text(state, MetricsNames::kOpenShift); };
  const std::string labels = "{from=\"master\",process=\"ftcs\",node=\"\",iface=\"eth0\"} ";
  expect_line(said(), "openshift_ptp_clock_state" + labels + "1");
  expect_line(said(), "openshift_ptp_offset_ns" + labels + "-50");
  expect_line(said(), "openshift_ptp_max_offset_ns" + labels + "70");
  state.mode = WatchMode::kHoldover;
  expect_line(said(), "openshift_ptp_clock_state" + labels + "2");
  state.mode = WatchMode::kAcquiring;
  expect_line(said(), "openshift_ptp_clock_state" + labels + "0");
}

TEST(Metrics, a_label_may_hold_anything) {
  WatchState state = locked();
  state.reference.set("a\"b\\c\nd");
  EXPECT_NE(text(state).find("reference=\"a\\\"b\\\\c d\""), std::string::npos);
}

}  // namespace
}  // namespace ftcs::daemon
