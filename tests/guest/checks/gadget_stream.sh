# Frames through a real gadget stack, in both formats and at every speed, bit for bit; every command back.
# Limit: 240 s
. "$source/tests/guest/gadget_lib.sh"
stream() {
  local name="$1" size="$2" frames="$3" speed="$4"
  shift 4
  device "$size"
  [[ "$(speed)" == "$speed" ]] || fail "speed of $name"
  client "$size"
  pattern "$name" --set $gadget_link --set run.clock=as-fast-as-possible \
    --set camera.width_px="$size" --set camera.height_px="$size" "$@"
  local run=$! began commands
  within 60 frames_above 2
  commands="$(seen commands)" began="$(seen seconds)"
  within 60 frames_above "$frames"
  echo "$name: $(tail -1 client.out), from $commands commands at $began s"
  stop_run "$name" "$run"
  sleep 0.5
  all_right
  (( $(seen missing) == $(seen overwritten) )) || fail "frames were lost on the way: $(tail -1 client.out)"
  for count in bad_headers bad_checksums short long not_taken; do
    (( $(report "$name" links.0.usb.device.$count) == 0 )) || fail "the device counts $count"
  done
  (( $(report "$name" links.0.usb.resets) == 1 )) || fail "a session more"
  local taken sent frames_sent
  frames_sent="$(report "$name" frames.sent)"
  taken="$(report "$name" commands.taken)" sent="$(seen commands)"
  kill "$client"
  wait "$client" || true
  rm client.out
  end_device
  # Those that the shared memory wrote over while the client was slow came all the same.
  grep -q "1 sessions, $frames_sent frames:" gadget.out || fail "of $frames_sent frames: $(cat gadget.out)"
  grep -q ' 0 commands lost' gadget.out || fail "$(cat gadget.out)"
  echo "$name: $taken of $sent commands taken before the end"
  # What was on its way when the run ended: the places of the device.
  (( taken > 0 && taken >= sent - 16 )) || fail "commands were lost"
}
controller is_super_speed=1
stream super-packed 1024 20 5000
stream super-plain 1024 20 5000 --set link.usb_packed=false
controller is_super_speed=0
stream high-packed 1024 10 480
# Trims are two whole packets of 64 bytes each.
controller is_high_speed=0
stream full-packed 96 10 12
