#!/usr/bin/env python3
"""The Python module against a camera in another process: client_python_test.py path-of-shm_peer."""

import gc
import os
import subprocess
import sys
import unittest

import numpy
import starloop_client as starloop

PEER = sys.argv.pop()
NAME = f"starloop-python-test-{os.getpid()}"


def expected(frame):
    height, width = frame.pixels.shape
    count = numpy.arange(height * width, dtype=numpy.uint64).reshape(height, width)
    return (frame.sequence * 31 + count) & 0x7FF


class Python(unittest.TestCase):
    def setUp(self):
        self.camera = subprocess.Popen([PEER, "camera", NAME], stdout=subprocess.PIPE)
        self.assertEqual(self.camera.stdout.readline(), b"open\n")

    def tearDown(self):
        self.camera.kill()
        self.camera.wait()
        self.camera.stdout.close()
        if os.path.exists(f"/dev/shm/{NAME}"):
            os.unlink(f"/dev/shm/{NAME}")  # what the killed camera left

    def test_frames_are_read_where_they_lie_and_are_as_they_were_sent(self):
        with starloop.Camera(NAME) as camera:
            last = -1
            for _ in range(50):
                with camera.wait_frame(10) as frame:
                    frame.check()
                    self.assertGreater(frame.sequence, last)
                    last = frame.sequence
                    self.assertEqual(frame.pixels.shape, (50, 72))
                    self.assertEqual(frame.pixels.dtype, numpy.uint16)
                    self.assertFalse(frame.pixels.flags.owndata)
                    self.assertFalse(frame.pixels.flags.writeable)
                    self.assertEqual(frame.pixels.ctypes.data, frame._raw.pixels)
                    self.assertTrue((frame.pixels == expected(frame)).all())
                    self.assertIsNone(frame.telemetry_row)
                    self.assertEqual(frame.j2000_to_camera, (1, 0, 0, 0))

    def test_an_array_outlives_the_camera_it_came_from(self):
        camera = starloop.Camera(NAME)
        frame = camera.wait_frame(10)
        pixels, copy = frame.pixels, frame.pixels.copy()
        with self.assertRaises(starloop.Busy):
            starloop.Camera(NAME, timeout_s=0)
        camera.close()
        del frame, camera
        gc.collect()
        self.assertEqual(pixels.shape, copy.shape)
        pixels.sum()
        starloop.Camera(NAME, timeout_s=0).close()

    def test_commands_go_out_and_more_than_64_that_nobody_takes_are_busy(self):
        with starloop.Camera(NAME) as camera:
            answer = camera.wait_frame(10).answer(centroid_px=(1, 2), confidence=0.5)
            camera.send_report(answer)
            camera.send_trim((1e-6, 2e-6), (0, 0), 5, answer)
            camera.send_rate((0, 0), 5)
            camera.send_attitude((1, 0, 0, 0), (0, 0, 0), 5)
            camera.send_mode(starloop.NADIR)
            for _ in range(59):
                camera.send_ping()
            with self.assertRaises(starloop.Busy):
                camera.send_ping()

    def test_frames_end_when_the_camera_is_gone(self):
        with starloop.Camera(NAME) as camera:
            frames = camera.frames(10)
            next(frames)
            self.camera.kill()
            self.camera.wait()
            self.assertLess(sum(1 for _ in frames), 10_000)
            with self.assertRaises(starloop.Disconnected):
                camera.wait_frame(10)
        with self.assertRaises(starloop.Disconnected):
            camera.wait_frame(10)

    def test_a_link_that_is_not_there_says_so(self):
        with self.assertRaisesRegex(starloop.Disconnected, "no camera has opened this link"):
            starloop.Camera("starloop-nobody-has-this", timeout_s=0)


if __name__ == "__main__":
    unittest.main()
