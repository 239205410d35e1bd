# SPDX-License-Identifier: MIT
# For prepare and run: where the unpacked packages are, and how their QEMU is called.
cache=${FTCS_VM_CACHE:-${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/ftcs/vm}
prefix=$cache/prefix
qemu=$prefix/usr/bin/qemu-system-x86_64
libraries=$prefix/usr/lib/x86_64-linux-gnu:$prefix/lib/x86_64-linux-gnu

qemu_missing_libraries() {
  LD_LIBRARY_PATH=$libraries ldd "$qemu" | sed -n 's/^[[:space:]]*\([^ ]*\) => not found/\1/p' | tr '\n' ' '
}

qemu_libraries_are_there() {
  [ -x "$qemu" ] && [ -z "$(qemu_missing_libraries)" ]
}
