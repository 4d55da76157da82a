# v4l2-ctl reads frames bit for bit.
camera
v4l2-ctl -d $node --stream-mmap --stream-count=15 --stream-to=frames.raw
judge_frames frames.raw
