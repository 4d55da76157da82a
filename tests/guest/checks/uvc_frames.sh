# Limit: 120 s
# The kernel's own uvcvideo makes a camera of the device in software, and a client that we did not write reads every
# format of it bit for bit.
. "$source/tests/guest/uvc.sh"
run_pattern() { pattern cam --set link.to=shm:cam0 --set run.frame_rate_hz="$1" --set realtime.priority=0; }
camera_by_network run_pattern 4
words="$(v4l2-ctl -d $uvc_node --all)"
for line in 'Driver name *: uvcvideo' 'Card type *: Starloop camera' 'Width/Height *: 1024/1025' \
            'pan_absolute.*min=-648000 max=648000 step=1' 'Frames per second: 4.000'; do
  grep -q "$line" <<<"$words" || fail "no '$line' in $words"
done
formats="$(v4l2-ctl -d $uvc_node --list-formats | sed -n "s/.*: '\(.*\)'.*/\1/p" | paste -sd,)"
[[ "$formats" == 'Y16 ,GREY,YUYV' ]] || fail "formats: $formats"
grab() { v4l2-ctl -d $uvc_node --set-fmt-video=pixelformat="$1" --stream-mmap --stream-count="$2" --stream-to="$3"; }
# Twice: a stream that was stopped begins anew.
grab 'Y16 ' 6 first.raw
grab GREY 4 GREY.raw
grab YUYV 4 YUYV.raw
grab 'Y16 ' 6 again.raw
cat first.raw again.raw | /usr/bin/python3 "$source/tools/check_pattern.py" --rows-below 1 | tee verdict
grep -q '^12 frames, 0 wrong' verdict || fail "$(cat verdict)"
/usr/bin/python3 "$source/tests/guest/uvc_judge.py" GREY.raw YUYV.raw
no_camera_by_network
cat device.out
