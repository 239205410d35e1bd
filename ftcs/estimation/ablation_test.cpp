// SPDX-License-Identifier: MIT
// What each mechanism of the estimator is for: a world in which the whole stays within its limit,
// and the same estimator without that one mechanism does not. Worlds of test/support/loaded_path.h,
// largest true error of eight seeds over the second half, or from one second after the event on.
// The estimator is compiled anew here, for banks that lack what is left out; what ships has no
// switches.
#include <algorithm>
#include <cstdio>

#include <gtest/gtest.h>

#include "ftcs/estimation/estimator.cpp"        // NOLINT(bugprone-suspicious-include)
#include "ftcs/estimation/estimator_noise.cpp"  // NOLINT(bugprone-suspicious-include)
#include "test/support/listener_for_test.h"

namespace ftcs::estimation {
namespace ablation {

struct WithoutJumps : FullGrid {  // nor the second early message that is waited for
  static constexpr bool kWatchesJumps = false;
};
struct WithoutSecondOpinion : FullGrid {
  static constexpr std::size_t kOpinionWindow = 0;
};
struct WithoutShapes : FullGrid {
  static constexpr std::size_t kNoiseWindow = 0;
};

}  // namespace ablation
namespace {

using test::LoadedPath;
using test::LoadedPathSpec;
using test::traffic;

template <class Estimator>
double worst(const LoadedPathSpec& spec) {
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const LoadedPath path(spec, seed);
    ListenerTo<Estimator> listener(path);
    const double from =
        spec.event_s < 0.0 ? spec.cycles / 2.0 : (spec.event_s + 1.0) / spec.interval_s;
    worst = std::max(worst, test::errors_of(listener, path, from).largest_ns);
  }
  return worst;
}

/// ns; the whole stays within `limit`, without the mechanism it is at least twice that.
template <class Without, class Whole = Estimator<FullGrid>>
void needs(const char* mechanism, const char* world, const LoadedPathSpec& spec, double limit) {
  const double whole = worst<Whole>(spec);
  const double without = worst<Without>(spec);
  std::printf("%-16s %-34s %8.1f ns, without it %8.1f\n", mechanism, world, whole, without);
  EXPECT_LE(whole, limit) << mechanism;
  EXPECT_GE(without, 2.0 * limit) << mechanism;
}

TEST(Ablation, every_mechanism_has_a_world_that_needs_it) {
  LoadedPathSpec early;  // by fifteen sigma
  early.early_share = 1.0 / 300.0;
  early.early_ns = 300.0;
  early.cycles = 2400;
  needs<Estimator<ablation::WithoutJumps>>("early messages", "one early in 300, 125 ms", early,
                                           40.0);

  LoadedPathSpec step;
  step.interval_s = 1.0;
  step.cycles = 900;
  step.event_s = 300.0;
  step.reference_step_ns = 20e3;
  needs<Estimator<ablation::WithoutJumps>>("jump watch", "step of the reference, 20 us, 1 s", step,
                                           100.0);

  LoadedPathSpec start;
  start.early_share = 0.1;
  start.early_ns = 20e3;
  start.cycles = 60;
  needs<Estimator<ablation::WithoutSecondOpinion>>(
      "second opinion", "the start, one in ten early by 20 us", start, 100.0);

  LoadedPathSpec queue;
  queue.traffic = {traffic(0.6, 1, 400.0), traffic(0.0)};
  needs<Estimator<ablation::WithoutShapes>>("learnt shapes", "waits of 400 ns, forward alone",
                                            queue, 100.0);

  LoadedPathSpec load;
  load.traffic = {traffic(0.4), traffic(0.4)};
  needs<Estimator<FullGrid>, LoadAwareEstimator<FullGrid>>("second picture", "load of 40 %", load,
                                                           60.0);
}

}  // namespace

template class Estimator<ablation::WithoutJumps>;
template class Estimator<ablation::WithoutSecondOpinion>;
template class Estimator<ablation::WithoutShapes>;

}  // namespace ftcs::estimation
