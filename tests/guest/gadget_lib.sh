# What the checks of the USB gadget share, behind lib.sh. Read by each of them.
export PYTHONPATH="$source/drivers/client/python"
export STARLOOP_CLIENT_LIBRARY="$build/drivers/client/libstarloop_client.so.0"
program="$build/starloop_usb_device"
gadgets=/sys/kernel/config/usb_gadget
udc=dummy_udc.0
# Not that of the device over USB/IP, which others have plugged in at the same time.
product=00f5
gadget_link=link.to=usb:1209:$product

# A port and a host's socket that is its other end, in this machine: dummy_hcd, with these options.
controller() {
  modprobe -r dummy_hcd
  modprobe dummy_hcd "$@"
  within 10 test -e "/sys/class/udc/$udc"
}
plugged() { grep -qx $product /sys/bus/usb/devices/*/idProduct; }
speed() { cat "$(dirname "$(grep -lx $product /sys/bus/usb/devices/*/idProduct)")/speed"; }
unplugged() { ! plugged; }
ended() { ! kill -0 "$1"; }

# The device for frames of so many pixels each way, and software under test that judges them.
device() {
  beside gadget sh "$source/tools/usb_device/gadget.sh" --program "$program" --product 0x$product -- \
    --shm board0 --width "$1" --height "$1"
  gadget=$!
  within 30 grep -q "on $udc" gadget.out
  within 30 plugged
}
client() {
  beside client /usr/bin/python3 -u "$source/tests/guest/gadget_client.py" board0 "$1" "$1"
  client=$!
}
# What the client has seen so far: a number of its last line.
seen() { tail -1 client.out | tr ' ' '\n' | sed -n "s/^$1=//p" | grep . || echo 0; }
frames_above() { (( $(seen frames) > $1 )); }
goes_on() { within 60 frames_above "$(($(seen frames) + $1))"; }
# A run of small frames, as $run, to the device and its software, at super speed.
small_stream() {
  controller is_super_speed=1
  device 256
  client 256
  pattern run --set $gadget_link --set camera.width_px=256 --set camera.height_px=256
  run=$!
  within 60 frames_above 3
}
# Every frame that came was one that went out, bit for bit, and none came twice.
all_right() {
  (( $(seen frames) > 0 )) || fail "no frame"
  (( $(seen wrong) == 0 && $(seen backward) == 0 )) || fail "$(tail -1 client.out)"
}
# Ends the device: nothing of it is left.
end_device() {
  local status=0
  kill -TERM "$gadget"
  wait "$gadget" || status=$?
  (( status == 143 )) || fail "gadget.sh ended with $status: $(cat gadget.out)"
  nothing_left
}
nothing_left() {
  [[ -z "$(ls "$gadgets")" ]] || fail "gadgets are left: $(find "$gadgets" -maxdepth 2)"
  if grep -q functionfs /proc/mounts; then fail "functionfs is left mounted"; fi
  # By its option, whole; the pattern is not itself one.
  if grep -zlsx -e '--gadge[t]' /proc/[0-9]*/cmdline; then fail "the program is left"; fi
  [[ ! -e /run/starloop-gadget-starloop ]] || fail "its folder is left"
}
# Words of a command that fails with this exit code.
refused() {
  local expected="$1" status=0
  shift
  words="$("$@" 2>&1)" || status=$?
  (( status == expected )) || fail "exit code $status of $*: $words"
}
says() { grep -q "$1" <<<"$words" || fail "no '$1' in: $words"; }
