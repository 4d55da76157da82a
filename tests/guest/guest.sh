#!/bin/bash
# First process of the guest once the host's files are there: runs the checks that are asked for (all, if
# none is), and switches the guest off. Each check leaves NAME.rc and NAME.log in /mnt.
#   guest.sh SOURCE BUILD KERNEL [CHECK...]
. "$1/tests/guest/machine.sh"

checks=("$@")
if (( $# == 0 )); then
  for file in "$source"/tests/guest/checks/*.sh; do checks+=("$(basename "$file" .sh)"); done
fi
# What becomes of one check.
run_check() {
  local check="$1" file="$source/tests/guest/checks/$1.sh" rc=0 limit began took
  limit="$(sed -n 's/^# Limit: *\([0-9]*\) s.*/\1/p' "$file")"
  began="$(date +%s%N)"
  export scratch="/dev/shm/$check"
  mkdir -p "$scratch"
  cd "$scratch"
  timeout -k 5 "${limit:-180}" setsid -w bash -c '. "$source/tests/guest/lib.sh"; . "$1"' \
    "$check" "$file" >"/mnt/$check.log" 2>&1 || rc=$?
  if (( rc == 124 || rc == 137 )); then echo "not done after ${limit:-180} s" >>"/mnt/$check.log"; fi
  cd /
  rm -rf "$scratch"
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
