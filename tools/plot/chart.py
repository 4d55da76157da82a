# Speed against accuracy as `starloop chart` measured it: the front of each scene's settings, what
# each knob changes, and the scene where the program's own choice is farthest off.
"""chart.py FOLDER/chart.csv: writes fronts.svg/png, tornado_<scene>.svg and chart.html beside it."""

import csv
import html
import math
import sys
from pathlib import Path

sys.dont_write_bytecode = True

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pointing_error import GREY, LIMIT, STYLE, X, Y
from report_html import PAGE_STYLE

LEAST = 1e-3  # of a pixel's noise: nothing below is told apart
KINDS = {"mixed": ("mixtures of all knobs", GREY, "o", 16),
         "single": ("one knob turned", X, "o", 22),
         "own": ("asked for", "#CC79A7", "D", 34),
         "standard": ("as the program chooses", Y, "*", 150)}


def number(text):
    return float(text) if text else math.nan


def read(path):
    """Scene name -> rows, in the order of the file."""
    scenes = {}
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            scenes.setdefault(row["scene"], []).append(row)
    return scenes


def error_of(row):
    """rho of lit pixels; of an empty scene that of the sky, which is then all that there is."""
    rho = number(row["rho_lit"])
    return max(rho if math.isfinite(rho) else number(row["rho_sky"]), LEAST)


def usable(rows):
    return [r for r in rows if math.isfinite(number(r["cpu_ms"])) and math.isfinite(error_of(r))]


def front(rows):
    """Those that no other beats in both."""
    best, kept = math.inf, []
    for row in sorted(rows, key=lambda r: (number(r["cpu_ms"]), error_of(r))):
        if error_of(row) < best:
            best = error_of(row)
            kept.append(row)
    return kept


def draw_front(axis, rows):
    rows = usable(rows)
    for kind, (label, colour, marker, size) in KINDS.items():
        some = [r for r in rows if r["kind"] == kind]
        # Hollow: most of it is bias, which no average takes away.
        hollow = [number(r["bias_lit"]) > number(r["noise_lit"]) for r in some]
        axis.scatter([number(r["cpu_ms"]) for r in some], [error_of(r) for r in some], s=size,
                     marker=marker, facecolors=["none" if h and kind != "standard" else colour
                                                for h in hollow],
                     edgecolors=colour, linewidths=0.9, label=label, zorder=3)
    line = front(rows)
    axis.step([number(r["cpu_ms"]) for r in line], [error_of(r) for r in line], where="post",
              color="#222222", linewidth=1.0, label="front", zorder=2)
    axis.axvline(number(rows[0]["period_ms"]), color=LIMIT, linewidth=1.0, linestyle="--")
    axis.axhline(0.3, color=LIMIT, linewidth=1.0, linestyle=":")
    limit = max((number(r["reference_lit"]) for r in rows if r["reference_lit"]), default=math.nan)
    if math.isfinite(limit) and limit > 0:
        axis.axhspan(LEAST / 2, limit, color="#eef1f5", zorder=0)
    axis.set_xscale("log")
    axis.set_yscale("log")
    errors = [error_of(r) for r in rows]
    axis.set_ylim(min(0.6 * min(errors), 0.1), max(1.7 * max(errors), 1.0))
    axis.set_title(rows[0]["title"] + (" (corner)" if rows[0]["corner"] == "1" else ""),
                   fontsize=10.5, loc="left")


def draw_fronts(scenes, folder):
    columns = min(len(scenes), 3)
    lines = math.ceil(len(scenes) / columns)
    wide, high = (4.6 * columns, 3.5 * lines) if len(scenes) > 1 else (8.0, 5.2)
    figure, axes = plt.subplots(lines, columns, figsize=(wide, high), squeeze=False)
    for axis in axes.flat[len(scenes):]:
        axis.set_visible(False)
    for axis, rows in zip(axes.flat, scenes.values()):
        draw_front(axis, rows)
    for axis in axes[:, 0]:
        axis.set_ylabel("error / sensor's noise, lit px")
    for k, axis in enumerate(axes.flat):
        if len(scenes) - columns <= k < len(scenes):
            axis.set_xlabel("CPU time of a frame, ms")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", frameon=False, fontsize=9,
                  ncols=len(labels) if columns > 2 else 3)
    figure.tight_layout(rect=(0, 0, 1, 1 - (0.35 if columns > 2 else 0.55) / high))
    for form in ("svg", "png"):
        figure.savefig(folder / f"fronts.{form}", dpi=130)
    plt.close(figure)


def draw_tornado(rows, path):
    """What each rung makes of the program's own choice: longest bars on top."""
    rows = usable(rows)
    standard = next((r for r in rows if r["kind"] == "standard"), None)
    singles = [r for r in rows if r["kind"] == "single"]
    if standard is None or not singles:
        return False

    def ratios(row):
        return (math.log2(error_of(row) / error_of(standard)),
                math.log2(number(row["cpu_ms"]) / number(standard["cpu_ms"])))

    singles.sort(key=lambda r: max(abs(x) for x in ratios(r)))
    places = np.arange(len(singles))
    figure, axes = plt.subplots(1, 2, figsize=(9.2, 0.7 + 0.22 * len(singles)), sharey=True)
    for axis, which, title in zip(axes, (0, 1), ("error", "CPU time")):
        values = np.array([ratios(r)[which] for r in singles])
        axis.barh(places, values, color=np.where(values > 0, Y, X), height=0.7)
        axis.axvline(0, color="#222222", linewidth=0.8)
        axis.set_title(f"{title}, times that of the program's own choice", fontsize=10, loc="left")
        axis.set_yticks(places, [r["setting"] for r in singles], fontsize=8.5)
        axis.xaxis.set_major_formatter(lambda x, _: f"{2.0 ** x:.3g}")
        axis.grid(axis="y", visible=False)
    figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)
    return True


def percent(text):
    value = number(text)
    return "" if math.isnan(value) else f"{100 * value:+.3f} %"


def figure_text(text, digits=3):
    value = number(text)
    return "" if math.isnan(value) else f"{value:.{digits}f}"


def summary(scenes):
    out = ["<table><tr><th>scene<th class=n>CPU ms<th class=n>p99<th class=n>wall ms"
           "<th class=n>lit<th class=n>edge<th class=n>sky<th class=n>flux<th class=n>centroid px"
           "<th>what it chose</tr>"]
    for name, rows in scenes.items():
        row = next((r for r in rows if r["kind"] == "standard"), None)
        if row is None:
            continue
        cells = [f"{number(row['cpu_ms']):.1f}", f"{number(row['cpu_ms_p99']):.1f}",
                 f"{number(row['wall_ms']):.1f}", figure_text(row["rho_lit"]),
                 figure_text(row["rho_edge"]), figure_text(row["rho_sky"]),
                 percent(row["flux_share"]), figure_text(row["centroid_px"], 4)]
        out.append(f"<tr><td>{html.escape(row['title'])}" +
                   "".join(f"<td class=n>{c}" for c in cells) +
                   f"<td>{html.escape(row['rungs'])}</tr>")
    return "\n".join(out + ["</table>"])


def worst(scenes):
    """The scene, or corner, where what the program chose is farthest off."""
    standards = [r for rows in scenes.values() for r in usable(rows) if r["kind"] == "standard"]
    return max(standards, key=error_of, default=None)


def details(name, rows, drawn):
    out = [f"<section><h2>{html.escape(rows[0]['title'])}</h2>",
           f"<p class=note><code>{html.escape(rows[0]['command'])}</code></p>"]
    if drawn:
        out.append((drawn).read_text(encoding="utf-8").split("?>", 1)[-1])
    line = front(usable(rows))
    if line:
        out.append("<p>On the front, from fast to right:</p><table>"
                   "<tr><th>setting<th class=n>CPU ms<th class=n>lit<th class=n>edge"
                   "<th class=n>centroid px<th>what it chose</tr>")
        out += [f"<tr><td>{html.escape(r['setting'])}<td class=n>{number(r['cpu_ms']):.1f}"
                f"<td class=n>{figure_text(r['rho_lit'])}<td class=n>{figure_text(r['rho_edge'])}"
                f"<td class=n>{figure_text(r['centroid_px'], 4)}<td>{html.escape(r['rungs'])}</tr>"
                for r in line]
        out.append("</table>")
    return "\n".join(out + ["</section>"])


def write_page(scenes, folder, tornados):
    first = next(iter(scenes.values()))[0]
    far = worst(scenes)
    picture = (folder / "fronts.svg").read_text(encoding="utf-8").split("?>", 1)[-1]
    parts = ["<!doctype html><meta charset=utf-8><title>Starloop: speed against accuracy</title>",
             f"<style>{PAGE_STYLE}</style><h1>Speed against accuracy</h1>",
             f"<p class=note>{html.escape(first['processor'])}, {first['processors']} processors; "
             f"version {html.escape(first['version'])}, commit {html.escape(first['commit'])}. "
             "Times are of the processor, one thread; dashed: the frame's period. Errors are "
             "root mean squares over pixels, each over the sensor's noise there; dotted: what the "
             "standard profile allows; grey: the reference's own noise. Hollow: mostly bias.</p>",
             picture, "<h2>What the program chooses by itself</h2>", summary(scenes)]
    if far is not None:
        parts.append(f"<p>Farthest off: <b>{html.escape(far['title'])}</b>, {error_of(far):.2f} "
                     "of the sensor's noise.</p>")
    parts += [details(name, rows, tornados.get(name)) for name, rows in scenes.items()]
    (folder / "chart.html").write_text("\n".join(parts), encoding="utf-8")


def main():
    path = Path(sys.argv[1])
    folder = path.parent
    scenes = {name: rows for name, rows in read(path).items() if usable(rows)}
    if not scenes:
        sys.exit(f"{path}: no point to draw")
    plt.rcParams.update(STYLE)
    plt.rcParams["svg.hashsalt"] = "starloop"
    draw_fronts(scenes, folder)
    tornados = {}
    for name, rows in scenes.items():
        tornado = folder / f"tornado_{name}.svg"
        if draw_tornado(rows, tornado):
            tornados[name] = tornado
    write_page(scenes, folder, tornados)


if __name__ == "__main__":
    main()
