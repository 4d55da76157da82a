# The picture of `starloop mtf`: each term of the transfer function along u, and their product in
# four directions, from mtf.csv.
"""mtf.py FILE.csv: draws FILE.png."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pointing_error import GREY, STYLE

COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7a5195"]


def main():
    path = Path(sys.argv[1])
    with path.open() as file:
        rows = list(csv.DictReader(file))
    names = [n for n in rows[0] if n not in
             ("direction_deg", "frequency_lp_mm", "cycles_per_px", "product_re", "product_im")]
    table = {n: np.array([float(r[n]) for r in rows]) for n in rows[0]}
    plt.rcParams.update(STYLE)
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.3), sharey=True)

    along_u = table["direction_deg"] == 0
    frequency = table["frequency_lp_mm"][along_u]
    for name, colour in zip(names, COLOURS):
        value = table[name][along_u]
        if name == "defocus":  # not told where the lens passes next to nothing
            value = np.where(np.abs(table["lens"][along_u]) > 1e-3, value, np.nan)
        # What does nothing is not drawn.
        if np.nanmax(value) - np.nanmin(value) > 1e-6:
            left.plot(frequency, value, color=colour, label=name)
    product = table["product_re"][along_u]
    left.plot(frequency, product, color="#222222", linewidth=2, label="all together")
    left.set_title("terms along u", loc="left", fontsize=10.5)
    left.set_ylabel("OTF, with its sign")

    for direction, style in zip((0, 45, 90, 135), ("-", "--", "-.", ":")):
        use = table["direction_deg"] == direction
        size = np.hypot(table["product_re"], table["product_im"])[use]
        right.plot(table["frequency_lp_mm"][use], size, style, color="#222222",
                   label=f"{direction} deg from u to v")
    right.set_title("modulus of all together", loc="left", fontsize=10.5)
    nyquist = 0.5 * frequency[-1] / table["cycles_per_px"][along_u][-1]
    for axes in (left, right):
        axes.axvline(nyquist, color=GREY, linewidth=0.8, linestyle=":")
        axes.text(nyquist, 1.02, " Nyquist", color=GREY, fontsize=8.5)
        axes.set_xlabel("frequency on the detector, lp/mm")
        axes.set_xlim(0, frequency[-1])
        axes.legend(frameon=False, fontsize=9)
    figure.tight_layout()
    figure.savefig(path.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
