# Limit: 120 s
# Commands arrive in the loop: pan and tilt of v4l2-ctl, and the extension unit of a client that closes its loop over
# V4L2 alone.
. "$source/tests/guest/uvc.sh"
run_small() {
  beside cam "$starloop" run "$source/config/flyby.toml" --quiet --no-pictures --out "$scratch/cam" --threads 1 \
    --set link.to=shm:cam0 --set link.telemetry_row=true --set record.frames=none --set realtime.priority=0 \
    --set camera.width_px=128 --set camera.height_px=128 \
    --set render.samples_per_pixel=1 --set visibility.max_range_km=3000 --set visibility.span_days=0.01 \
    --set run.pass=1 --set run.frame_rate_hz="$1"
}
camera_by_network run_small 5
v4l2-ctl -d $uvc_node -c pan_absolute=100 -c tilt_absolute=-7
now="$(v4l2-ctl -d $uvc_node -C pan_absolute,tilt_absolute | paste -sd' ')"
[[ "$now" == 'pan_absolute: 100 tilt_absolute: -7' ]] || fail "$now"
# An arc second is 4848.137 nrad.
/usr/bin/python3 "$source/tests/guest/uvc_client.py" $uvc_node turned 484814 -33937
/usr/bin/python3 "$source/tests/guest/uvc_client.py" $uvc_node 128 20
no_camera_by_network
cat device.out
