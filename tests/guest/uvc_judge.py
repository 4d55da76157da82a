#!/usr/bin/env python3
"""Checks frames of the pattern in the formats of eight bits, from stdin: uvc_judge.py GREY|YUYV [ROWS_BELOW]

The brightness is the pattern's highest eight bits of eleven; below it the telemetry row's bytes as they are."""
import sys

import numpy as np

WIDTH = HEIGHT = 1024


def main() -> int:
    step = 2 if sys.argv[1] == "YUYV" else 1
    rows_below = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    size = step * WIDTH * (HEIGHT + rows_below)
    ramp = np.arange(WIDTH) + 3 * np.arange(HEIGHT)[:, None]
    frames = 0
    while len(data := sys.stdin.buffer.read(size)) == size:
        pixels = np.frombuffer(data, "u1").reshape(HEIGHT + rows_below, WIDTH, step)
        if step == 2 and (pixels[:, :, 1] != 0x80).any():
            sys.exit(f"frame {frames}: it has colours")
        bright = pixels[:HEIGHT, :, 0]
        if rows_below and bytes(pixels[HEIGHT, :4, 0]) != b"SLTR":
            sys.exit(f"frame {frames}: no telemetry row: {bytes(pixels[HEIGHT, :8, 0])}")
        # The row knows the frame; without it, try them all.
        numbers = [int.from_bytes(bytes(pixels[HEIGHT, 8:16, 0]), "little")] if rows_below else range(2048)
        if not any((bright == ((ramp + 7 * k) % 2048 >> 3)).all() for k in numbers):
            sys.exit(f"frame {frames}: not the pattern")
        frames += 1
    print(f"{frames} frames, {len(data)} bytes left")
    return 0 if frames > 0 and not data else 1


if __name__ == "__main__":
    sys.exit(main())
