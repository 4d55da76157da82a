# Sets the guest up: what an init system would have done, and the drivers. guest.sh and measure.sh read it.
source="$1" build="$2" kernel="$3"
shift 3
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C source build
exec </dev/null
: >/mnt/booted

busybox ip link set lo up
mkdir -p /dev/shm /dev/pts /run
mount -t tmpfs tmpfs /dev/shm
mount -t tmpfs tmpfs /run
mount -t devpts devpts /dev/pts
for link in fd:fd stdin:fd/0 stdout:fd/1 stderr:fd/2; do
  [[ -e "/dev/${link%%:*}" ]] || ln -s "/proc/self/${link#*:}" "/dev/${link%%:*}"
done
mkdir -p /lib/modules
ln -sfn "$kernel/modules" "/lib/modules/$(uname -r)"

# A program of a hundred and fifty libraries asks the host for each at each start. Here they are nearer.
mkdir /run/near
ldd "$build/starloop" | sed -n 's#.* => \(/[^ ]*\).*#\1#p' | xargs cp -Lt /run/near
export LD_LIBRARY_PATH=/run/near

for module in configfs vhci-hcd dummy_hcd libcomposite usb_f_fs uvcvideo; do modprobe "$module"; done
mountpoint -q /sys/kernel/config || mount -t configfs configfs /sys/kernel/config

# The end of it: RC. There is no init to ask.
switch_off() {
  dmesg >/mnt/dmesg
  cut -d' ' -f1 /proc/uptime >/mnt/uptime
  echo "$1" >/mnt/rc
  sync
  echo o >/proc/sysrq-trigger
  sleep 60
}
