// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

#include "ftcs/servo/adaptive/adaptive_servo.h"
#include "ftcs/servo/baseline/frequency_compensated_servo.h"
#include "ftcs/servo/baseline/kalman_servo.h"
#include "ftcs/servo/baseline/minimum_delay_servo.h"
#include "ftcs/servo/baseline/pid_servo.h"
#include "ftcs/servo/baseline/regression_servo.h"
#include "ftcs/servo/external_servo.h"
#include "ftcs/servo/free_running_servo.h"
#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/servo/linuxptp_pi_servo.h"
#include "ftcs/servo/pics_servo.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"
#include "ftcs/servo/two_way_servo.h"

namespace ftcs {

// A further servo needs one line in each of: ServoKind, kServoKinds, ServoConfig, AnyServo::Variant
// and, in any_servo.cpp, make_servo and validate.

/// The last five with a name are baselines for comparison.
enum class ServoKind : std::uint8_t {
  kFtcs,
  kPics,
  kLinuxptpPi,
  kFreeRunning,
  kAdaptive,
  kRegression,
  kPid,
  kFrequencyCompensated,
  kKalman,
  kMinimumDelay,
  kExternal,  ///< from a shared library; has no name here, since nothing can make it but its loader
};

/// A kind and its name.
struct ServoKindName {
  ServoKind kind;
  std::string_view name;
};

/// Every servo with the name it has on the command line and in files.
inline constexpr ServoKindName kServoKinds[] = {
    {ServoKind::kAdaptive, "adaptive"}, {ServoKind::kFtcs, "ftcs"},
    {ServoKind::kPics, "pics"},         {ServoKind::kLinuxptpPi, "linuxptp-pi"},
    {ServoKind::kFreeRunning, "none"},  {ServoKind::kRegression, "regression"},
    {ServoKind::kPid, "pid"},           {ServoKind::kFrequencyCompensated, "frequency-compensated"},
    {ServoKind::kKalman, "kalman"},     {ServoKind::kMinimumDelay, "minimum-delay"},
};

/// "unknown" for kExternal and for what is no kind.
[[nodiscard]] std::string_view servo_kind_name(ServoKind kind) noexcept;
/// The exact name; no value: there is no such servo.
[[nodiscard]] std::optional<ServoKind> servo_kind_from_name(std::string_view name) noexcept;

/// Everything that can be set about any servo. sync_interval and limits are common: make_servo()
/// hands them to the law that is chosen (the interval unless it is zero; the limits narrowed by the
/// law's own). two_way is the part in front of a classic law; of it the adaptive servo, the Kalman
/// filter and the selection by delay take fixed_path_delay alone, where they have none themselves,
/// and an external servo takes everything but the gate.
struct ServoConfig {
  ServoKind kind = ServoKind::kAdaptive;
  Nanoseconds sync_interval{0};  ///< in reference time; zero: the law's own, or measured
  RateLimits limits{};           ///< local per free running
  TwoWayConfig two_way{};
  FtcsConfig ftcs{};
  PicsConfig pics{};
  LinuxptpPiConfig linuxptp_pi{};
  FreeRunningConfig free_running{};
  AdaptiveConfig adaptive{};
  RegressionConfig regression{};
  PidConfig pid{};
  FrequencyCompensatedConfig frequency_compensated{};
  KalmanConfig kalman{};
  MinimumDelayConfig minimum_delay{};
  ExternalConfig external{};
};

/// The first thing that is wrong with the common limits or the chosen kind, with the common
/// settings filled in, or with what the kind takes of two_way; no value: make_servo() may be
/// called. Other kinds' settings are not looked at.
[[nodiscard]] std::optional<ServoConfigError> validate(const ServoConfig& config) noexcept;

/// Any servo as one value, chosen at run time: a closed set, so no virtual functions and no heap.
///
///     ServoConfig config{.kind = ServoKind::kFtcs};
///     if (const auto error = validate(config)) return describe(*error);
///     AnyServo servo = make_servo(config);
///
/// As large as the adaptive servo. A program that needs one servo takes that servo's type instead,
/// and links no other (BasicClockDiscipline).
class AnyServo {
 public:
  using Variant =
      std::variant<TwoWayServo<FtcsServo>, TwoWayServo<PicsServo>, TwoWayServo<LinuxptpPiServo>,
                   TwoWayServo<FreeRunningServo>, AdaptiveServo, TwoWayServo<RegressionServo>,
                   TwoWayServo<PidServo>, TwoWayServo<FrequencyCompensatedServo>, KalmanServo,
                   MinimumDelayServo, ExternalServo>;

  /// In place: the adaptive servo is too large to pass through the stack of a real-time thread.
  template <class Servo, class... Configs>
  explicit AnyServo(std::in_place_type_t<Servo> type, const Configs&... configs) noexcept
      : servo_(type, configs...) {}

  ServoUpdate update(const TimestampPair& pair, const ClockReading& now) noexcept;
  void reset() noexcept;
  /// The clock has been stepped by somebody else; a servo that lives in free-running time need not
  /// know.
  void on_step(Duration step) noexcept;
  /// A clock was set back: on_new_epoch() of the servo, or reset() where it has none.
  void on_new_epoch() noexcept;
  /// False: the servo has heard no answer, or made no path delay of it yet.
  [[nodiscard]] bool path_delay_known() const noexcept;
  /// AdaptiveServo::free_path_delay(); nothing where the servo has none.
  void free_path_delay(double sigma_ns) noexcept;
  [[nodiscard]] ServoSnapshot snapshot() const noexcept;
  /// As of `now`, for a servo whose belief ages (holdover); otherwise as of the last message.
  [[nodiscard]] ServoSnapshot snapshot_at(const ClockReading& now) const noexcept;

 private:
  Variant servo_;
};

static_assert(ClockServo<AnyServo>);

/// The servo that `config` asks for. Valid: validate(config) finds nothing.
[[nodiscard]] AnyServo make_servo(const ServoConfig& config) noexcept;

}  // namespace ftcs
