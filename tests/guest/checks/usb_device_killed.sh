# The device's process is killed in the middle of a run: frames are refused, the run goes on, and a device that is
# started anew gets frames again.
size=(--width 256 --height 256)
device cam "${size[@]}"
attach
beside client "$build/tests/guest/guest_client" cam 256 256
pattern run --set run.frame_rate_hz=10 --set camera.width_px=256 --set camera.height_px=256 --set link.to=usb:1209:0001
run=$!
within 120 has_count client frames 5
kill -9 $device_pid
unplugged() { ! grep -q ' 006 ' $vhci/status; }
within 60 unplugged
device cam "${size[@]}"
beside again "$build/tests/guest/guest_client" cam 256 256
attach
within 60 has_count again frames 10
stop_run run $run
(( $(report run frames.faults) > 0 )) || fail "no frame was refused while there was no device"
equal "whole" "$(count again whole)" "$(count again frames)"
detach
