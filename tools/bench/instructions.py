#!/usr/bin/env python3
"""Counts the instructions of the hot loops under callgrind, and compares them with a reference.

    tools/bench/instructions.py [--update] [build/release/hot_loops]

Ends with 1 where a stage takes over 5 % more than tests/data/instructions.csv says or the loops fail,
and with 77 where nothing can be said: no valgrind, or another compiler, library or processor than
the reference's. --update writes the reference anew."""

import os
import pathlib
import platform
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "tests/data/instructions.csv"
TOLERANCE = 0.05
SKIPPED = 77
# What valgrind shows of a processor and the loops choose their path by; it has no AVX-512.
FLAGS = ["sse4_2", "avx", "f16c", "fma", "avx2", "bmi1", "bmi2", "abm", "erms"]


class CannotCount(Exception):
    pass


class Broken(Exception):
    pass


def output_of(*command):
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except OSError as error:
        raise CannotCount(f"{command[0]} does not run: {error}") from error
    except subprocess.CalledProcessError as error:
        raise Broken(f"{command[0]} fails: {error}") from error


def machine_of(program):
    """What the counts depend on besides the code."""
    if not os.access(program, os.X_OK):
        raise Broken(f"{program} is no program: build it")
    cpu = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
    has = set(re.findall(r"^flags\s*:(.*)$", cpu, re.M)[0].split()) if "flags" in cpu else set()
    vendor = re.search(r"^vendor_id\s*:\s*(\S+)", cpu, re.M)
    machine = {
        "valgrind": output_of("valgrind", "--version").strip(),
        "built with": " ".join(output_of(program, "--built-with").split()),
        "libm": " ".join(platform.libc_ver()),
    }
    libraries = dict(re.findall(r"(\S+) => (\S+)", output_of("ldd", program)))
    for name in ("embree", "tbb"):
        paths = [path for library, path in libraries.items() if library.startswith("lib" + name)]
        machine[name] = " ".join(os.path.basename(os.path.realpath(path)) for path in paths)
    machine["processor"] = " ".join(
        [vendor.group(1) if vendor else platform.machine()] + [f for f in FLAGS if f in has])
    return machine


def on_one_core():
    """Threads of libraries that wait by turning would be counted."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def count(program):
    """stage -> instructions"""
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", "--instr-atstart=no",
             f"--callgrind-out-file={folder}/out", program],
            capture_output=True, text=True, preexec_fn=on_one_core, check=False)
        if run.returncode != 0:
            raise Broken(f"{program} fails: under valgrind it ends with {run.returncode}:\n"
                         f"{run.stderr[-2000:]}")
        stages = {}
        for dump in sorted(pathlib.Path(folder).iterdir()):
            text = dump.read_text(encoding="utf-8")
            stage = re.search(r"^desc: Trigger: Client Request: (\w+)$", text, re.M)
            if stage:
                total = int(re.search(r"^totals: (\d+)", text, re.M).group(1))
                stages[stage.group(1)] = stages.get(stage.group(1), 0) + total
    return stages


def read_reference():
    machine, stages = {}, {}
    if not REFERENCE.exists():
        raise Broken(f"{REFERENCE} is missing: --update writes it")
    for line in REFERENCE.read_text(encoding="utf-8").splitlines():
        if line.startswith("# ") and ": " in line:
            key, value = line[2:].split(": ", 1)
            machine[key] = value
        elif "," in line and not line.startswith(("#", "stage,")):
            stage, _, instructions = line.partition(",")
            if not (instructions.isdigit() and int(instructions) > 0):
                raise Broken(f"{REFERENCE}: expected stage,instructions, found {line!r}")
            stages[stage] = int(instructions)
    return machine, stages


def write_reference(machine, stages):
    lines = ["# regenerate: tools/bench/instructions.py --update"]
    lines += [f"# {key}: {value}" for key, value in machine.items()]
    lines += ["stage,instructions"] + [f"{stage},{n}" for stage, n in stages.items()]
    REFERENCE.write_text("\n".join(lines) + "\n", encoding="utf-8")


def compare(reference, found):
    """Whether no stage takes more than it may."""
    good = reference.keys() == found.keys()
    if not good:
        print(f"the stages are {', '.join(found)}; the reference has {', '.join(reference)}")
    for stage in (s for s in reference if s in found):
        ratio = found[stage] / reference[stage]
        note = ""
        if ratio > 1 + TOLERANCE:
            good, note = False, "  MORE than 5 % over the reference"
        elif ratio < 1 - TOLERANCE:
            note = "  the reference may be lowered: tools/bench/instructions.py --update"
        print(f"{stage:10} reference {reference[stage]:12} found {found[stage]:12} "
              f"ratio {ratio:.4f}{note}")
    return good


def main(arguments):
    update = "--update" in arguments
    paths = [a for a in arguments if a != "--update"]
    program = paths[0] if paths else str(ROOT / "build/release/hot_loops")
    try:
        machine = machine_of(program)
        if not update:
            expected, reference = read_reference()
            for key, value in machine.items():
                if expected.get(key) != value:
                    raise CannotCount(f"{key} is '{value}', the reference's '{expected.get(key)}'")
        found = count(program)
    except CannotCount as error:
        print(f"skipped: {error}")
        return SKIPPED
    except Broken as error:
        print(error)
        return 1
    if update:
        write_reference(machine, found)
        return 0
    return 0 if compare(reference, found) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
