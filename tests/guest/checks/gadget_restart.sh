# The device's program killed in the middle of the stream, and its script as well: each time all is
# taken down, the next start finds a clean place, and host and software under test go on.
# Limit: 240 s
. "$source/tests/guest/gadget_lib.sh"
small_stream
for i in 1 2; do
  kill -KILL "$(cat /run/starloop-gadget-starloop/program)"
  status=0
  wait "$gadget" || status=$?
  (( status == 137 )) || fail "gadget.sh ended with $status"
  nothing_left
  device 256
  goes_on 3
done
# A second one is told that there is one.
refused 3 sh "$source/tools/usb_device/gadget.sh" --program "$program" -- --shm board1
says "is there already"
goes_on 3
kill -KILL "$gadget"
wait "$gadget" || true
device 256
goes_on 3
stop_run run "$run"
all_right
# Each of the four starts was a camera of its own. One more may be seen between: who removes a killed camera's
# remains holds its lock meanwhile, and so looks like it.
(( $(seen cameras) >= 4 )) || fail "$(tail -1 client.out)"
tail -1 client.out
end_device
