#!/usr/bin/env python3
"""Keeps the rooms in order: a room includes only rooms to its left, in the order of ROOMS; a
third-party header is included by its one owner; and #include "..." starts at the repository's root.
Tests stand where what they test stands; those of engine/ are one program and see all of it.

    tools/check_layers.py [root]

Prints file:line and what is wrong with it, and ends with 1 when there is anything."""

import pathlib
import re
import sys

ROOMS = ["core", "orbit", "scene", "render", "optics", "detector", "engine", "hil", "drivers",
         "tools"]
RANK = {room: rank for rank, room in enumerate(ROOMS)}
FOLDERS = ["engine", "hil", "drivers", "tools", "tests"]
SUFFIXES = {".h", ".cpp"}

# Start of the header's path -> the rooms that may include it.
OWNERS = [
    ("embree", {"render", "tools"}),  # tools: the yardstick of the benchmark
    ("erfa", {"orbit"}),
    ("toml++/", {"core"}),
    ("toml.hpp", {"core"}),
    ("fitsio", {"core"}),
    ("Random123/", {"core"}),
    ("tiny_obj_loader", {"scene"}),
    ("unsupported/Eigen/FFT", {"optics"}),
    ("fftw3", {"optics"}),
    ("asio", {"hil", "tools"}),
    ("boost/asio", {"hil", "tools"}),
    ("openssl/", {"hil"}),
    ("libusb", {"drivers"}),
    ("linux/videodev2", {"drivers"}),
    ("linux/usb/", {"drivers"}),
    ("linux/aio_abi", {"drivers"}),
    ("opencv2/", {"tools"}),
    ("spdlog/", {"tools"}),
    ("CLI/", {"tools"}),
]

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def room_of(path):
    """The room that a file belongs to: nothing for tests/support, which serves all tests."""
    parts = path.split("/")
    if parts[0] == "tests":
        parts = parts[1:]
        if parts[0] not in ("engine", "hil", "drivers", "tools"):
            return None
    if parts[0] == "engine":
        return parts[1] if len(parts) > 2 and parts[1] in RANK else "engine"
    return parts[0] if parts[0] in RANK else None


def layer_of(path):
    """The room whose includes a file may have."""
    if path.startswith("tests/engine/"):
        return "engine"
    return room_of(path)


def includes_of(text):
    """(line, opening bracket, path) of each #include outside comments."""
    text = re.sub(r"/\*.*?\*/", lambda m: "\n" * m.group().count("\n"), text, flags=re.S)
    for number, line in enumerate(text.split("\n"), start=1):
        match = INCLUDE.match(line)
        if match:
            yield number, match.group(1), match.group(2)


def owners_of(header):
    for start, rooms in OWNERS:
        if header.startswith(start):
            return rooms
    return None


class Tree:
    def __init__(self, root):
        self.root = root
        self.files = {}
        for folder in FOLDERS:
            for path in sorted((root / folder).rglob("*")):
                if path.suffix in SUFFIXES and path.is_file():
                    name = path.relative_to(root).as_posix()
                    self.files[name] = list(includes_of(path.read_text(encoding="utf-8")))

    def rooms_behind(self, name, seen):
        """The rooms that a header of tests/support brings along, itself or through others."""
        room = room_of(name)
        if room is not None:
            return {room}
        rooms = set()
        if name not in seen:
            seen.add(name)
            for _, bracket, header in self.files.get(name, []):
                if bracket == '"':
                    rooms |= self.rooms_behind(header, seen)
        return rooms

    def complaints(self):
        for name, includes in self.files.items():
            room = layer_of(name)
            is_test = name.startswith("tests/")
            for line, bracket, header in includes:
                where = f"{name}:{line}: "
                if bracket == '"':
                    yield from (where + c for c in self.own(name, room, is_test, header))
                elif header in self.files:
                    yield where + f'<{header}> is ours: write "{header}"'
                yield from (where + c for c in foreign(room_of(name), header))

    def own(self, name, room, is_test, header):
        if not (self.root / header).is_file():
            beside = (self.root / name).parent / header
            if beside.is_file():
                right = beside.resolve().relative_to(self.root).as_posix()
                yield f'"{header}" does not start at the repository\'s root: write "{right}"'
            else:
                yield f'"{header}" is no file of the repository; <> is for what is not ours'
            return
        if ".." in pathlib.PurePosixPath(header).parts or header.startswith("./"):
            yield f'"{header}" does not start at the repository\'s root'
            return
        if header.startswith("tests/") and not is_test:
            yield f'{name.split("/")[0]} includes "{header}": the product knows no tests'
            return
        if room is None:
            return
        for other in sorted(self.rooms_behind(header, set()), key=RANK.get):
            if RANK[other] > RANK[room]:
                yield (f'{"a test of " if is_test else ""}{room} includes "{header}": '
                       f"{other} is to the right of {room} (" + " < ".join(ROOMS) + ")")


def foreign(room, header):
    owners = owners_of(header)
    if owners is None or room is None:
        return
    if room not in owners:
        yield f"{room} includes <{header}>: it belongs to {', '.join(sorted(owners))} alone"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else __file__).resolve()
    if root.is_file():
        root = root.parents[1]
    tree = Tree(root)
    if not tree.files:
        print(f"{root}: no sources here", file=sys.stderr)
        return 1
    complaints = list(tree.complaints())
    for complaint in complaints:
        print(complaint)
    print(f"{len(tree.files)} files, {len(complaints)} complaints")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
