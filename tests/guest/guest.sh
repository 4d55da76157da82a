#!/bin/bash
# First process of the guest once the host's files are there: runs the checks that are asked for (all, if
# none is), and switches the guest off. Each check leaves NAME.rc and NAME.log in /mnt.
#   guest.sh SOURCE BUILD KERNEL [CHECK...]
. "$1/tests/guest/machine.sh"

checks=("$@")
if (( $# == 0 )); then
  for file in "$source"/tests/guest/checks/*.sh; do checks+=("$(basename "$file" .sh)"); done
fi
# Runs a check once: its exit code.
attempt() {
  local check="$1" file="$source/tests/guest/checks/$1.sh" rc=0 limit
  limit="$(sed -n 's/^# Limit: *\([0-9]*\) s.*/\1/p' "$file")"
  export scratch="/dev/shm/$check"
  mkdir -p "$scratch"
  cd "$scratch"
  timeout -k 5 "${limit:-180}" setsid -w bash -c '. "$source/tests/guest/lib.sh"; . "$1"' \
    "$check" "$file" || rc=$?
  if (( rc == 124 || rc == 137 )); then echo "not done after ${limit:-180} s"; fi
  cd /
  rm -rf "$scratch"
  return $rc
}
# What becomes of one check. An emulator on a busy machine can be held up for longer than a check waits: what
# fails is tried once more, and its log says so.
run_check() {
  local check="$1" rc=0 began took
  began="$(date +%s%N)"
  attempt "$check" >"/mnt/$check.log" 2>&1 || rc=$?
  if (( rc != 0 && rc != 77 )); then
    rc=0
    echo "---- failed; once more ----" >>"/mnt/$check.log"
    attempt "$check" >>"/mnt/$check.log" 2>&1 || rc=$?
  fi
  took=$((($(date +%s%N) - began) / 100000000))
  echo "$rc $((took / 10)).$((took % 10))" >"/mnt/$check.rc"
}
# One after the other of those that share a driver: v4l2_*, gadget_*, and those over USB/IP.
lane() {
  local check
  for check in "${checks[@]}"; do
    case "$check" in
      v4l2_*) [[ "$1" == v4l2 ]] || continue ;;
      gadget_*) [[ "$1" == gadget ]] || continue ;;
      *) [[ "$1" == others ]] || continue ;;
    esac
    run_check "$check"
  done
}
for name in v4l2 gadget others; do lane $name & done
wait
switch_off 0
