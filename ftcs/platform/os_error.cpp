// SPDX-License-Identifier: MIT
#include "ftcs/platform/os_error.h"

#include <cerrno>
#include <cstring>
#include <utility>

namespace ftcs::platform {
namespace {

OsErrorKind kind_of(int number) {
  switch (number) {
    case ENODEV:
    case ENXIO:
      return OsErrorKind::kNoSuchInterface;
    case ENETDOWN:
      return OsErrorKind::kInterfaceDown;
    case EADDRNOTAVAIL:
      return OsErrorKind::kNoAddress;
    case EPERM:
    case EACCES:
      return OsErrorKind::kNotPermitted;
    case EADDRINUSE:
      return OsErrorKind::kAddressInUse;
    case EOPNOTSUPP:
    case ERANGE:
      return OsErrorKind::kTimestampingUnsupported;
    default:
      return OsErrorKind::kSystem;
  }
}

const char* reason(const OsError& error) {
  switch (error.kind) {
    case OsErrorKind::kNoSuchInterface:
      return "no such device";
    case OsErrorKind::kInterfaceDown:
      return "the interface is down";
    case OsErrorKind::kNoAddress:
      return "no IP address of the version asked for";
    case OsErrorKind::kBadAddress:
      return "not an IPv4 address";
    case OsErrorKind::kNotPermitted:
      return "not permitted (run as root or grant the capability)";
    case OsErrorKind::kAddressInUse:
      return "already in use by another program";
    case OsErrorKind::kTimestampingUnsupported:
      return "the requested time stamping is not supported";
    case OsErrorKind::kNoSuchDevice:
      return "no such device";
    case OsErrorKind::kForeignFile:
      return "it holds something else and is left as it is";
    case OsErrorKind::kSystem:
      break;
  }
  return std::strerror(error.number);  // one thread: the static buffer is ours
}

}  // namespace

std::string OsError::message() const { return what + ": " + reason(*this); }

OsError os_error(int number, std::string what) {
  return {kind_of(number), number, std::move(what)};
}

}  // namespace ftcs::platform
