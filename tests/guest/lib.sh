# What the checks share. guest.sh reads it in front of each: any command that fails, fails the check.
set -euo pipefail
starloop="$build/starloop"
node=/dev/video20

fail() { echo "FAILED: $*"; exit 1; }
# equal WHAT GOT WANTED
equal() { [[ "$2" == "$3" ]] || fail "$1: $2, and not $3"; }

# Waits until a command is true, at most so many seconds.
within() {
  local seconds="$1" end=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    (( SECONDS < end )) || fail "not within $seconds s: $*"
    sleep 0.2
  done
}

# Starts a program beside the check; $! is its process, NAME.out has its words. It ends with the check.
beside_all=()
end_beside() { for pid in "${beside_all[@]}"; do kill -9 "$pid" 2>/dev/null || true; done; }
trap end_beside EXIT
beside() {
  local name="$1"
  shift
  "$@" >"$name.out" 2>&1 &
  beside_all+=($!)
}
# Waits for its end, which must be a good one.
joined() { local status=0; wait "$2" || status=$?; (( status == 0 )) || { cat "$1.out"; fail "$1 ended with $status"; }; }
# A count of what guest_reader and guest_client print: of the last line that has it.
count() { sed -n "s/.*\b$2=\([0-9]*\).*/\1/p" "$1.out" | tail -1; }
has_count() { local n; n="$(count "$1" "$2")"; [[ -n "$n" ]] && (( n >= $3 )); }

# The words of a run of the pattern, minutes long unless it is told to be shorter, of which nothing is kept.
# Its results go below a folder of that name, of this check's own.
pattern_words() {
  local name="$1"
  shift
  words=("$starloop" run "$source/config/flyby.toml" --pattern --quiet --no-pictures --out "$scratch/$name"
         --threads 1 --set record.frames=none --set visibility.max_range_km=3000
         --set visibility.span_days=0.01 --set run.pass=1 --set link.telemetry_row=true "$@")
}
pattern() { pattern_words "$@"; beside "$1" "${words[@]}"; }
stop_run() { kill -INT "$2"; joined "$1" "$2"; }
# Values of the report of a run that has ended: report NAME KEY.KEY... ...
report() {
  /usr/bin/python3 -I -S -c '
import json, sys
whole = json.load(open(sys.argv[1]))
for keys in sys.argv[2:]:
    value = whole
    for key in keys.split("."): value = value[int(key) if key.isdigit() else key]
    print(value)' "$scratch/$1/flyby/"*/report.json "${@:2}" | xargs
}

# The module anew, with these options: one node, "starloop".
no_loopback() {
  no_camera
  if grep -q ^v4l2loopback /proc/modules; then within 10 rmmod v4l2loopback; fi
}
loopback() {
  no_loopback
  modprobe v4l2loopback devices=1 video_nr=20 card_label=starloop "$@"
  within 10 test -c $node
}
shows_format() { v4l2-ctl -d $node -V | grep -q "'$1"; }
capabilities() {
  v4l2-ctl -d $node -D | sed '1,/Device Caps/d' | sed -n 's/^\t*Video \(Capture\|Output\)$/\1/p' | xargs
}

# A camera for checks that only read, at 5 frames a second. It stays for the next one.
camera() {
  if [[ -e /run/camera ]] && kill -0 "$(cat /run/camera)" 2>/dev/null; then return; fi
  loopback exclusive_caps=1
  scratch=/run pattern_words camera_results --set run.frame_rate_hz=5 --set link.to=v4l2:starloop
  setsid "${words[@]}" >/run/camera.out 2>&1 &
  echo $! >/run/camera
  within 120 shows_format Y16
}
no_camera() {
  if [[ ! -e /run/camera ]]; then return; fi
  kill -INT "$(cat /run/camera)" 2>/dev/null || true
  within 20 camera_has_ended
  rm /run/camera
}
camera_has_ended() { ! kill -0 "$(cat /run/camera)"; }
check_pattern() { /usr/bin/python3 "$source/tools/check_pattern.py" "$@"; }
# What a client has read of the camera: each frame as it was sent. Where the machine is held up for half a second
# the driver skips frames, or tears one, which then says so; more than three of fifteen are the link's fault.
judge_frames() {
  check_pattern --telemetry-row --first 3 <"$1" | tee verdict || true
  grep -Eq '^15 frames, 0 wrong, [0-3] missing in between(, [1-3] torn)?$' verdict || fail "$(tail -1 verdict)"
}

# The device in software, and this kernel's host side: device SHM [WORD...].
device() {
  beside device "$build/starloop_usb_device" --port 3240 --shm "$@"
  device_pid=$!
  within 20 grep -q listening device.out
}
attach() { usbip attach -r 127.0.0.1 -b 1-1; }
detach() { for port in $(sed -n 's/^[hs]s  *\([0-9]*\)  *006 .*/\1/p' $vhci/status); do echo $((10#$port)) >$vhci/detach; done; }
vhci=/sys/devices/platform/vhci_hcd.0
