// SPDX-License-Identifier: MIT
#include "ftcs/daemon/kept_state.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "ftcs/platform/durable_file.h"
#include "ftcs/report/json.h"

namespace ftcs::daemon {
namespace {

/// Another format gets another number; a file with a higher one is of a later program.
constexpr int kVersion = 1;
/// Crystals age by some 0.1 ppm a month; after a quarter of a year a guess is as good.
constexpr std::int64_t kOldestS = std::int64_t{90} * 86'400;
/// A crystal that was switched off, or is warmer than before, does not come back closer than this.
constexpr double kLeastRateSigma = 2e-7;
/// Between any two crystals; more would be somebody's joke, and the clock starts with it.
constexpr double kLargestRate = 1e-3;
/// The year 9999.
constexpr std::int64_t kLatestS = 253'402'300'799;
/// Nobody writes more; a file that is larger is something else.
constexpr std::size_t kLargestFile = 65'536;

/// The date that the file carries.
std::int64_t now_s(const Log& log) { return log.kernel().clock_ns(CLOCK_REALTIME) / 1'000'000'000; }

Result<LearntState, std::string> from_json(const Json& json, std::string_view clock,
                                           std::int64_t now) {
  const int version = json.at("ftcs_state").get<int>();
  if (version != kVersion)
    return fmt::format("it has format {}, this program knows {}", version, kVersion);
  const auto kept_clock = json.at("clock").get<std::string>();
  if (kept_clock != clock)
    return fmt::format("it is of another clock ({}), this is {}", kept_clock, clock);
  const auto saved_at_s = json.at("saved_at_s").get<std::int64_t>();
  if (saved_at_s < 0 || saved_at_s > kLatestS) return std::string("its date is impossible");
  const std::int64_t age_s = now - saved_at_s;
  if (age_s > kOldestS) return fmt::format("it is {} days old", age_s / 86'400);
  LearntState learnt{json.at("rate_ppb").get<double>() * 1e-9,
                     json.at("rate_sigma_ppb").get<double>() * 1e-9,
                     json.at("timestamp_noise_ns").get<double>()};
  if (!learnt.valid() || std::abs(learnt.rate_deviation) > kLargestRate) {
    return std::string("its figures are impossible");
  }
  learnt.rate_sigma = std::max(learnt.rate_sigma, kLeastRateSigma);
  return learnt;
}

}  // namespace

std::string to_text(const KeptState& state) {
  const Json json = {{"ftcs_state", kVersion},
                     {"clock", state.clock},
                     {"saved_at_s", state.saved_at_s},
                     {"rate_ppb", state.learnt.rate_deviation * 1e9},
                     {"rate_sigma_ppb", state.learnt.rate_sigma * 1e9},
                     {"timestamp_noise_ns", state.learnt.timestamp_noise_ns}};
  return dump(json);
}

Result<LearntState, std::string> read_kept_state(std::string_view text, std::string_view clock,
                                                 std::int64_t now) {
  try {
    return from_json(Json::parse(text), clock, now);
  } catch (const Json::exception&) {
    return std::string("it is broken");
  }
}

StateKeeper::StateKeeper(Log& log, std::string path, Duration interval, std::string clock)
    : log_(log), path_(std::move(path)), interval_(interval), clock_(std::move(clock)) {
  if (path_.empty()) return;
  std::error_code ignored;
  const auto status = std::filesystem::status(path_, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    log_(LogLevel::kWarning, "driftfile {}: not used, it is no regular file", path_);
    path_.clear();
    return;
  }
  std::ifstream file(path_, std::ios::binary);
  if (!file) {
    log_(LogLevel::kInfo, "driftfile {}: not there yet", path_);
    return;
  }
  std::string text(kLargestFile, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  const auto state = read_kept_state(text, clock_, now_s(log_));
  if (!state) {
    log_(LogLevel::kWarning, "driftfile {}: not used, {}", path_, state.error());
    return;
  }
  learnt_ = *state;
  log_(LogLevel::kNotice, "driftfile {}: rate {:+.3f} ppb, timestamp noise {:.0f} ns", path_,
       learnt_->rate_deviation * 1e9, learnt_->timestamp_noise_ns);
}

void StateKeeper::note(const ServoSnapshot& snapshot, FreeRunningTime now) {
  if (path_.empty()) return;
  if (const auto learnt = learnt_from(snapshot)) latest_ = learnt;
  if (!saved_) saved_ = now;
  if (now - *saved_ < interval_) return;
  if (!latest_ || !take_result(false)) return;  // a disk that is slow, or stalled: next time
  saved_ = now;
  writing_ = std::async(std::launch::async, platform::write_durably, path_,
                        to_text({clock_, now_s(log_), *latest_}), platform::Readers::kOwner);
}

void StateKeeper::save() {
  (void)take_result(true);
  if (path_.empty() || !latest_) return;
  report(platform::write_durably(path_, to_text({clock_, now_s(log_), *latest_})));
}

bool StateKeeper::take_result(bool wait) {
  if (!writing_.valid()) return true;
  if (!wait && writing_.wait_for(std::chrono::seconds{0}) != std::future_status::ready)
    return false;
  report(writing_.get());
  return true;
}

void StateKeeper::report(const std::optional<std::string>& problem) {
  if (problem && !warned_) log_(LogLevel::kWarning, "driftfile: {}", *problem);
  warned_ = problem.has_value();
}

}  // namespace ftcs::daemon
