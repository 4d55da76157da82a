#!/usr/bin/env python3
"""Frames of a run through shared memory and a pipe: raw_frames_test.py path-of-starloop source-folder."""

import os
import subprocess
import sys
import tempfile
import unittest

SOURCE = sys.argv.pop()
STARLOOP = sys.argv.pop()
RAW_FRAMES = [sys.executable, "-B", f"{SOURCE}/tools/examples/raw_frames.py"]
CHECK_PATTERN = [sys.executable, "-B", f"{SOURCE}/tools/check_pattern.py"]
LINK = f"starloop-raw-test-{os.getpid()}"


class RawFrames(unittest.TestCase):
    def setUp(self):
        self.out = tempfile.TemporaryDirectory()

    def tearDown(self):
        self.out.cleanup()

    def run_of_pattern(self, frames, *words):
        sets = ["run.clock=lockstep", "run.frame_rate_hz=10", f"run.duration_s={frames / 10 - 0.05}",
                f"link.to=shm:{LINK}", "camera.width_px=64", "camera.height_px=64",
                "visibility.span_days=4", "record.frames=none", *words]
        return subprocess.Popen(
            [STARLOOP, "run", f"{SOURCE}/config/flyby.toml", "--pattern", "--quiet", "--no-pictures",
             "--out", self.out.name] + [w for s in sets for w in ("--set", s)])

    def test_every_frame_comes_out_of_the_pipe_bit_for_bit_and_its_telemetry_row_with_it(self):
        for row in ("false", "true"):
            run = self.run_of_pattern(20, f"link.telemetry_row={row}")
            raw = subprocess.Popen(RAW_FRAMES + [LINK], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
            options = ["--width", "64", "--height", "64"]
            check = subprocess.run(CHECK_PATTERN + options + ["--telemetry-row"] * (row == "true"),
                                   stdin=raw.stdout, capture_output=True, check=False)
            said = raw.communicate()[1]
            self.assertEqual((raw.returncode, run.wait()), (0, 0))
            self.assertEqual(said, b"64 x 64 pixels, 11 bits\n" if row == "false"
                             else b"64 x 65 pixels, 11 bits\n")
            self.assertEqual(check.returncode, 0, check.stdout)
            self.assertIn(b"20 frames, 0 wrong, 0 missing", check.stdout)

    def test_a_pipe_that_is_closed_ends_it_without_a_word(self):
        run = self.run_of_pattern(20)
        raw = subprocess.Popen(RAW_FRAMES + [LINK], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        raw.stdout.read(100)
        raw.stdout.close()
        self.assertEqual(raw.stderr.read(), b"64 x 64 pixels, 11 bits\n")
        self.assertEqual(raw.wait(), 0)
        raw.stderr.close()
        run.terminate()
        run.wait()

    def test_a_link_that_is_not_there_is_an_error(self):
        end = subprocess.run(
            [sys.executable, "-c",
             "import starloop_client, sys; sys.argv = ['raw_frames.py', 'nowhere']\n"
             "open_camera = starloop_client.Camera\n"
             "starloop_client.Camera = lambda name, timeout_s: open_camera(name, timeout_s=0.1)\n"
             f"exec(compile(open('{RAW_FRAMES[2]}').read(), 'raw_frames.py', 'exec'))"],
            capture_output=True, check=False)
        self.assertEqual(end.returncode, 1)
        self.assertIn(b"raw_frames.py: ", end.stderr)
        self.assertIn(b"nowhere", end.stderr)


if __name__ == "__main__":
    unittest.main()
