#!/usr/bin/env python3
"""Plants violations in a small tree and sees tools/check_layers.py find them."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

CHECK = pathlib.Path(__file__).resolve().parents[2] / "tools" / "check_layers.py"

GOOD = {
    "engine/core/a.h": '#include <toml++/toml.h>\n',
    "engine/orbit/a.h": '#include <erfa.h>\n\n#include "engine/core/a.h"\n',
    "engine/scene/a.h": '#include "engine/orbit/a.h"\n',
    "engine/render/a.h": '#include <embree3/rtcore.h>\n#include "engine/scene/a.h"\n',
    "engine/optics/a.h": '#include <unsupported/Eigen/FFT>\n#include "engine/render/a.h"\n',
    "engine/detector/a.h": '#include "engine/optics/a.h"\n',
    "engine/a.h": '#include <vector>\n#include "engine/detector/a.h"\n',
    "hil/a.h": '#include "engine/a.h"\n',
    "drivers/a.h": '#include <libusb.h>\n#include "hil/a.h"\n',
    "tools/x/a.cpp": '#include <CLI/CLI.hpp>\n#include "drivers/a.h"\n',
    "tests/hil/a_test.cpp": '#include "hil/a.h"\n#include "tests/support/fakes.h"\n',
    "tests/support/fakes.h": '#include "hil/a.h"\n',
}

# What is added, and the complaint that has to follow.
BAD = [
    ("engine/core/b.h", '#include "engine/orbit/a.h"\n',
     'engine/core/b.h:1: core includes "engine/orbit/a.h": orbit is to the right of core'),
    ("engine/scene/b.cpp", '\n\n#include "engine/render/a.h"\n',
     'engine/scene/b.cpp:3: scene includes "engine/render/a.h": render is to the right of scene'),
    ("engine/detector/b.h", '#include "engine/a.h"\n', "engine is to the right of detector"),
    ("engine/b.cpp", '  #  include "hil/a.h"\n', "engine/b.cpp:1: engine includes"),
    ("hil/b.cpp", '#include "drivers/a.h"\n', "drivers is to the right of hil"),
    ("tests/engine/core/b_test.cpp", '#include "hil/a.h"\n',
     'a test of engine includes "hil/a.h": hil is to the right of engine'),
    ("tests/engine/core/b_test.cpp", '#include <erfa.h>\n',
     "core includes <erfa.h>: it belongs to orbit alone"),
    ("tests/engine/b_test.cpp", '#include "tests/support/fakes.h"\n',
     'a test of engine includes "tests/support/fakes.h": hil is to the right of engine'),
    ("hil/c.cpp", '#include "tests/support/fakes.h"\n', "the product knows no tests"),
    ("engine/scene/c.cpp", '#include <embree3/rtcore.h>\n',
     "scene includes <embree3/rtcore.h>: it belongs to render, tools alone"),
    ("hil/d.cpp", '#include <erfa.h>\n', "it belongs to orbit alone"),
    ("tools/x/b.cpp", '#include <toml++/toml.h>\n', "it belongs to core alone"),
    ("tools/x/b.cpp", '#include <fitsio.h>\n', "it belongs to core alone"),
    ("engine/render/b.cpp", '#include <unsupported/Eigen/FFT>\n', "it belongs to optics alone"),
    ("drivers/b.cpp", '#include <opencv2/core.hpp>\n', "it belongs to tools alone"),
    ("hil/e.cpp", '#include <spdlog/spdlog.h>\n', "it belongs to tools alone"),
    ("hil/e.cpp", '#include <CLI/CLI.hpp>\n', "it belongs to tools alone"),
    ("engine/core/c.cpp", '#include <tiny_obj_loader.h>\n', "it belongs to scene alone"),
    ("engine/detector/c.cpp", '#include <Random123/philox.h>\n', "it belongs to core alone"),
    ("drivers/c.cpp", '#include <asio.hpp>\n', "it belongs to hil, tools alone"),
    ("hil/f.cpp", '#include <linux/videodev2.h>\n', "it belongs to drivers alone"),
    ("hil/f.cpp", '#include <libusb-1.0/libusb.h>\n', "it belongs to drivers alone"),
    ("tests/hil/g_test.cpp", '#include <libusb.h>\n', "it belongs to drivers alone"),
    ("hil/g.cpp", '#include "a.h"\n',
     'hil/g.cpp:1: "a.h" does not start at the repository\'s root: write "hil/a.h"'),
    ("hil/g.cpp", '#include "../engine/a.h"\n', "does not start at the repository's root"),
    ("hil/g.cpp", '#include "hil/../engine/a.h"\n', "does not start at the repository's root"),
    ("hil/g.cpp", '#include "hil/nowhere.h"\n', "is no file of the repository"),
    ("hil/g.cpp", '#include <hil/a.h>\n', '<hil/a.h> is ours: write "hil/a.h"'),
]

HARMLESS = [
    ("engine/core/d.h", '/* #include "hil/a.h"\n#include "hil/a.h"\n*/\n'),
    ("engine/core/d.h", '// #include "hil/a.h"\n'),
    ("engine/core/d.h", '#include <Eigen/Core>\n'),
    ("tests/engine/core/b_test.cpp", '#include "engine/scene/a.h"\n'),
    ("tests/engine/orbit/b_test.cpp", '#include <erfa.h>\n'),
    ("tests/tools/b_test.cpp", '#include "drivers/a.h"\n#include "tests/support/fakes.h"\n'),
]


class CheckLayers(unittest.TestCase):
    def check(self, *extra):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in [*GOOD.items(), *extra]:
                path = pathlib.Path(folder) / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            done = subprocess.run([sys.executable, str(CHECK), folder], capture_output=True,
                                  text=True, check=False)
            return done.returncode, done.stdout

    def test_a_good_tree_has_no_complaints(self):
        self.assertEqual(self.check(), (0, f"{len(GOOD)} files, 0 complaints\n"))

    def test_every_planted_violation_is_found_where_it_stands(self):
        for name, text, complaint in BAD:
            with self.subTest(file=name, text=text):
                code, out = self.check((name, text))
                self.assertEqual(code, 1, out)
                self.assertIn(complaint, out)
                self.assertTrue(out.startswith(name + ":"), out)
                self.assertIn(" 1 complaints", out)

    def test_what_is_allowed_or_commented_out_is_left_alone(self):
        for name, text in HARMLESS:
            with self.subTest(file=name, text=text):
                code, out = self.check((name, text))
                self.assertEqual(code, 0, out)

    def test_an_empty_tree_is_a_mistake_not_a_success(self):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, str(CHECK), folder], capture_output=True,
                                  text=True, check=False)
            self.assertEqual(done.returncode, 1)


if __name__ == "__main__":
    unittest.main()
