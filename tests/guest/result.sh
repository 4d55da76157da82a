#!/usr/bin/env bash
# What became of a check in the guest: result.sh RESULTS CHECK
results="$1" check="$2"
if [[ -s "$results/skipped" ]]; then cat "$results/skipped"; exit 77; fi
if [[ ! -s "$results/$check.rc" ]]; then echo "the guest did not come to $check"; exit 1; fi
read -r status took <"$results/$check.rc"
cat "$results/$check.log"
echo "$check took $took s in the guest"
if (( status == 0 || status == 77 )); then exit "$status"; fi
echo "failed with $status; console and logs are in $results"
exit 1
