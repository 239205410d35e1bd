# SPDX-License-Identifier: MIT
# systemd as the first process of a job that says so ("# vm: systemd"): that of the host, with its targets and our units. Sourced by image.sh.

add_systemd() {  # ROOT
  local root=$1 library program packaging=$here/../../packaging
  [ -x /lib/systemd/systemd ] || { echo "test/vm: skipped: no systemd here" >&2; exit 77; }
  mkdir -p "$root"/{lib/systemd/system,usr/lib/systemd/system,usr/lib/sysusers.d,etc/systemd/system,etc/ftcs,usr/sbin}
  cp /lib/systemd/systemd "$root/lib/systemd/systemd"
  ldd /lib/systemd/systemd | grep -o '/[^ ]*' | while read -r library; do
    mkdir -p "$root$(dirname "$library")"
    [ -e "$root$library" ] || cp -L "$library" "$root$library"
  done
  for program in systemctl systemd-sysusers; do add_program "$root" "$(command -v $program)"; done
  cp /lib/systemd/system/*.target "$root/lib/systemd/system/"
  cp "$packaging"/systemd/*@.service "$root/usr/lib/systemd/system/"
  cp "$packaging/systemd/ftcs.sysusers" "$root/usr/lib/sysusers.d/ftcs.conf"
  cp "$packaging"/etc/*.conf "$root/etc/ftcs/"
  add_module "$root" veth  # a wire for drives in software
  # No journal and no bus: the job's own output is what is looked at.
  printf '[Manager]\nDefaultStandardOutput=null\nShowStatus=no\n' > "$root/etc/systemd/system.conf"
  printf '[Unit]\nRequires=basic.target\nWants=job.service\nAfter=basic.target\n' > "$root/etc/systemd/system/default.target"
  printf '[Unit]\nAfter=basic.target\n[Service]\nType=oneshot\nExecStart=/usr/bin/bash /guest/systemd-job\n' \
    > "$root/etc/systemd/system/job.service"
  printf 'root:x:0:\n' > "$root/etc/group"
  printf 'ID=debian\n' > "$root/etc/os-release"
  : > "$root/etc/machine-id"
}
