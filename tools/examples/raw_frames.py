#!/usr/bin/env python3
"""Frames of a link in shared memory as raw pixels on stdout, for programs that read a pipe:

    python3 raw_frames.py NAME-OF-THE-LINK | ffmpeg -f rawvideo -pixel_format gray16le ...

docs/links.md has whole pipelines. 16 bits a pixel, little-endian, row by row; a telemetry row, if there
is one, is the last row of each frame. The first frame's size goes to stderr. It answers each frame with
an empty report, so that it reads a run in lockstep too, and ends with the camera, or with whoever reads
the pipe.
Needs numpy and the module starloop_client, installed or on PYTHONPATH."""

import os
import sys

import starloop_client


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    told = False
    with starloop_client.Camera(sys.argv[1], timeout_s=10) as camera:
        for frame in camera.frames(timeout_s=10):
            if not told:
                height, width = frame.pixels.shape
                rows = height + (frame.telemetry_row is not None)
                print(f"{width} x {rows} pixels, {frame.bits} bits", file=sys.stderr)
                told = True
            sys.stdout.buffer.write(frame.pixels)
            if frame.telemetry_row is not None:
                sys.stdout.buffer.write(frame.telemetry_row)
            sys.stdout.buffer.flush()
            try:
                camera.send_report(frame.answer())
            except starloop_client.Disconnected:
                return


if __name__ == "__main__":
    try:
        main()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nothing is left to flush
    except starloop_client.Error as error:
        sys.exit(f"raw_frames.py: {error}")
