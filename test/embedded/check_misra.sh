#!/bin/sh
# check_misra.sh FILE...: MISRA C:2012 as far as cppcheck's addon knows it, but for what is listed here with its reason.
set -eu
command -v cppcheck > /dev/null || { echo "check_misra: skipped, cppcheck is not installed"; exit 77; }
# 2.3, 2.5 a header's names are used elsewhere; 2.4 tags of the enums are names for readers; 10.1 signed numbers are shifted
# to the right, which a typedef checks; 10.8 64 bits are put together from words, and taken modulo 2^64; 7.2, 10.x negative numbers are made of unsigned magnitudes and compared with
# constants that fit both; 8.7 the interface is used by others; 12.1 C's precedence of * over +, && over ||; 15.5, 15.6 early
# returns in one line; 17.8 a counter that is counted down.
allowed='misra-c2012-(2\.3|2\.4|2\.5|7\.2|8\.7|10\.1|10\.3|10\.4|10\.6|10\.7|10\.8|12\.1|15\.5|15\.6|17\.8)\]'
found=$(cppcheck --addon=misra --std=c99 --enable=style -q "$@" 2>&1 | grep 'misra-c2012' | grep -vE "$allowed" || true)
[ -z "$found" ] || { echo "$found" >&2; exit 1; }
