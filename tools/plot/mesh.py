# The picture of `starloop mesh`: the body from five sides, with the edges that are no part of a
# closed surface.
"""mesh.py FILE_views.json FILE.png: draws it from FILE_views.json and FILE_views.png."""

import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pointing_error import GREY, STYLE

OPEN, MANY = "#D00000", "#B000B0"
MOST_NAMES = 9
SHORTEST = 0.004  # of a view's side: an edge below that is drawn as a dot


def axis_name(direction):
    """"y", "-x", or nothing for a slanted one."""
    for name, part in zip("xyz", direction):
        if abs(abs(part) - 1.0) < 1e-9:
            return ("-" if part < 0 else "") + name
    return ""


def draw_edges(axes, view):
    lines = np.array(view["lines"], dtype=float).reshape(-1, 6)
    for is_open, colour in ((0, MANY), (1, OPEN)):
        for hidden in (1, 0):
            of_kind = lines[(lines[:, 4] == is_open) & (lines[:, 5] == hidden)]
            ends = of_kind[:, :4].reshape(-1, 2, 2)
            alpha = 0.15 if hidden else 1.0
            axes.add_collection(LineCollection(ends, colors=colour, linewidths=1.1, alpha=alpha))
            short = np.hypot(*(ends[:, 1] - ends[:, 0]).T) < SHORTEST * view["side_m"]
            middle = ends[short].mean(axis=1)
            axes.plot(middle[:, 0], middle[:, 1], "o", markersize=2.5, color=colour, alpha=alpha)


def draw_axes_cross(axes, view):
    """The body's axes from its origin, a fifth of the view long."""
    length = 0.2 * view["side_m"]
    for name, across, along in zip("xyz", view["right"], view["up"]):
        if np.hypot(across, along) < 1e-6:
            continue
        axes.annotate("", (across * length, along * length), (0, 0),
                      arrowprops={"arrowstyle": "->", "color": "#202020", "linewidth": 0.9})
        axes.text(1.15 * across * length, 1.15 * along * length, name, fontsize=9, ha="center",
                  va="center", color="#202020")


def draw_view(axes, view, picture):
    (left, low), side = view["low_m"], view["side_m"]
    axes.imshow(picture, extent=(left, left + side, low, low + side), interpolation="antialiased")
    draw_edges(axes, view)
    if left < 0 < left + side and low < 0 < low + side:
        draw_axes_cross(axes, view)
    axes.set_xlim(left, left + side)
    axes.set_ylim(low, low + side)
    axes.set_title(view["title"], loc="left", fontsize=10.5)
    right, up = axis_name(view["right"]), axis_name(view["up"])
    for name, tell in ((right, axes.set_xlabel), (up, axes.set_ylabel)):
        if name:
            tell(f"{name}, m")
    if right.startswith("-"):
        ticks = axes.get_xticks()
        axes.set_xticks(ticks, [f"{-t:g}" if t else "0" for t in ticks])
        axes.set_xlim(left, left + side)
        axes.set_xlabel(f"{right[1:]}, m")
    if not right and not up:
        axes.set_xticks([])
        axes.set_yticks([])


def words(report):
    size = [high - low for low, high in zip(report["low_m"], report["high_m"])]
    told, mended = report["told"], report["mended"]
    left_out = sum(defect["count"] for defect in report["left_out"].values())
    return "\n".join([
        f"{Path(report['mesh']).name}: {report['triangles']} triangles",
        " x ".join(f"{s:.4g}" for s in size) + " m",
        f"area {report['area_m2']:.4g} m2",
        f"{report['closed_pieces']} of {report['pieces']} pieces closed, "
        f"{report['volume_m3']:.4g} m3",
        f"{left_out} of {report['file']['faces']} faces left out",
        f"{mended['flipped']['count']} turned round, {mended['welded_vertices']} vertices welded",
        f"{told['open_edges']['count']} open edges, "
        f"{told['non_manifold_edges']['count']} of over two faces",
        f"{told['t_junctions']['count']} vertices in the middle of an open edge",
    ])


def draw_legend(axes, report):
    axes.axis("off")
    axes.text(0, 1, words(report), transform=axes.transAxes, va="top", fontsize=9.5,
              linespacing=1.5)
    handles = []
    for i, material in enumerate(report["materials"][:MOST_NAMES]):
        colour = np.array(report["colours"][i % len(report["colours"])]) / 255.0
        handles.append(Patch(color=colour,
                             label=f"{material['name'][:32]}, {material['area_m2']:.3g} m2"))
    if len(report["materials"]) > MOST_NAMES:
        handles.append(Patch(color="none",
                             label=f"and {len(report['materials']) - MOST_NAMES} more"))
    for defect, colour, label in (("open_edges", OPEN, "open edge; faint: hidden"),
                                  ("non_manifold_edges", MANY, "edge of over two faces")):
        if report["told"][defect]["count"]:
            handles.append(Line2D([], [], color=colour, label=label))
    axes.legend(handles=handles, loc="lower left", frameon=False, fontsize=9,
                bbox_to_anchor=(-0.03, -0.05))


def main():
    path = Path(sys.argv[1])
    report = json.loads(path.read_text(errors="replace"))
    views = report["views"]
    strip = plt.imread(path.with_suffix(".png"))
    plt.rcParams.update(STYLE)
    figure, grid = plt.subplots(2, 3, figsize=(13, 8.8))
    for axes, view, picture in zip(grid.flat, views, np.split(strip, len(views), axis=1)):
        draw_view(axes, view, picture)
        axes.grid(False)
        for spine in axes.spines.values():
            spine.set_color(GREY)
    draw_legend(grid.flat[-1], report)
    figure.tight_layout()
    figure.savefig(sys.argv[2], dpi=110)


if __name__ == "__main__":
    main()
