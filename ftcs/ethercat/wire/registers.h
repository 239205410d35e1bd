// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

/// Addresses in the memory of a SubDevice controller. Clauses are those of ETG.1000.4 (IEC
/// 61158-4-12); widths in octets; everything little-endian. "Local" is what one SubDevice has of
/// its own, "system" what all of them agree on.
///
/// An address is the `offset` of a datagram's Target. A SubDevice that does not have it, or does
/// not let it be written, does not count in the working counter.
namespace ftcs::ethercat::reg {

// 6.1.1, information of the controller: read only.
inline constexpr std::uint16_t kType = 0x0000;              ///< 1: family of the controller
inline constexpr std::uint16_t kRevision = 0x0001;          ///< 1
inline constexpr std::uint16_t kBuild = 0x0002;             ///< 2
inline constexpr std::uint16_t kFmmuCount = 0x0004;         ///< 1: FMMU channels, up to 16
inline constexpr std::uint16_t kSyncManagerCount = 0x0005;  ///< 1: sync managers, up to 16
inline constexpr std::uint16_t kRamSize = 0x0006;           ///< 1: process RAM from 0x1000, KiByte
inline constexpr std::uint16_t kPortDescriptor = 0x0007;    ///< 1: 2 bits a port; 3 = MII
inline constexpr std::uint16_t kFeatures = 0x0008;  ///< 2: bits kFeatureDc, kFeatureDc64, ...

// 6.1.2, addresses: by which a datagram of configured addressing finds the SubDevice.
inline constexpr std::uint16_t kStationAddress =
    0x0010;                                             ///< 2: given by the MainDevice at the scan
inline constexpr std::uint16_t kStationAlias = 0x0012;  ///< 2: from SII or switches

// 6.1.3 and 6.1.4, data link layer.
inline constexpr std::uint16_t kDlControl = 0x0100;  ///< 4: loops of the ports, use of the alias
inline constexpr std::uint16_t kDlStatus = 0x0110;   ///< 2: link, loop and signal of each port

// 6.1.5, application layer (states: ETG.1000.6, 6.4.1). A state is asked for by 0x0120 and reached
// when 0x0130 shows it; bit 4 of 0x0130 says that it was refused or left, 0x0134 why, until bit 4
// of 0x0120 acknowledges it.
inline constexpr std::uint16_t kAlControl = 0x0120;     ///< 2: state asked for; bit 4 acknowledges
inline constexpr std::uint16_t kAlStatus = 0x0130;      ///< 2: state; bit 4: an error
inline constexpr std::uint16_t kAlStatusCode = 0x0134;  ///< 2: which (AlStatusCode)
inline constexpr std::uint16_t kPdiControl = 0x0140;    ///< 1: kind of the application's interface

// 6.1.6, events: interrupts towards both sides. This MainDevice polls instead, and masks none.
inline constexpr std::uint16_t kEventMask = 0x0200;       ///< 2: which events show in datagrams
inline constexpr std::uint16_t kAlEventMask = 0x0204;     ///< 4: which events the application hears
inline constexpr std::uint16_t kEventRequest = 0x0210;    ///< 2: events for the MainDevice
inline constexpr std::uint16_t kAlEventRequest = 0x0220;  ///< 4: events for the application

// 6.2, error counters: a write of any value clears the group.
inline constexpr std::uint16_t kRxErrorCounter = 0x0300;    ///< 2 a port: bad frames, bad symbols
inline constexpr std::uint16_t kErrorCountersEnd = 0x0314;  ///< first address behind the counters

// 6.3, watchdogs: (divider + 2) * 40 ns * time.
inline constexpr std::uint16_t kWatchdogDivider = 0x0400;          ///< 2: ticks of 40 ns, less 2
inline constexpr std::uint16_t kWatchdogTimePdi = 0x0410;          ///< 2: 0 = off
inline constexpr std::uint16_t kWatchdogTimeProcessData = 0x0420;  ///< 2: without outputs; 0 = off
inline constexpr std::uint16_t kWatchdogStatus = 0x0440;           ///< 2: bit 0 = not expired
inline constexpr std::uint16_t kWatchdogCounter = 0x0442;          ///< 1: how often it expired

// 6.4, SubDevice information interface: addresses in words of 16 bits. A read: the word's address
// to 0x0504, the command to 0x0502, then 0x0502 until bit 15 falls, then 0x0508 (sii.h).
inline constexpr std::uint16_t kSiiConfiguration = 0x0500;  ///< 1: bit 0: the application owns it
inline constexpr std::uint16_t kSiiControl = 0x0502;        ///< 2: command; bit 15: busy
inline constexpr std::uint16_t kSiiAddress = 0x0504;        ///< 4: word
inline constexpr std::uint16_t kSiiData = 0x0508;           ///< 4 or 8 (control, bit 6)

// 6.6 and 6.7, channels (channels.h): written in PREOP, before SAFEOP is asked for.
inline constexpr std::uint16_t kFmmu = 0x0600;         ///< 16 each: memory at logical addresses
inline constexpr std::uint16_t kSyncManager = 0x0800;  ///< 8 each: consistent pieces of memory

// 6.8, distributed clock. Nanoseconds. Local time counts from power on; system time = local time +
// offset counts from 2000-01-01 where somebody set it so.
//
//     system copy = local time + 0x0920
//     0x092C      = mean of (system copy - (received + 0x0928)),  received: what FRMW of 0x0910
//                   brought from the reference, once a cycle
//
// A control loop in each SubDevice keeps 0x092C at zero by the rate of its local time (0x0932); the
// reference has nobody to follow. At the scan a write to 0x0900 latches one frame's arrivals, of
// which the delays are reckoned (compute_propagation_delays()).
inline constexpr std::uint16_t kReceiveTimePort0 =
    0x0900;  ///< 4 a port: local time, mod 2^32, at
             ///< which the frame that wrote here came
/// 8 (or 4): local copy of the system time at the start of this frame, less 0x0928. A write is
/// compared with it and is one step of the control loop.
inline constexpr std::uint16_t kSystemTime = 0x0910;
inline constexpr std::uint16_t kReceiveTimeProcessingUnit = 0x0918;  ///< 8: as 0x0900, local time
inline constexpr std::uint16_t kSystemTimeOffset = 0x0920;  ///< 8: system less local; acts at once
inline constexpr std::uint16_t kSystemTimeDelay = 0x0928;   ///< 4: from the reference to here
/// 4: mean difference of the local copy to what was received; bit 31 its sign, documented both
/// ways.
inline constexpr std::uint16_t kSystemTimeDifference = 0x092C;
/// 2: bandwidth of the control loop, 0x0080 (fast) to 0x3FFF (slow); a write starts the loop anew.
inline constexpr std::uint16_t kSpeedCounterStart = 0x0930;
/// 2, read only: the rate that the loop has learnt, two's complement.
inline constexpr std::uint16_t kSpeedCounterDifference = 0x0932;
inline constexpr std::uint16_t kSystemTimeDifferenceFilter = 0x0934;  ///< 1: mean over 2^n frames
inline constexpr std::uint16_t kSpeedCounterFilter = 0x0935;          ///< 1: the same of the rate

// 6.8, SYNC signals. Times are system time, nanoseconds. SYNC0 comes at 0x0990 + n * 0x09A0; the
// times are written first, 0x0981 activates them.
inline constexpr std::uint16_t kCyclicUnitControl =
    0x0980;                                                 ///< 1: 0 = the MainDevice owns the unit
inline constexpr std::uint16_t kDcActivation = 0x0981;      ///< 1: kActivateCyclic, kActivateSync0
inline constexpr std::uint16_t kPulseLength = 0x0982;       ///< 2: of SYNC, units of 10 ns
inline constexpr std::uint16_t kActivationStatus = 0x0984;  ///< 1: bit 0: SYNC0 is to come
inline constexpr std::uint16_t kSync0Status = 0x098E;       ///< 1: SYNC0 is pending (acknowledged)
inline constexpr std::uint16_t kSync0StartTime = 0x0990;    ///< 8: first SYNC0; later the next one.
                                                            ///< In the past: it never comes
inline constexpr std::uint16_t kSync1StartTime = 0x0998;    ///< 8, read only: the next SYNC1
inline constexpr std::uint16_t kSync0CycleTime = 0x09A0;    ///< 4: 0 = once
/// 4: SYNC1 so long behind SYNC0. From a SYNC0 cycle on it leaves events out: v behind the first
/// SYNC0, then every (floor(v / cycle) + 1) cycles.
inline constexpr std::uint16_t kSync1CycleTime = 0x09A4;
inline constexpr std::uint16_t kLatchUnit = 0x09A8;   ///< 1 each: latch inputs
inline constexpr std::uint16_t kProcessRam = 0x1000;  ///< mailboxes and process data from here

inline constexpr std::uint16_t kFeatureDc = 0x0004;    ///< in kFeatures: has a distributed clock
inline constexpr std::uint16_t kFeatureDc64 = 0x0008;  ///< in kFeatures: of 64 bits, else 32
inline constexpr std::uint8_t kActivateCyclic = 0x01;  ///< in kDcActivation: the unit runs
inline constexpr std::uint8_t kActivateSync0 = 0x02;   ///< in kDcActivation: SYNC0 is generated

inline constexpr std::uint8_t kActivateSync1 = 0x04;  ///< in kDcActivation: SYNC1 is generated

inline constexpr std::size_t kFmmuSize = 16;        ///< octets a channel
inline constexpr std::size_t kSyncManagerSize = 8;  ///< octets a channel
inline constexpr std::size_t kPorts = 4;            ///< of a controller, at most

}  // namespace ftcs::ethercat::reg
