// SPDX-License-Identifier: MIT
// World: a transmitter whose Syncs leave once a second, and which answers a request between every
// two of them; our oscillator is 50 ppm fast. Each message is late by noise of its own.
#include "ftcs/measurement/shared_timescale.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/time/rate.h"
#include "test/support/forbid_allocation.h"

namespace ftcs {
namespace {

using Verdict = SharedTimescale::Verdict;
using Noise = std::function<double(std::mt19937_64&)>;

double normal(std::mt19937_64& random, double sigma) {
  return std::normal_distribution<double>(0.0, sigma)(random);
}
double chance(std::mt19937_64& random) { return std::uniform_real_distribution<double>()(random); }

class SharedTimescaleTest : public testing::Test {
 protected:
  /// A second: a response whose stamp is `ahead` of the transmitter's time, then a Sync.
  void second(double ahead) {
    watch.on_response(pair(at_ + 0.1 + 0.8 * chance(random), ahead + noise(random)));
    sync();
  }
  void sync() { watch.on_sync(pair(at_ += 1.0, noise(random))); }
  static EventPair pair(double at_s, double reference_ns) {
    const Duration elapsed = Duration::from_ns(at_s * 1e9);
    return {Direction::kForward,
            ReferenceTime{elapsed + Duration{Nanoseconds{1'800'000'000'000'000'000}}} +
                Duration::from_ns(std::round(reference_ns)),
            FreeRunningTime{scale(elapsed, Rate::from_ppm(50.0))}};
  }

  SharedTimescale watch;
  std::mt19937_64 random{7};
  Noise noise = [](std::mt19937_64& from) { return normal(from, 10.0); };

 private:
  double at_ = 0.0;
};

TEST_F(SharedTimescaleTest, four_comparisons_suffice) {
  sync();
  for (int i = 0; i < 3; ++i) second(0.0);
  EXPECT_EQ(watch.verdict(), Verdict::kOpen);
  second(0.0);
  EXPECT_EQ(watch.verdict(), Verdict::kShared);
}

TEST_F(SharedTimescaleTest, a_clock_of_its_own_is_never_taken_for_the_transmitters) {
  for (const double ahead : {37e9, -1e6, 200.0}) {
    watch.reset();
    sync();
    for (int i = 0; i < 64; ++i) {
      ASSERT_EQ(watch.verdict(), Verdict::kOpen) << ahead << ", " << i;
      second(ahead);
    }
    EXPECT_EQ(watch.verdict(), Verdict::kForeign);
    EXPECT_NEAR(watch.difference_ns(), ahead, 10.0);
  }
}

TEST_F(SharedTimescaleTest, is_found_out_when_it_departs) {
  sync();
  for (int i = 0; i < 200; ++i) second(0.0);
  ASSERT_EQ(watch.verdict(), Verdict::kShared);
  for (int i = 0; i < 64; ++i) second(20.0);
  EXPECT_EQ(watch.verdict(), Verdict::kForeign);
}

TEST_F(SharedTimescaleTest, noise_of_any_shape_is_no_difference) {
  const Noise shapes[] = {
      [](std::mt19937_64&) { return 0.0; },
      [](std::mt19937_64& from) { return normal(from, 1'000.0); },
      [](std::mt19937_64& from) { return -std::exponential_distribution<double>(1e-3)(from); },
      [](std::mt19937_64& from) {  // one in ten is late by up to 100 us
        return normal(from, 100.0) - (chance(from) < 0.1 ? 1e5 * chance(from) : 0.0);
      },
      [](std::mt19937_64& from) { return chance(from) < 0.3 ? -2'000.0 : normal(from, 20.0); }};
  for (const Noise& shape : shapes) {
    noise = shape;
    watch.reset();
    sync();
    for (int i = 0; i < 20'000; ++i) second(0.0);
    EXPECT_EQ(watch.verdict(), Verdict::kShared) << &shape - shapes;
  }
}

/// How long a message waits in a queue of frames of one length that arrive at random.
class Queue {
 public:
  Queue(double frame_ns, double load) : frame_(frame_ns), mean_gap_(frame_ns / load) {}
  /// At a moment not before the last one asked for, ns.
  double wait(double now, std::mt19937_64& random) {
    while (next_ <= now) {
      work_ = std::max(0.0, work_ - (next_ - then_)) + frame_;
      then_ = next_;
      next_ += std::exponential_distribution<double>(1.0 / mean_gap_)(random);
    }
    return std::max(0.0, work_ - (now - then_));
  }

 private:
  double frame_, mean_gap_;
  double work_ = 0.0, then_ = 0.0, next_ = 0.0;  ///< ns
};

class SharedTimescaleBehindAQueue : public SharedTimescaleTest {
 protected:
  /// A Sync and the response that leaves so much later, whose stamp is `ahead` of the
  /// transmitter's time; ns. The next Sync leaves `interval` later.
  void exchange(Queue* queue, double behind, double interval, double ahead = 0.0) {
    watch.on_sync(heard(queue, 0.0, 0.0));
    watch.on_response(heard(queue, behind, ahead));
    sent_ += interval;
  }
  void begin() {
    watch.reset();
    sent_ = 0.0;
  }

 private:
  EventPair heard(Queue* queue, double after, double ahead) {
    const double sent = sent_ + after;
    const double wait = queue == nullptr ? 0.0 : queue->wait(sent, random);
    const double received = sent + wait + normal(random, 20.0);
    return pair(received * 1e-9, sent - received + ahead);
  }
  double sent_ = 0.0;
};

TEST_F(SharedTimescaleBehindAQueue, a_response_right_behind_a_sync_that_waited_is_no_difference) {
  constexpr double kInterval = 15'625'000.0;
  for (const double load : {0.2, 0.4, 0.6}) {
    for (const double behind : {1e5, 1e6, 1.46e7}) {
      begin();
      Queue queue{2e6, load};
      int shared = 0;
      for (int i = 0; i < 20'000; ++i) {
        exchange(&queue, behind, kInterval);
        ASSERT_NE(watch.verdict(), Verdict::kForeign) << load << ", " << behind << ", " << i;
        shared += watch.verdict() == Verdict::kShared ? 1 : 0;
      }
      EXPECT_GT(shared, 19'000) << load << ", " << behind;
    }
  }
}

/// Bursts: a Sync and the response behind it are together, or one frame apart, which is always the
/// same difference.
TEST_F(SharedTimescaleBehindAQueue, long_frames_that_nearly_fill_a_link_are_no_difference) {
  Queue queue{2e6, 0.95};
  for (int i = 0; i < 100; ++i) exchange(nullptr, 1.2e6, 125e6);
  ASSERT_EQ(watch.verdict(), Verdict::kShared);
  for (int i = 0; i < 20'000; ++i) {
    exchange(&queue, 1.2e6, 125e6);
    ASSERT_NE(watch.verdict(), Verdict::kForeign) << i;
  }
}

/// What messages wait for, now and then, is no excuse for it.
TEST_F(SharedTimescaleBehindAQueue, a_time_that_departs_where_one_message_of_five_waits_is_found) {
  for (const double behind : {1e5, 1.2e6, 2e7}) {
    for (const double off : {-1e3, 100.0, 1e3, 37e9}) {
      begin();
      Queue queue{120e3, 0.2};
      for (int i = 0; i < 200; ++i) exchange(&queue, behind, 125e6);
      ASSERT_EQ(watch.verdict(), Verdict::kShared);
      for (int i = 0; i < 300; ++i) exchange(&queue, behind, 125e6, off);
      EXPECT_EQ(watch.verdict(), Verdict::kForeign) << behind << ", " << off;
    }
  }
}

TEST_F(SharedTimescaleTest, a_time_that_is_off_by_as_much_as_messages_are_apart_is_not_shared) {
  for (const double off : {30e3, 40e3, 1e6}) {
    watch.reset();
    for (int i = 0; i < 5'000; ++i) {
      watch.on_sync(pair(i, normal(random, 10e3)));
      watch.on_response(pair(i + 10e-6, off + normal(random, 10e3)));
      ASSERT_NE(watch.verdict(), Verdict::kShared) << off << ", " << i;
    }
  }
}

TEST_F(SharedTimescaleTest, a_time_that_departs_by_as_much_is_not_heard_any_more) {
  const auto exchange = [&](double at, double ahead) {
    watch.on_sync(pair(at, noise(random)));
    watch.on_response(pair(at + 1e-3, ahead + noise(random)));
  };
  for (int i = 0; i < 100; ++i) exchange(i, 0.0);
  ASSERT_EQ(watch.verdict(), Verdict::kShared);
  EXPECT_TRUE(watch.checked());
  for (int i = 0; i < 20; ++i) exchange(100.0 + i, 1e6);
  EXPECT_FALSE(watch.checked());
}

TEST_F(SharedTimescaleTest, without_syncs_nothing_says_so_any_more) {
  sync();
  for (int i = 0; i < 10; ++i) second(0.0);
  EXPECT_TRUE(watch.checked());
  for (int i = 0; i < 16; ++i) watch.on_response(pair(20.0 + i, 0.0));
  EXPECT_FALSE(watch.checked());
  EXPECT_EQ(watch.verdict(), Verdict::kShared);
}

TEST_F(SharedTimescaleTest, compares_only_what_came_between_two_syncs) {
  watch.on_sync(pair(1.0, 0.0));
  for (int i = 0; i < 10; ++i) {
    watch.on_response(pair(1.5 + i - 2.0, 0.0));  // older than the Sync before the last
    watch.on_sync(pair(2.0 + i, 0.0));
  }
  EXPECT_EQ(watch.verdict(), Verdict::kOpen);
}

TEST_F(SharedTimescaleTest, a_response_may_be_told_after_the_next_sync_or_before_an_older_one) {
  for (int i = 0; i < 10; ++i) {
    watch.on_sync(pair(1.0 + i, 0.0));
    watch.on_response(pair(0.5 + i, 0.0));
  }
  EXPECT_EQ(watch.verdict(), Verdict::kShared);
  watch.reset();
  for (int i = 0; i < 10; ++i) {
    watch.on_response(pair(1.1 + i, 0.0));
    watch.on_sync(pair(1.0 + i, 0.0));
  }
  EXPECT_EQ(watch.verdict(), Verdict::kShared);
}

TEST_F(SharedTimescaleTest, does_not_allocate) {
  const test::ForbidAllocation guard;
  sync();
  for (int i = 0; i < 100; ++i) second(0.0);
}

}  // namespace
}  // namespace ftcs
