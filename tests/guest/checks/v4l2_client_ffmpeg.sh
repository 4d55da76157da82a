# ffmpeg reads frames bit for bit.
camera
ffmpeg -nostdin -loglevel error -f v4l2 -input_format gray16le -i $node -frames:v 15 -fps_mode passthrough \
  -f rawvideo frames.raw
judge_frames frames.raw
