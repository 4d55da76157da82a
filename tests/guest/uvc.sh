# What checks of the camera share; read after lib.sh.
uvc_node=/dev/video0

# Starts a run beside the check, with the words given, and attaches its camera.
camera_by_network() {
  "$@"
  run_pid=$!
  beside device "$build/starloop_usb_device" --camera cam0
  device_pid=$!
  within 60 grep -q listening device.out
  attach
  within 30 uvc_is_there
}
uvc_is_there() {
  local name
  for name in /sys/class/video4linux/video*; do
    if grep -q '^Starloop camera' "$name/name" && [[ "$(cat "$name/index")" == 0 ]]; then
      uvc_node="/dev/$(basename "$name")"
      v4l2-ctl -d "$uvc_node" -D
      return
    fi
  done
  return 1
}
no_camera_by_network() {
  detach
  within 10 grep -q 'host gone' device.out
  kill -9 $device_pid
  kill -INT $run_pid
}
