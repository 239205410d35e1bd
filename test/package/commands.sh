#!/bin/bash
# SPDX-License-Identifier: MIT
# commands.sh PACKAGING FTCS: the program understands each command line of the units and the files that they name. The interface
# and the clock are not there, so that each ends at once with exit code 1; 2 is a wrong flag, which systemd may ignore.
set -euo pipefail
packaging=$(realpath "$1")
ftcs=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
lines=0
while IFS= read -r line; do
  read -ra words <<< "$(sed "s|^Exec[A-Za-z]*=[-+]*/usr/bin/ftcs||; s|CLOCK_REALTIME|/dev/no-such-clock|; s|%i|no-such-if|g
    s|/etc/ftcs|$packaging/etc|; s|/run/|$work/|; s|/var/lib/ftcs|$work|" <<< "$line")"
  code=0
  timeout 10 "$ftcs" "${words[@]}" > "$work/said" 2>&1 || code=$?
  if [ "$code" -ne 1 ]; then
    echo "$line: exit code $code, expected 1: $(tail -n 2 "$work/said")" >&2
    exit 1
  fi
  lines=$((lines + 1))
done < <(grep -h '^Exec.*/usr/bin/ftcs' "$packaging"/systemd/*.service)
[ "$lines" -ge 4 ] || { echo "$lines command lines, expected 4 or more" >&2; exit 1; }
echo "$lines command lines are understood"
