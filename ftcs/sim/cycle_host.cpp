// SPDX-License-Identifier: MIT
#include "ftcs/sim/cycle_host.h"

#include <algorithm>

#include "ftcs/time/relabel.h"

namespace ftcs::sim {

using ethercat::WireTime;

CycleHost::CycleHost(const node::CycleNodeConfig& config, ethercat::Segment& segment,
                     WireTime start, Oscillator* crystal)
    : segment_(segment),
      crystal_(crystal),
      node_(std::make_unique<node::CycleNode>(config)),
      now_(start) {}

FreeRunningTime CycleHost::shown_at(WireTime instant) {
  return crystal_ == nullptr ? relabel<FreeRunningTime>(instant)
                             : crystal_->reading_at(relabel<TrueTime>(instant));
}

WireTime CycleHost::instant_of(FreeRunningTime reading) {
  return crystal_ == nullptr ? relabel<WireTime>(reading)
                             : relabel<WireTime>(crystal_->true_at(reading));
}

bool CycleHost::pass(ethercat::ConstBytes frame, bool lost) {
  stamps_.sent = stamps_.received = shown_at(now_) + (noise_ ? noise_() : Duration{});
  const auto plant = plant_ ? plant_(stamps_.sent) : std::nullopt;
  stamps_.has_system_time = plant.has_value();
  stamps_.system_time = plant.value_or(ReferenceTime{});
  if (frame.empty() || lost) return false;
  std::copy(frame.begin(), frame.end(), buffer_.begin());
  const ethercat::Bytes bytes = ethercat::Bytes{buffer_}.first(frame.size());
  const auto view = ethercat::FrameView::parse(bytes);
  if (!view) return false;
  const auto passage = segment_.pass(*view, now_);
  if (!passage.returned || (way_back_ && !way_back_(*view))) return false;
  stamps_.received = shown_at(passage.at);
  return node_->on_frame(bytes, stamps_) != ethercat::FrameOutcome::kIgnored;
}

bool CycleHost::exchange(bool lost) {
  const bool answered = pass(node_->next_frame(), lost);
  if (!answered) node_->on_timeout();
  return answered;
}

bool CycleHost::bring_up() {
  constexpr int kMostFrames = 2'000'000;
  for (int i = 0; i < kMostFrames && !node_->cyclic(); ++i) {
    if (node_->stopped()) return false;
    exchange();
    wait(Duration{kBringUpRoundTrip});
  }
  node_->start(shown_at(now_));
  return node_->cyclic();
}

const CycleDecision& CycleHost::cycle(Duration late, bool lost) {
  now_ = std::max(now_, instant_of(node_->decision().wake + late));
  const FreeRunningTime read = shown_at(now_);
  const ethercat::ConstBytes frame = node_->begin_cycle(read, plant_ ? plant_(read) : std::nullopt);
  if (stack_) wait(stack_());
  const bool answered = pass(frame, lost);
  wait(Duration{kReplyTime});
  return node_->end_cycle(answered, stamps_, shown_at(now_));
}

void CycleHost::stop() {
  constexpr Nanoseconds kBetween{1'000'000};
  node_->stop();
  while (!node_->stopped()) {
    exchange();
    wait(Duration{kBetween});
  }
}

}  // namespace ftcs::sim
