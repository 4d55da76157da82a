# OpenCV's VideoCapture reads frames bit for bit.
camera
"$build/tests/guest/guest_opencv" $node 15 >frames.raw
judge_frames frames.raw
