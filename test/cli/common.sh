# SPDX-License-Identifier: MIT
# shellcheck shell=bash disable=SC2034
# Sourced by the tests that start programs: "$ftcs"; a folder of their own, "$folder"; processes in pids, ended at exit.

ftcs=$(realpath "${1:-build/ftcs}")
folder=$(mktemp -d)
pids=()
cleanup() {
  for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null; done
  wait 2> /dev/null
  rm -rf "$folder"
}
trap cleanup EXIT

fail() {
  echo "FAILED: $*"
  for log in "$folder"/*; do
    [ -f "$log" ] && echo "--- $(basename "$log")" && tail -n 15 "$log"
  done
  exit 1
}
