#!/usr/bin/env python3
# Draws contact_sheet.png and pointing_error.png into a run's folder, from its tables and pictures.
# Needs matplotlib and numpy only. Call: run_report.py FOLDER [OTHER_FOLDER]
"""Two pictures of a run: what the camera saw and how well it was pointed."""

import csv
import json
import re
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # no __pycache__ next to the sources

COLUMNS = (
    "frame time_s range_km phase_deg target_u_px target_v_px photocentre_u_px photocentre_v_px "
    "tracker_u_px tracker_v_px error_u_px error_v_px trim_x_urad trim_y_urad"
).split()
DEFAULT_IFOV_RAD = 6.5e-6 / 4.5


class Unusable(Exception):
    """A folder that nothing can be drawn from; its text is all that the user needs to see."""


def number(text):
    """A cell as a float: a cut-off last row must not cost the plot of all others."""
    try:
        return float(text)
    except (TypeError, ValueError):
        return float("nan")


class Run:
    """A run's folder in memory; both drawings see only this, never the files' layout."""

    def __init__(self, folder):
        self.folder = Path(folder)
        if not self.folder.is_dir():
            raise Unusable(f"{folder}: no such folder")
        for read, name in (self._read_frames, "frames.csv"), (self._read_report, "report.json"):
            try:
                read(self.folder / name)
            except OSError as e:
                raise Unusable(f"{self.folder / name}: {e.strerror}") from e
            except (ValueError, csv.Error) as e:
                raise Unusable(f"{self.folder / name}: {e}") from e
        self.time_s = self.time_s - self.time_s[0]
        self.pictures = self._find_pictures()

    def _read_frames(self, path):
        """Each column becomes an attribute of its name."""
        with open(path, newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [c for c in COLUMNS if c not in (reader.fieldnames or [])]
            if missing:
                raise ValueError(f"no column {', '.join(missing)}")
            rows = [[number(row[c]) for c in COLUMNS] for row in reader]
        table = np.array(rows, dtype=float).reshape(-1, len(COLUMNS))
        table = table[np.isfinite(table[:, :3]).all(axis=1) & (table[:, 2] > 0)]  # up to range_km
        if len(table) == 0:
            raise ValueError("no frames")
        for name, values in zip(COLUMNS, table.T):
            setattr(self, name, values)

    def _read_report(self, path):
        with open(path, encoding="utf-8") as file:
            report = json.load(file)
        if not isinstance(report, dict):
            raise ValueError("not a report")
        self.scenario = str(report.get("scenario", "run"))
        self.open_loop = report.get("open_loop") is True
        self.passage = self._section(report, "pass")
        self.pointing = self._section(report, "pointing")
        self.ifov_rad = self.figure(self._section(report, "camera"), "ifov_rad") or DEFAULT_IFOV_RAD

    @staticmethod
    def _section(report, key):
        return report[key] if isinstance(report.get(key), dict) else {}

    @staticmethod
    def figure(section, key):
        """The finite number under key, else None: a report of an odd run may hold null."""
        value = section.get(key)
        good = isinstance(value, (int, float)) and not isinstance(value, bool)
        return float(value) if good and np.isfinite(value) else None

    def _find_pictures(self):
        """Row of the table -> path of that frame's picture, for frames that have one."""
        by_frame = {}
        for path in self.folder.glob("frame_*.png"):
            found = re.fullmatch(r"frame_(\d+)\.png", path.name)
            if found:
                by_frame[int(found.group(1))] = path
        return {i: by_frame[int(f)] for i, f in enumerate(self.frame) if int(f) in by_frame}

    @property
    def boresight_px(self):
        """Where the camera points in the picture, as the table implies it."""
        both = []
        for axis in "uv":
            centre = getattr(self, f"photocentre_{axis}_px") - getattr(self, f"error_{axis}_px")
            centre = centre[np.isfinite(centre)]
            both.append(float(np.median(centre)) if len(centre) else 512.0)
        return both

    @property
    def closest_km(self):
        """Between two frames the pass may come closer than in any."""
        return self.figure(self.passage, "min_range_km") or float(self.range_km.min())

    @property
    def closest_s(self):
        at, start = (self.figure(self.passage, k) for k in ("closest_s", "start_s"))
        known = at is not None and start is not None
        return at - start if known else float(self.time_s[self.range_km.argmin()])


def main(arguments):
    if len(arguments) not in (1, 2):
        raise Unusable("call: run_report.py FOLDER [OTHER_FOLDER]")
    run = Run(arguments[0])
    other = Run(arguments[1]) if len(arguments) == 2 else None
    if other and other.open_loop == run.open_loop:
        print("run_report.py: one run should be with commands and one without (--open-loop); "
              f"{other.folder} is left out", file=sys.stderr)
        other = None
    pointing_error.draw(run, other, run.folder / "pointing_error.png")
    if not contact_sheet.draw(run, run.folder / "contact_sheet.png"):
        print("run_report.py: no picture of the target, so no contact sheet", file=sys.stderr)


if __name__ == "__main__":
    try:  # the imports too: without matplotlib, one line is to say so
        import matplotlib

        matplotlib.use("Agg")
        import numpy as np

        import contact_sheet
        import pointing_error

        main(sys.argv[1:])
    except (Unusable, OSError, ValueError, csv.Error, ImportError) as e:
        print(f"run_report.py: {e}", file=sys.stderr)
        sys.exit(2)
