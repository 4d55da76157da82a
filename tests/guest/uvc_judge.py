#!/usr/bin/env python3
"""Checks frames of the pattern in the formats of eight bits: uvc_judge.py GREY.raw YUYV.raw

The brightness is the pattern's highest eight bits of eleven; below it is a telemetry row, its bytes as they are."""
import sys

import numpy as np

WIDTH = HEIGHT = 1024


def judge(name: str) -> None:
    step = 2 if name.startswith("YUYV") else 1
    size = step * WIDTH * (HEIGHT + 1)
    ramp = np.arange(WIDTH) + 3 * np.arange(HEIGHT)[:, None]
    with open(name, "rb") as file:
        data = file.read()
    frames, left = divmod(len(data), size)
    if frames == 0 or left:
        sys.exit(f"{name}: {len(data)} bytes are no whole frames of {size}")
    for n in range(frames):
        pixels = np.frombuffer(data, "u1", size, n * size).reshape(HEIGHT + 1, WIDTH, step)
        if step == 2 and (pixels[:, :, 1] != 0x80).any():
            sys.exit(f"{name}, frame {n}: it has colours")
        row = bytes(pixels[HEIGHT, :, 0])
        if row[:4] != b"SLTR":
            sys.exit(f"{name}, frame {n}: no telemetry row: {row[:16].hex()}")
        k = int.from_bytes(row[8:16], "little")
        if (pixels[:HEIGHT, :, 0] != ((ramp + 7 * k) % 2048 >> 3)).any():
            sys.exit(f"{name}, frame {n}: not the pattern of {k}")
    print(f"{name}: {frames} frames")


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        judge(argument)
