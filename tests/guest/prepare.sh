#!/usr/bin/env bash
# Makes what the guest boots: Debian's own kernel, its modules with v4l2loopback built from its package,
# and an initramfs. Nothing is installed; all of it lies in the folder given (safe to delete), once for
# each version of the kernel. Prints that version's folder.
#   prepare.sh CACHE
# Exit code 77: something is missing here; the last line says what, and what gets it.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
cache="$1"

skip() { echo "SKIPPED: $1"; exit 77; }

missing=()
for program in qemu-system-x86_64 busybox depmod cpio make gcc-12 python3 apt-get dpkg-deb \
               v4l2-ctl gst-launch-1.0 ffmpeg usbip; do
  PATH="$PATH:/usr/sbin:/sbin" command -v "$program" >/dev/null || missing+=("$program")
done
PATH="$PATH:/usr/sbin:/sbin"
if (( ${#missing[@]} > 0 )); then skip "no ${missing[*]}; tools/setup.sh --guest installs it"; fi

# What a package depends on, by a prefix of the name.
dependency() { { apt-cache depends "$1" 2>/dev/null || true; } | sed -n "/^ *Depends: $2/{s/.*: //p;q}"; }
image="$(dependency linux-image-amd64 linux-image-)"
if [[ -z "$image" ]]; then skip "apt knows no linux-image-amd64; sudo apt-get update asks for it"; fi
kernel="${image#linux-image-}"
recipe="$(cat "${BASH_SOURCE[0]}" "$here/init" | sha256sum | head -c 12)"
folder="$cache/$kernel-$recipe"
if [[ -e "$folder/initramfs" ]]; then echo "$folder"; exit 0; fi

headers="linux-headers-$kernel"
packages=("$image" "$headers" "$(dependency "$headers" linux-headers-)"
          "$(dependency "$headers" linux-kbuild-)" v4l2loopback-dkms)
work="$folder.part"
rm -rf "$work"
mkdir -p "$work"/{root,module,ramfs}
cd "$work"
apt-get download -qq "${packages[@]}" >download.log 2>&1 ||
  skip "no ${packages[0]} from apt ($(tail -1 download.log)); sudo apt-get update, and a network"

# Of the kernel's modules only those rooms where ours are.
for deb in linux-headers*.deb linux-kbuild*.deb v4l2loopback*.deb; do dpkg-deb -x "$deb" root; done
dpkg-deb --fsys-tarfile "$image"_*.deb | tar -x -C root --wildcards './boot/vmlinuz*' \
  './lib/modules/*/modules.*' './lib/modules/*/kernel/drivers/media/*' \
  './lib/modules/*/kernel/drivers/usb/*' './lib/modules/*/kernel/drivers/virtio/*' \
  './lib/modules/*/kernel/fs/*' './lib/modules/*/kernel/lib/*' './lib/modules/*/kernel/net/9p/*'

# The only path in the headers that is no relative one.
sed -i "s#include /usr/src#include $work/root/usr/src#" "root/usr/src/$headers/Makefile"
cp -r root/usr/src/v4l2loopback-*/. module
make -C "root/usr/src/$headers" M="$work/module" modules >module.log 2>&1 ||
  { cat module.log >&2; echo "v4l2loopback was not built" >&2; exit 1; }
mkdir "root/lib/modules/$kernel/extra"
cp module/v4l2loopback.ko "root/lib/modules/$kernel/extra"
depmod -b root "$kernel"
mv root/lib/modules/"$kernel" modules

# The kernel without its wrapping: under emulation the unwrapping costs seconds.
python3 - root/boot/vmlinuz-* vmlinux <<'PYTHON'
import lzma, sys
data = open(sys.argv[1], "rb").read()
start = data.index(b"\xfd7zXZ\x00")
open(sys.argv[2], "wb").write(lzma.LZMADecompressor().decompress(data[start:]))
PYTHON

# What it takes to see the host's files.
mkdir -p ramfs/{bin,modules,proc,sys,dev,host,over,root}
cp "$(command -v busybox)" ramfs/bin
cp "$here/init" ramfs
n=10
for module in virtio_pci 9pnet_virtio 9p overlay; do
  while read -r path; do
    name="$(basename "$path")"
    if ! compgen -G "ramfs/modules/*-$name" >/dev/null; then
      cp "modules/$path" "ramfs/modules/$((n++))-$name"
    fi
  done < <(sed -n "s#^\(kernel/[^:]*/$module\.ko\): *#\1 #p" modules/modules.dep |
           tr ' ' '\n' | sed '/^$/d' | tac)
done
(cd ramfs && find . | cpio -o -H newc --quiet | gzip -1) >initramfs.part
rm -rf root module ramfs ./*.deb
mv initramfs.part initramfs
rm -rf "$folder"
mv "$work" "$folder"
echo "$folder"
