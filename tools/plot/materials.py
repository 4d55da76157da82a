# The picture of `starloop materials`: how each surface scatters within the plane of incidence, and
# what share of light it sends back.
"""materials.py FOLDER: draws albedo.csv and lobes.csv of it as materials.png."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pointing_error import GREY, LIMIT, STYLE, X

COLOURS = ["#0072B2", "#00795A", "#D55E00", "#8A3F75"]  # by incidence, rising
DECADES = 5  # drawn below the brightest


def read(path, keys):
    """{first key: {...: rows of numbers}} of a table whose first columns are `keys`."""
    table = {}
    with path.open() as file:
        for row in csv.DictReader(file):
            place = table
            for key in keys[:-1]:
                place = place.setdefault(row[key], {})
            numbers = [float(v) for k, v in row.items() if k not in keys]
            place.setdefault(row[keys[-1]], []).append(numbers)
    return table


def main():
    folder = Path(sys.argv[1])
    albedos = read(folder / "albedo.csv", ["material"])
    lobes = read(folder / "lobes.csv", ["material", "theta_in_deg"])
    plt.rcParams.update(STYLE)
    rows = max(1, len(albedos))
    figure, axes = plt.subplots(rows, 2, figsize=(11, 2.9 * rows + 0.5), squeeze=False,
                                gridspec_kw={"width_ratios": [1.7, 1]})
    for (lobe, share), (name, numbers) in zip(axes, albedos.items()):
        top = 1e-9
        low = np.inf
        for (theta, points), colour in zip(lobes[name].items(), COLOURS):
            points = np.array(points)
            lobe.plot(points[:, 0], points[:, 1], color=colour, lw=1.3, label=f"{float(theta):g}°")
            lobe.axvline(float(theta), color=colour, lw=0.7, ls=":")
            top = max(top, points[:, 1].max())
            low = min(low, points[points[:, 1] > 0, 1].min(initial=np.inf))
        lobe.set_yscale("log")
        lobe.set_ylim(max(0.5 * low, top * 10**-DECADES), 3 * top)
        lobe.set_xlim(-90, 90)
        lobe.set_xticks(range(-90, 91, 30))
        lobe.set_ylabel("BRDF, 1/sr")
        lobe.set_title(name, loc="left", fontsize=11, fontweight="bold")
        numbers = np.array(numbers)
        share.plot(numbers[:, 0], numbers[:, 2], color=GREY, lw=1.2, ls="--",
                   label="as printed, or measured")
        share.plot(numbers[:, 0], numbers[:, 1], color=X, lw=1.6, label="in use")
        share.axhline(1, color=LIMIT, lw=0.9)
        share.set_xlim(0, 90)
        share.set_ylim(0, 1.15)
        share.set_xticks(range(0, 91, 15))
        share.set_ylabel("albedo")
    axes[0, 0].legend(frameon=False, fontsize=9, title="light from", title_fontsize=9, ncols=2)
    axes[0, 1].legend(frameon=False, fontsize=9, loc="center left")
    axes[-1, 0].set_xlabel("leaves at, degrees within the plane of incidence (dotted: the mirror)")
    axes[-1, 1].set_xlabel("light from, degrees off the normal")
    figure.tight_layout()
    figure.savefig(folder / "materials.png", dpi=110)


if __name__ == "__main__":
    main()
