// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "ftcs/daemon/log.h"
#include "ftcs/daemon/ptp_options.h"
#include "ftcs/daemon/ptp_receiver.h"
#include "ftcs/fieldbus/plant_clock.h"
#include "ftcs/fieldbus/plant_mailbox.h"

namespace ftcs::daemon {

/// A PTP receiver that tells plant time whenever its loop has turned, if it is locked to a
/// grandmaster that knows the date.
class PlantReceiver final : public PtpReceiver {
 public:
  using PtpReceiver::PtpReceiver;
  [[nodiscard]] PlantMailbox& mailbox() noexcept { return mailbox_; }
  /// Why nothing is told; from any thread.
  [[nodiscard]] std::string reason();

 private:
  void housekeeping(FreeRunningTime now) override;
  /// Empty: nothing speaks against it.
  [[nodiscard]] std::string objection(ReferenceTime plant);

  void warn_of_timescale();

  bool warned_ = false;
  PlantMailbox mailbox_;
  std::mutex guard_;
  std::string reason_;
};

/// `ftcs ptp` in the process of the cycle: sockets, port and virtual clock in a thread of their
/// own, of ordinary priority; what the cycle hears of it is a mailbox without a lock, and nothing
/// in between.
class PtpPlantSource final : public PlantSource {
 public:
  /// To be called before the thread of the cycle gets its priority. One sentence if clock or
  /// sockets cannot be had.
  [[nodiscard]] static Result<std::unique_ptr<PtpPlantSource>, std::string> start(
      platform::Kernel& kernel, const PtpOptions& options);
  ~PtpPlantSource() override;
  PtpPlantSource(const PtpPlantSource&) = delete;
  PtpPlantSource& operator=(const PtpPlantSource&) = delete;

  [[nodiscard]] std::optional<PlantReading> read(FreeRunningTime) override {
    return receiver_->mailbox().take();
  }
  [[nodiscard]] std::string reason() override;

 private:
  PtpPlantSource(platform::Kernel& kernel, const PtpOptions& options);

  Log log_;
  std::unique_ptr<PlantReceiver> receiver_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

/// The clock of --plant-time: "ptp:eth1" ("ptp" where the options have the interface), or what
/// PlantClock::open() knows.
[[nodiscard]] Result<PlantClock, std::string> open_plant_clock(const std::string& name,
                                                               PtpOptions ptp,
                                                               platform::Kernel& kernel);

}  // namespace ftcs::daemon
