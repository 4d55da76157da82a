# Limit: 240 s
# Twenty times unplugged and plugged in during one run: each time frames flow again, each frame is accounted for,
# none is wrong, and the program holds no more descriptors than at first.
device cam --width 256 --height 256
attach
beside client "$build/tests/guest/guest_client" cam 256 256
pattern run --set run.frame_rate_hz=10 --set camera.width_px=256 --set camera.height_px=256 --set link.to=usb:1209:0001
run=$!
descriptors() { ls /proc/$run/fd | wc -l; }
within 120 has_count client frames 5
held="$(descriptors)"
for round in $(seq 20); do
  detach
  seen="$(count client frames)"
  attach
  within 60 has_count client frames $((seen + 2))
done
equal "descriptors after 20 rounds" "$(descriptors)" "$held"
stop_run run $run
read -r connections due sent refused skipped dropped < <(report run links.0.usb.connections frames.due \
  frames.sent frames.faults frames.skipped frames.dropped)
equal "connections" "$connections" 21
equal "due" "$due" $((sent + refused + skipped + dropped))
seen="$(count client frames)"
equal "whole" "$(count client whole)" "$seen"
equal "wrong, and not noticed" "$(count client torn_unnoticed)" 0
# What the device has taken and could not confirm any more is a frame that was refused.
(( seen >= sent && seen <= sent + refused )) || fail "$seen seen, $sent sent, $refused refused"
echo "20 rounds: $sent sent, $refused refused, $seen seen"
detach
