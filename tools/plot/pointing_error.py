# The pointing plot of run_report.py: what becomes of the target with and without commands, at full
# scale; how well it is held, around zero; and the range below, as the cause of the hard part.
"""Draws pointing_error.png."""

import matplotlib.pyplot as plt
import numpy as np

# Okabe and Ito's colours, told apart by colour-blind readers too: one for each axis everywhere.
X, Y, SIZE, LIMIT = "#0072B2", "#D55E00", "#222222", "#00795A"
GREY = "#5d6673"
STYLE = {
    "font.family": "DejaVu Sans", "font.size": 10.5, "axes.edgecolor": "#9aa3af",
    "axes.labelcolor": "#222222", "xtick.color": GREY, "ytick.color": GREY, "axes.grid": True,
    "grid.color": "#e3e7ec", "grid.linewidth": 0.7, "axes.spines.top": False,
    "axes.spines.right": False, "axes.axisbelow": True,
}


def roles(run, other):
    """(held, lost): the run with commands and the one without; None for one that is missing."""
    runs = [r for r in (run, other) if r is not None]
    held = next((r for r in runs if not r.open_loop), None)
    lost = next((r for r in runs if r.open_loop), None)
    return held, lost


def inside(run):
    """Where the target's centre is on the detector."""
    width, height = (2 * b for b in run.boresight_px)
    u, v = run.target_u_px, run.target_v_px
    return (u > -0.5) & (u < width - 0.5) & (v > -0.5) & (v < height - 0.5)


def error_without(lost):
    """x and y of an open-loop run. Off the detector, what light is left there misleads, so that
    the target's centre takes the place of the photocentre."""
    both = []
    use = inside(lost) & np.isfinite(lost.error_u_px) & np.isfinite(lost.error_v_px)
    for axis, boresight in zip("uv", lost.boresight_px):
        centre = getattr(lost, f"target_{axis}_px") - boresight
        both.append(np.where(use, getattr(lost, f"error_{axis}_px"), centre))
    return both


def error_if_without(held):
    """x and y as they would be with no trim, from a closed-loop run: a trim tilts the boresight
    towards +x, which moves the target by -trim / ifov, so undoing it adds trim / ifov."""
    both = []
    for axis, trim, boresight in zip("uv", "xy", held.boresight_px):
        centre = getattr(held, f"target_{axis}_px") - boresight
        both.append(centre + getattr(held, f"trim_{trim}_urad") * 1e-6 / held.ifov_rad)
    return both


def leaving(run, error):
    """Index of the first point beyond the field's edge, which is half a pixel out, or None."""
    beyond = [abs(e + 0.5) > half for e, half in zip(error, run.boresight_px)]
    out = np.nonzero(beyond[0] | beyond[1])[0]
    return int(out[0]) if len(out) else None


def line(axes, time, values, **style):
    """A line, and a dot where a run is too short for one."""
    axes.plot(time, values, marker="o" if len(time) < 3 else None, **style)


def draw_loss(axes, held, lost):
    """The upper panel: both runs at the scale at which the target is lost."""
    without = lost or held
    error = error_without(lost) if lost else error_if_without(held)
    how = "without commands" if lost else "without commands (computed)"
    t = without.time_s
    half = without.boresight_px
    axes.axhspan(-half[0], half[0], color="#eef3f8", zorder=0)
    for edge in {s * h for s in (-1, 1) for h in half}:
        axes.axhline(edge, color=GREY, lw=0.9, zorder=1)
    line(axes, t, error[0], color=X, lw=2.2, ls=(0, (5, 2)), label=f"x {how}")
    line(axes, t, error[1], color=Y, lw=2.2, ls=(0, (5, 2)), label=f"y {how}")
    if held:
        line(axes, held.time_s, held.error_u_px, color=X, lw=1.8, label="x with commands")
        line(axes, held.time_s, held.error_v_px, color=Y, lw=1.3, label="y with commands")
    mark_leaving(axes, without, error)
    reach = np.concatenate(error + [[-half[0], half[0]]])
    low, high = np.nanmin(reach), np.nanmax(reach)
    axes.set_ylim(low - 0.06 * (high - low), high + 0.08 * (high - low))
    axes.text(0.995, half[0], f"edge of the {2 * half[0]:.0f} px field ", color=GREY, fontsize=9,
              transform=axes.get_yaxis_transform(), ha="right", va="bottom")
    axes.set_ylabel("pointing error (px)")


def mark_leaving(axes, run, error):
    i = leaving(run, error)
    if i is None:
        return
    which = int(np.argmax([abs(error[k][i]) / run.boresight_px[k] for k in (0, 1)]))
    t, e = run.time_s[i], error[which][i]
    axes.plot(t, e, "o", ms=8, mfc="white", mec=(X, Y)[which], mew=2, zorder=5)
    axes.annotate(f"leaves the field after {t:.1f} s", (t, e), xytext=(10, 8 if e < 0 else -8),
                  textcoords="offset points", va="bottom" if e < 0 else "top", fontsize=10.5)


def draw_hold(axes, held):
    """The lower panel: around zero linear, beyond it logarithmic, as the run begins far off."""
    t = held.time_s
    size = np.hypot(held.error_u_px, held.error_v_px)
    line(axes, t, held.error_u_px, color=X, lw=1.3, label="x")
    line(axes, t, held.error_v_px, color=Y, lw=1.3, label="y")
    draw_tracker(axes, held, 0.5)
    draw_score(axes, held)
    line(axes, t, size, color=SIZE, lw=0.8, alpha=0.5, zorder=1.5, label="magnitude")
    axes.fill_between(t, size, color=SIZE, alpha=0.08, lw=0, zorder=1)
    scale(axes, np.concatenate([held.error_u_px, held.error_v_px, size]))
    axes.set_ylabel("pointing error (px)")


def draw_tracker(axes, run, alpha):
    """The tracker's own share of the error: no loop can hold better than it measures."""
    for axis, name, colour in (("u", "x", X), ("v", "y", Y)):
        measured = getattr(run, f"tracker_{axis}_px") - getattr(run, f"photocentre_{axis}_px")
        axes.plot(run.time_s, measured, ".", color=colour, ms=4, alpha=alpha, mew=0,
                  label=f"tracker minus photocentre, {name}")


def draw_score(axes, held):
    """The criterion, and what was reached in the time that it counts."""
    limit, rms, after = (held.figure(held.pointing, k) for k in ("limit_px", "rms_px", "after_s"))
    if limit:
        axes.axhspan(-limit, limit, color=LIMIT, alpha=0.10, lw=0, zorder=0)
        axes.axhline(limit, color=LIMIT, lw=1.2, ls="--", label=f"criterion: {limit:g} px rms")
    if rms and after is not None and held.time_s[-1] > after:
        axes.plot([after, held.time_s[-1]], [rms, rms], color=LIMIT, lw=1.8,
                  label=f"reached: {rms:.2f} px rms from {after:g} s on")


def scale(axes, values):
    """Linear to 1 px, where the criterion is, and logarithmic beyond."""
    values = np.append(values[np.isfinite(values)], [-1.0, 1.0])
    axes.set_yscale("symlog", linthresh=1.0, linscale=1.5)
    axes.set_ylim(1.6 * values.min(), 1.6 * values.max())
    decades = [1.0, 10.0, 100.0, 1000.0]
    ticks = [-d for d in reversed(decades)] + [-0.5, 0.0, 0.5] + decades
    ticks = [v for v in ticks if axes.get_ylim()[0] <= v <= axes.get_ylim()[1]]
    axes.set_yticks(ticks)
    axes.set_yticklabels([f"{v:g}".replace("-", "\u2212") for v in ticks])
    axes.minorticks_off()


def draw_legend(axes):
    """Above the panel, where no data can be."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.004, 0.995), frameon=False, fontsize=9,
                ncol=4, columnspacing=1.6, handlelength=1.8, borderaxespad=0.2)


def draw_range(axes, run):
    line(axes, run.time_s, run.range_km, color=GREY, lw=1.5)
    axes.fill_between(run.time_s, run.range_km, color=GREY, alpha=0.10, lw=0)
    axes.set_ylim(0, 1.15 * run.range_km.max())
    axes.locator_params(axis="y", nbins=3)
    axes.set_ylabel("range (km)")
    axes.set_xlabel("time since start (s)")
    axes.annotate(f"closest: {run.closest_km:.1f} km", (run.closest_s, run.closest_km),
                  xytext=(0, 7), textcoords="offset points", ha="center", color="#222222",
                  fontsize=9.5)


def draw(run, other, path):
    """Writes the plot; the panels share their time axis."""
    held, lost = roles(run, other)
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(
            3, 1, sharex=True, figsize=(12.5, 10), dpi=130,
            gridspec_kw={"height_ratios": [3.1, 3.6, 1.0], "hspace": 0.26, "left": 0.075,
                         "right": 0.975, "top": 0.895, "bottom": 0.06})
        draw_loss(panels[0], held, lost)
        panels[0].set_title("Where the target is in the field", loc="left", fontsize=11.5)
        if held:
            draw_hold(panels[1], held)
            panels[1].set_title("How well it is held\n", loc="left", fontsize=11.5, pad=3)
            panels[1].text(0, 1.012, "with commands; linear to 1 px, logarithmic beyond",
                           transform=panels[1].transAxes, fontsize=9, color=GREY)
        else:
            draw_tracker(panels[1], lost, 0.9)
            scale(panels[1], np.concatenate([lost.tracker_u_px - lost.photocentre_u_px,
                                             lost.tracker_v_px - lost.photocentre_v_px]))
            panels[1].set_ylabel("tracker's error (px)")
            panels[1].set_title("How well it is measured, while in the field", loc="left",
                                fontsize=11.5)
        for panel in panels[:2]:
            draw_legend(panel)
        draw_range(panels[2], run)
        if run.time_s[-1] > 0:
            panels[2].set_xlim(0, run.time_s[-1])
        figure.align_ylabels(panels)
        figure.suptitle(f"Pointing error, {run.scenario}: photocentre minus boresight", x=0.075,
                        y=0.965, ha="left", fontsize=16, weight="bold")
        figure.savefig(path)
        plt.close(figure)
