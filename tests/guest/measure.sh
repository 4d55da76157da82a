#!/bin/bash
# What the links cost in the guest, 1024 x 1024: frames a second as fast as it goes, time of the processor for each
# (of the sender, threads of the link and its system calls included), and how old a frame is when the client has it,
# at ten a second. By hand, on a machine that does nothing else:
#   tests/guest/run.sh build/release build/release/guest/measured measure.sh
#   cat build/release/guest/measured/figures
# An emulated processor is ten to thirty times slower than its host: compare links with each other, not with a board.
. "$1/tests/guest/machine.sh"
export scratch=/dev/shm/measure
mkdir -p "$scratch"
cd "$scratch"
. "$source/tests/guest/lib.sh"
set +e
trap - EXIT
here="$build/tests/guest"

# one NAME READER-WORDS -- SENDER-WORDS
one() {
  local name="$1" reader=()
  shift
  while [[ "$1" != -- ]]; do reader+=("$1"); shift; done
  shift
  for rate in 0 10; do
    # A node has a format once somebody sends.
    "$here/guest_sender" "$1" 6 $rate "${@:2}" >sender.out 2>&1 &
    local sender=$!
    if [[ "$1" == v4l2:* ]]; then within 20 shows_format Y16; fi
    "${reader[@]}" >reader.out 2>&1
    wait $sender
    echo "$name rate=$rate $(cat sender.out) $(cat reader.out)" | tee -a /mnt/figures
  done
}
loopback exclusive_caps=1 max_buffers=8
one "v4l2 write" "$here/guest_reader" --stamps --patience 2 -- v4l2:starloop
one "v4l2 mapped" "$here/guest_reader" --stamps --patience 2 -- v4l2:starloop mapped
one "shm" "$here/guest_client" cam0 1024 1024 stamps -- shm:cam0
device cam
attach
one "usb/ip packed" "$here/guest_client" cam 1024 1024 stamps -- usb
one "usb/ip plain" "$here/guest_client" cam 1024 1024 stamps -- usb plain
detach
switch_off 0
