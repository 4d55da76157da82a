# The cable pulled and put back in the middle of the stream, six times: frames go on each time.
# Limit: 150 s
. "$source/tests/guest/gadget_lib.sh"
small_stream
for i in $(seq 6); do
  echo '' >"$gadgets/starloop/UDC"
  # Every second time it is back before anybody may have looked.
  if (( i % 2 == 0 )); then within 10 unplugged; fi
  echo "$udc" >"$gadgets/starloop/UDC"
  goes_on 2
done
stop_run run "$run"
all_right
tail -1 client.out
(( $(report run links.0.usb.connections) >= 6 )) || fail "$(report run links)"
end_device
grep '^[67] connections' gadget.out || fail "$(cat gadget.out)"
