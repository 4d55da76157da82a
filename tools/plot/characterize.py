# The pictures of `starloop characterize`: what a data sheet by EMVA 1288 shows, and the edge.
"""characterize.py FOLDER: draws transfer, linearity, dark, snr and edge.png from its tables."""

import csv
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pointing_error import GREY, SIZE, STYLE, X, Y

FIT, MARK = "#222222", "#00795A"
QUANTISING = 1 / 12  # DN^2


def table(path):
    """Columns by name; text that is no number stays text, nothing is not a number."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    columns = {}
    for name in rows[0] if rows else ():
        cells = [r[name] for r in rows]
        try:
            columns[name] = np.array([float(c) if c else np.nan for c in cells])
        except ValueError:
            columns[name] = np.array(cells)
    return columns


def of_depth(columns, bits):
    use = columns["bits"] == bits
    return {name: values[use] for name, values in columns.items()}


def figures_of(sensor):
    return {f["key"]: f for f in sensor["figures"]}


def told(figure):
    """'2.1839 ± 0.0008 DN/e- (true 2.1845)': as many places as the error has a meaning for."""
    error, unit = figure["standard_error"], figure["unit"]
    places = 2 if not error else int(np.clip(1 - np.floor(np.log10(error)), 0, 7))
    truth = f"(true {figure['true']:.{places}f})"
    if figure["measured"] is None:
        return f"not measurable (true {figure['true']:.{places}f} {unit})"
    sign = {"upper limit": "< ", "lower limit": "> "}.get(figure["standing"], "")
    spread = "" if sign or not error else f" ± {error:.{places}f}"
    return f"{sign}{figure['measured']:.{places}f}{spread} {unit} {truth}"


def panels(sensors, height, rows=1, ratios=None, **options):
    figure, axes = plt.subplots(rows, len(sensors), figsize=(5.7 * len(sensors), height),
                                squeeze=False, layout="constrained",
                                gridspec_kw={"height_ratios": ratios} if ratios else None,
                                **options)
    for axis, sensor in zip(axes[0], sensors):
        axis.set_title(f"{sensor['bits']} bits, pedestal {sensor['pedestal_dn']:g} DN", loc="left",
                       fontsize=10.5)
    return figure, axes


def legend(axis, **options):
    axis.legend(facecolor="white", edgecolor="none", framealpha=0.85, fontsize=9, **options)


def draw_transfer(report, light, _):
    figure, axes = panels(report["sensors"], 4.6)
    for axis, sensor in zip(axes[0], report["sensors"]):
        level = of_depth(light, sensor["bits"])
        figures = figures_of(sensor)
        dark = level["mean_dn"][0]
        signal = level["mean_dn"] - dark
        lit = signal > 0
        noise = level["temporal_variance_dn2"]
        axis.loglog(signal[lit], noise[lit], ".", color=X, markersize=5, label="measured")
        peak = sensor["saturation_level"]
        top = signal[peak]
        # What the quantiser leaves next to nothing of is no use to look at.
        seen = lit & (noise > 0.2 * QUANTISING) & (np.arange(len(noise)) <= peak)
        x = np.geomspace(0.7 * signal[seen].min(), top, 200)
        gain = figures["gain_dn_e"]
        # Relative to the fit's own zero, so that a pedestal does not matter.
        fitted = sensor["transfer_intercept_dn2"] + gain["measured"] * (x + dark)
        axis.loglog(x, np.where(fitted > 0, fitted, np.nan), color=FIT, linewidth=1,
                    label=f"K = {told(gain)}")
        axis.axvspan(0.05 * top, 0.7 * top, color=FIT, alpha=0.06, linewidth=0)
        axis.text(0.19 * top, 0.015, "fit", color=GREY, fontsize=8.5, ha="center",
                  transform=axis.get_xaxis_transform())
        axis.plot(top, noise[peak], "o", markersize=9, fillstyle="none", color=Y,
                  label=f"saturation: {told(figures['saturation_capacity_e'])}")
        axis.axhline(QUANTISING, color=GREY, linewidth=0.8, linestyle=":")
        axis.text(1.0, QUANTISING * 1.12, "quantising, 1/12 DN² ", color=GREY, fontsize=8.5,
                  ha="right", transform=axis.get_yaxis_transform())
        axis.set_xlabel("mean over the dark, DN")
        axis.set_xlim(x[0], 2 * top)
        axis.set_ylim(0.2 * min(QUANTISING, noise[seen].min()), 3 * noise[peak])
        legend(axis, loc="upper left")
    axes[0, 0].set_ylabel("temporal variance, DN²")
    return figure


def draw_linearity(report, light, _):
    figure, axes = panels(report["sensors"], 5.6, rows=2, ratios=[3, 2], sharex="col")
    for (above, below), sensor in zip(axes.T, report["sensors"]):
        level = of_depth(light, sensor["bits"])
        figures = figures_of(sensor)
        photons = level["photons"] * 1e-3
        above.plot(photons, level["mean_dn"], ".", color=X, markersize=5, label="measured")
        above.plot(photons, level["fitted_mean_dn"], color=FIT, linewidth=1,
                   label=told(figures["responsivity_dn_photon"]).replace(" (", "\n("))
        above.set_ylim(0, 1.08 * level["mean_dn"].max())
        legend(above, loc="upper left")
        below.plot(photons, 100 * level["linearity_deviation"], ".-", color=X, linewidth=0.8,
                   markersize=5)
        below.axhline(0, color=FIT, linewidth=1)
        error = figures["linearity_error"]
        below.set_title(f"LE = {error['measured']:.4f} %, 5 to 95 % of saturation; noise alone "
                        f"makes {error['standard_error']:.4f} %", loc="left", fontsize=9.5)
        below.set_xlabel("photons per pixel, thousands")
    axes[0, 0].set_ylabel("mean, DN")
    axes[1, 0].set_ylabel("off the line, %")
    return figure


def draw_dark(report, _, dark):
    figure, axes = panels(report["sensors"], 5.6, rows=2, sharex="col")
    for (above, below), sensor in zip(axes.T, report["sensors"]):
        level = of_depth(dark, sensor["bits"])
        figures = figures_of(sensor)
        use = level["shows_noise"] > 0
        for axis, name, key in ((above, "mean_dn", "dark_current_e_s"),
                                (below, "temporal_variance_dn2", "dark_current_by_variance_e_s")):
            axis.plot(level["exposure_s"][use], level[name][use], "o", color=X, markersize=5,
                      label="measured")
            if not use.all():
                axis.plot(level["exposure_s"][~use], level[name][~use], "x", color=Y,
                          label="cut off or hidden by the quantiser")
            if figures[key]["measured"] is not None:
                line = np.polyfit(level["exposure_s"][use], level[name][use], 1)
                axis.plot(level["exposure_s"], np.polyval(line, level["exposure_s"]), color=FIT,
                          linewidth=1, zorder=0)
            axis.plot([], [], color=FIT, linewidth=1, label=told(figures[key]))
            legend(axis, loc="upper left")
        below.set_xlabel("exposure, s")
    axes[0, 0].set_ylabel("dark mean, DN")
    axes[1, 0].set_ylabel("dark temporal variance, DN²")
    return figure


def draw_snr(report, light, _):
    figure, axes = panels(report["sensors"], 4.6, sharey="row")
    for axis, sensor in zip(axes[0], report["sensors"]):
        level = of_depth(light, sensor["bits"])
        figures = figures_of(sensor)
        threshold = figures["sensitivity_threshold_photons"]
        end = level["photons"][sensor["saturation_level"]]
        signal = level["mean_dn"] - level["mean_dn"][0]
        use = (signal > 0) & (level["photons"] <= end)
        noise = np.sqrt(level["temporal_variance_dn2"][use])
        axis.loglog(level["photons"][use], signal[use] / noise, ".", color=X, markersize=5,
                    label="measured")
        photons = np.geomspace(0.3, end, 300)
        efficiency = figures["quantum_efficiency"]["true"] / 100
        electrons = efficiency * photons
        least = threshold["true"] * efficiency - 0.5
        axis.loglog(photons, electrons / np.sqrt(least**2 - 0.25 + electrons), color=FIT,
                    linewidth=1, label="what the scenario says")
        axis.loglog(photons, np.sqrt(photons), ":", color=GREY, linewidth=1,
                    label="of the light itself")
        axis.axvline(end, color=Y, linewidth=0.9)
        axis.axhline(1, color=GREY, linewidth=0.8)
        if threshold["measured"] is not None:
            axis.axvline(threshold["measured"], color=MARK, linewidth=0.9)
        axis.plot([], [], color=MARK, label=f"threshold: {told(threshold)}")
        axis.plot([], [], color=Y, label=f"range: {told(figures['dynamic_range_db'])}")
        axis.set_xlabel("photons per pixel")
        axis.set_ylim(0.006, None)
        axis.yaxis.set_major_formatter("{x:g}")
        legend(axis, loc="lower right")
    axes[0, 0].set_ylabel("signal to noise")
    return figure


def draw_edge(report, edges, spread):
    figure, axes = plt.subplots(1, 3, figsize=(13.2, 4.2), layout="constrained")
    first, second, third = axes
    for i, (edge, colour) in enumerate(zip(report["slanted_edge"], (X, Y))):
        near = edges["near"] == edge["near"]
        frequency = edges["cycles_per_px"][near]
        name = f"edge {edge['angle_deg']:.2f}° off the {edge['near']}"
        where = spread["near"] == edge["near"]
        first.plot(spread["distance_px"][where], spread["spread"][where], color=colour,
                   linewidth=1.2, label=name)
        second.plot(frequency[2 * i::4], edges["mtf"][near][2 * i::4], "o", color=colour, markersize=4,
                    label=name)
        off = edges["mtf"][near] - edges["analytic"][near]
        third.plot(frequency, off, color=colour, linewidth=1.2,
                   label=f"at most {edge['worst_deviation']:+.4f}, at "
                         f"{edge['worst_cycles_per_px']:.3f}")
    near = edges["near"] == edges["near"][0]
    second.plot(edges["cycles_per_px"][near], edges["analytic"][near], color=SIZE, linewidth=1,
                label="product of the optics' terms", zorder=0)
    first.set_xlim(-6, 6)
    first.set_xlabel("distance from the edge, px")
    first.set_title("edge spread function", loc="left", fontsize=10.5)
    second.set_xlabel("cycles per pixel along the normal")
    second.set_ylim(0, 1.05)
    second.set_title("MTF", loc="left", fontsize=10.5)
    third.axvspan(0, report["slanted_edge"][0]["compared_from_cycles_per_px"], color=FIT,
                  alpha=0.08, linewidth=0)
    third.text(0.0, -0.0116, "  longer than the window", color=GREY, fontsize=8.5, rotation=90,
               va="bottom")
    for limit in (-0.01, 0.01):
        third.axhline(limit, color=GREY, linewidth=0.9, linestyle=":")
    third.set_ylim(-0.0125, 0.0125)
    third.set_xlabel("cycles per pixel")
    third.set_title("measured less analytic", loc="left", fontsize=10.5)
    for axis, place in zip(axes, ("upper left", "upper right", "lower right")):
        legend(axis, loc=place)
    return figure


def main():
    folder = Path(sys.argv[1])
    report = json.loads((folder / "report.json").read_text())
    light, dark = table(folder / "ptc.csv"), table(folder / "dark.csv")
    plt.rcParams.update(STYLE)
    pictures = {
        "transfer": draw_transfer(report, light, dark),
        "linearity": draw_linearity(report, light, dark),
        "dark": draw_dark(report, light, dark),
        "snr": draw_snr(report, light, dark),
        "edge": draw_edge(report, table(folder / "edge.csv"), table(folder / "edge_spread.csv")),
    }
    for name, figure in pictures.items():
        figure.savefig(folder / f"{name}.png", dpi=110)


if __name__ == "__main__":
    main()
