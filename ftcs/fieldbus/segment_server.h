// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ftcs/fieldbus/host_other_side.h"
#include "ftcs/platform/ethercat_link.h"
#include "ftcs/sim/drives/segment.h"
#include "ftcs/sim/drives/simulated_crystal.h"

namespace ftcs::daemon {

/// Something that happens to a running segment.
struct SegmentFault {
  enum class Kind : std::uint8_t { kCut, kMend, kRestart, kSkew };
  Kind kind = Kind::kCut;
  std::size_t device = 0;
  double at_s = 0.0;  ///< after the first frame
  double ppm = 0.0;   ///< kSkew: the crystal's deviation from then on
};

struct SegmentOptions {
  std::string interface;  ///< raw Ethernet; empty: UDP
  std::string address = "127.0.0.1";
  std::uint16_t port = ethercat::kUdpPort;
  std::size_t drives = 8;
  std::vector<double> ppm{50.0, -80.0, 80.0};  ///< of the crystals; the last two take turns
  double random_walk_ppb = 0.0;                ///< per square root of a second
  bool tree = false;                           ///< every SubDevice carries up to three; else a line
  Nanoseconds cable{50};
  Nanoseconds hop{300};
  /// Share of the frames that are swallowed, half of them before they reach a drive.
  double drop = 0.0;
  /// Bit 31 of 0x092C is documented both ways: set when the local copy is ahead, or behind.
  bool sign_bit_means_ahead = true;
  unsigned clock_bits = 64;  ///< of the distributed clocks: 64, 32, or 0: there are none
  /// This SubDevice is a bridge terminal, whose other side shows CLOCK_REALTIME.
  std::optional<std::size_t> bridge;
  std::uint64_t seed = 1;
  double duration_s = 0.0;  ///< zero: until a signal
  std::vector<SegmentFault> faults;
  std::string json;
  /// One line each 50 frames: CLOCK_MONOTONIC and the reference's system time at that instant, ns.
  std::string clock_csv;
};

/// Serves a segment of modelled drives on a link until it is told to stop.
class SegmentServer {
 public:
  /// The kernel must outlive the server.
  SegmentServer(platform::Kernel& kernel, const SegmentOptions& options,
                platform::EthercatLink link);
  /// Returns when `stop` says so or the time is up.
  template <class Stop>
  void run(const Stop& stop) {
    while (!stop() && !finished()) serve();
  }
  void serve();
  void print_summary() const;
  [[nodiscard]] std::string json() const;
  /// At the end: whether all that was to be recorded has been.
  [[nodiscard]] bool finish_records();
  [[nodiscard]] const ethercat::Segment& segment() const { return *segment_; }

 private:
  [[nodiscard]] bool finished() const;
  void build();
  [[nodiscard]] ethercat::SubDeviceConfig config_of(std::size_t n);
  void write_clock(FreeRunningTime stamp);
  void end_clock_csv(int number);
  void apply_faults(FreeRunningTime now);
  void apply(const SegmentFault& fault, ethercat::WireTime now);

  SegmentOptions options_;
  platform::EthercatLink link_;
  HostOtherSide other_side_;
  std::unique_ptr<ethercat::Segment> segment_;
  std::vector<std::unique_ptr<sim::SimulatedCrystal>> crystals_;
  FreeRunningTime start_;
  bool started_ = false;
  std::size_t next_fault_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t malformed_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint64_t user_stamps_ = 0;
  std::uint64_t random_ = 0;
  bool record_cut_ = false;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> clock_csv_{nullptr, std::fclose};
};

}  // namespace ftcs::daemon
