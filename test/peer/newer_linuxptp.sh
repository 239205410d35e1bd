#!/bin/bash
# SPDX-License-Identifier: MIT
# Prints the path of a ptp4l of Debian's newer suite, unpacked with its libraries beside the system: nothing is installed,
# no right is needed. $FTCS_NEWER_PTP4L, where it is set, is taken instead.
#
# What is downloaded (3 MB, once) is kept in $XDG_CACHE_HOME/ftcs/linuxptp or ~/.cache/ftcs/linuxptp;
# $FTCS_DEBIAN_MIRROR is asked for it, or else the mirror of the system's own apt; $FTCS_NEWER_SUITE (forky) is the suite.
# Exit code 77, and the reason, where it cannot be had.
set -euo pipefail

if [ -n "${FTCS_NEWER_PTP4L:-}" ]; then
  realpath "$FTCS_NEWER_PTP4L"
  exit 0
fi
# shellcheck source=test/debian_mirror.sh
source "$(dirname "$(realpath "$0")")/../debian_mirror.sh"
suite=${FTCS_NEWER_SUITE:-forky}
cache=${XDG_CACHE_HOME:-$HOME/.cache}/ftcs/linuxptp
keyring=/usr/share/keyrings/debian-archive-keyring.gpg

skip() {
  echo "newer linuxptp: skipped: $*" >&2
  exit 77
}

for program in apt-get dpkg flock; do command -v $program > /dev/null || skip "needs $program"; done
[ "$(dpkg --print-architecture)" = amd64 ] || skip "made for amd64"
[ -r "$keyring" ] || skip "needs $keyring"
mkdir -p "$cache"
exec 9> "$cache/lock"
flock 9
cd "$cache"

# apt's own state lies here, not in the system; of that the proxy alone is read.
download() {
  mkdir -p lists/partial archives/partial empty debs
  echo "deb [signed-by=$keyring] $mirror $suite main" > sources.list
  : > status
  {
    for key in SourceParts Parts PreferencesParts; do echo "Dir::Etc::$key \"$cache/empty\";"; done
    cat << END
Dir::Etc::SourceList "$cache/sources.list";
Dir::State::Lists "$cache/lists";
Dir::State::status "$cache/status";
Dir::Cache "$cache";
Dir::Cache::Archives "$cache/archives";
APT::Update::Post-Invoke-Success "";
Acquire::Languages "none";
Acquire::Check-Valid-Until "false";
Debug::NoLocking "true";
END
    apt-config dump Acquire::http Acquire::https 2> /dev/null | grep -i proxy || true
  } > apt.conf
  export APT_CONFIG=$cache/apt.conf
  apt-get update -qq > update.log 2>&1 || true
  (cd debs && apt-get download -qq linuxptp libnettle8t64 libc6 libgcc-s1) > download.log 2>&1 ||
    skip "no packages from $mirror $suite: $(tail -n 1 download.log)"
}

if [ ! -x ptp4l ]; then
  mirror=$(debian_mirror)
  [ -n "$mirror" ] || skip "$no_mirror"
  download
  rm -rf prefix
  for deb in debs/*.deb; do dpkg -x "$deb" prefix; done
  rm -rf debs lists archives
  libraries=$cache/prefix/usr/lib/x86_64-linux-gnu
  printf '#!/bin/sh\nexec %s --library-path %s %s "$@"\n' "$libraries/ld-linux-x86-64.so.2" "$libraries" \
    "$cache/prefix/usr/sbin/ptp4l" > ptp4l.new
  chmod +x ptp4l.new
  ./ptp4l.new -v > /dev/null || skip "that ptp4l does not run here"
  mv ptp4l.new ptp4l  # last: what is complete has it
fi
echo "$cache/ptp4l"
