// SPDX-License-Identifier: MIT
// World: test/support/loaded_path.h, random-walk FM of 1e-9, jitter of 20 ns,
// frames of 120 us (1,500 octets at 100 Mbit/s) unless said. Errors are true
// ones, over the last half, median and worst of the seeds; the oracle is the
// same filter bank hearing only the messages that did not wait.
#include "test/support/loaded_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/listener_for_test.h"

namespace ftcs::estimation {
namespace {

using test::LoadedPath;
using test::LoadedPathSpec;
using test::PathErrors;
using test::PathMessage;
using test::traffic;

/// Knows which messages waited.
class Oracle {
 public:
  explicit Oracle(const LoadedPath& path) : listener_(path) {}
  void hear(const PathMessage& message) {
    if (!message.waited) listener_.hear(message);
  }
  [[nodiscard]] double offset_ns(double now) const { return listener_.offset_ns(now); }

 private:
  Listener listener_;
};

LoadedPathSpec loaded(double forward, double backward, int hops = 1, double service_ns = 120e3) {
  LoadedPathSpec spec;
  spec.traffic = {traffic(forward, hops, service_ns), traffic(backward, hops, service_ns)};
  return spec;
}
LoadedPathSpec at_interval(double seconds, LoadedPathSpec spec) {
  spec.interval_s = seconds;
  return spec;
}

struct Figures {
  double median = 0.0, worst = 0.0, largest = 0.0;
};

template <class Estimator>
Figures figures(const LoadedPathSpec& spec, std::uint64_t seeds) {
  std::vector<double> rms;
  Figures result;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const LoadedPath path(spec, seed);
    Estimator estimator(path);
    const PathErrors errors = test::errors_of(estimator, path, spec.cycles / 2.0);
    rms.push_back(errors.rms_ns);
    result.largest = std::max(result.largest, errors.largest_ns);
  }
  std::sort(rms.begin(), rms.end());
  result.median = rms[rms.size() / 2];
  result.worst = rms.back();
  return result;
}

struct Row {
  const char* name;
  LoadedPathSpec spec;
  double median, worst, largest;  ///< ns, at most
};

TEST(LoadedPath, messages_that_wait_do_not_move_the_clock) {
  const std::array<Row, 15> rows = {{
      {"no load", loaded(0.0, 0.0), 5, 6, 30},
      {"20 %", loaded(0.2, 0.2), 5, 6, 35},
      {"40 %", loaded(0.4, 0.4), 6, 7, 40},
      {"60 %", loaded(0.6, 0.6), 7, 8, 45},
      {"70 %", loaded(0.7, 0.7), 8, 9, 50},
      {"80 %", loaded(0.8, 0.8), 9, 11, 60},
      {"forward alone, 40 %", loaded(0.4, 0.0), 6, 7, 40},
      {"forward alone, 60 %", loaded(0.6, 0.0), 6, 7, 40},
      {"backward alone, 80 %", loaded(0.0, 0.8), 6, 7, 40},
      {"12 us frames, 60 %", loaded(0.6, 0.6, 1, 12e3), 7, 8, 45},
      {"62.5 ms, 40 %", at_interval(0.0625, loaded(0.4, 0.4)), 5, 6, 40},
      {"1 s, 40 %", at_interval(1.0, loaded(0.4, 0.4)), 14, 17, 150},
      {"3 hops, 40 %", loaded(0.4, 0.4, 3), 9, 11, 60},
      {"3 hops, 60 %", loaded(0.6, 0.6, 3), 15, 20, 130},
      {"10 hops, 20 %", loaded(0.2, 0.2, 10), 13, 16, 90},
  }};
  std::printf("%-22s %7s %7s %8s | oracle %7s %7s %8s\n", "ns", "median", "worst", "largest",
              "median", "worst", "largest");
  for (const Row& row : rows) {
    const Figures ours = figures<Listener>(row.spec, 8);
    const Figures oracle = figures<Oracle>(row.spec, 8);
    std::printf("%-22s %7.1f %7.1f %8.0f |        %7.1f %7.1f %8.0f\n", row.name, ours.median,
                ours.worst, ours.largest, oracle.median, oracle.worst, oracle.largest);
    EXPECT_LE(ours.median, row.median) << row.name;
    EXPECT_LE(ours.worst, row.worst) << row.name;
    EXPECT_LE(ours.largest, row.largest) << row.name;
    EXPECT_LE(ours.median, (row.spec.interval_s < 1.0 ? 1.1 : 1.3) * oracle.median) << row.name;
  }
}

/// Largest error from half a second after the event on, and of the last third,
/// worst of the seeds.
struct Change {
  const char* name;
  LoadedPathSpec spec;
  double after_s;  ///< seconds after the event from which the limit holds
  double largest;
};

TEST(LoadedPath, what_changes_under_load_is_followed) {
  const auto with = [](LoadedPathSpec spec, auto change) {
    spec.event_s = 300.0;
    change(spec);
    return spec;
  };
  using S = LoadedPathSpec;
  const auto load = [](auto utilisation) {
    S spec;
    spec.event_s = 300.0;
    for (const Direction direction : kDirections) {
      spec.traffic[direction].utilisation = utilisation;
    }
    return spec;
  };
  // A step times the skew of 50 ppm is no error: it is when the event was.
  const std::array<Change, 12> rows = {{
      {"load 0 to 60 %", load([](double t) { return t < 300.0 ? 0.0 : 0.6; }), 0.0, 100},
      {"load 20 / 80 %, square",
       load([](double t) { return std::fmod(t, 150.0) < 75.0 ? 0.2 : 0.8; }), 0.0, 100},
      {"load 20 to 80 %, ramp", load([](double t) { return 0.5 - 0.3 * std::cos(t / 50.0); }), 0.0,
       100},
      {"path 15 us longer, 40 %", with(loaded(0.4, 0.4), [](S& s) { s.longer_path_ns = 15e3; }),
       0.0, 200},
      {"path 9 us shorter, 40 %", with(loaded(0.4, 0.4), [](S& s) { s.longer_path_ns = -9e3; }),
       0.0, 200},
      {"reference steps by 20 us, 40 %",
       with(loaded(0.4, 0.4), [](S& s) { s.reference_step_ns = 20e3; }), 2.0, 100},
      {"reference steps by 1 ms, 40 %",
       with(loaded(0.4, 0.4), [](S& s) { s.reference_step_ns = 1e6; }), 4.0, 100},
      {"reference steps by 1 ms, 70 %",
       with(loaded(0.7, 0.7), [](S& s) { s.reference_step_ns = 1e6; }), 4.0, 100},
      {"reference steps by -0.1 ms, 70 %",
       with(loaded(0.7, 0.7), [](S& s) { s.reference_step_ns = -1e5; }), 4.0, 100},
      {"reference steps by 50 ms, 80 %",
       with(loaded(0.8, 0.8), [](S& s) { s.reference_step_ns = 50e6; }), 2.0, 3000},
      {"reference steps by 2 s, 3 hops, 60 %",
       with(loaded(0.6, 0.6, 3), [](S& s) { s.reference_step_ns = 2e9; }), 2.0, 4e5},
      {"rate steps by 1 ppm, 40 %", with(loaded(0.4, 0.4), [](S& s) { s.rate_step = 1e-6; }), 0.0,
       1000},
  }};
  for (const Change& row : rows) {
    double largest = 0.0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      const LoadedPath path(row.spec, seed);
      Listener listener(path);
      const double from = (row.spec.event_s + row.after_s) / row.spec.interval_s;
      largest = std::max(largest, test::errors_of(listener, path, from).largest_ns);
    }
    std::printf("%-32s largest error %6.0f ns\n", row.name, largest);
    EXPECT_LE(largest, row.largest) << row.name;
  }
}

TEST(LoadedPath, the_floor_is_found_within_seconds) {
  struct Start {
    double utilisation, median, worst;  ///< cycles
  };
  for (const Start& row : {Start{0.4, 15, 30}, Start{0.6, 30, 45}, Start{0.8, 50, 75}}) {
    std::vector<double> cycles;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      LoadedPathSpec spec = loaded(row.utilisation, row.utilisation);
      spec.cycles = 600;
      const LoadedPath path(spec, seed);
      Listener listener(path);
      cycles.push_back(test::errors_of(listener, path, 0.0).last_above_ns / path.interval_ns());
    }
    std::sort(cycles.begin(), cycles.end());
    std::printf("%2.0f %%: within 5 us for good after %.0f cycles, worst %.0f\n",
                100.0 * row.utilisation, cycles[10], cycles.back());
    EXPECT_LE(cycles[10], row.median);
    EXPECT_LE(cycles.back(), row.worst);
  }
}

TEST(LoadedPath, the_reported_deviation_is_true_under_load) {
  for (const double utilisation : {0.4, 0.8}) {
    std::array<int, 3> inside{};
    int all = 0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      const LoadedPath path(loaded(utilisation, utilisation), seed);
      Listener listener(path);
      for (const PathMessage& message : path.messages()) {
        listener.hear(message);
        if (message.heard_ns < 2400.0 * path.interval_ns()) continue;
        const double now = message.heard_ns;
        const double error = std::abs(listener.offset_ns(now) - path.offset_ns(now));
        for (std::size_t k = 0; k < 3; ++k) {
          inside[k] += error < static_cast<double>(k + 1) * listener.sigma_ns(now) ? 1 : 0;
        }
        ++all;
      }
    }
    const auto share = [&](std::size_t k) { return 100.0 * inside[k] / all; };
    std::printf("%2.0f %%: inside 1, 2, 3 sigma %.1f %.1f %.1f %%\n", 100.0 * utilisation, share(0),
                share(1), share(2));
    EXPECT_GE(share(0), 60.0);
    EXPECT_LE(share(0), 76.0);
    EXPECT_GE(share(1), 92.0);
    EXPECT_LE(share(1), 98.0);
    EXPECT_GE(share(2), 99.0);
  }
}

}  // namespace
}  // namespace ftcs::estimation
