# Without the module `run` and `links` say how to get it; with it `links` shows the node by its label.
no_loopback
words="$("$starloop" links)"
grep -q 'v4l2 *no: sudo modprobe v4l2loopback' <<<"$words" || fail "links says: $words"
status=0
words="$("$starloop" run "$source/config/flyby.toml" --pattern --set link.to=v4l2:starloop 2>&1)" || status=$?
(( status == 3 )) || fail "exit code $status"
grep -q 'sudo modprobe v4l2loopback card_label=starloop' <<<"$words" || fail "run says: $words"
loopback exclusive_caps=1
words="$("$starloop" links)"
grep -q 'v4l2 *yes: /dev/video20 "starloop"' <<<"$words" || fail "links says: $words"
