# The plots of report_html.py. Each takes the run's tables and returns a figure; a column that is
# not there raises Missing, whose text says which.
"""Figures of latency, pacing, pointing, detection, stage times and drop causes."""

import matplotlib.pyplot as plt
import numpy as np

from pointing_error import GREY, LIMIT, SIZE, STYLE, X, Y

GOOD, BAD, FAINT, ALARM = "#00795A", "#B3261E", "#d5dae1", "#E69F00"
STAGES = (("geometry", "#56B4E9"), ("render", X), ("optics", "#CC79A7"), ("detector", Y))
MANY = 3000  # points of one line from which a picture of it is smaller than the line itself


class Missing(Exception):
    """What a plot would need; its text is shown in its place."""


def column(table, name, of):
    values = table.get(name)
    if values is None:
        raise Missing(f"{of} has no column {name}")
    if not np.isfinite(values).any():
        raise Missing(f"{of} has no figures in {name}")
    return values


def panels(rows, height, ratios=None):
    figure, axes = plt.subplots(rows, 1, figsize=(9.2, height), squeeze=False,
                                gridspec_kw={"height_ratios": ratios} if ratios else None,
                                layout="constrained")
    return figure, axes[:, 0]


def series(axes, time, values, **style):
    dots = np.isfinite(values).sum() < 3
    axes.plot(time, values, marker="o" if dots else None, rasterized=len(values) > MANY, **style)


def since_start(table, of):
    time = column(table, "time_s", of)
    return time - time[0]


def histogram(axes, values, unit):
    """Counts on a logarithmic scale: the one frame in ten thousand is what one looks for."""
    values = values[np.isfinite(values)]
    low, high = float(values.min()), float(values.max())
    whole = np.all(values == np.round(values))
    if whole and high - low < 60:
        bins = np.arange(low - 0.5, high + 1.0)
    else:
        bins = np.linspace(low, high if high > low else low + 1.0, 50)
    axes.hist(values, bins=bins, color=X, log=True, rwidth=0.9 if whole else None)
    if whole and high - low < 12:
        axes.set_xticks(np.arange(low, high + 1.0))
        axes.set_xlim(low - 6, high + 6)  # a single bar is a bar, not a wall
    axes.set_ylim(bottom=0.5)
    axes.set_xlabel(unit)
    axes.set_ylabel("frames")


def draw_latency(run):
    t = since_start(run.detections, "detections.csv")
    latency = column(run.detections, "latency_frames", "detections.csv")
    figure, (above, below) = panels(2, 4.6)
    histogram(above, latency, "latency (frames)")
    series(below, t, latency, color=X, lw=1.2, drawstyle="steps-mid")
    below.set_ylim(0, np.nanmax(latency) + 1)
    below.set_ylabel("latency (frames)")
    below.set_xlabel("time since start (s)")
    return figure


def draw_pacing(run):
    t = since_start(run.frames, "frames.csv")
    late = column(run.frames, "late_ms", "frames.csv")
    if run.report.get("clock") == "lockstep":
        raise Missing("in lockstep the loop's clock is simulated, and no frame can be late")
    figure, (above, below) = panels(2, 4.6)
    histogram(above, late, "wake-up after the deadline (ms)")
    series(below, t, late, color=X, lw=1.0)
    skipped = run.frames.get("skipped_before")
    if skipped is not None and (skipped > 0).any():
        for i, moment in enumerate(t[skipped > 0]):
            below.axvline(moment, color=BAD, lw=0.8, alpha=0.6,
                          label=None if i else "periods skipped before this frame")
        below.legend(frameon=False, fontsize=9, loc="lower right", bbox_to_anchor=(1, 0.98))
    below.set_ylim(0, max(1.08 * np.nanmax(late), 0.1))
    below.set_ylabel("late (ms)")
    below.set_xlabel("time since start (s)")
    return figure


def draw_pointing(run):
    t = since_start(run.frames, "frames.csv")
    u = column(run.frames, "error_u_px", "frames.csv")
    v = column(run.frames, "error_v_px", "frames.csv")
    figure, (axes,) = panels(1, 3.0)
    series(axes, t, u, color=X, lw=1.2, label="x")
    series(axes, t, v, color=Y, lw=1.2, label="y")
    series(axes, t, np.hypot(u, v), color=SIZE, lw=0.8, alpha=0.6, label="magnitude")
    limit = run.figure("pointing", "limit_px")
    if limit:
        axes.axhspan(-limit, limit, color=LIMIT, alpha=0.12, lw=0, label=f"limit: {limit:g} px rms")
    axes.set_yscale("symlog", linthresh=1.0)
    axes.set_ylabel("photocentre - boresight (px)")
    axes.set_xlabel("time since start (s)")
    axes.legend(frameon=False, fontsize=9, ncol=4, loc="lower right", bbox_to_anchor=(1, 0.99))
    return figure


def states(run):
    """What there was to see and what was said of it: name, colour, in which frames, drawn from
    which height up."""
    of = "detections.csv"
    detectable = column(run.detections, "detectable", of) > 0
    found = column(run.detections, "found", of) > 0
    alarms = column(run.detections, "false_alarms", of) > 0
    return (("detected", GOOD, detectable & found, 0.0), ("missed", BAD, detectable & ~found, 0.0),
            ("nothing to detect", FAINT, ~detectable, 0.0), ("false alarm", ALARM, alarms, 0.6))


def draw_strip(axes, t, kinds):
    # Each frame reaches to the next; the last is as long as the one before.
    ends = np.append(t[1:], t[-1] + (t[-1] - t[-2] if len(t) > 1 else 1.0))
    for name, colour, which, low in kinds:
        # Neighbours of one kind are one bar: thousands of frames stay a few shapes.
        edges = np.flatnonzero(np.diff(np.concatenate([[False], which, [False]]).astype(int)))
        bars = [(t[a], ends[b - 1] - t[a]) for a, b in zip(edges[::2], edges[1::2])]
        axes.broken_barh(bars, (low, 1 - low), color=colour, lw=0, label=f"{name}: {which.sum()}")
    axes.set_yticks([])
    axes.grid(False)
    axes.set_ylim(0, 1)
    axes.legend(frameon=False, fontsize=9, ncol=4, loc="lower left", bbox_to_anchor=(0, 0.98),
                borderaxespad=0)


def draw_detection(run):
    of = "detections.csv"
    t = since_start(run.detections, of)
    kinds = states(run)
    figure, (strip, error, signal) = panels(3, 6.2, [0.5, 2.2, 1.5])
    draw_strip(strip, t, kinds)
    centroid = [run.detections.get(f"error_{axis}_px") for axis in "uv"]
    if all(c is not None and np.isfinite(c).any() for c in centroid):
        series(error, t, centroid[0], color=X, lw=1.0, label="u")
        series(error, t, centroid[1], color=Y, lw=1.0, label="v")
        error.axhline(0, color=GREY, lw=0.6)
        error.legend(frameon=False, fontsize=9, ncol=2, loc="lower right", bbox_to_anchor=(1, 0.98),
                     borderaxespad=0)
    else:
        error.text(0.5, 0.5, "no detection has a true centroid to compare with", ha="center",
                   va="center", color=GREY, transform=error.transAxes)
    error.set_ylabel("detected - true centroid (px)")
    series(signal, t, column(run.detections, "signal_to_noise", of), color=SIZE, lw=1.2)
    signal.set_ylabel("signal to noise")
    signal.set_ylim(bottom=0)
    share = signal.twinx()
    series(share, t, column(run.detections, "visible_fraction", of), color=LIMIT, lw=1.2)
    share.set_ylim(0, 1.05)
    share.grid(False)
    share.set_ylabel("share in the frame", color=LIMIT)
    signal.set_xlabel("time since start (s)")
    for axes in (strip, error, signal):
        axes.set_xlim(0, max(float(t[-1]), 1e-3))
    return figure


def draw_quality(run):
    of = "quality.csv"
    t = since_start(run.quality, of)
    figure, (score, sharpness) = panels(2, 4.6)
    series(score, t, column(run.quality, "score_db", of), color=X, lw=1.2)
    score.set_ylabel("score (dB)")
    series(sharpness, t, column(run.quality, "sharpness", of), color=Y, lw=1.2)
    sharpness.set_ylim(0, 1)
    sharpness.set_ylabel("sharpness")
    sharpness.set_xlabel("time since start (s)")
    return figure


def draw_stages(run):
    t = since_start(run.frames, "frames.csv")
    times = [(name, colour, column(run.frames, f"{name}_ms", "frames.csv"))
             for name, colour in STAGES]
    figure, (axes,) = panels(1, 3.0)
    axes.stackplot(t, *[np.nan_to_num(v) for _, _, v in times], colors=[c for _, c, _ in times],
                   labels=[n for n, _, _ in times], lw=0, rasterized=len(t) > MANY)
    busy = run.frames.get("busy_ms")
    if busy is not None and np.nanmax(busy) > 0:
        series(axes, t, busy, color=SIZE, lw=0.8, label="all, by the loop's clock")
    axes.set_ylabel("time (ms)")
    axes.set_xlabel("time since start (s)")
    axes.set_ylim(bottom=0)
    axes.margins(x=0)
    axes.legend(frameon=False, fontsize=9, ncol=5, loc="lower left", bbox_to_anchor=(0, 1))
    return figure


def draw_drops(run):
    frames = run.report.get("frames")
    kinds = ("sent", "skipped", "dropped", "faults")
    if not isinstance(frames, dict) or any(run.figure("frames", k) is None for k in kinds):
        raise Missing("report.json does not count frames sent, skipped, dropped and faults")
    counts = [run.figure("frames", k) for k in kinds]
    labels = ("sent", "skipped: the loop was too slow", "dropped: the link held every slot",
              "faults: the link refused")
    figure, (axes,) = panels(1, 1.9)
    bars = axes.barh(labels, counts, color=(GOOD, BAD, ALARM, SIZE), height=0.65)
    axes.bar_label(bars, [f"{c:.0f}" for c in counts], padding=4, fontsize=9.5)
    axes.invert_yaxis()
    axes.set_xlim(0, 1.12 * max(counts + [1]))
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("frames")
    return figure


PLOTS = (
    ("Latency", "From a frame to the first that can show its answer.", draw_latency),
    ("Pacing", "How late the loop woke up for each frame.", draw_pacing),
    ("Pointing", "Linear to 1 px, logarithmic beyond.", draw_pointing),
    ("Detection", "What was there to see in each frame, and what was said of it.", draw_detection),
    ("Image quality by frame", "How good a picture each frame is, without knowing what it shows: "
     "docs/image_quality.md. A gap: nothing could be measured.", draw_quality),
    ("Stage times", "What each frame cost, by stage.", draw_stages),
    ("Drop causes", "What became of every frame that was due.", draw_drops),
)
