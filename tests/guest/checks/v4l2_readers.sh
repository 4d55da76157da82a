# Readers that leave, and one that is killed with a buffer in its hands, change nothing for the run and the next.
loopback exclusive_caps=1
pattern run --set run.frame_rate_hz=5 --set link.to=v4l2:starloop
run=$!
within 120 shows_format Y16
reader="$build/tests/guest/guest_reader"
for round in 1 2; do
  "$reader" --frames 5
  beside hangs "$reader" --hangs
  hangs=$!
  within 60 grep -q holding hangs.out
  kill -9 $hangs
done
"$reader" --frames 10 | tee last.out
equal "torn frames that no checksum told" "$(count last torn_unnoticed)" 0
has_count last whole 7 || fail "too few of ten were whole"
stop_run run $run
equal "refused by the link" "$(report run frames.faults)" 0
