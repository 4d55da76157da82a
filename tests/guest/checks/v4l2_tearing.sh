# Both ways into the node: a reader that gives its buffer back in time sees no torn frame; of one that keeps it
# too long each torn frame is seen by its checksum.
reader="$build/tests/guest/guest_reader"
for method in write mapped; do
  loopback exclusive_caps=1
  pattern $method --set run.frame_rate_hz=5 --set link.to=v4l2:starloop --set link.v4l2_method=$method
  run=$!
  within 120 shows_format Y16
  beside slow-$method "$reader" --hold-ms 1030 --skip 1 --frames 5
  slow=$!
  "$reader" --hold-ms 60 --frames 20 | tee timely.out
  joined slow-$method $slow
  cat slow-$method.out
  equal "$method: whole frames of the timely reader" "$(count timely whole)" 20
  equal "$method: torn frames that no checksum told" "$(count timely torn_unnoticed)" 0
  equal "$method: the same of the slow reader" "$(count slow-$method torn_unnoticed)" 0
  # Otherwise nothing was proven.
  has_count slow-$method torn_noticed 1 || fail "$method: the slow reader saw no torn frame"
  stop_run $method $run
done
