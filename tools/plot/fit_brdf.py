# The picture of `starloop fit-brdf`: measured points and the fit within the plane of incidence, and
# how far each point of the whole table is off.
"""fit_brdf.py FOLDER: draws fit.csv and fit_curves.csv of it as fit.png."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pointing_error import GREY, STYLE, X, Y

MOST_CUTS = 8


def points_of(path):
    """theta_in, in-plane angle (nan out of the plane), value, sigma, model."""
    with path.open() as file:
        reader = csv.DictReader(file)
        polar = "azimuth_deg" in reader.fieldnames
        rows = []
        for row in reader:
            if polar:
                azimuth = abs(float(row["azimuth_deg"])) % 360
                out = float(row["theta_out_deg"])
                in_plane = {0.0: out, 180.0: -out}.get(azimuth, out if out == 0 else np.nan)
            else:
                beside = float(row["out_of_plane_deg"])
                in_plane = float(row["in_plane_deg"]) if beside == 0 else np.nan
            rows.append([float(row["theta_in_deg"]), in_plane, float(row["brdf_per_sr"]),
                         float(row["sigma_per_sr"]), float(row["model_per_sr"])])
    return np.array(rows)


def draw_cut(axes, theta, points, curve):
    axes.plot(curve[:, 1] - theta, curve[:, 2], color=Y, lw=1.2, zorder=3, label="fit")
    if len(points):
        axes.errorbar(points[:, 1] - theta, points[:, 2], yerr=points[:, 3], fmt="o", ms=2.6, lw=0.8,
                      color=X, label="measured")
    axes.set_yscale("log")
    axes.set_title(f"light from {theta:g}°", loc="left", fontsize=10)
    # A lobe is a degree wide, and the rest of the sky a hundred.
    axes.set_xscale("symlog", linthresh=1.0, linscale=0.6)
    axes.set_xlim(-170, 170)
    ticks = [-90, -10, -1, 0, 1, 10, 90]
    axes.set_xticks(ticks, [f"{t}" for t in ticks])
    axes.minorticks_off()


def draw_residuals(axes, points):
    points = points[points[:, 4] > 0]
    pull = (points[:, 2] - points[:, 4]) / np.where(points[:, 3] > 0, points[:, 3], np.inf)
    in_plane = np.isfinite(points[:, 1])
    order = np.arange(len(points))
    axes.plot(order[in_plane], pull[in_plane], "o", ms=2.4, color=X, label="in the plane")
    axes.plot(order[~in_plane], pull[~in_plane], "o", ms=2.4, color=Y, label="out of it")
    starts = np.flatnonzero(np.diff(points[:, 0], prepend=-1))
    for start in starts:
        axes.axvline(start - 0.5, color="#9aa3af", lw=0.6)
    axes.set_xticks(starts, [f"{points[s, 0]:g}°" for s in starts])
    axes.set_ylim(-1.1 * max(3.5, np.abs(pull).max(initial=0)),
                  1.1 * max(3.5, np.abs(pull).max(initial=0)))
    axes.set_xlim(-0.5, max(1, len(points)) - 0.5)
    axes.set_xlabel("points in the file's order, by the light's incidence")
    axes.set_ylabel("measured - fit, sigmas")
    axes.legend(frameon=False, fontsize=9, ncols=2, loc="upper right")


def main():
    folder = Path(sys.argv[1])
    points = points_of(folder / "fit.csv")
    points = points[np.argsort(points[:, 0], kind="stable")]
    with (folder / "fit_curves.csv").open() as file:
        curves = np.array([[float(v) for v in row.values()] for row in csv.DictReader(file)])
    thetas = np.unique(curves[:, 0])
    if len(thetas) > MOST_CUTS:
        thetas = thetas[np.linspace(0, len(thetas) - 1, MOST_CUTS).round().astype(int)]
    plt.rcParams.update(STYLE)
    columns = min(4, len(thetas))
    rows = -(-len(thetas) // columns)
    figure = plt.figure(figsize=(11, 2.7 * rows + 2.8))
    grid = figure.add_gridspec(rows + 1, columns)
    first = None
    for i, theta in enumerate(thetas):
        axes = figure.add_subplot(grid[i // columns, i % columns], sharex=first, sharey=first)
        first = first or axes
        cut = points[(points[:, 0] == theta) & np.isfinite(points[:, 1])]
        draw_cut(axes, theta, cut, curves[curves[:, 0] == theta])
        if i % columns == 0:
            axes.set_ylabel("BRDF, 1/sr")
        if i // columns == rows - 1 or i + columns >= len(thetas):
            axes.set_xlabel("off the mirror, in plane, deg")
    seen = np.concatenate([points[points[:, 2] > 0, 2], curves[curves[:, 2] > 0, 2]])
    first.set_ylim(0.4 * max(seen.min(), seen.max() * 1e-6), 3 * seen.max())
    first.legend(frameon=False, fontsize=9, loc="lower center")
    draw_residuals(figure.add_subplot(grid[rows, :]), points)
    figure.tight_layout()
    figure.savefig(folder / "fit.png", dpi=110)


if __name__ == "__main__":
    main()
