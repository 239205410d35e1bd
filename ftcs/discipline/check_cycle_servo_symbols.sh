#!/bin/sh
# What the archive needs and does not bring along: memcpy, memset and, unless it is the small one, libm. memmove comes
# from copies within one array in the adaptive servo.
set -e
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
ld -r --whole-archive -o "$work/all.o" "$1"
allowed='^(memcpy|memset)$'
case $1 in
  *_small.a) ;;
  *) allowed='^(memcpy|memset|memmove|sqrt|exp|exp2|log|pow|erfc|round|floor|ceil|fabs|tgamma|lgamma)$' ;;
esac
if nm --undefined-only "$work/all.o" | awk '{print $NF}' | grep -v '^_GLOBAL_OFFSET_TABLE_$' | grep -Ev "$allowed"; then
  echo "undefined symbols beyond what a C program has" >&2
  exit 1
fi
