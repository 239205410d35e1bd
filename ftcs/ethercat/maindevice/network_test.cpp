// SPDX-License-Identifier: MIT
// The world: trees of SubDevices with crystals of 1 ns tick and no skew, wires of chosen length;
// the MainDevice scans and measures. Oracle: the delays that the wiring adds up to.
#include "ftcs/ethercat/maindevice/network.h"

#include <gtest/gtest.h>

#include "test/support/main_bench.h"

namespace ftcs::ethercat {
namespace {

using test::MainBench;

MainDeviceConfig scan_only() {
  MainDeviceConfig config;
  config.scan_only = true;
  config.clocks.drift_pulses = 0;
  return config;
}

SubDeviceConfig fine_clock(std::int64_t initial_local = 0) {
  SubDeviceConfig config;
  config.clock.tick = Nanoseconds{1};
  config.clock.initial_local = Nanoseconds{initial_local};
  return config;
}

/// Scans and compares all that was measured with what was wired.
void expect_delays_as_wired(MainBench& bench, std::int64_t tolerance_ns = 0) {
  bench.bring_up();
  ASSERT_FALSE(bench.main().failure()) << name(bench.main().failure().kind);
  const Network& network = bench.main().network();
  ASSERT_EQ(network.count, bench.segment().size());
  for (std::size_t position = 0; position < network.count; ++position) {
    const std::size_t number = bench.segment().at_position(position);
    EXPECT_NEAR(static_cast<double>(network.devices[position].propagation_delay),
                bench.segment().delay_to(number).ns(), static_cast<double>(tolerance_ns))
        << "position " << position;
  }
}

TEST(PropagationDelay, of_a_line_of_fifty_is_exact) {
  MainBench bench(scan_only());
  for (int n = 0; n < 50; ++n) {
    bench.add({.parent = n - 1, .cable = Nanoseconds{5 * n}}, 0, fine_clock());
  }
  expect_delays_as_wired(bench);
}

TEST(PropagationDelay, of_a_tree_with_all_ports_taken_is_exact) {
  MainBench bench(scan_only());
  bench.add({}, 0, fine_clock());
  for (int n = 1; n < 40; ++n) {
    const Wiring wiring{.parent = (n - 1) / 3,
                        .parent_port = static_cast<unsigned>((n - 1) % 3 + 1),
                        .cable = Nanoseconds{10 + 7 * n}};
    bench.add(wiring, 0, fine_clock());
  }
  expect_delays_as_wired(bench);
}

//  0 ─ 1 ─ 2 ─ … ─ 9 and from every third of them a branch of four on port 3
TEST(PropagationDelay, of_lines_with_branches_is_exact) {
  MainBench bench(scan_only());
  for (int n = 0; n < 10; ++n) {
    bench.add({.parent = n - 1, .cable = Nanoseconds{100}}, 0, fine_clock());
  }
  int last = 9;
  for (int root = 0; root < 10; root += 3) {
    int parent = root;
    unsigned port = 3;
    for (int n = 0; n < 4; ++n) {
      bench.add({.parent = parent, .parent_port = port, .cable = Nanoseconds{33}}, 0, fine_clock());
      parent = ++last;
      port = 1;
    }
  }
  expect_delays_as_wired(bench);
}

TEST(PropagationDelay, survives_the_wrap_of_the_receive_times_anywhere_in_the_walk) {
  for (std::int64_t before = 0; before < 12'000; before += 400) {
    MainBench bench(scan_only());
    for (int n = 0; n < 12; ++n) {
      // Bring-up until the latch takes a few ms: the wrap shall fall into the latching frame.
      bench.add({.parent = n - 1, .cable = Nanoseconds{20}}, 0,
                fine_clock((std::int64_t{1} << 32) - before));
    }
    bench.bring_up();
    const std::int64_t latched =
        static_cast<std::int64_t>(bench.main().network().devices[0].receive_time);
    // Again with the wrap exactly `before` ns after the latch.
    MainBench again(scan_only());
    for (int n = 0; n < 12; ++n) {
      const std::int64_t start = (std::int64_t{1} << 32) - before;
      again.add({.parent = n - 1, .cable = Nanoseconds{20}}, 0,
                fine_clock(start - (latched - start)));
    }
    expect_delays_as_wired(again);
    EXPECT_EQ(again.main().network().devices[0].receive_time,
              static_cast<std::uint64_t>((std::int64_t{1} << 32) - before));
  }
}

TEST(PropagationDelay, with_ten_nanosecond_ticks_and_skew_is_within_a_tick_and_a_part_of_the_loop) {
  MainBench bench(scan_only());
  for (int n = 0; n < 20; ++n) {
    bench.add({.parent = n - 1, .cable = Nanoseconds{50}}, n % 2 == 0 ? 100.0 : -100.0);
  }
  // Twenty differences of two latches, each on a grid of 10 ns.
  expect_delays_as_wired(bench, 60);
}

TEST(PropagationDelay, knows_what_processing_costs_beyond_forwarding) {
  MainDeviceConfig config = scan_only();
  config.clocks.processing_excess = Nanoseconds{40};
  MainBench bench(config);
  const auto wire = [](int parent, unsigned port) {
    return Wiring{.parent = parent,
                  .parent_port = port,
                  .cable = Nanoseconds{60},
                  .processing = Nanoseconds{320},
                  .forwarding = Nanoseconds{280}};
  };
  bench.add(wire(-1, 0), 0, fine_clock());
  bench.add(wire(0, 3), 0, fine_clock());
  bench.add(wire(0, 1), 0, fine_clock());
  bench.add(wire(1, 1), 0, fine_clock());
  bench.add(wire(2, 2), 0, fine_clock());
  bench.add(wire(0, 2), 0, fine_clock());
  expect_delays_as_wired(bench);
}

TEST(PropagationDelay, passes_through_a_subdevice_without_a_clock) {
  MainBench bench(scan_only());
  SubDeviceConfig plain = fine_clock();
  plain.dc = false;
  bench.add({}, 0, fine_clock());
  bench.add({.parent = 0}, 0, plain);
  bench.add({.parent = 1}, 0, fine_clock());
  bench.bring_up();
  EXPECT_EQ(bench.main().network().devices[2].propagation_delay, 600U);
  EXPECT_EQ(bench.main().network().clocks(), 2U);
}

TEST(Offsets, let_all_copies_agree_at_once_whatever_their_clocks_started_with) {
  MainBench bench(scan_only());
  for (int n = 0; n < 8; ++n) {
    bench.add({.parent = n - 1}, 0, fine_clock(1'000'000'007LL * n * n));
  }
  bench.bring_up();
  const auto reference = bench.segment()[0].dc().system_time(bench.now());
  // The reference shows the MainDevice's time (less nothing: the first cable is 0 ns long).
  EXPECT_EQ(reference, static_cast<std::uint64_t>(bench.now().since_epoch().floor_ns()));
  for (std::size_t n = 1; n < 8; ++n) {
    EXPECT_EQ(bench.segment()[n].dc().system_time(bench.now()), reference) << n;
  }
}

TEST(Topology, contradicting_ports_are_refused) {
  Network network;
  network.count = 2;
  network.devices[0].links.set(0, true);
  network.devices[1].links.set(0, true);
  EXPECT_FALSE(resolve_topology(network)) << "nowhere to hang the second";
  network.devices[0].links.set(1, true);
  EXPECT_TRUE(resolve_topology(network));
  EXPECT_EQ(network.devices[1].parent, 0);
  network.devices[0].links.set(2, true);
  EXPECT_FALSE(resolve_topology(network)) << "one that does not answer";
  network.devices[0].links.set(2, false);
  network.devices[1].links.set(0, false);
  EXPECT_FALSE(resolve_topology(network)) << "wired in reverse";
}

}  // namespace
}  // namespace ftcs::ethercat
