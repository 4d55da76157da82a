# The picture of `starloop orbits`: figure 8 of Li et al. 2023, how far each model of motion is from
# a reference, over a day and over the whole span.
"""orbits.py FILE.csv: draws FILE.png."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pointing_error import STYLE

COLOURS = {"two-body": "#0072B2", "j2": "#D55E00", "ephemeris": "#00795A"}
DAY_S = 86400.0
LEAST_M = 1e-9  # what is less than this is drawn there


def draw(axes, table, unit_s, last_s):
    for (body, model), points in sorted(table.items()):
        points = points[points[:, 0] <= last_s]
        points = points[np.argsort(points[:, 0])]
        few = "o" if len(points) < 50 else None
        axes.plot(points[:, 0] / unit_s, np.maximum(points[:, 1], LEAST_M),
                  "-" if body == "camera" else "--", marker=few, markersize=3,
                  color=COLOURS[model], label=f"{body}, {model}")
    axes.set_yscale("log")
    axes.set_xlim(0, last_s / unit_s)


def main():
    path = Path(sys.argv[1])
    table = {}
    with path.open() as file:
        for row in csv.DictReader(file):
            key = (row["body"], row["model"])
            table.setdefault(key, []).append((float(row["t_s"]), float(row["error_m"])))
    table = {key: np.array(points) for key, points in table.items()}
    last_s = max((points[:, 0].max() for points in table.values()), default=DAY_S)
    plt.rcParams.update(STYLE)
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.3), sharey=True)
    draw(left, table, 3600.0, min(DAY_S, last_s))
    draw(right, table, DAY_S, last_s)
    left.set_xlabel("hours after the epoch")
    right.set_xlabel("days after the epoch")
    left.set_ylabel("error of the place, m")
    left.set_title("the first day", loc="left", fontsize=10.5)
    right.set_title("the whole span", loc="left", fontsize=10.5)
    if table:
        right.legend(frameon=False, fontsize=9)
    figure.tight_layout()
    figure.savefig(path.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
