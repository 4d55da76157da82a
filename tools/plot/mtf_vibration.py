# Vibration as `starloop mtf` wrote it, after figures 12 and 13 of Li et al. 2023: its transfer
# function as a surface and as a plane, and what its amplitude does.
"""mtf_vibration.py FILE_vibration.csv FILE_plane.csv: draws FILE_vibration.png."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import MaxNLocator

from mtf_plane import MAP, SCALE, Plane, draw_bar, draw_plane, least
from pointing_error import GREY, STYLE

COLOURS = ["#9ecae1", "#4292c6", "#222222", "#D55E00"]  # the scenario's own is black


def draw_surface(axis, plane, value):
    axis.plot_surface(plane.u, plane.v, value, rcount=129, ccount=129, linewidth=0,
                      antialiased=False, **MAP)
    axis.set_zlim(*SCALE)
    axis.set_box_aspect((1, 1, 0.85), zoom=0.95)
    axis.view_init(elev=24, azim=-128)
    axis.invert_yaxis()  # v points down in the frames
    axis.set_xlabel("along u, lp/mm", labelpad=2)
    axis.set_ylabel("along v, lp/mm", labelpad=2)
    axis.tick_params(labelsize=8.5, pad=0)
    for side in (axis.xaxis, axis.yaxis, axis.zaxis):
        side.set_major_locator(MaxNLocator(4))
        side.set_pane_color((1, 1, 1, 0))
        side._axinfo["grid"].update(color="#e3e7ec", linewidth=0.7)


def main():
    path = Path(sys.argv[1])
    plane = Plane(Path(sys.argv[2]))
    vibration = plane.terms["vibration"]
    with path.open() as file:
        rows = list(csv.DictReader(file))
    table = {n: np.array([float(r[n]) for r in rows]) for n in rows[0]}
    plt.rcParams.update(STYLE)
    figure = plt.figure(figsize=(15.5, 4.9), layout="constrained")
    grid = figure.add_gridspec(1, 3, width_ratios=[1.25, 1.1, 1.15])

    surface = figure.add_subplot(grid[0], projection="3d")
    draw_surface(surface, plane, vibration)
    surface.set_title("the vibration's transfer function", loc="left", fontsize=10.5)

    flat = figure.add_subplot(grid[1])
    draw_bar(figure, draw_plane(flat, plane, vibration), flat, shrink=0.85, aspect=28)
    flat.set_title(f"the same from above, {least(vibration)}", loc="left", fontsize=10.5)
    flat.set_xlabel("along u, lp/mm")
    flat.set_ylabel("along v, lp/mm")

    curves = figure.add_subplot(grid[2])
    for amplitude, colour in zip(np.unique(table["amplitude_urad"]), COLOURS):
        use = table["amplitude_urad"] == amplitude
        own = colour == "#222222"
        curves.plot(table["frequency_lp_mm"][use], table["vibration"][use], color=colour,
                    linewidth=2 if own else 1.4,
                    label=f"{amplitude:.3g} µrad = {table['amplitude_um'][use][0]:.3g} µm"
                          + (", yours" if own else ""))
    curves.axhline(0, color="#222222", linewidth=0.7)
    curves.axvline(plane.nyquist, color=GREY, linewidth=0.8, linestyle=":")
    curves.text(plane.nyquist, 1.02, " Nyquist", color=GREY, fontsize=8.5)
    curves.set_xlim(0, plane.cutoff)
    curves.set_ylim(-0.45, 1.08)
    curves.set_xlabel("frequency along the vibration, lp/mm")
    curves.set_ylabel("OTF, with its sign")
    curves.set_title("by amplitude, J0(2π A f)", loc="left", fontsize=10.5)
    curves.legend(frameon=False, fontsize=9, ncols=2, loc="upper center",
                  bbox_to_anchor=(0.47, -0.14))
    figure.savefig(path.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
