#!/usr/bin/python3
"""Software under test behind a USB gadget: judges each frame of `starloop run --pattern` bit for bit,
answers each with a trim, and says after each what it has seen so far. Opens the camera again when it
is gone, for it comes back; ends when it is killed.

    gadget_client.py NAME WIDTH HEIGHT
"""
import sys
import time

import numpy as np

import starloop_client as starloop

name, width, height = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
ramp = (np.arange(width) + 3 * np.arange(height)[:, None]).astype(np.uint16)
frames = wrong = missing = backward = commands = cameras = overwritten = 0
last = None
began = time.monotonic()


def judge(frame):
    global frames, wrong, missing, backward, overwritten, last
    frames += 1
    expected = (ramp + np.uint16(7 * frame.sequence % 2048)) & 2047
    if frame.pixels.shape != ramp.shape or not np.array_equal(frame.pixels, expected):
        wrong += 1
    if last is not None:
        backward += frame.sequence <= last
        missing += max(0, frame.sequence - last - 1)
    last = frame.sequence
    overwritten = frame.link_lost


while True:
    try:
        with starloop.Camera(name, timeout_s=60) as camera:
            cameras += 1
            for frame in camera.frames(timeout_s=60):
                judge(frame)
                try:
                    camera.send_trim((1e-6 * frame.sequence, 0), (0, 0), frame.middle_ns,
                                     frame.answer())
                    commands += 1
                except starloop.Busy:
                    pass
                print(f"frames={frames} wrong={wrong} missing={missing} backward={backward} "
                      f"overwritten={overwritten} commands={commands} cameras={cameras} last={last} "
                      f"seconds={time.monotonic() - began:.2f}", flush=True)
    except starloop.Error as error:
        print(f"gadget_client.py: {error}", file=sys.stderr, flush=True)
        time.sleep(0.1)
