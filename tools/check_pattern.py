#!/usr/bin/env python3
"""Checks the frames of `starloop run --pattern` bit for bit, as raw pixels from stdin:

    v4l2-ctl -d /dev/video20 --stream-mmap --stream-to=- --stream-count=100 | tools/check_pattern.py
    ffmpeg -f v4l2 -input_format gray16le -i /dev/video20 -frames 100 -f rawvideo - | tools/check_pattern.py

Pixel (u, v) of frame k is (u + 3 v + 7 k) modulo 2^bits. With a telemetry row (hil/telemetry_row.h) its
checksum must be right and its frame the one above it. Exit code 0: every frame was one of the pattern's.
"""
import argparse
import sys

import numpy as np

ROW_PIXELS = 56
TORN = "torn, and its row says so: the reader kept the buffer too long, or never had all of it"


def crc32c(data: bytes) -> int:
    crc = 0xFFFFFFFF
    for byte in data:
        crc = crc >> 8 ^ TABLE[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFFFFFF


def table_entry(byte: int) -> int:
    for _ in range(8):
        byte = byte >> 1 ^ (0x82F63B78 if byte & 1 else 0)
    return byte


TABLE = [table_entry(byte) for byte in range(256)]


def frame_of_row(row: np.ndarray) -> int | None:
    """The frame that a telemetry row speaks of; None: it is none."""
    if row[:ROW_PIXELS].max() > 255 or row[ROW_PIXELS:].any():
        return None
    said = row[:ROW_PIXELS].astype(np.uint8).tobytes()
    if said[:6] != b"SLTR\2\x38" or int.from_bytes(said[52:], "little") != crc32c(said[:52]):
        return None
    return int.from_bytes(said[8:16], "little")


class Pattern:
    """The frames as they should come."""

    def __init__(self, o: argparse.Namespace):
        self.largest = 2**o.bits
        # Sums wrap at 2^16, of which every 2^bits is a part.
        self.ramp = (np.arange(o.width) + 3 * np.arange(o.height)[:, None]).astype(np.uint16)
        # Frames are 7 k apart modulo a power of two: 7 has an inverse, so the first pixel names the frame.
        self.inverse = pow(7, -1, self.largest)
        self.down = o.bits - 8 if o.format == "grey" else 0
        self.up = 16 - o.bits if o.format == "y16-top" else 0

    def name(self, image: np.ndarray) -> int:
        return (int(image[0, 0]) >> self.up) * self.inverse % self.largest

    def frame(self, k: int) -> np.ndarray:
        dn = (self.ramp + np.uint16(7 * k % self.largest)) & np.uint16(self.largest - 1)
        return dn >> self.down << self.up


def complaint(o: argparse.Namespace, pattern: Pattern, pixels: np.ndarray) -> tuple[str, int]:
    """What is wrong with a frame, and which it is."""
    image = pixels[:o.height]
    k = frame_of_row(pixels[o.height]) if o.telemetry_row else pattern.name(image)
    if k is None:
        return "the row below it is no telemetry", 0
    off = image != pattern.frame(k)
    if not off.any():
        return "", k
    if o.telemetry_row and int.from_bytes(bytes(pixels[o.height, 48:52].tolist()), "little") != crc32c(
            image.tobytes()):
        return TORN, k
    v, u = np.argwhere(off)[0]
    return f"{np.count_nonzero(off)} pixels wrong, the first at column {u}, row {v}", k


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--width", type=int, default=1024)
    options.add_argument("--height", type=int, default=1024, help="rows, without a telemetry row")
    options.add_argument("--rows-below", type=int, default=0, help="rows below, not looked at")
    options.add_argument("--telemetry-row", action="store_true", help="one row below, looked at")
    options.add_argument("--bits", type=int, default=11)
    options.add_argument("--format", choices=["y16", "y16-top", "grey"], default="y16",
                         help="grey needs the telemetry row: eight bits do not name the frame")
    options.add_argument("--first", type=int, default=0,
                         help="frames at the start that may be anything: an old picture in a buffer")
    o = options.parse_args()
    rows = o.height + (1 if o.telemetry_row else o.rows_below)
    if o.format == "grey" and not o.telemetry_row:
        options.error("--format grey needs --telemetry-row")
    pixel = "u1" if o.format == "grey" else "<u2"
    size = np.dtype(pixel).itemsize * o.width * rows
    pattern = Pattern(o)
    frames = wrong = torn = missing = 0
    last = None
    while len(data := sys.stdin.buffer.read(size)) == size:
        frames += 1
        text, k = complaint(o, pattern, np.frombuffer(data, pixel).reshape(-1, o.width))
        if text and frames <= o.first:
            continue
        if text:
            torn += text == TORN
            wrong += text != TORN
            print(f"frame {frames}: {text}")
        elif last is not None and frames > o.first:
            missing += (k - last - 1) % pattern.largest
        last = None if text else k
    if data:
        print(f"{len(data)} bytes at the end are no whole frame of {size}")
    print(f"{frames} frames, {wrong} wrong, {missing} missing in between"
          + (f", {torn} torn" if torn else ""))
    return 0 if frames > 0 and wrong + torn == 0 and not data else 1


if __name__ == "__main__":
    sys.exit(main())
