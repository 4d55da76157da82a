# A reader keeps the node's format: a run that wants another is refused and says why; without the reader it is not.
loopback exclusive_caps=1
pattern first --set link.to=v4l2:starloop
first=$!
within 120 shows_format Y16
beside hangs "$build/tests/guest/guest_reader" --hangs
hangs=$!
within 60 grep -q holding hangs.out
stop_run first $first
grey=(--set link.to=v4l2:starloop --set link.v4l2_format=grey --set run.duration_s=0.5)
pattern refused "${grey[@]}"
status=0
wait $! || status=$?
equal "exit code" $status 3
grep -q 'asked for GREY 1024 x 1025.*got Y16.*a reader holds that format' refused.out || fail "$(cat refused.out)"
kill -9 $hangs
wait $hangs || true
pattern taken "${grey[@]}"
joined taken $!
