// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <limits>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <optional>
#include <span>
#include <vector>

#include "ftcs/sim/drives/segment.h"
#include "ftcs/time/relabel.h"
#include "test/support/fake_kernel.h"

namespace ftcs::platform {

/// A kernel whose one socket is the cable to a segment of modelled drives. Its clocks stand still
/// while a program runs and move on where it sleeps or waits, so that two runs are the same to the
/// bit. CLOCK_MONOTONIC is the time of the wire.
class SegmentKernel final : public FakeKernel {
 public:
  explicit SegmentKernel(ethercat::Segment& segment) : segment_(segment) {
    reading_ns = 0;
    raw_ns = 1'000'000'000;
  }

  std::int64_t reply_ns = 60'000;  ///< from sending a frame until who waits for it is woken
  std::int64_t late_ns = 0;        ///< from the instant of a sleep to the end of it
  std::function<void()> on_send;   ///< before each frame
  bool gives_rx_stamps = true;
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;                    ///< frames that were sent and swallowed
  std::function<bool()> swallows = nullptr;  ///< whether the cable loses this frame

  ssize_t send_to(int, std::span<const std::uint8_t> bytes,
                  const SocketAddress&) noexcept override {
    if (on_send) on_send();
    if (send_errno != 0) return -send_errno;
    ++frames;
    if (gives_tx_stamps) stamp_ = {stamp_now(), static_cast<std::uint32_t>(frames - 1)};
    if (swallows && swallows()) {
      ++lost;
      return static_cast<ssize_t>(bytes.size());
    }
    Frame frame{{bytes.begin(), bytes.end()}, 0, raw_ns + reply_ns};
    const auto view = ethercat::FrameView::parse(frame.bytes);
    if (!view) return static_cast<ssize_t>(bytes.size());
    const auto instant = ethercat::WireTime::from_ns(raw_ns);
    const auto passage = segment_.pass(*view, instant);
    if (!passage.returned) return static_cast<ssize_t>(bytes.size());
    frame.stamp_ns = stamp_now() + (passage.at - instant).rounded_ns();
    on_the_way_.push_back(std::move(frame));
    return static_cast<ssize_t>(bytes.size());
  }
  ssize_t receive(int, msghdr& message, int flags) noexcept override {
    if ((flags & MSG_ERRQUEUE) != 0) return take_transmit_stamp(message);
    if (on_the_way_.empty() || on_the_way_.front().due_ns > raw_ns) return -EAGAIN;
    const Frame frame = std::move(on_the_way_.front());
    on_the_way_.pop_front();
    const std::size_t length = std::min(frame.bytes.size(), message.msg_iov[0].iov_len);
    std::memcpy(message.msg_iov[0].iov_base, frame.bytes.data(), length);
    std::size_t size = 0;
    if (gives_rx_stamps) size = write_stamp(CMSG_FIRSTHDR(&message), frame.stamp_ns);
    message.msg_controllen = size;
    return static_cast<ssize_t>(length);
  }
  int wait_readable(int, std::int64_t timeout_ns) noexcept override {
    const std::int64_t until = raw_ns + timeout_ns;
    const bool comes = !on_the_way_.empty() && on_the_way_.front().due_ns <= until;
    advance((comes ? std::max(on_the_way_.front().due_ns, raw_ns) : until) - raw_ns);
    return comes ? 1 : 0;
  }
  void sleep_until(std::int64_t instant_ns) noexcept override {
    advance(std::max<std::int64_t>(instant_ns + late_ns - raw_ns, 0));
  }

 private:
  struct Frame {
    std::vector<std::uint8_t> bytes;
    std::int64_t stamp_ns = 0;
    std::int64_t due_ns = 0;
  };
  struct TransmitStamp {
    std::int64_t ns = 0;
    std::uint32_t key = 0;
  };
  [[nodiscard]] std::int64_t stamp_now() const { return realtime_ns; }
  static std::size_t write_stamp(cmsghdr* header, std::int64_t ns) {
    scm_timestamping stamps{};
    stamps.ts[0] = {ns / 1'000'000'000, ns % 1'000'000'000};
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_TIMESTAMPING;
    header->cmsg_len = CMSG_LEN(sizeof stamps);
    std::memcpy(CMSG_DATA(header), &stamps, sizeof stamps);
    return CMSG_SPACE(sizeof stamps);
  }
  /// Of SOF_TIMESTAMPING_OPT_TSONLY and OPT_ID: the stamp, and the number of its frame.
  ssize_t take_transmit_stamp(msghdr& message) {
    if (!stamp_) return -EAGAIN;
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    std::size_t size = write_stamp(header, stamp_->ns);
    header = CMSG_NXTHDR(&message, header);
    sock_extended_err error{};
    error.ee_data = stamp_->key;
    header->cmsg_level = SOL_IP;
    header->cmsg_type = IP_RECVERR;
    header->cmsg_len = CMSG_LEN(sizeof error);
    std::memcpy(CMSG_DATA(header), &error, sizeof error);
    size += CMSG_SPACE(sizeof error);
    message.msg_controllen = size;
    stamp_.reset();
    return 0;
  }

  ethercat::Segment& segment_;
  std::deque<Frame> on_the_way_;
  std::optional<TransmitStamp> stamp_;
};

}  // namespace ftcs::platform
