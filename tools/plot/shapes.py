# Meshes as `starloop shapes` wrote them, after figure 4 of Li et al. 2023: each shape with its
# triangles, and below it how good they are.
"""shapes.py FOLDER/shapes.csv: draws FOLDER/shapes.png."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from pointing_error import GREY, STYLE

FACE = np.array([0.62, 0.75, 0.88])
LIGHT = np.array([0.35, -0.5, 0.8]) / np.linalg.norm([0.35, -0.5, 0.8])


def read_obj(path):
    places, corners = [], []
    for line in path.read_text().splitlines():
        word, *rest = line.split()
        if word == "v":
            places.append([float(x) for x in rest])
        elif word == "f":
            corners.append([int(x) - 1 for x in rest])
    return np.array(places), np.array(corners)


def draw_body(axis, places, corners):
    faces = places[corners]
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    shade = 0.55 + 0.45 * np.clip(normal @ LIGHT, 0, 1)
    colours = np.clip(FACE * shade[:, None] / 0.9, 0, 1)
    axis.add_collection3d(Poly3DCollection(faces, facecolors=colours, edgecolors="#22405e",
                                           linewidths=0.45))
    reach = 0.74 * np.linalg.norm(places, axis=1).max()
    for limits in (axis.set_xlim, axis.set_ylim, axis.set_zlim):
        limits(-reach, reach)
    axis.set_box_aspect((1, 1, 1), zoom=1.2)
    axis.view_init(elev=28, azim=-38)
    axis.set_axis_off()


def draw_region(axis, places, corners):
    axis.tripcolor(places[:, 0], places[:, 1], corners, facecolors=np.ones(len(corners)),
                   cmap=matplotlib.colors.ListedColormap([FACE]))
    axis.triplot(places[:, 0], places[:, 1], corners, color="#22405e", linewidth=0.6)
    axis.set_aspect("equal")
    axis.set_axis_off()


def draw_quality(axis, row, bins):
    counts = np.array([int(row[f"bin_{i}"]) for i in range(bins)])
    share = 100 * counts / max(counts.sum(), 1)
    axis.bar((np.arange(bins) + 0.5) / bins, share, width=0.9 / bins, color="#4292c6")
    axis.axvline(float(row["smallest_quality"]), color="#D55E00", linewidth=1.2)
    axis.text(0.04, 0.93, f"{row['triangles']} triangles\nleast {float(row['smallest_quality']):.2f}"
              f", mean {float(row['mean_quality']):.2f}\nup to "
              f"{float(row['off_m']) / float(row['edge_m']):.2g} edges off",
              transform=axis.transAxes, va="top", fontsize=9, color="#222222")
    axis.set_xlim(0, 1)
    axis.set_ylim(0, 100)
    axis.set_xlabel("radius ratio, 2 r / R")
    axis.grid(axis="y", color="#e3e7ec", linewidth=0.7)
    axis.set_axisbelow(True)


def main():
    table = Path(sys.argv[1])
    with table.open() as file:
        rows = list(csv.DictReader(file))
    bins = sum(name.startswith("bin_") for name in rows[0])
    plt.rcParams.update(STYLE)
    figure = plt.figure(figsize=(3.2 * len(rows), 6.0), layout="constrained")
    grid = figure.add_gridspec(2, len(rows), height_ratios=[1.45, 1])
    for i, row in enumerate(rows):
        places, corners = read_obj(table.parent / f"{row['name']}.obj")
        flat = np.ptp(places[:, 2]) == 0
        axis = figure.add_subplot(grid[0, i], projection=None if flat else "3d")
        (draw_region if flat else draw_body)(axis, places, corners)
        wrong = row["name"].endswith("_truss")
        axis.set_title(f"{'abcdefgh'[i]}  {row['title']}"
                       + (": its edges are cut off" if wrong else ""),
                       loc="left", fontsize=11, color="#D55E00" if wrong else "#222222")
        below = figure.add_subplot(grid[1, i])
        draw_quality(below, row, bins)
        if i == 0:
            below.set_ylabel("triangles, %")
        else:
            below.set_yticklabels([])
    figure.savefig(table.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
