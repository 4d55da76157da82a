#!/usr/bin/env python3
"""A tracker in Python: threshold, centroid, and a trim that brings the target to the middle.

    python3 tracker.py NAME-OF-THE-LINK [rad-per-pixel]

Needs numpy and the module starloop_client, installed or on PYTHONPATH. Runs until the camera is
gone. Copy it, and put your own software where find_target() is."""

import sys

import numpy

import starloop_client


def find_target(pixels):
    """(u, v) of the centroid of all that is brighter or, before the Earth, darker than the
    background by more than the threshold, or None."""
    # The background is the median; its noise is what 84 % of a normal distribution stay under.
    below = numpy.cumsum(numpy.bincount(pixels.ravel()))
    median, one_sigma = numpy.searchsorted(below, [0.5 * pixels.size, 0.841 * pixels.size])
    off = numpy.abs(pixels - numpy.float32(median))
    v, u = numpy.nonzero(off > 6.0 * max(0.5, one_sigma - median))
    if len(u) < 4:  # noise, or a cosmic ray
        return None
    off = off[v, u].astype(float)
    return (off @ u) / off.sum(), (off @ v) / off.sum()


class Filter:
    """An alpha-beta filter on one axis: an offset, and the rate at which it grows."""

    def __init__(self):
        self.offset_rad = self.rate_rad_s = 0.0
        self.last_ns = None

    def add(self, seen_rad, at_ns):
        if self.last_ns is None or at_ns <= self.last_ns:
            self.offset_rad, self.rate_rad_s = seen_rad, 0.0
        else:
            dt = (at_ns - self.last_ns) * 1e-9
            predicted = self.offset_rad + self.rate_rad_s * dt
            surprise = seen_rad - predicted
            self.offset_rad = predicted + 0.8 * surprise
            self.rate_rad_s += 0.5 * surprise / dt
        self.last_ns = at_ns


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    ifov_rad = float(sys.argv[2]) if len(sys.argv) > 2 else 1.4444e-6
    axes = [Filter(), Filter()]
    with starloop_client.Camera(sys.argv[1], timeout_s=10) as camera:
        for frame in camera.frames(timeout_s=10):
            target = find_target(frame.pixels)
            if target is None:
                answer = frame.answer()
            else:
                answer = frame.answer(centroid_px=target, confidence=1.0, id=1)
                middle_px = (frame.width_px // 2, frame.height_px // 2)
                # What is wrong with the pointing: where the target is seen, plus the trim that
                # was on.
                for axis, place, middle, trim in zip(axes, target, middle_px, frame.trim_rad):
                    axis.add((place - middle) * ifov_rad + trim, frame.middle_ns)
            # Every frame gets its answer: a camera in lockstep waits for it.
            if axes[0].last_ns is None:
                camera.send_report(answer)
            else:
                camera.send_trim([axis.offset_rad for axis in axes],
                                 [axis.rate_rad_s for axis in axes], axes[0].last_ns, answer)


if __name__ == "__main__":
    try:
        main()
    except starloop_client.Error as error:
        sys.exit(f"{sys.argv[0]}: {error}")
