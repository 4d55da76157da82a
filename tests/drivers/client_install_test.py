#!/usr/bin/env python3
"""Installs the client below a prefix of its own and builds an example against that alone, by
pkg-config and by find_package: client_install_test.py build-folder cmake python-or-empty."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

BUILD, CMAKE, PYTHON = sys.argv[1:4]
del sys.argv[1:]
EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "tools" / "examples" / "tracker.c"

PROJECT = f"""cmake_minimum_required(VERSION 3.25)
project(elsewhere LANGUAGES C)
find_package(StarloopClient REQUIRED)
foreach(kind IN ITEMS shared static)
  add_executable(by_${{kind}} {EXAMPLE})
  target_link_libraries(by_${{kind}} PRIVATE starloop_client::${{kind}} m)
endforeach()
"""


def run(*words, **environment):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True,
                          check=False, env={**os.environ, **environment})


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.prefix = pathlib.Path(cls.folder.name) / "prefix"
        done = run(CMAKE, "--install", BUILD, "--component", "client", "--prefix", cls.prefix)
        assert done.returncode == 0, done.stdout + done.stderr
        cls.library = next(cls.prefix.rglob("libstarloop_client.so")).parent

    def succeed(self, *words, **environment):
        done = run(*words, **environment)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def expect_runs(self, program):
        done = run(program, "a/b", LD_LIBRARY_PATH=str(self.library))
        self.assertEqual(done.returncode, 1)
        self.assertIn('"a/b" is no name of a link', done.stderr)

    def test_the_header_is_alone_and_names_nothing_of_ours(self):
        headers = list((self.prefix / "include").rglob("*"))
        self.assertEqual([header.name for header in headers], ["starloop_client.h"])
        for language in ("c", "c++"):
            self.succeed("cc", "-x", language, "-Wall", "-Wextra", "-Werror", "-fsyntax-only",
                         headers[0])

    def test_an_example_builds_by_pkg_config(self):
        flags = self.succeed("pkg-config", "--cflags", "--libs", "starloop-client",
                             PKG_CONFIG_PATH=str(self.library / "pkgconfig")).split()
        program = pathlib.Path(self.folder.name) / "by_pkg_config"
        self.succeed("cc", "-O2", EXAMPLE, "-o", program, *flags, "-lm")
        self.expect_runs(program)

    def test_an_example_builds_by_find_package(self):
        source = pathlib.Path(self.folder.name) / "project"
        source.mkdir()
        (source / "CMakeLists.txt").write_text(PROJECT, encoding="utf-8")
        self.succeed(CMAKE, "-G", "Ninja", "-S", source, "-B", source / "build",
                     f"-DCMAKE_PREFIX_PATH={self.prefix}")
        self.succeed(CMAKE, "--build", source / "build")
        for kind in ("shared", "static"):
            self.expect_runs(source / "build" / f"by_{kind}")

    @unittest.skipIf(not PYTHON, "no Python with numpy")
    def test_the_python_module_finds_the_library_of_its_own_prefix(self):
        module = next(self.prefix.rglob("starloop_client.py"))
        out = self.succeed(PYTHON, "-c", "import starloop_client as s; print(s._library._name)",
                           PYTHONPATH=str(module.parent), PYTHONDONTWRITEBYTECODE="1",
                           STARLOOP_CLIENT_LIBRARY="")
        self.assertTrue(out.startswith(str(self.prefix.resolve())), out)


if __name__ == "__main__":
    unittest.main()
