#!/bin/sh
# must_not_compile.sh COMPILER SOURCE_DIR CASE
set -eu
file=$2/test/compile_fail/timescales.cpp
"$1" -std=c++20 -I"$2" -fsyntax-only "$file" || { echo "the correct form does not compile either"; exit 1; }
if "$1" -std=c++20 -I"$2" -fsyntax-only -D"$3" "$file" 2> /dev/null; then
  echo "$3 compiles, and must not"
  exit 1
fi
