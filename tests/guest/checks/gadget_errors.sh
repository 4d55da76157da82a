# What is missing is said, with the command that helps, and nothing is left behind.
# Limit: 60 s
. "$source/tests/guest/gadget_lib.sh"
script="$source/tools/usb_device/gadget.sh"
controller is_super_speed=1
refused 3 sh "$script" --program "$program" --udc nothing.1
says "no controller nothing.1; there are: $udc"
refused 3 sh "$script" --program /bin/nothing
says "no program '/bin/nothing'"
refused 3 sh "$script" --nonsense
says "what is --nonsense"
refused 3 setpriv --reuid 65534 --clear-groups sh "$script" --program "$program"
says "only root"
nothing_left
# The program alone, where nothing is mounted; and one that cannot start ends the script.
refused 3 "$program" --gadget "$scratch" --shm board0
says "modprobe usb_f_fs"
refused 3 sh "$script" --program "$program" -- --shm /a/b
nothing_left
# A port that somebody else has.
mkdir -p "$gadgets/other/configs/c.1" "$gadgets/other/functions/Loopback.0"
ln -s "$gadgets/other/functions/Loopback.0" "$gadgets/other/configs/c.1/"
echo "$udc" >"$gadgets/other/UDC"
refused 3 sh "$script" --program "$program"
says "$udc is taken by the gadget"
echo '' >"$gadgets/other/UDC"
rm "$gadgets/other/configs/c.1/Loopback.0"
rmdir "$gadgets/other/configs/c.1" "$gadgets/other/functions/Loopback.0" "$gadgets/other"
modprobe -r dummy_hcd
refused 3 sh "$script" --program "$program"
says "/sys/class/udc is empty"
nothing_left
modprobe dummy_hcd
