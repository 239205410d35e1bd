#!/bin/bash
# SPDX-License-Identifier: MIT
# Several scripts of this folder at once, each in its own network namespaces: they wait most of the time, and what they
# judge needs a machine on which nothing computes, not one on which nothing else waits.
#
# test/interop/together.sh build/ftcs "SCRIPT ARGUMENTS..."...
set -uo pipefail
ftcs=$1
shift
here=$(dirname "$0")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
pids=()
for one in "$@"; do
  read -ra words <<< "$one"
  "$here/${words[0]}.sh" "$ftcs" "${words[@]:1}" > "$folder/${#pids[@]}" 2>&1 &
  pids+=($!)
done
failed=0 skipped=0
for i in "${!pids[@]}"; do
  code=0
  wait "${pids[$i]}" || code=$?
  echo "== ${*:i+1:1}: exit code $code"
  cat "$folder/$i"
  case $code in
    0) ;;
    77) skipped=$((skipped + 1)) ;;
    *) failed=$((failed + 1)) ;;
  esac
done
[ "$failed" -eq 0 ] || exit 1
[ "$skipped" -eq 0 ] || exit 77
