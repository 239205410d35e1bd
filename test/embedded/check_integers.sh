#!/bin/sh
# check_integers.sh ARCHIVE: the object code calls no floating point, no heap and no library but memcpy and memset, and has no
# instruction on floating point registers (x86-64: the archive of the host).
set -eu
needed=$("${NM:-nm}" --undefined-only "$1" | awk 'NF {print $NF}' | grep -vE '^(ftcs_addend_.*|memcpy|memset|__stack_chk_fail|_GLOBAL_OFFSET_TABLE_)$|:$' || true)
if [ -n "$needed" ]; then
  echo "$1 needs: $needed; expected nothing but memcpy and memset" >&2
  exit 1
fi
if "${OBJDUMP:-objdump}" -d "$1" | grep -E '[[:space:]](cvt|add|sub|mul|div|sqrt|ucomi|comi)(ss|sd|si2sd|si2ss|tsd2si|tss2si)[[:space:]]'; then
  echo "$1 computes in floating point" >&2
  exit 1
fi
