# The plane of `starloop mtf`: each term of the transfer function that does something, and their
# product, with their signs.
"""mtf_plane.py FILE_plane.csv: draws FILE_plane.png."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import FuncNorm

from pointing_error import GREY, STYLE

# Blue: passed as it is; red: with the other sign. Roots, so that a hundredth is still a colour.
MAP = {"cmap": "RdBu",
       "norm": FuncNorm((lambda x: np.sign(x) * np.sqrt(np.abs(x)),
                         lambda x: np.sign(x) * np.square(x)), vmin=-1, vmax=1)}
SCALE = (-0.5, 1)  # of the bar: no sinusoid and no square turns more than that over
TICKS = [-0.4, -0.2, -0.05, 0, 0.05, 0.2, 0.4, 0.7, 1]
NEXT_TO_NOTHING = 1e-6


class Plane:
    """Terms by name as square tables, no number beyond the lens' cutoff; frequencies in lp/mm."""

    def __init__(self, path):
        with path.open() as file:
            rows = list(csv.DictReader(file))
        side = int(round(len(rows) ** 0.5))
        column = {name: np.array([float(r[name] or "nan") for r in rows]).reshape(side, side)
                  for name in rows[0]}
        self.u, self.v = column["u_lp_mm"], column["v_lp_mm"]
        self.cutoff = self.u.max()
        self.nyquist = 0.5 * self.cutoff / column["u_cycles_per_px"].max()
        self.inside = np.isfinite(column["pixel"])
        self.terms, self.complex = {}, set()
        for name in ("lens", "defocus", "jitter", "vibration", "table", "pixel", "smear",
                     "product"):
            value = column.get(name)
            if value is None:
                value = column[f"{name}_re"]
                if np.nanmax(np.abs(column[f"{name}_im"])) > NEXT_TO_NOTHING:
                    self.complex.add(name)
            self.terms[name] = np.where(self.inside, value, np.nan)
        lens = np.hypot(column["lens_re"], column["lens_im"])
        self.passed = lens > 1e-2  # where signs matter
        # Where the lens passes next to nothing, what defocus makes of that is not told.
        self.terms["defocus"][lens <= 1e-3] = np.nan

    def at_work(self):
        """What is not 1 everywhere, the product always among it."""
        return [n for n, value in self.terms.items()
                if n == "product" or np.nanmax(np.abs(value - 1)) > NEXT_TO_NOTHING]


def draw_plane(axis, plane, value, of_light=False):
    """The image of the colour map, with Nyquist's square and the lens' circle."""
    end = plane.cutoff
    half_step = 0.5 * (plane.u[0, 1] - plane.u[0, 0])
    edge = end + half_step
    image = axis.imshow(value, extent=(-edge, edge, edge, -edge), interpolation="nearest", **MAP)
    signed = np.where(plane.passed, value, np.nan) if of_light else value
    if np.nanmin(signed) < 0 < np.nanmax(signed):
        axis.contour(plane.u, plane.v, signed, levels=[0], colors="#222222", linewidths=0.7)
    axis.add_patch(plt.Circle((0, 0), end, fill=False, color=GREY, linewidth=1))
    axis.add_patch(plt.Rectangle((-plane.nyquist, -plane.nyquist), 2 * plane.nyquist,
                                 2 * plane.nyquist, fill=False, color="#222222", linewidth=1,
                                 linestyle=(0, (4, 2))))
    axis.set_xlim(-1.03 * edge, 1.03 * edge)
    axis.set_ylim(1.03 * edge, -1.03 * edge)  # v points down, as in the frames
    axis.set_aspect("equal")
    axis.grid(False)
    return image


def least(value):
    return f"least {np.nanmin(value).round(3) + 0.0:.3f}"


def draw_bar(figure, image, axes, **options):
    bar = figure.colorbar(image, ax=axes, ticks=TICKS, format="{x:g}", **options)
    bar.ax.set_ylim(SCALE)
    bar.ax.minorticks_off()
    bar.outline.set_visible(False)
    bar.set_label("OTF, with its sign; black lines: zero")


def main():
    path = Path(sys.argv[1])
    plane = Plane(path)
    names = plane.at_work()
    plt.rcParams.update(STYLE)
    columns = min(4, len(names)) if len(names) != 6 else 3
    rows = -(-len(names) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(3.35 * columns + 0.9, 3.6 * rows + 0.6),
                                squeeze=False, sharex=True, sharey=True, layout="constrained")
    for axis in axes.flat[len(names):]:
        axis.axis("off")
    for axis, name in zip(axes.flat, names):
        value = plane.terms[name]
        image = draw_plane(axis, plane, value, name in ("lens", "product"))
        kind = ", real part" if name in plane.complex else ""
        title = "all together" if name == "product" else name
        axis.set_title(f"{title}{kind}", loc="left", fontsize=10.5,
                       fontweight="bold" if name == "product" else "normal")
        axis.set_title(least(value), loc="right", fontsize=8.5, color=GREY)
    for axis in axes[-1]:
        axis.set_xlabel("along u, lp/mm")
    for axis in axes[:, 0]:
        axis.set_ylabel("along v, lp/mm")
    draw_bar(figure, image, axes, shrink=0.9, aspect=30, pad=0.015)
    figure.suptitle(f"Square: Nyquist, {plane.nyquist:.2f} lp/mm.  Circle: the lens passes "
                    f"{plane.cutoff:.2f} lp/mm.", x=0.01, ha="left", fontsize=9.5, color=GREY)
    figure.savefig(path.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
