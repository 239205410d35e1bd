// SPDX-License-Identifier: MIT
#include "ftcs/estimation/jump_watch.h"

#include <cmath>

#include "ftcs/estimation/belief.h"

namespace ftcs::estimation {

/// No queue makes packets early, so that two messages, one of each direction,
/// tell a jump of the offset from anything else. A longer path looks like two
/// late packets, which are common; so does a jump of the offset where one
/// direction is all there is.
bool JumpHypothesis::certain() const noexcept {
  if (!two_way_) return lead_ > kBeyondDoubt;
  return lead_ > (jumped_ == Of::kOffset ? kSure : kBeyondDoubt) && seen_[0] && seen_[1];
}

void JumpHypothesis::start(const JumpMessage& message) noexcept {
  const Estimate& believed = message.believed;
  const double innovation = message.seen.z - believed.x - message.seen.sign * believed.d;
  const double size = std::abs(innovation) / message.scale;
  // Filters resolve no larger variance: then it has jumped by what is seen, give or take so much.
  const bool far = jumped_ == Of::kOffset && size * size > kUnknown;
  Estimate jumped = believed;
  if (far) jumped.x += innovation;
  (jumped_ == Of::kOffset ? jumped.xx : jumped.dd) += far ? kUnknown : size * size;
  filter_.start(jumped);
  lead_ = -kHint;  // ln of the probability that a message brings one
  two_way_ = message.two_way;
  alive_ = far || size * size < ModelBank<OneModel>::kLargestVariance;
}

/// The oscillator wanders as the filters believe that it does.
void JumpHypothesis::predict(const JumpMessage& message) noexcept {
  alive_ = filter_.predict(message.seen.elapsed, 0, message.process);
}

bool JumpHypothesis::judge(const JumpMessage& message) noexcept {
  const auto said =
      filter_.judge(message.seen, message.shape, message.scale, message.outliers, true);
  filter_.correct(message.seen, message.scale, said);
  lead_ += said.log_density[0] - message.log_density;
  if (said.credit[0] > 0.5) seen_[message.seen.sign > 0.0 ? 0 : 1] = true;
  if (!filter_.healthy()) alive_ = false;
  return message.outliers.late > kOften && said.centred[0] < 0.0 && said.distance[0] > kEightSigma;
}

/// A jump of the offset makes one direction early; where late messages are
/// common its size is to be read from that one.
bool JumpHypothesis::may_start(const JumpMessage& message) const noexcept {
  if (message.distance < kEightSigma) return false;
  const Estimate& e = message.believed;
  const bool early = message.seen.sign * (message.seen.z - e.x) - e.d < 0.0;
  return early || jumped_ == Of::kDelay || message.outliers.late <= kOften;
}

void JumpHypothesis::follow(const JumpMessage& message) noexcept {
  if (!alive_ && message.distance < kEightSigma) return;  // almost always
  bool early = false;
  if (alive_) {
    predict(message);
    early = judge(message);
  }
  if (message.distance < kEightSigma) {
    if (lead_ <= 0.0) alive_ = false;
  } else if (may_start(message)) {
    JumpHypothesis afresh(jumped_);
    afresh.start(message);
    (void)afresh.judge(message);
    // Where messages wait the one that it started from may have: then one that did not is early.
    if (!alive_ || (early && afresh.alive_) || afresh.lead_ > lead_) *this = afresh;
  }
  if (!alive_) clear();
}

void JumpWatch::follow(const JumpMessage& message) noexcept {
  offset_.follow(message);
  if (message.delay_free) delay_.follow(message);
}

JumpWatch::Verdict JumpWatch::judge(double rival) const noexcept {
  const JumpHypothesis& best = leading();
  if (!speaks() || best.lead() <= rival) return Verdict::kNothing;
  // What spoke for a jump of the delay may be from before the clock has jumped: the offset's has to
  // be plainly worse.
  const bool disputed = &best == &delay_ && best.lead() < offset_.lead() + kConvincing;
  return best.certain() && !disputed ? Verdict::kJumped : Verdict::kWait;
}

void JumpWatch::clear() noexcept {
  offset_.clear();
  delay_.clear();
}

}  // namespace ftcs::estimation
