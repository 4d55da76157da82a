# A node that goes away in the middle of a run, and comes back: frames are refused meanwhile and flow again, and the
# run ends well. v4l2loopback does not let its node go while it is open; vivid does, and its output is a strict one.
loopback exclusive_caps=1
pattern held --set link.to=v4l2:starloop
held=$!
within 120 shows_format Y16
! rmmod v4l2loopback 2>rmmod.out || fail "the module went while a run had its node"
grep -q 'in use' rmmod.out || fail "$(cat rmmod.out)"
stop_run held $held
equal "refused while the module stayed" "$(report held frames.faults)" 0

strict=/dev/video21 driver=/sys/bus/platform/drivers/vivid
modprobe vivid n_devs=1 node_types=0x0101 output_types=1 vid_cap_nr=22 vid_out_nr=21
pattern run --set run.frame_rate_hz=10 --set link.telemetry_row=false --set link.to=v4l2:$strict
run=$!
has_node() { ls -l /proc/$run/fd | grep -q "$strict\$"; }
within 120 has_node
sleep 1
echo vivid.0 >$driver/unbind
no_node() { ! has_node; }
within 60 no_node
echo vivid.0 >$driver/bind
within 60 has_node
sleep 6
stop_run run $run
read -r sent refused < <(report run frames.sent frames.faults)
echo "$sent sent, $refused refused while the node was away"
# Ten or so were before; six seconds were after.
(( sent >= 20 && refused > 0 )) || fail "nothing was sent after the node came back, or nothing refused"
rmmod vivid
