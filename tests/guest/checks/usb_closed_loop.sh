# The loop closed over USB: a scene of few pixels, software under test that knows shared memory alone, and the
# scenario's own criteria.
device cam --width 256 --height 256
# The same field with pixels four times as wide. The run waits for the device, which waits for its software.
beside run "$starloop" run "$source/config/flyby.toml" --no-pictures --out "$scratch/run" \
  --set link.to=usb:1209:0001 --set run.clock=lockstep --set record.frames=none --set camera.width_px=256 \
  --set camera.height_px=256 --set camera.focal_length_m=1.125 --set optics.aperture_m=0.09 \
  --set render.samples_per_pixel=4 --set run.duration_s=4 --set criteria.after_s=2 \
  --set criteria.max_latency_frames=1
run=$!
within 120 grep -q 'frames go to usb' run.out
beside tracker "$build/tools/examples/example_c" cam 5.7778e-6
tracker=$!
sleep 0.5
attach
joined run $run
equal "sent, and commands taken" "$(report run frames.sent commands.taken)" "41 41"
grep -i 'px rms' run.out
kill $tracker
detach
