#!/usr/bin/env python3
"""Checks the frames of `starloop run --pattern` bit for bit, as raw 16-bit pixels from stdin:

    v4l2-ctl -d /dev/video20 --stream-mmap --stream-to=- --stream-count=100 | tools/check_pattern.py
    ffmpeg -f v4l2 -input_format gray16le -i /dev/video20 -frames 100 -f rawvideo - | tools/check_pattern.py

Pixel (u, v) of frame k is (u + 3 v + 7 k) modulo 2^bits. Exit code 0: every frame was one of the pattern's.
"""
import argparse
import sys

import numpy as np


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--width", type=int, default=1024)
    options.add_argument("--height", type=int, default=1024, help="rows, without a telemetry row")
    options.add_argument("--rows-below", type=int, default=0, help="telemetry rows, not looked at")
    options.add_argument("--bits", type=int, default=11)
    options.add_argument("--first", type=int, default=0,
                         help="frames at the start that may be anything: an old picture in a buffer")
    o = options.parse_args()
    size = 2 * o.width * (o.height + o.rows_below)
    largest = 2**o.bits
    ramp = (np.arange(o.width) + 3 * np.arange(o.height)[:, None]).astype(np.int64)
    # Frames 7 k apart modulo a power of two: 7 has an inverse, so the first pixel names the frame.
    inverse = pow(7, -1, largest)
    frames = wrong = missing = 0
    last = None
    while len(data := sys.stdin.buffer.read(size)) == size:
        frames += 1
        pixels = np.frombuffer(data, "<u2").reshape(-1, o.width)[:o.height]
        k = int(pixels[0, 0]) * inverse % largest
        off = int(np.count_nonzero(pixels != (ramp + 7 * k) % largest))
        if off and frames <= o.first:
            continue
        if off:
            wrong += 1
            v, u = np.argwhere(pixels != (ramp + 7 * k) % largest)[0]
            print(f"frame {frames}: {off} pixels wrong, the first at column {u}, row {v}")
            last = None
            continue
        if last is not None:
            missing += (k - last - 1) % largest
        last = k
    if data:
        print(f"{len(data)} bytes at the end are no whole frame of {size}")
    print(f"{frames} frames, {wrong} wrong, {missing} missing in between")
    return 0 if frames > 0 and wrong == 0 and not data else 1


if __name__ == "__main__":
    sys.exit(main())
