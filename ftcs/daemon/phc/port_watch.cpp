// SPDX-License-Identifier: MIT
#include "ftcs/daemon/phc/port_watch.h"

#include <utility>
#include <variant>

#include "ftcs/daemon/time_feed.h"

namespace ftcs::daemon {
namespace {

constexpr std::int64_t kQuestionIntervalNs = 1'000'000'000;
constexpr std::int64_t kPatienceNs = 5'000'000'000;
constexpr int kAnswersAtOnce = 16;

int importance(ptp::PortState state) {
  if (state == ptp::PortState::kTimeReceiver) return 2;
  return state == ptp::PortState::kTimeTransmitter ? 1 : 0;
}

}  // namespace

Result<PortWatch, platform::OsError> PortWatch::open(const PortAddress& address) {
  auto client = ManagementClient::open(address);
  if (!client) return client.error();
  return PortWatch(std::move(*client));
}

void PortWatch::attend(std::int64_t now_ns) {
  for (int i = 0; i < kAnswersAtOnce; ++i) {
    const auto answer = client_.next_answer();
    if (!answer) break;
    take(*answer, now_ns);
  }
  if (port_ && now_ns - answered_ns_ > kPatienceNs) {
    port_.reset();
    properties_.reset();
    scale_.reset();
  }
  if (asked_ns_ && now_ns - *asked_ns_ < kQuestionIntervalNs) return;
  asked_ns_ = now_ns;
  client_.ask(ptp::ManagementId::kPortPropertiesNp);
  client_.ask(ptp::ManagementId::kTimePropertiesDataSet);
}

// A boundary clock answers for each of its ports: the one that receives time is the one that
// counts, and for want of that one that transmits.
void PortWatch::take(const ptp::ManagementData& data, std::int64_t now_ns) {
  if (const auto* properties = std::get_if<ptp::PortPropertiesNp>(&data)) {
    const bool other = properties_ && properties_->port != properties->port;
    if (!other || importance(properties->state) > importance(properties_->state)) {
      properties_ = *properties;
    }
  } else if (const auto* time = std::get_if<ptp::TimePropertiesDataSet>(&data)) {
    scale_ = reference_scale(time->flags, time->utc_offset);
    ++scale_answers_;
  }
  if (!properties_ || !scale_) return;
  answered_ns_ = now_ns;
  port_ = Port{properties_->state, properties_->timestamping != 0,
               std::string(properties_->interface.view()), *scale_, scale_answers_};
}

std::optional<Pairing> pairing(const PortWatch& watch, bool system_may_lead) {
  if (watch.is_receiving()) return Pairing{watch.port()->interface, true};
  if (system_may_lead && watch.is_transmitting()) return Pairing{watch.port()->interface, false};
  return std::nullopt;
}

}  // namespace ftcs::daemon
