# GStreamer's v4l2src reads frames bit for bit.
camera
# Only the two plugins it takes: with all of them it would look into each at its first start.
mkdir plugins
ln -s /usr/lib/*/gstreamer-1.0/libgst{video4linux2,coreelements}.so plugins
export GST_PLUGIN_SYSTEM_PATH_1_0="$PWD/plugins" GST_REGISTRY="$PWD/registry" GST_REGISTRY_FORK=no
gst-launch-1.0 -q v4l2src device=$node num-buffers=15 ! video/x-raw,format=GRAY16_LE ! filesink location=frames.raw
judge_frames frames.raw
