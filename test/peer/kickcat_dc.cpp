// SPDX-License-Identifier: MIT
// KickCAT's MainDevice with distributed clocks, for kickcat_drives.sh: brings every SubDevice of an
// interface to OP with SYNC0 every millisecond and follows their clock with KickCAT's own soft PLL.
// Compiled against KickCAT where it is; no part of any other target.
//
//   kickcat_dc INTERFACE SECONDS     Exit code 0: in OP to the end, clocks within 1 us, PLL locked.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <vector>

#include "kickcat/Bus.h"
#include "kickcat/CoE/CiA/DS402/Drive.h"
#include "kickcat/Link.h"
#include "kickcat/OS/Timer.h"
#include "kickcat/helpers.h"

using namespace kickcat;

namespace {

using Drives = std::vector<std::unique_ptr<CoE::CiA::DS402::Drive>>;

/// To SAFEOP; the start of the cycles, on the reference clock.
nanoseconds bring_up(Bus& bus, Drives& drives, std::vector<uint8_t>& image) {
  bus.init(100ms);
  const nanoseconds start = bus.enableDC(1ms, 500us, 1s);
  bus.requestState(State::PRE_OP);
  bus.waitForState(State::PRE_OP, 3000ms);
  for (auto& slave : bus.slaves()) {
    drives.push_back(std::make_unique<CoE::CiA::DS402::Drive>(bus, slave));
    drives.back()->configure(CoE::CiA::DS402::control::POSITION_CYCLIC);
    drives.back()->setInterpolationTimePeriod(1, -3);
    // Sync error counter limit: six missed SYNC0s in a row. Hosts stand still now and then.
    constexpr uint16_t kLimit = 17;
    bus.writeSDO(slave, 0x10F1, 2, Bus::Access::PARTIAL, &kLimit, sizeof kLimit);
  }
  bus.createMapping(image.data(), image.size());
  bus.requestState(State::SAFE_OP);
  bus.waitForState(State::SAFE_OP, 1000ms);
  for (auto& drive : drives) drive->attach();
  return start;
}

struct Figures {
  long bad = 0;  ///< datagrams without their working counter
  long locked_at = -1;
  std::size_t operational = 0;
};

Figures cycle(Bus& bus, Drives& drives, Timer& timer, long cycles) {
  Figures seen;
  const auto on_error = [&seen](const DatagramState&) { ++seen.bad; };
  for (long cycle = 0; cycle < cycles; ++cycle) {
    static_cast<void>(timer.wait_next_tick());
    try {
      bus.sendLogicalRead(on_error);
      bus.sendLogicalWrite(on_error);
      bus.finalizeDatagrams();
      bus.processAwaitingFrames();
      // Half a second of outputs at SYNC0 before OP is asked for.
      if (cycle == 500) bus.requestState(State::OPERATIONAL);
      if (cycle == 1000) {
        for (auto& drive : drives) drive->enable();
      }
      // One a cycle: drives that wait for outputs meanwhile would fault, and rightly so.
      const long left = cycles - 1 - cycle;
      if (left < static_cast<long>(drives.size())) {
        seen.operational += bus.getCurrentState(bus.slaves().at(static_cast<std::size_t>(left))) ==
                            State::OPERATIONAL;
      }
    } catch (const std::exception& error) {
      std::fprintf(stderr, "[%ld] %s\n", cycle, error.what());
    }
    for (auto& drive : drives) drive->update();
    bus.sync(timer);
    if (timer.locked() && seen.locked_at < 0) seen.locked_at = cycle;
  }
  return seen;
}

int run(const char* interface, double seconds) {
  auto [nominal, redundancy] = createSockets(interface, "");
  auto link = std::make_shared<Link>(nominal, redundancy, [] {});
  // KickCAT's bring-up gives up on one late frame: a busy host gets more time than a bus would.
  link->setTimeout(20ms);
  Bus bus{link};
  std::vector<uint8_t> image(4096);
  Drives drives;
  const nanoseconds start = bring_up(bus, drives, image);
  link->setTimeout(2ms);
  Timer timer{1ms};
  timer.start(start);
  const long cycles = static_cast<long>(seconds * 1000);
  const Figures seen = cycle(bus, drives, timer, cycles);
  const bool synchronized = bus.isDCSynchronized(1000ns);
  bool enabled = true;
  for (auto& drive : drives) enabled &= drive->isEnabled();
  std::printf(
      "KickCAT: %zu SubDevices, %zu in OP at the end, enabled %s, clocks within 1 us %s, soft PLL "
      "locked in cycle %ld, "
      "%ld datagrams without their working counter in %ld cycles\n",
      bus.slaves().size(), seen.operational, enabled ? "yes" : "no", synchronized ? "yes" : "no",
      seen.locked_at, seen.bad, cycles);
  const bool good =
      seen.operational == drives.size() && enabled && synchronized && seen.locked_at >= 0;
  return good ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: kickcat_dc INTERFACE SECONDS\n");
    return 2;
  }
  try {
    return run(argv[1], std::atof(argv[2]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "kickcat_dc: %s\n", error.what());
    return 1;
  }
}
