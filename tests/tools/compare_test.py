"""What tools/bench/compare says of measured times, and to wrong input. Its builds are not tried here."""
import importlib.machinery
import importlib.util
import math
import pathlib
import random
import shutil
import subprocess
import sys
import unittest

PROGRAM = pathlib.Path(__file__).resolve().parents[2] / "tools" / "bench" / "compare"


def load():
    loader = importlib.machinery.SourceFileLoader("compare", str(PROGRAM))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("compare", loader))
    loader.exec_module(module)
    return module


compare = load()


class Arithmetic(unittest.TestCase):
    def test_interval_has_the_ranks_of_the_sign_test(self):
        self.assertEqual(compare.interval([*range(1, 10)]), (2, 8))  # 1 - 2 (1 + 9) / 2^9 = .961
        self.assertEqual(compare.interval([3, 1, 2, 6, 5, 4]), (1, 6))  # 1 - 2 / 2^6 = .969
        self.assertEqual(compare.interval([*range(1, 21)]), (6, 15))  # 1 - 2 * 21700 / 2^20 = .959
        self.assertEqual(compare.interval([1, 2, 3, 4, 5]), (-math.inf, math.inf))  # at most .938

    def test_interval_holds_the_median_as_often_as_it_says(self):
        random.seed(4)
        held = 0
        for _ in range(4000):
            low, high = compare.interval([random.lognormvariate(0.0, 0.5) for _ in range(9)])
            held += low <= 1.0 <= high
        # 96.1 %, give or take four sigmas of .3.
        self.assertAlmostEqual(held / 4000, 0.961, delta=0.0125)

    def test_a_shift_beyond_the_noise_is_marked_and_noise_is_not(self):
        noise = [0.97, 0.99, 1.02, 1.01, 0.98, 1.03, 1.0, 0.99, 1.01]
        self.assertEqual(compare.verdict(noise)["differs"], 0)
        self.assertEqual(compare.verdict([1.1 * x for x in noise])["differs"], 1)
        self.assertEqual(compare.verdict([0.9 * x for x in noise])["differs"], -1)
        # One pair in which something else ran is no reason.
        self.assertEqual(compare.verdict([*noise[:8], 5.0])["differs"], 0)

    def test_units_are_one_and_what_failed_is_left_out(self):
        report = {"benchmarks": [
            {"name": "a", "cpu_time": 2.0, "time_unit": "ms"},
            {"name": "b", "cpu_time": 3.0, "time_unit": "ns", "run_type": "iteration"},
            {"name": "b_mean", "cpu_time": 3.0, "time_unit": "ns", "run_type": "aggregate"},
            {"name": "c", "cpu_time": 0.0, "time_unit": "ns", "error_occurred": True}]}
        self.assertEqual(compare.times_of(report), {"a": 2e6, "b": 3.0})

    def test_only_what_both_have_is_compared_pair_by_pair(self):
        pairs = [({"a": 1.0, "gone": 1.0}, {"a": 2.0, "new": 1.0}),
                 ({"a": 10.0, "gone": 1.0}, {"a": 20.0, "new": 1.0})]
        found = compare.compare(pairs)
        self.assertEqual(list(found), ["a"])
        self.assertEqual(found["a"]["ratio"], 2.0)

    def test_whatever_runs_first_goes_second_in_the_next_pair(self):
        order = []
        pairs = compare.in_turn(lambda: order.append("a") or "A", lambda: order.append("b") or "B", 3)
        self.assertEqual("".join(order), "abbaab")
        self.assertEqual(pairs, [("A", "B")] * 3)

    def test_only_what_is_slower_for_sure_and_by_more_breaks_a_limit(self):
        noise = [0.97, 0.99, 1.02, 1.01, 0.98, 1.03, 1.0, 0.99, 1.01]
        found = {"twice": compare.verdict([2.0 * x for x in noise]),
                 "a tenth": compare.verdict([1.1 * x for x in noise]),
                 "half": compare.verdict([0.5 * x for x in noise]),
                 "wild": compare.verdict([0.4, 0.5, 0.6, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0])}
        self.assertEqual(compare.broken_by(found, 1.2), ["twice"])
        self.assertEqual(compare.broken_by(found, 1.0), ["twice", "a tenth"])


class WrongInput(unittest.TestCase):
    def told(self, *words):
        done = subprocess.run([sys.executable, "-B", str(PROGRAM), *words], text=True,
                              capture_output=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.stdout, "")
        return done.stderr

    @unittest.skipIf(shutil.which("git") is None, "no git here")
    def test_is_told_in_one_line(self):
        self.assertEqual(self.told("HEAD", ".", "--pairs", "0"),
                         "compare: --pairs must be at least 1, got 0\n")
        self.assertEqual(self.told("HEAD", ".", "--pairs", "5", "--fail-above", "1.1"),
                         "compare: --fail-above needs at least 6 pairs, got 5\n")
        self.assertEqual(self.told("HEAD", ".", "--fail-above", "nan"),
                         "compare: --fail-above must be a ratio of at least 1, got nan\n")
        self.assertEqual(self.told("HEAD", ".", "--json", "/no/such/folder/x"),
                         "compare: --json /no/such/folder/x: there is no such folder\n")
        self.assertEqual(self.told(".", "."), "compare: both are working tree\n")
        self.assertEqual(self.told("--", "--all", "."), 'compare: "--all" is no commit of this repository\n')


if __name__ == "__main__":
    unittest.main()
