// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "ftcs/ptp/actions.h"
#include "ftcs/time/instant.h"

namespace ftcs::ptp {

/// True if `a` is better than `b`: the data set comparison of IEEE 1588-2019, 9.3.4. Part 1
/// compares two grandmasters; part 2, two paths to one grandmaster: fewer steps removed, then the
/// smaller sender. (At a receiver with one port the cases of part 2 that look at the receiver's own
/// identity all favour the shorter path, or are errors.)
[[nodiscard]] bool better(const TransmitterData& a, const TransmitterData& b) noexcept;

/// The transmitters that are heard, with the qualification of 9.3.2.5: two Announce messages within
/// four announce intervals. Fixed capacity.
class ForeignTransmitters {
 public:
  /// 9.3.2.4.3 asks for at least five.
  static constexpr std::size_t kCapacity = 8;

  enum class Heard : std::uint8_t {
    kNew,
    kKnown,
    kTableFull  ///< ignored: all places are taken by transmitters that still announce
  };

  /// An Announce arrived. A newcomer may take the place of a transmitter that has fallen silent,
  /// but not that of `selected`: when its silence ends it is for the receipt timeout to say.
  Heard hear(const TransmitterData& data, Duration announce_interval, FreeRunningTime now,
             const PortIdentity& selected = {}, std::uint16_t sequence_id = 0) noexcept;

  /// The best of the qualified ones and of `selected`, which needs no further qualification while
  /// it is in the table; null if there is none. With `first_suffices` one Announce within the
  /// window qualifies. Valid until the next change.
  [[nodiscard]] const TransmitterData* best(const PortIdentity& selected, FreeRunningTime now,
                                            bool first_suffices = false) const noexcept;
  /// When `port` counts as silent: `intervals` announce intervals after its last Announce
  /// (9.2.6.12). None if unknown.
  [[nodiscard]] std::optional<FreeRunningTime> receipt_timeout(const PortIdentity& port,
                                                               int intervals) const noexcept;

  /// Of its last Announce. None: not in the table.
  [[nodiscard]] std::optional<std::uint16_t> sequence_id(const PortIdentity& port) const noexcept;
  /// None: not in the table.
  [[nodiscard]] std::optional<FreeRunningTime> last_heard(const PortIdentity& port) const noexcept;

  /// What was refused is worse than any other for so long, or until it has fallen silent.
  static constexpr Nanoseconds kDoubtTime{300'000'000'000};
  /// False: it is doubted already, or unknown.
  bool doubt(const PortIdentity& port, FreeRunningTime now) noexcept;
  /// It must qualify anew.
  void forget(const PortIdentity& port) noexcept;
  void clear() noexcept { records_ = {}; }

 private:
  struct Record {
    bool used = false;
    bool heard_twice = false;
    TransmitterData data{};
    Duration announce_interval{};
    FreeRunningTime last{};
    FreeRunningTime before_last{};
    std::uint16_t sequence_id = 0;
    std::optional<FreeRunningTime> doubted_until{};
  };
  [[nodiscard]] static bool qualified(const Record& record, FreeRunningTime now,
                                      bool first_suffices) noexcept;
  [[nodiscard]] const Record* find(const PortIdentity& port) const noexcept;
  [[nodiscard]] Record* place_for(const PortIdentity& port, const PortIdentity& selected,
                                  FreeRunningTime now) noexcept;

  std::array<Record, kCapacity> records_{};
};

}  // namespace ftcs::ptp
