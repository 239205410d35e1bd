#!/bin/bash
# SPDX-License-Identifier: MIT
# Manual pages name every option of --help and give man no reason to warn; both completions know commands, options, values.
set -euo pipefail
ftcs=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "$*" >&2; exit 1; }

for command in "" analyse compare demo doctor ethercat ethercat-segment paper phc ptp simulate status; do
  # shellcheck disable=SC2086
  "$ftcs" manual man $command > "$work/page.1"
  grep -q '^.SH NAME' "$work/page.1" || fail "no page of '$command'"
  command -v man > /dev/null || continue
  LC_ALL=C.UTF-8 MANWIDTH=100 man --warnings=all -l "$work/page.1" > "$work/page.txt" 2> "$work/warnings"
  [ ! -s "$work/warnings" ] || { cat "$work/warnings"; fail "man warns about the page of '$command'"; }
  sed 's/.\x08//g; s/\x1b\[[0-9;]*m//g' "$work/page.txt" > "$work/plain.txt"
  # shellcheck disable=SC2086
  for option in $("$ftcs" $command --help | grep -oE '^  (-[a-zA-Z0-9])?,?(--[a-zA-Z0-9_-]+)?' | tr ', ' '\n\n' | sort -u); do
    grep -qe "$option" "$work/plain.txt" || fail "the page of '$command' does not name $option"
  done
done
for command in "" ptp "ethercat scan"; do
  # shellcheck disable=SC2086
  cmp <("$ftcs" help $command) <("$ftcs" $command --help) || fail "'help $command' is not '$command --help'"
done

"$ftcs" manual man nonsense 2> "$work/error" && fail "a page of a command that is none"
grep -q "no command 'nonsense'" "$work/error"

"$ftcs" manual bash > "$work/ftcs.bash"
complete_bash() {  # words of the command line, the last one unfinished
  bash --norc -c 'source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _ftcs; echo "${COMPREPLY[*]}"' \
    bash "$work/ftcs.bash" "$@"
}
expect() { [ "$1" = "$2" ] || fail "completion gives '$1', expected '$2'"; }
expect "$(complete_bash ftcs pt)" "ptp"
expect "$(complete_bash ftcs ptp --neve)" "--never-step --never_step"
expect "$(complete_bash ftcs ptp -i eth0 --role time-t)" "time-transmitter"
expect "$(complete_bash ftcs ethercat sc)" "scan"

if command -v zsh > /dev/null; then
  "$ftcs" manual zsh > "$work/_ftcs"
  zsh -f -c 'compdef() { :; }; _files() { :; }; compadd() { shift; print -r -- "$@"; }
    source "$1"; shift; words=("$@"); CURRENT=$#; _ftcs' zsh "$work/_ftcs" ftcs ptp -i eth0 --role "" > "$work/zsh"
  expect "$(cat "$work/zsh")" "time-receiver time-transmitter"
  zsh -f -c 'compdef() { :; }; _files() { :; }; compadd() { shift; print -r -- "$@"; }
    source "$1"; shift; words=("$@"); CURRENT=$#; _ftcs' zsh "$work/_ftcs" ftcs "" | grep -qw ethercat-segment ||
    fail "zsh does not complete commands"
fi
