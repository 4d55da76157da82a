#!/usr/bin/env bash
# Boots the guest once, has it run a script of this folder, and waits for the end.
#   run.sh BUILD RESULTS SCRIPT [WORD...]
# BUILD is a build tree whose programs are driven; RESULTS, emptied first, gets what the script writes to
# /mnt, and the console. STARLOOP_GUEST_CACHE: where the kernel is kept, else BUILD/guest/kernel.
# STARLOOP_GUEST_SECONDS: how long it may take. Exit code: that of the script; 77 skipped (something is
# missing, or the kernel does not come up), 98 the guest did not come to its end by itself, 99 it hung.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
build="$(cd "$1" && pwd)"
results="$2"
script="$3"
shift 3
limit="${STARLOOP_GUEST_SECONDS:-600}"
PATH="$PATH:/usr/sbin:/sbin"

mkdir -p "$results"
find "$results" -mindepth 1 -delete
results="$(cd "$results" && pwd)"

status=0
prepared="$("$here/prepare.sh" "${STARLOOP_GUEST_CACHE:-$build/guest/kernel}")" || status=$?
kernel="$(tail -1 <<<"$prepared")"
if (( status == 77 )); then echo "$kernel" | tee "$results/skipped"; exit 77; fi
if (( status != 0 )); then exit "$status"; fi
kernel="$(cd "$kernel" && pwd)"

printf 'exec /bin/bash %q' "$here/$script" >"$results/job"
printf ' %q' "$(cd "$here/../.." && pwd)" "$build" "$kernel" "$@" >>"$results/job"
echo >>"$results/job"

# Emulated, never by KVM: one that opens need not work. Nehalem has no instructions that emulation makes
# slower than none.
started=$SECONDS
timeout -k 5 "$limit" qemu-system-x86_64 -machine q35 -accel tcg,thread=multi -cpu Nehalem -smp 2 -m 2560 \
  -bios /usr/share/qemu/qboot.rom -nodefaults -no-reboot -display none -nic none \
  -serial "file:$results/console" -kernel "$kernel/vmlinux" -initrd "$kernel/initramfs" \
  -append "console=ttyS0 quiet mitigations=off panic=-1 norandmaps" \
  -fsdev local,id=host,path=/,security_model=none,readonly=on,multidevs=remap \
  -device virtio-9p-pci,fsdev=host,mount_tag=host \
  -fsdev "local,id=out,path=$results,security_model=none" \
  -device virtio-9p-pci,fsdev=out,mount_tag=out </dev/null || status=$?
# A kernel that does not come up here says nothing about the programs.
if [[ ! -e "$results/booted" ]]; then
  tail -20 "$results/console"
  echo "SKIPPED: QEMU does not bring Debian's kernel up on this machine (exit code $status after" \
    "$((SECONDS - started)) s); its console is above" | tee "$results/skipped"
  exit 77
fi
if (( status == 124 || status == 137 )); then
  tail -20 "$results/console"
  echo "the guest hung: it was not done after $limit s; the end of its console is above"
  exit 99
fi
if [[ ! -s "$results/rc" ]]; then
  tail -40 "$results/console"
  echo "the guest ended before its time (qemu $status): a panic, or no memory; its console is above"
  exit 98
fi
echo "the guest ran for $((SECONDS - started)) s"
exit "$(cat "$results/rc")"
