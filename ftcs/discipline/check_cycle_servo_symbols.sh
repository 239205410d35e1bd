#!/bin/sh
# What the archive needs and does not bring along: memcpy, memset and, unless it is the small one, memmove and libm.
set -e
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
ld -r --whole-archive -o "$work/all.o" "$1"
allowed='^(memcpy|memset)$'
case $1 in
  *_small.a) ;;
  *) allowed='^(memcpy|memmove|memset|sqrt|exp|exp2|log|pow|erfc|round|floor|ceil|fabs|tgamma|lgamma)$' ;;
esac
nm --undefined-only "$work/all.o" | awk '{print $NF}' | grep -v '^_GLOBAL_OFFSET_TABLE_$' > "$work/undefined" || true
if grep -Ev "$allowed" "$work/undefined"; then
  echo "undefined symbols beyond what a C program has" >&2
  exit 1
fi
echo "undefined:" $(sort -u "$work/undefined")
