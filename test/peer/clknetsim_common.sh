# SPDX-License-Identifier: MIT
# shellcheck shell=bash
# Sourced by the scripts that run programs inside clknetsim (https://github.com/mlichvar/clknetsim): its path, a folder
# of their own, "$folder"; nodes in pids, ended at exit. It is GPL and never part of this project: a separate program.

skip() { echo "skipped: $*"; exit 77; }
[ -n "${CLKNETSIM_PATH:-}" ] || skip "CLKNETSIM_PATH names no clknetsim"
[ -x "$CLKNETSIM_PATH/clknetsim" ] || skip "$CLKNETSIM_PATH holds no clknetsim"
CLKNETSIM_PATH=$(realpath "$CLKNETSIM_PATH")
PATH=$PATH:/usr/sbin

folder=$(mktemp -d)
pids=()
cleanup() {
  for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null || true; done
  rm -rf "$folder"
}
trap cleanup EXIT

start_node() {  # number, program and its arguments
  local node=$1
  shift
  LD_PRELOAD=$CLKNETSIM_PATH/clknetsim.so CLKNETSIM_NODE=$node CLKNETSIM_SOCKET=$folder/sock \
    "$@" > "$folder/log.$node" 2>&1 &
  pids+=($!)
}
