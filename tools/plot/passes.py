# The pictures of `starloop passes --out`, after figure 9 of Li et al. 2023: which condition lets the
# camera see the target when, over the whole search and about one pass; and that pass' curves.
"""passes.py FOLDER [NUMBER]: draws passes.png and pass_NUMBER.png from the tables there."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pointing_error import GREY, LIMIT, SIZE, STYLE, X, Y

NAMES = {"range": "within range", "line-of-sight": "Earth not in the way",
         "eclipse": "target in sunlight", "sun-exclusion": "Sun out of view",
         "field": "target in the field", "signal": "bright enough", "all": "all: a pass",
         "earth-behind": "Earth behind"}
DAY_S = 86400.0


def read_conditions(path):
    """By name: starts and ends, in seconds."""
    windows = {}
    with path.open() as file:
        for row in csv.DictReader(file):
            windows.setdefault(row["condition"], []).append(
                (float(row["start_s"]), float(row["end_s"])))
    return windows


def read_table(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def rows_of(windows, needed_only):
    last = ["all"] if needed_only else ["all", "earth-behind"]
    return [n for n in NAMES if n not in ("all", "earth-behind") and n in windows] + last


def draw_rows(axes, windows, names, begin, end, scale, zero):
    """A bar where the condition is met; the last rows are what comes of it."""
    axes.set_ylim(len(names) - 0.45, -0.55)
    axes.set_yticks(range(len(names)), [NAMES[n] for n in names])
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="y", visible=False)
    for row, name in enumerate(names):
        colour = {"all": LIMIT, "earth-behind": Y}.get(name, X)
        bars = [((a - zero) / scale, (b - a) / scale) for a, b in windows.get(name, ())
                if b > begin and a < end]
        axes.broken_barh(bars, (row - 0.3, 0.6), facecolor=colour, edgecolor="none")
        # What is too short for a bar is still to be seen.
        width = (end - begin) / scale / 1000
        for start, length in bars:
            if length < width:
                axes.plot([start + length / 2] * 2, [row - 0.3, row + 0.3], color=colour,
                          linewidth=0.8, solid_capstyle="butt")
    axes.set_xlim((begin - zero) / scale, (end - zero) / scale)


def number_passes(axes, passes, row, chosen):
    """Above their marks, in groups where those are too close for a number each."""
    left, right = axes.get_xlim()
    groups = []
    for i, one in enumerate(passes):
        x = float(one["closest_s"]) / DAY_S
        if groups and x - groups[-1][-1][1] < 0.018 * (right - left):
            groups[-1].append((i + 1, x))
        else:
            groups.append([(i + 1, x)])
    for group in groups:
        first, last = group[0][0], group[-1][0]
        here = first <= chosen <= last
        text = str(first) if first == last else f"{first}\N{EN DASH}{last}"
        axes.text((group[0][1] + group[-1][1]) / 2, row - 0.34, text, ha="center", va="bottom",
                  fontsize=8.5, color=SIZE if here else GREY,
                  fontweight="bold" if here else "normal")


def draw_timeline(folder, windows, passes, number):
    chosen = passes[number - 1] if number else None
    figure, panels = plt.subplots(2 if chosen else 1, 1, squeeze=False,
                                  figsize=(11, 6.4 if chosen else 3.4))
    whole = panels[0][0]
    begin, end = windows["span"][0]
    names = rows_of(windows, True)
    draw_rows(whole, windows, names, begin, end, DAY_S, 0.0)
    number_passes(whole, passes, names.index("all"), number)
    whole.set_xlabel("days after the epoch")
    whole.set_title(f"{len(passes)} passes in {(end - begin) / DAY_S:.6g} days: where each condition "
                    "is met", loc="left", fontsize=10.5)
    if chosen:
        draw_zoom(panels[1][0], windows, chosen, number)
    figure.tight_layout()
    figure.savefig(folder / "passes.png", dpi=110)


def draw_zoom(axes, windows, chosen, number):
    start, closest, end = (float(chosen[k]) for k in ("start_s", "closest_s", "end_s"))
    span_begin, span_end = windows["span"][0]
    # Enough around to see what cuts, and what would have.
    around = max(1.0, 0.6 * (end - start))
    draw_rows(axes, windows, rows_of(windows, False), max(span_begin, start - around),
              min(span_end, end + around), 1.0, closest)
    marks = []
    for x, name in ((start, "AOS"), (closest, "TCA"), (end, "LOS")):
        axes.axvline(x - closest, color=SIZE, linewidth=0.8, linestyle=":")
        if marks and x - marks[-1][0] < 0.1 * (end - start):
            marks[-1][1] += ", " + name
        else:
            marks.append([x, name])
    for x, name in marks:
        axes.text(x - closest, -0.55, name, ha="center", va="bottom", fontsize=8.5, color=GREY)
    axes.set_xlabel(f"seconds after {chosen['closest_utc'].replace('T', ' ')} UTC")
    cut = [chosen["start_limited_by"], chosen["end_limited_by"]]
    cut = ["the search's end" if c == "span" else c for c in cut]
    axes.set_title(f"pass {number}: begins by {cut[0]}, ends by {cut[1]}", loc="left",
                   fontsize=10.5, pad=16)


def draw_curves(folder, passes, number):
    chosen = passes[number - 1]
    rows = read_table(folder / f"pass_{number}.csv")
    table = {n: np.array([float(r[n]) for r in rows]) for n in rows[0]}
    time = table["time_s"] - float(chosen["closest_s"])
    rate = "range rate, km/s"
    if np.abs(table["range_rate_km_s"]).max() < 0.1:
        table["range_rate_km_s"] *= 1e3
        rate = "range rate, m/s"
    curves = (("range_km", "range, km"), ("range_rate_km_s", rate),
              ("line_of_sight_rate_mrad_s", "line of sight\nturns, mrad/s"),
              ("phase_angle_deg", "phase angle, deg"))
    figure, panels = plt.subplots(len(curves), 1, figsize=(8, 8.4), sharex=True)
    behind = table["earth_behind"] > 0.5
    dim = table["lit_fraction"] < 1.0
    for axes, (name, label) in zip(panels, curves):
        axes.plot(time, table[name], color=X, linewidth=1.6)
        axes.set_ylabel(label)
        axes.margins(x=0)
        axes.ticklabel_format(axis="y", useOffset=False)
        axes.set_ylim(axes.get_ylim())
        for where, colour in ((behind, Y), (dim, SIZE)):
            axes.fill_between(time, 0, 1, where=where, transform=axes.get_xaxis_transform(),
                              color=colour, alpha=0.13, linewidth=0)
    figure.align_ylabels()
    shades = []
    if behind.any():
        shades.append("orange: the Earth behind")
    if dim.any():
        shades.append("dark: penumbra")
    title = f"pass {number}, closest {float(chosen['min_range_km']):.3f} km"
    panels[0].set_title(title + ("   (" + "; ".join(shades) + ")" if shades else ""), loc="left",
                        fontsize=10.5)
    panels[-1].set_xlabel(f"seconds after {chosen['closest_utc'].replace('T', ' ')} UTC")
    figure.tight_layout()
    figure.savefig(folder / f"pass_{number}.png", dpi=110)


def main():
    folder = Path(sys.argv[1])
    number = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    plt.rcParams.update(STYLE)
    windows = read_conditions(folder / "conditions.csv")
    passes = read_table(folder / "passes.csv")
    draw_timeline(folder, windows, passes, number)
    if number:
        draw_curves(folder, passes, number)


if __name__ == "__main__":
    main()
