#!/usr/bin/env python3
"""check_pattern.py finds what was planted in a stream of pattern frames, and nothing else."""
import subprocess
import sys

import numpy as np

WIDTH, HEIGHT = 60, 30


def frame(k: int, bits: int = 11, rows_below: int = 0) -> np.ndarray:
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    image = ((u + 3 * v + 7 * k) % 2**bits).astype("<u2")
    return np.vstack([image, np.full((rows_below, WIDTH), 77, "<u2")])


def check(frames, *more: str, tail: bytes = b"") -> tuple[int, str]:
    data = b"".join(f.tobytes() for f in frames) + tail
    words = [sys.executable, sys.argv[1], "--width", str(WIDTH), "--height", str(HEIGHT), *more]
    done = subprocess.run(words, input=data, capture_output=True, check=False)
    return done.returncode, done.stdout.decode()


def expect(result: tuple[int, str], code: int, words: str) -> None:
    assert result[0] == code and words in result[1], result


good = [frame(k) for k in range(5)]
expect(check(good), 0, "5 frames, 0 wrong, 0 missing")
# Far into a run, across the end of the counter.
expect(check([frame(k) for k in range(2040, 2060)]), 0, "20 frames, 0 wrong, 0 missing")
expect(check([frame(k) for k in (3, 4, 8, 9)]), 0, "4 frames, 0 wrong, 3 missing")
expect(check([frame(k, bits=8) for k in range(4)], "--bits", "8"), 0, "4 frames, 0 wrong")
expect(check([frame(k, rows_below=1) for k in range(4)], "--rows-below", "1"), 0, "4 frames, 0 wrong")
bad = [f.copy() for f in good]
bad[2][7, 9] ^= 1
expect(check(bad), 1, "frame 3: 1 pixels wrong, the first at column 9, row 7")
# Half of one frame and half of the next: torn.
torn = [f.copy() for f in good]
torn[3][HEIGHT // 2:] = good[4][HEIGHT // 2:]
expect(check(torn), 1, "5 frames, 1 wrong")
old = [np.zeros_like(good[0]), *good]
expect(check(old, "--first", "1"), 0, "6 frames, 0 wrong")
expect(check(good, tail=b"abc"), 1, "3 bytes at the end")
expect(check([]), 1, "0 frames")


# A telemetry row, byte by byte as hil/telemetry_row.h has it; its checksum by another way than the tool's.
def crc32c(data: bytes) -> int:
    bits = [int(b) for byte in data for b in f"{byte:08b}"[::-1]] + [0] * 32
    for i in range(32):
        bits[i] ^= 1
    for i in range(8 * len(data)):
        if bits[i]:
            for j, b in enumerate(f"{0x11EDC6F41:033b}"):
                bits[i + j] ^= int(b)
    return int("".join(map(str, bits[-32:][::-1])), 2) ^ 0xFFFFFFFF


def with_row(image: np.ndarray, k: int) -> np.ndarray:
    said = b"SLTR\2\x38\0\0" + k.to_bytes(8, "little") + bytes(32)
    said += crc32c(image.tobytes()).to_bytes(4, "little")
    said += crc32c(said).to_bytes(4, "little")
    row = np.zeros((1, WIDTH), image.dtype)
    row[0, :56] = list(said)
    return np.vstack([image, row])


assert crc32c(b"123456789") == 0xE3069283
rows = [with_row(frame(k), k) for k in (5, 6, 5000)]
expect(check(rows, "--telemetry-row"), 0, f"3 frames, 0 wrong, {4993 % 2048} missing")
spoilt = [f.copy() for f in rows]
spoilt[1][HEIGHT, 9] ^= 1
expect(check(spoilt, "--telemetry-row"), 1, "frame 2: the row below it is no telemetry")
# A row that is whole, below the image of another frame.
expect(check([with_row(frame(3), 4)], "--telemetry-row"), 1, "frame 1: 1800 pixels wrong")
grey = [with_row((frame(k) >> 3).astype("u1"), k) for k in range(3)]
expect(check(grey, "--telemetry-row", "--format", "grey"), 0, "3 frames, 0 wrong, 0 missing")
grey[1][5, 5] ^= 1
expect(check(grey, "--telemetry-row", "--format", "grey"), 1, "3 frames, 0 wrong, 0 missing in between, 1 torn")
top = [(frame(k) << 5).astype("<u2") for k in range(3)]
expect(check(top, "--format", "y16-top"), 0, "3 frames, 0 wrong, 0 missing")
top[2][0, 1] ^= 1
expect(check(top, "--format", "y16-top"), 1, "frame 3: 1 pixels wrong, the first at column 1, row 0")
expect(check(good, "--format", "y16-top"), 1, "wrong")
