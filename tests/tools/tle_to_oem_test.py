#!/usr/bin/python3
"""Tests tools/tle_to_oem.py: tle_to_oem_test.py TLE_TO_OEM STARLOOP SOURCE_DIR. Ends with 77, which
ctest takes for skipped, where python3-sgp4 or python3-erfa are missing."""

import importlib.util
import pathlib
import subprocess
import sys
import tempfile
import unittest

try:
    import erfa
    import numpy
    from sgp4.api import WGS72, Satrec
except ImportError as missing:
    print(f"skipped: {missing}; tools/setup.sh installs it")
    sys.exit(77)

SCRIPT, STARLOOP, SOURCE = sys.argv[1:4]
# AIAA 2006-6753: the first set of its verification run, and the state at its epoch, km and km/s.
VANGUARD = ("VANGUARD 1\n"
            "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753\n"
            "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667\n")
PLACE = (7022.46529266, -1400.08296755, 0.03995155)
VELOCITY = (1.893841015, 6.405893759, 4.534807250)


def load():
    spec = importlib.util.spec_from_file_location("tle_to_oem", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(*arguments):
    return subprocess.run([sys.executable, SCRIPT, *arguments], capture_output=True, text=True,
                          check=False)


class TleToOem(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.tle = pathlib.Path(self.folder.name) / "a.tle"
        self.tle.write_text(VANGUARD)
        self.oem = pathlib.Path(self.folder.name) / "a.oem"

    def test_sgp4_gives_the_verification_state(self):
        lines = VANGUARD.splitlines()
        satellite = Satrec.twoline2rv(lines[1], lines[2], WGS72)
        error, place, velocity = satellite.sgp4_tsince(0.0)
        self.assertEqual(error, 0)
        # The printed digits: well under a metre.
        numpy.testing.assert_allclose(place, PLACE, rtol=0, atol=1e-8)
        numpy.testing.assert_allclose(velocity, VELOCITY, rtol=0, atol=1e-9)

    def test_teme_goes_to_j2000_as_vallados_example(self):
        # Vallado 2013, example 3-15, without the corrections to IAU 1980's nutation: km.
        utc = erfa.dtf2d("UTC", 2004, 4, 6, 7, 51, 28.386009)
        tt = erfa.taitt(*erfa.utctai(*utc))
        matrix = load().j2000_from_teme(tt)
        place = matrix @ numpy.array((5094.18016210, 6127.64465950, 6380.34453270))
        # .00264" of the equinox' later terms are .08 m here.
        numpy.testing.assert_allclose(place, (5102.50960000, 6123.01152000, 6378.13630000),
                                      rtol=0, atol=2e-4)
        numpy.testing.assert_allclose(matrix @ matrix.T, numpy.eye(3), rtol=0, atol=1e-15)

    def write(self, *more):
        return run(str(self.tle), "--start", "2000-06-27T18:50:19.733568", "--stop",
                   "2000-06-27T22:50:00", "-o", str(self.oem), *more)

    def test_the_file_begins_at_the_state(self):
        written = self.write()
        self.assertEqual(written.returncode, 0, written.stderr)
        rows = [r.split() for r in self.oem.read_text().splitlines() if r.startswith("2000-")]
        place = numpy.array([float(x) for x in rows[0][1:4]])
        # From TEME: .01 deg of precession and nutation in half a year, of 7161 km.
        self.assertAlmostEqual(numpy.linalg.norm(place), numpy.linalg.norm(PLACE), delta=1e-6)
        self.assertLess(numpy.linalg.norm(place - PLACE), 1.5)
        self.assertGreater(numpy.linalg.norm(place - PLACE), 0.5)

    def test_starloop_flies_it(self):
        self.assertEqual(self.write("--step", "60").returncode, 0)
        flown = subprocess.run(
            [STARLOOP, "passes", SOURCE + "/config/flyby.toml", "--set",
             "scenario.epoch=2000-06-27T18:51:00", "--set", "orbit.target.propagator=ephemeris",
             "--set", f"orbit.target.file={self.oem}", "--set", "visibility.span_days=0.16",
             "--set", "visibility.max_range_km=20000"],
            capture_output=True, text=True, check=False)
        self.assertEqual(flown.returncode, 0, flown.stderr)
        self.assertIn("target: ephemeris motion", flown.stdout)

    def test_what_is_wrong_is_said(self):
        for arguments in (["--start", "yesterday", "--stop", "2000-06-28T00:00:00"],
                          ["--start", "2000-06-28T00:00:00", "--stop", "2000-06-27T00:00:00"],
                          ["--start", "2000-06-27T00:00:00", "--stop", "2000-06-27T00:01:00"],
                          ["--start", "2000-06-27T00:00:00", "--stop", "2000-06-28T00:00:00",
                           "--name", "ISS"]):
            said = run(str(self.tle), *arguments)
            self.assertNotEqual(said.returncode, 0)
            self.assertTrue(said.stderr.startswith("tle_to_oem.py: expected"), said.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
