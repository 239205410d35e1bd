// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

/// Addresses in the memory of a SubDevice controller, with the names of ETG.1000.4, 6 and 7.
namespace ftcs::ethercat::reg {

inline constexpr std::uint16_t kType = 0x0000;
inline constexpr std::uint16_t kRevision = 0x0001;
inline constexpr std::uint16_t kBuild = 0x0002;
inline constexpr std::uint16_t kFmmuCount = 0x0004;
inline constexpr std::uint16_t kSyncManagerCount = 0x0005;
inline constexpr std::uint16_t kRamSize = 0x0006;         ///< KiByte
inline constexpr std::uint16_t kPortDescriptor = 0x0007;  ///< 2 bits a port; 3 = MII
inline constexpr std::uint16_t kFeatures = 0x0008;
inline constexpr std::uint16_t kStationAddress = 0x0010;
inline constexpr std::uint16_t kStationAlias = 0x0012;
inline constexpr std::uint16_t kDlControl = 0x0100;
inline constexpr std::uint16_t kDlStatus = 0x0110;
inline constexpr std::uint16_t kAlControl = 0x0120;
inline constexpr std::uint16_t kAlStatus = 0x0130;
inline constexpr std::uint16_t kAlStatusCode = 0x0134;
inline constexpr std::uint16_t kPdiControl = 0x0140;
inline constexpr std::uint16_t kEventMask = 0x0200;
inline constexpr std::uint16_t kEventRequest = 0x0210;
inline constexpr std::uint16_t kAlEventMask = 0x0204;
inline constexpr std::uint16_t kAlEventRequest = 0x0220;
inline constexpr std::uint16_t kRxErrorCounter = 0x0300;
inline constexpr std::uint16_t kErrorCountersEnd = 0x0314;
inline constexpr std::uint16_t kWatchdogDivider = 0x0400;
inline constexpr std::uint16_t kWatchdogTimePdi = 0x0410;
inline constexpr std::uint16_t kWatchdogTimeProcessData = 0x0420;
inline constexpr std::uint16_t kWatchdogStatus = 0x0440;
inline constexpr std::uint16_t kWatchdogCounter = 0x0442;
inline constexpr std::uint16_t kSiiConfiguration = 0x0500;
inline constexpr std::uint16_t kSiiControl = 0x0502;
inline constexpr std::uint16_t kSiiAddress = 0x0504;
inline constexpr std::uint16_t kSiiData = 0x0508;
inline constexpr std::uint16_t kFmmu = 0x0600;
inline constexpr std::uint16_t kSyncManager = 0x0800;
inline constexpr std::uint16_t kReceiveTimePort0 = 0x0900;
inline constexpr std::uint16_t kSystemTime = 0x0910;
inline constexpr std::uint16_t kReceiveTimeProcessingUnit = 0x0918;
inline constexpr std::uint16_t kSystemTimeOffset = 0x0920;
inline constexpr std::uint16_t kSystemTimeDelay = 0x0928;
inline constexpr std::uint16_t kSystemTimeDifference = 0x092C;
inline constexpr std::uint16_t kSpeedCounterStart = 0x0930;
inline constexpr std::uint16_t kSpeedCounterDifference = 0x0932;
inline constexpr std::uint16_t kSystemTimeDifferenceFilter = 0x0934;
inline constexpr std::uint16_t kSpeedCounterFilter = 0x0935;
inline constexpr std::uint16_t kCyclicUnitControl = 0x0980;
inline constexpr std::uint16_t kDcActivation = 0x0981;
inline constexpr std::uint16_t kPulseLength = 0x0982;
inline constexpr std::uint16_t kActivationStatus = 0x0984;
inline constexpr std::uint16_t kSync0Status = 0x098E;
inline constexpr std::uint16_t kSync0StartTime = 0x0990;
inline constexpr std::uint16_t kSync0CycleTime = 0x09A0;
inline constexpr std::uint16_t kSync1CycleTime = 0x09A4;
inline constexpr std::uint16_t kLatchUnit = 0x09A8;
inline constexpr std::uint16_t kProcessRam = 0x1000;

inline constexpr std::uint16_t kFeatureDc = 0x0004;
inline constexpr std::uint16_t kFeatureDc64 = 0x0008;
inline constexpr std::uint8_t kActivateCyclic = 0x01;
inline constexpr std::uint8_t kActivateSync0 = 0x02;

inline constexpr std::size_t kFmmuSize = 16;
inline constexpr std::size_t kSyncManagerSize = 8;
inline constexpr std::size_t kPorts = 4;

}  // namespace ftcs::ethercat::reg
