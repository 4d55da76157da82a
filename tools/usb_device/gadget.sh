#!/bin/sh
# Makes this machine's USB device port a frame-injection device, and takes all of it down at the end:
#
#   sudo tools/usb_device/gadget.sh [options] [-- options of starloop_usb_device]
#     --program FILE   starloop_usb_device (default: beside this script, in the build tree, in PATH)
#     --udc NAME       the controller, of /sys/class/udc (default: the first)
#     --vendor ID --product ID --serial TEXT   what a host sees (default 0x1209, 0x0001, the host's name)
#     --name NAME      of the gadget (default: starloop), if there are several controllers
#
# It ends with the program, or by SIGINT and SIGTERM; what an earlier one left behind is taken down
# first. The program alone (--gadget FOLDER) serves any functionfs: add the function ffs.NAME to a gadget
# of your own, and bind that once FOLDER/ep1 is there.
# Plain sh: boards have no more.
set -eu

program='' udc='' vendor=0x1209 product=0x0001 serial="$(uname -n)" name=starloop
fail() { echo "gadget.sh: $*" >&2; exit 3; }
while [ $# -gt 0 ]; do
  case "$1" in
    --program | --udc | --vendor | --product | --serial | --name)
      [ $# -ge 2 ] || fail "$1 wants a value"
      eval "${1#--}=\$2"
      shift 2 ;;
    --) shift; break ;;
    -h | --help) sed -n '2,/^# Plain/s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) fail "what is $1? (options of starloop_usb_device go behind --)" ;;
  esac
done
[ "$(id -u)" = 0 ] || fail "only root may make a gadget: sudo $0"

here="$(cd "$(dirname "$0")" && pwd)"
if [ -z "$program" ]; then
  for file in "$here/starloop_usb_device" "$here/../../build/release/starloop_usb_device" \
              "$(command -v starloop_usb_device || true)"; do
    if [ -x "$file" ]; then program="$file"; break; fi
  done
fi
[ -x "$program" ] || fail "no program '$program'; --program says where starloop_usb_device is"

config=/sys/kernel/config
gadget="$config/usb_gadget/$name"
run="/run/starloop-gadget-$name"
ffs="$run/ffs"
pid=''

# Of a program that this name left behind.
left_behind() {
  left="$(cat "$run/program" 2>/dev/null || true)"
  if [ -n "$left" ] && grep -q starloop_usb_device "/proc/$left/cmdline" 2>/dev/null; then
    kill -KILL "$left" || true
    tries=0
    while [ -e "/proc/$left" ] && [ "$tries" -lt 50 ]; do tries=$((tries + 1)); sleep 0.1; done
  fi
}

# Tells the host first: nobody then waits in the middle of a transfer.
take_down() {
  if [ -e "$gadget/UDC" ]; then echo '' >"$gadget/UDC" 2>/dev/null || true; fi
  if [ -n "$pid" ]; then
    kill -TERM "$pid" 2>/dev/null || true
    wait "$pid" 2>/dev/null || true
  fi
  if [ -d "$ffs" ]; then
    umount "$ffs" 2>/dev/null || true
    rmdir "$ffs" || true
  fi
  if [ -d "$gadget" ]; then
    rm -f "$gadget/configs/c.1/ffs.$name"
    for folder in configs/c.1/strings/0x409 configs/c.1 "functions/ffs.$name" strings/0x409 .; do
      if [ -d "$gadget/$folder" ]; then rmdir "$gadget/${folder#.}" || true; fi
    done
  fi
  rm -rf "$run"
}

# What the kernel must have.
modprobe -q libcomposite 2>/dev/null || true
if [ ! -d "$config/usb_gadget" ]; then mount -t configfs none "$config" 2>/dev/null || true; fi
[ -d "$config/usb_gadget" ] || fail "this kernel makes no gadgets: modprobe libcomposite" \
  "(CONFIG_USB_CONFIGFS and CONFIG_USB_CONFIGFS_F_FS), and mount -t configfs none $config"
if [ -z "$udc" ]; then
  for file in /sys/class/udc/*; do
    if [ -e "$file" ]; then udc="${file##*/}"; break; fi
  done
fi
[ -n "$udc" ] || fail "no USB device port: /sys/class/udc is empty. The controller's module is not" \
  "loaded (modprobe dwc2, dwc3, musb_hdrc, ...), or its port is a host's (dr_mode in the device tree);" \
  "modprobe dummy_hcd makes one that ends in this machine itself"
[ -e "/sys/class/udc/$udc" ] || fail "no controller $udc; there are: $(ls /sys/class/udc)"

if [ -s "$run/pid" ] && kill -0 "$(cat "$run/pid")" 2>/dev/null; then
  fail "gadget $name is there already, of process $(cat "$run/pid")"
fi
left_behind
take_down
for file in "$config"/usb_gadget/*/UDC; do
  if [ -e "$file" ] && [ "$(cat "$file")" = "$udc" ]; then
    fail "controller $udc is taken by the gadget ${file%/UDC}; echo '' >$file frees it"
  fi
done

trap take_down EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP
mkdir -p "$ffs"
echo $$ >"$run/pid"

mkdir "$gadget"
echo "$vendor" >"$gadget/idVendor"
echo "$product" >"$gadget/idProduct"
mkdir "$gadget/strings/0x409" "$gadget/configs/c.1" "$gadget/configs/c.1/strings/0x409"
echo "$serial" >"$gadget/strings/0x409/serialnumber"
echo Starloop >"$gadget/strings/0x409/manufacturer"
echo "Frame injection device" >"$gadget/strings/0x409/product"
echo Frames >"$gadget/configs/c.1/strings/0x409/configuration"
echo 0xc0 >"$gadget/configs/c.1/bmAttributes"
mkdir "$gadget/functions/ffs.$name" 2>/dev/null ||
  fail "this kernel has no FunctionFS: modprobe usb_f_fs (CONFIG_USB_CONFIGFS_F_FS)"
ln -s "$gadget/functions/ffs.$name" "$gadget/configs/c.1/ffs.$name"
mount -t functionfs "$name" "$ffs" || fail "functionfs cannot be mounted at $ffs"

"$program" --gadget "$ffs" "$@" &
pid=$!
echo "$pid" >"$run/program"
# Its endpoints appear when it has said what it is; to bind it before is an error.
tries=0
until [ -e "$ffs/ep2" ]; do
  kill -0 "$pid" 2>/dev/null || { status=0; wait "$pid" || status=$?; exit "$status"; }
  tries=$((tries + 1))
  [ "$tries" -le 100 ] || fail "$program does not say what it is"
  sleep 0.1
done
echo "$udc" >"$gadget/UDC" ||
  fail "controller $udc does not take the gadget (has it two bulk endpoints? see dmesg)"
echo "gadget.sh: $vendor:$product on $udc"

status=0
wait "$pid" || status=$?
pid=''
exit "$status"
