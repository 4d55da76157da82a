# The sheet of `starloop quality-ladders`: one frame, and what its score makes of smear, defocus,
# noise and less light.
"""quality_ladders.py FOLDER: draws ladders.png from ladders.csv and the frames beside it."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import PowerNorm

from pointing_error import GREY, STYLE, X

STEPS = 6  # pictures in a row


def number(text):
    return float(text) if text else np.nan


def read(path):
    """Ladder -> its rows, in order."""
    ladders = {}
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            ladders.setdefault(row["ladder"], []).append(row)
    return ladders


def draw_frame(axes, frame, ends, row, unit):
    axes.imshow(frame, cmap="gray", norm=PowerNorm(0.5, *ends), interpolation="nearest")
    axes.set_xticks([])
    axes.set_yticks([])
    score = f"{number(row['score_db']):.1f} dB" if row["score_db"] else "no score"
    axes.set_title(f"{number(row['value']):g} {unit}", fontsize=8, pad=2, color=GREY)
    axes.set_xlabel(score, fontsize=9, labelpad=2)


def main(folder):
    ladders = read(folder / "ladders.csv")
    with plt.rc_context({**STYLE, "font.size": 9}):
        figure, grid = plt.subplots(len(ladders), STEPS + 1, figsize=(11.5, 1.95 * len(ladders)),
                                    width_ratios=[1] * STEPS + [1.7], layout="constrained")
        for line, (name, rows) in zip(grid, ladders.items()):
            frames = [plt.imread(folder / row["frame"]) for row in rows]
            for axes in line[:STEPS]:
                axes.set_visible(False)
            pick = np.unique(np.linspace(0, len(rows) - 1, min(STEPS, len(rows))).round().astype(int))
            for axes, i in zip(line, pick):
                axes.set_visible(True)
                # Each its own black and white: what a person who looks would set.
                black, white = np.percentile(frames[i], (5, 99.8))
                draw_frame(axes, frames[i], (black, max(white, black + 1e-9)), rows[i],
                           rows[i]["unit"])
            line[0].set_ylabel(name, fontsize=10)
            axes = line[STEPS]
            scores = [number(row["score_db"]) for row in rows]
            labels = [f"{number(row['value']):g}" for row in rows]
            axes.plot(range(len(rows)), scores, color=X, marker="o", ms=3.5, lw=1.4)
            axes.set_xticks(range(len(rows)), labels, fontsize=7)
            axes.set_xlim(-0.3, len(rows) - 0.7)
            axes.set_ylabel("score (dB)", fontsize=8)
            axes.set_xlabel(rows[0]["unit"], fontsize=8, labelpad=1)
            for i, score in enumerate(scores):
                if np.isnan(score):
                    axes.axvline(i, color=GREY, lw=0.8, ls=":")
        figure.savefig(folder / "ladders.png", dpi=100)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
