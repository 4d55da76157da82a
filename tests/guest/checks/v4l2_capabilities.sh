# The node says what it is before, during and after a run, twice in a row, in both of the driver's manners.
while read -r exclusive idle busy; do
  loopback exclusive_caps=$exclusive
  for round in 1 2; do
    equal "exclusive_caps=$exclusive, before run $round" "$(capabilities)" "${idle//,/ }"
    pattern run$exclusive$round --set link.to=v4l2:starloop
    run=$!
    within 120 shows_format Y16
    equal "exclusive_caps=$exclusive, during run $round" "$(capabilities)" "${busy//,/ }"
    stop_run run$exclusive$round $run
    equal "exclusive_caps=$exclusive, after run $round" "$(capabilities)" "${idle//,/ }"
  done
done <<'TABLE'
1 Output Capture
0 Capture,Output Capture,Output
TABLE
