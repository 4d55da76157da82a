#!/usr/bin/env python3
"""check_pattern.py finds what was planted in a stream of pattern frames, and nothing else."""
import subprocess
import sys

import numpy as np

WIDTH, HEIGHT = 40, 30


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
