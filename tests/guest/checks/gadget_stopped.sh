# A device that stops reading in the middle of a frame: the host gives the frame up, and when the device
# goes on both are in step again, though the beginning of the lost frame lies in its reads.
# Limit: 120 s
. "$source/tests/guest/gadget_lib.sh"
controller is_super_speed=1
device 1024
client 1024
pattern run --set $gadget_link --set link.usb_packed=false --set run.frame_rate_hz=2
run=$!
within 60 frames_above 1
for i in 1 2; do
  program_id="$(cat /run/starloop-gadget-starloop/program)"
  kill -STOP "$program_id"
  sleep 1.3
  kill -CONT "$program_id"
  goes_on 1
done
stop_run run "$run"
all_right
tail -1 client.out
(( $(report run links.0.usb.resets) > 1 )) || fail "no frame was cut: nothing was shown"
end_device
