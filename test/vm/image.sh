# SPDX-License-Identifier: MIT
# The initial file system of the virtual machine, in two archives: the system's programs and the kernel's modules (made once), and what
# is tried on them (made for each run). Sourced by prepare and run.

# shellcheck source=test/vm/systemd.sh
source "$here/systemd.sh"

# A program at its own name in /usr/bin, its libraries at their own places.
add_program() {  # ROOT PROGRAM
  local file library
  file=$(readlink -f "$2")
  cp "$file" "$1/usr/bin/$(basename "$2")"
  ldd "$file" 2> /dev/null | grep -o '/[^ ]*' | while read -r library; do
    mkdir -p "$1$(dirname "$library")"
    [ -e "$1$library" ] || cp -L "$library" "$1$library"
  done || true
}

# A module of the kernel and those that it needs, decompressed; modules/order names them in the order to load them.
add_module() {  # ROOT NAME
  local root=$1 name=$2 file needed
  [ ! -e "$root/modules/$name.ko" ] || return 0
  file=$(find "$prefix/lib/modules" \( -name "$name.ko.xz" -o -name "${name//_/-}.ko.xz" \) -print -quit)
  [ -n "$file" ] || { echo "test/vm: the kernel has no module $name" >&2; exit 1; }
  xz -dc "$file" > "$root/modules/$name.ko"
  for needed in $(tr '\0' '\n' < "$root/modules/$name.ko" | sed -n 's/^depends=//p' | tr , ' '); do
    add_module "$root" "$needed"
  done
  echo "$name" >> "$root/modules/order"
}

# The same files make the same archive: the kernel reads its headers, and a digit more is an instruction more.
archive() {  # ROOT ARCHIVE
  find "$1" -exec touch -h -d @0 {} +
  (cd "$1" && find . -print | LC_ALL=C sort |
    "$prefix/bin/busybox" cpio -o -H newc -R 0:0 --renumber-inodes --ignore-devno 2> /dev/null) > "$2.new"
  mv "$2.new" "$2"
}

make_base_image() {  # ARCHIVE
  local root applet program
  root=$(mktemp -d)
  mkdir -p "$root"/{bin,sbin,usr/bin,usr/sbin,proc,sys,dev,run,tmp,var,etc,lib,lib64,modules,results,usr/share/zoneinfo}
  echo "root:x:0:0::/:/bin/sh" > "$root/etc/passwd"
  cp "$prefix/bin/busybox" "$root/bin/busybox"
  for applet in $("$prefix/bin/busybox" --list); do
    [ "$applet" = busybox ] || ln -s busybox "$root/bin/$applet"
  done
  rm -f "$root/bin/ip"  # iproute2's is meant
  for program in bash ip ethtool ptp4l phc2sys phc_ctl pmc ts2phc chronyd chronyc chrt setpriv awk; do
    command -v "$program" > /dev/null || { echo "test/vm: no $program here, jobs that need it will fail" >&2; continue; }
    add_program "$root" "$(command -v "$program")"
  done
  for program in 9p 9pnet_virtio igb; do add_module "$root" "$program"; done
  archive "$root" "$1"
  rm -rf "$root"
}

make_job_image() {  # ARCHIVE JOB_FILE SEED
  local root
  root=$(mktemp -d)
  mkdir -p "$root"/{usr/bin,modules,guest}
  add_program "$root" "$ftcs"
  mv "$root/usr/bin/$(basename "$ftcs")" "$root/usr/bin/ftcs.new" && mv "$root/usr/bin/ftcs.new" "$root/usr/bin/ftcs"
  strip -g "$root/usr/bin/ftcs"
  add_program "$root" "$witness"
  mv "$root/usr/bin/$(basename "$witness")" "$root/usr/bin/witness"
  cp "$built/vptp/vptp.ko" "$root/modules/"
  strip -g "$root/modules/vptp.ko"
  cp "$here"/guest/* "$root/guest/"
  install -m 755 "$here/guest/init" "$root/init"
  ! grep -q '^# vm: systemd' "$2" || add_systemd "$root"
  install -m 755 "$here/guest/at" "$root/usr/bin/at"
  { echo "SEED=$3"; echo ". /guest/lib.sh"; cat "$2"; echo finish; } > "$root/job"
  archive "$root" "$1"
  rm -rf "$root"
}
