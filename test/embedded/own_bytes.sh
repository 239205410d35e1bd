#!/bin/sh
# own_bytes.sh IMAGE OBJECT...: bytes in IMAGE of the functions and constants that the OBJECTs define.
set -eu
image="$1"
shift
names=$(arm-none-eabi-nm --defined-only "$@" | awk '$2 ~ /[tTrR]/ && $3 !~ /^\$/ {sub(/\..*/, "", $3); print $3}' | sort -u)
arm-none-eabi-nm -S -t d "$image" | awk -v names="$names" '
  BEGIN {split(names, list, "\n"); for (i in list) known[list[i]] = 1}
  {name = $4; sub(/\..*/, "", name)}
  $3 ~ /[tTrR]/ && known[name] {sum += $2}
  END {print sum + 0}'
