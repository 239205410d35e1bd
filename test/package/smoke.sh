#!/bin/bash
# SPDX-License-Identifier: MIT
# smoke.sh FOLDER: the packages in FOLDER (tools/make-deb) in a fresh Debian 12: installed, a clock locked as README has it, the
# library linked, removed, purged, and no file left. Needs root and mmdebstrap; fetches Debian's packages. Not in make test.
set -euo pipefail
[ "$(id -u)" -eq 0 ] || { echo "smoke.sh: needs root" >&2; exit 77; }
command -v mmdebstrap > /dev/null || { echo "smoke.sh: needs mmdebstrap" >&2; exit 77; }
folder=$(realpath "$1")
root=$(mktemp -d)
cleanup() {
  umount "$root/proc" 2> /dev/null || true
  rm -rf "$root"
}
trap cleanup EXIT
fail() { echo "smoke.sh: $*" >&2; exit 1; }
inside() { LC_ALL=C DEBIAN_FRONTEND=noninteractive chroot "$root" "$@"; }
files() { (cd "$root" && find bin/ etc lib/ opt run srv usr var -xdev \( -type f -o -type l \) | sort); }

mmdebstrap --quiet --variant=apt --include=g++,cmake,make,pkg-config,passwd "${SUITE:-bookworm}" "$root"
mount -t proc proc "$root/proc"
printf '#!/bin/sh\nexit 101\n' > "$root/usr/sbin/policy-rc.d"  # no service is started in a chroot
chmod 755 "$root/usr/sbin/policy-rc.d"
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
inside apt-get update -qq
mkdir "$root/packages"
cp "$folder"/*.deb "$root/packages"
# What the package needs stays out of the comparison.
inside sh -c 'apt-get install -y -qq --no-install-recommends $(dpkg-deb -f /packages/ftcs_*.deb Depends Pre-Depends |
  sed "s/^[A-Za-z-]*: //; s/([^)]*)//g; s/|[^,]*//g; s/,/ /g")' > "$root/log" 2>&1 || { cat "$root/log"; fail "dependencies"; }
files > "$root/before"

inside sh -c 'apt-get install -y -qq --no-install-recommends /packages/ftcs_*.deb /packages/libftcs-dev_*.deb' \
  > "$root/log" 2>&1 || { cat "$root/log"; fail "apt install"; }
inside getent passwd ftcs > /dev/null || fail "there is no user ftcs"
inside ftcs --version
inside ftcs demo --duration 5 > "$root/demo" || { cat "$root/demo"; fail "ftcs demo did not lock"; }
grep -E '^adaptive +yes' "$root/demo" || { cat "$root/demo"; fail "the adaptive servo did not lock"; }
for file in usr/lib/systemd/system/ftcs-{ptp,phc,ethercat}@.service usr/lib/udev/rules.d/60-ftcs.rules etc/ftcs/ptp.conf \
  usr/share/man/man1/ftcs-ptp.1.gz usr/share/bash-completion/completions/ftcs usr/share/zsh/vendor-completions/_ftcs; do
  [ -e "$root/$file" ] || [ -e "$root/${file#usr/}" ] || fail "$file is missing"
done
inside sh -c 'cd /tmp && cp -r /usr/share/doc/libftcs-dev/examples e && gunzip -f e/*.gz 2>/dev/null; cd e &&
  c++ -std=c++20 -I.. 01_lock_a_clock.cpp -o one $(pkg-config --cflags --libs ftcs) && ./one | tail -1; rc=$?; rm -rf /tmp/e; exit $rc' ||
  fail "example 01 does not build against the package"

# An older version, with a file of the configuration that its owner has changed, and a program that runs.
mkdir "$root/older"
dpkg-deb -R "$folder"/ftcs_*.deb "$root/older/tree"
sed -i 's/^Version: .*/Version: 0.0.1/' "$root/older/tree/DEBIAN/control"
dpkg-deb --root-owner-group -b "$root/older/tree" "$root/older/ftcs.deb" > /dev/null
inside dpkg -i --force-downgrade /older/ftcs.deb > "$root/log" 2>&1 || { cat "$root/log"; fail "an older version"; }
rm -rf "$root/older"
echo 'domainNumber 7' >> "$root/etc/ftcs/ptp.conf"
inside ftcs ptp -i lo -S --event-port 42319 --general-port 42320 --uds_address none --duration 60 > "$root/running" 2>&1 &
running=$!
sleep 2
inside sh -c 'apt-get install -y -qq --no-install-recommends /packages/ftcs_*.deb' < /dev/null > "$root/log" 2>&1 ||
  { cat "$root/log"; fail "upgrade"; }
grep -q '^domainNumber 7' "$root/etc/ftcs/ptp.conf" || fail "the upgrade took a setting away"
kill -0 "$running" || fail "the upgrade ended a running program"
wait "$running" || [ $? -eq 3 ] || { cat "$root/running"; fail "the program that ran over the upgrade"; }
inside ftcs ptp -f /etc/ftcs/ptp.conf -i no-such-if > "$root/said" 2>&1 && fail "no interface is no error"
grep -q 'interface no-such-if: no such device' "$root/said" || { cat "$root/said"; fail "an unclear error"; }
rm -f "$root/running" "$root/said"

inside apt-get remove -y -qq ftcs libftcs-dev > "$root/log" 2>&1 || { cat "$root/log"; fail "apt remove"; }
[ ! -e "$root/usr/bin/ftcs" ] || fail "the program is still there"
[ -e "$root/etc/ftcs/ptp.conf" ] || fail "remove took the configuration, which is for purge"
inside dpkg --purge ftcs > "$root/log" 2>&1 || { cat "$root/log"; fail "dpkg --purge"; }
inside getent passwd ftcs > /dev/null && fail "the user ftcs is still there"
files > "$root/after"
left=$(comm -13 "$root/before" "$root/after" | grep -Ev '^var/(cache|log|lib/(dpkg|apt))|^etc/(passwd|group|shadow|gshadow|subuid|subgid)-?$' || true)
[ -z "$left" ] || { echo "$left"; fail "files are left"; }
echo "installed, locked, linked, removed, purged: nothing is left"
