# Frames through libusb, usbfs and vhci-hcd to a client of the device's shared memory: each one, bit for bit,
# packed and plain.
# Room for all of them: an emulated reader is slower than the cable.
device cam --frames 15
attach
within 60 "$starloop" links
"$starloop" links | grep 'usb *yes: .*1209:0001'
for packed in true false; do
  beside client-$packed "$build/tests/guest/guest_client" cam 1024 1024
  client=$!
  pattern run-$packed --set run.clock=as-fast-as-possible --set run.duration_s=1.4 --set link.to=usb:1209:0001 --set link.usb_packed=$packed
  joined run-$packed $!
  read -r sent due good < <(report run-$packed frames.sent frames.due links.0.usb.device.good)
  equal "sent" "$sent" "$due"
  # Its last word may come when nobody listens any more.
  (( good >= sent - 1 )) || fail "the device counts $good of $sent"
  within 60 has_count client-$packed frames "$sent"
  kill $client
  equal "whole" "$(count client-$packed whole)" "$sent"
  equal "torn" "$(count client-$packed torn_noticed) $(count client-$packed torn_unnoticed)" "0 0"
  equal "missing" "$(count client-$packed missing)" 0
done
detach
