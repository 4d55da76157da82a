# GREY has the highest eight bits, Y16 at the top the value in the high ones; both carry their telemetry row.
loopback exclusive_caps=1
read_as() {
  within 120 shows_format "$2"
  v4l2-ctl -d $node --stream-mmap --stream-count=10 --stream-to=frames.raw
  stop_run "$1" "$3"
  check_pattern --telemetry-row --first 3 --format "$1" <frames.raw
}
pattern grey --set run.frame_rate_hz=5 --set link.to=v4l2:starloop --set link.v4l2_format=grey
read_as grey GREY $!
pattern y16-top --set run.frame_rate_hz=5 --set link.to=v4l2:starloop --set link.v4l2_to_top=true
read_as y16-top Y16 $!
