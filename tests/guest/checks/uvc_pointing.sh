# Limit: 120 s
# Commands arrive in the loop: pan and tilt of v4l2-ctl, and the extension unit of a client that closes its loop over
# V4L2 alone.
. "$source/tests/guest/uvc.sh"
camera_by_network 4
v4l2-ctl -d $uvc_node -c pan_absolute=100 -c tilt_absolute=-7
now="$(v4l2-ctl -d $uvc_node -C pan_absolute,tilt_absolute | paste -sd' ')"
[[ "$now" == 'pan_absolute: 100 tilt_absolute: -7' ]] || fail "$now"
! v4l2-ctl -d $uvc_node -c pan_absolute=700000 || v4l2-ctl -d $uvc_node -C pan_absolute | grep -q 648000 ||
  fail 'beyond half a turn'
/usr/bin/python3 "$source/tests/guest/uvc_client.py" $uvc_node 12
no_camera_by_network
cat device.out
