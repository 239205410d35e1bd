// SPDX-License-Identifier: MIT
// A PTP receiver over your own transport: octets and stamps in, octets out. Here a socket pair; its
// far end transmits.
#include <ctime>

#include "examples/socket_pair.h"
#include "ftcs/clock/virtual_clock.h"
#include "ftcs/node/receiver_node.h"

using namespace ftcs;
struct Oscillator final : FreeRunningSource {
  FreeRunningTime now() noexcept override {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC_RAW, &t);
    return FreeRunningTime::from_ns(t.tv_sec * 1'000'000'000LL + t.tv_nsec);
  }
};

int main() {
  Oscillator host;
  VirtualClock clock(host, {.free_running = host.now()});
  node::ReceiverNodeConfig config{.port = {.port = {{1}, 1}, .log_min_delay_req_interval = -4}};
  config.follower.discipline.step.mode = StepMode::kFirst;  // it starts at zero
  node::ReceiverNode receiver(config, clock);
  example::SocketPair sockets(host);
  const auto act = [&] {  // after each input, all of it; other events tell, you may log them
    while (const auto event = receiver.next())
      if (const auto* send = example::to_send(*event)) sockets.send(*send);
  };
  receiver.start(host.now());
  for (int turn = 0; turn < 20'000 && !receiver.locked(); ++turn, example::wait(), act()) {
    sockets.far_end();
    while (const auto message = sockets.receive()) {
      // Yours: the first host.now() is the stamp of the network adapter.
      message->event ? receiver.on_event_message(message->view(), host.now(), host.now())
                     : receiver.on_general_message(message->view(), host.now());
      act();
    }
    while (const auto sent = sockets.sent()) {
      receiver.on_transmit_timestamp(sent->id, sent->at, host.now());
      act();
    }
    if (receiver.deadline() && *receiver.deadline() <= host.now()) receiver.on_timer(host.now());
  }
  return receiver.locked() ? 0 : 1;
}
