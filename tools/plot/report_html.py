#!/usr/bin/env python3
# Writes report.html into a run's folder, from its report.json, tables and pictures: one file that
# needs no other. Needs matplotlib and numpy only. Call: report_html.py FOLDER
"""A run as one page: verdict, counts, percentiles, plots. What is missing is said in its place."""

import base64
import csv
import html
import io
import json
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # no __pycache__ next to the sources

PAGE_STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.45 "DejaVu Sans", Verdana, sans-serif; color: #1c2127; background: #fff;
       max-width: 62rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.6rem; margin: 0 0 .2rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .4rem; border-bottom: 1px solid #d5dae1;
     padding-bottom: .2rem; }
p.note { color: #5d6673; margin: .2rem 0 .6rem; font-size: .9rem; }
p.missing { color: #7a4b00; background: #fff6e0; padding: .5rem .8rem; border-radius: 4px; }
.verdict { display: inline-block; padding: .25rem .9rem; border-radius: 4px; color: #fff;
           font-weight: bold; margin: .6rem 0; }
.good { background: #00795A; } .bad { background: #B3261E; } .none { background: #5d6673; }
table { border-collapse: collapse; margin: .5rem 0; font-size: .92rem; }
th, td { padding: .25rem .9rem .25rem 0; text-align: left; border-bottom: 1px solid #e3e7ec;
         vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
td.met { color: #00795A; font-weight: bold; } td.missed { color: #B3261E; font-weight: bold; }
svg, img { max-width: 100%; height: auto; }
.columns { display: flex; flex-wrap: wrap; gap: 0 3.5rem; }
section { break-inside: avoid; }
@media print { body { margin: 0; max-width: none; font-size: 11px; }
               .verdict { border: 1px solid #000; color: #000; background: none; } }
"""


class Unusable(Exception):
    """A folder that no page can be made from; its text is all that the user needs to see."""


def number(text):
    try:
        return float(text)
    except (TypeError, ValueError):
        return float("nan")


def read_table(path, troubles):
    """Column name -> numbers; empty when there is no such file."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            rows = list(reader)
    except (OSError, ValueError, csv.Error) as e:
        troubles.append(f"{path.name}: {getattr(e, 'strerror', None) or e}")
        return {}
    if not rows:
        troubles.append(f"{path.name}: no lines")
        return {}
    return {c: np.array([number(r[c]) for r in rows]) for c in reader.fieldnames}


class Run:
    """A run's folder in memory."""

    def __init__(self, folder):
        self.folder = Path(folder)
        path = self.folder / "report.json"
        try:
            with open(path, encoding="utf-8") as file:
                self.report = json.load(file)
        except (OSError, ValueError) as e:
            raise Unusable(f"{path}: {getattr(e, 'strerror', None) or e}") from e
        if not isinstance(self.report, dict):
            raise Unusable(f"{path}: not a report")
        self.troubles = []
        self.frames = read_table(self.folder / "frames.csv", self.troubles)
        self.detections = read_table(self.folder / "detections.csv", self.troubles)
        self.quality = (read_table(self.folder / "quality.csv", self.troubles)
                        if self.section("image_quality") else {})
        self.commands = read_table(self.folder / "commands.csv", self.troubles)

    def section(self, key):
        value = self.report.get(key)
        return value if isinstance(value, dict) else {}

    def figure(self, section, key):
        """The finite number under section and key, else None."""
        value = self.section(section).get(key)
        good = isinstance(value, (int, float)) and not isinstance(value, bool)
        return float(value) if good and np.isfinite(value) else None


def shown(value, digits=4):
    if value is None:
        return "&ndash;"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{digits}g}"
    return html.escape(str(value))


def table(header, rows, numbers_from=1):
    """Cells are HTML; those from column `numbers_from` on stand to the right."""
    def line(cells, tag):
        return "<tr>" + "".join(
            f'<{tag}{" class=n" if i >= numbers_from else ""}>{c}</{tag}>'
            for i, c in enumerate(cells)) + "</tr>"
    head = line(header, "th") if header else ""
    return f"<table>{head}{''.join(line(r, 'td') for r in rows)}</table>"


def verdict(run):
    met = run.report.get("criteria_met")
    if met is True:
        return '<p class="verdict good">All criteria met</p>'
    if met is False:
        return '<p class="verdict bad">Criteria not met</p>'
    return '<p class="verdict none">Not judged: open loop</p>'


def criteria(run):
    rows = []
    limit = run.figure("pointing", "limit_px")
    if limit:
        reached, frames = run.figure("pointing", "rms_px"), run.figure("pointing", "frames")
        after = run.figure("pointing", "after_s") or 0.0
        met = run.section("pointing").get("met")
        if not isinstance(met, bool):
            met = bool(frames) and reached is not None and reached <= limit
        rows.append((f"pointing error from {after:g} s on, px rms", reached, limit, met))
    judged = run.section("detection").get("criteria")
    for c in [c for c in judged if isinstance(c, dict)] if isinstance(judged, list) else []:
        rows.append((c.get("key", "?").replace("_", " "), c.get("reached"), c.get("limit"),
                     c.get("met") is True))
    if not rows or run.report.get("criteria_met") is None:
        return "<p class=note>No criterion was judged.</p>"
    body = "".join(
        f"<tr><td>{html.escape(name)}</td><td class=n>{shown(reached)}</td>"
        f"<td class=n>{shown(limit)}</td>"
        f'<td class={"met" if met else "missed"}>{"met" if met else "missed"}</td></tr>'
        for name, reached, limit, met in rows)
    return ("<table><tr><th>criterion</th><th class=n>reached</th><th class=n>limit</th><th></th>"
            f"</tr>{body}</table>")


def sum_of(run, section, whole, parts):
    """A whole and its parts, and whether they add up."""
    figures = [run.figure(section, k) for k in (whole, *parts)]
    if any(f is None for f in figures):
        return f"<p class=missing>report.json does not count {section} that way</p>"
    rows = [(html.escape(k.replace("_", " ")), f"{f:.0f}")
            for k, f in zip((*parts, whole), (*figures[1:], figures[0]))]
    rows[-1] = tuple(f"<b>{c}</b>" for c in rows[-1])
    wrong = figures[0] - sum(figures[1:])
    note = f"<p class=missing>{wrong:+.0f} do not add up</p>" if wrong else ""
    return table((section, "count"), rows) + note


def counts(run):
    blocks = [sum_of(run, "frames", "due", ("sent", "skipped", "dropped", "faults"))]
    if run.section("detection"):
        blocks.append(sum_of(run, "detection", "frames", ("answered", "unanswered")))
        blocks.append(sum_of(run, "detection", "detections",
                             ("matches", "false_alarms", "duplicates", "strays")))
    commands = [(html.escape(k), shown(v)) for k, v in run.section("commands").items()
                if not isinstance(v, (dict, list))]
    if commands:
        blocks.append(table(("commands", "count"), commands))
    return '<div class="columns">' + "".join(f"<div>{b}</div>" for b in blocks) + "</div>"


def detection(run):
    d = run.section("detection")
    if not d:
        return "<p class=missing>report.json has no scores of detections</p>"
    centroid = d.get("centroid_error") if isinstance(d.get("centroid_error"), dict) else {}
    rows = [
        ("detected, of the frames that show the target",
         f"{shown(d.get('detected'))} of {shown(d.get('detectable'))}"),
        ("detection rate", shown(d.get("detection_rate"))),
        ("false alarms per frame", shown(d.get("false_alarms_per_frame"))),
        ("centroid error: rms, p50, p95, max (px)",
         " / ".join(shown(centroid.get(k)) for k in ("rms", "p50", "p95", "max"))),
        ("centroid bias: u, v (px)",
         " / ".join(shown(centroid.get(k)) for k in ("bias_u", "bias_v"))),
        (f"boxes: mean overlap with the truth, of {shown(d.get('boxes'))}",
         shown(d.get("box_iou_mean"))),
        ("acquisition (s)", shown(d.get("acquisition_s"))),
        ("share of frames on target", shown(d.get("time_on_target"))),
    ]
    return table(None, rows)


def image_quality(run):
    q = run.section("image_quality")
    if not q:
        return "<p class=note>Pictures were not scored in this run (record.quality).</p>"
    without = q.get("without_score") if isinstance(q.get("without_score"), dict) else {}
    causes = "; ".join(f"{html.escape(k.replace('_', ' '))} {shown(v)}"
                       for k, v in without.items() if v)
    rows = [
        ("frames with a score", f"{shown(q.get('scored'))} of {shown(q.get('frames'))}"
         + (f" ({causes})" if causes else "")),
        ("score: median (dB)", shown(q.get("median_score_db"))),
        ("score: worst (dB), in frame",
         f"{shown(q.get('worst_score_db'))}, {shown(q.get('worst_frame'))}"),
        ("sharpness: median", shown(q.get("median_sharpness"))),
        ("contrast: median (sigma)", shown(q.get("median_contrast_sigma"))),
        ("noise of the background: median (DN)", shown(q.get("median_noise_dn"))),
    ]
    return table(None, rows)


def percentiles(run):
    rows = []
    for name, p in run.section("statistics").items():
        if isinstance(p, dict):
            cells = [shown(p.get(k)) for k in ("count", "p50", "p99", "p99_9", "max")]
            rows.append((f"{html.escape(name)} ({html.escape(str(p.get('unit', '')))})", *cells))
    if not rows:
        return "<p class=missing>report.json has no statistics</p>"
    note = ("<p class=note>By nearest rank: p99 is the smallest value that 99 % of the frames do not "
            "exceed. In a lockstep run the loop's clock is simulated: late and busy are 0.</p>")
    return table(("", "count", "p50", "p99", "p99.9", "max"), rows) + note


def about(run):
    passage = run.section("pass")
    rows = [(k, shown(run.report.get(k))) for k in ("clock", "seed", "threads", "open_loop")
            if k in run.report]
    rows += [(f"pass {k}", shown(v, 9)) for k, v in passage.items()]
    left_out = run.report.get("left_out")
    if isinstance(left_out, list):
        rows.append(("left out", html.escape("; ".join(map(str, left_out)))))
    return table(None, [(html.escape(k.replace("_", " ")), v) for k, v in rows], numbers_from=9)


def as_svg(figure):
    text = io.StringIO()
    figure.savefig(text, format="svg", dpi=150, metadata={"Date": None, "Creator": None})
    plt.close(figure)
    svg = text.getvalue()
    return svg[svg.index("<svg"):]


def plots(run, keep):
    """Every plot as a section of its own; `keep`, if given, also gets each as a PNG."""
    for title, note, draw in report_plots.PLOTS:
        with plt.rc_context({**report_plots.STYLE, "font.size": 9.5, "svg.hashsalt": title,
                             "svg.fonttype": "path"}):
            try:
                figure = draw(run)
                if keep:
                    figure.savefig(keep / f"{title.lower().replace(' ', '_')}.png", dpi=90)
                content = f"<p class=note>{note}</p>{as_svg(figure)}"
            except report_plots.Missing as e:
                plt.close("all")
                content = f"<p class=missing>Not drawn: {html.escape(str(e))}.</p>"
        yield f"<section><h2>{title}</h2>{content}</section>"


def picture(run, name, title):
    path = run.folder / name
    if not path.is_file():
        return f"<section><h2>{title}</h2><p class=missing>No {name} in this run.</p></section>"
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return (f'<section><h2>{title}</h2><img alt="{title}" src="data:image/png;base64,{data}">'
            "</section>")


def page(run, keep=None):
    name = html.escape(str(run.report.get("scenario", "run")))
    parts = [
        f"<h1>Starloop: {name}</h1><p class=note>{html.escape(run.folder.resolve().name)}</p>",
        verdict(run), criteria(run),
        f"<section><h2>Counts</h2>{counts(run)}</section>",
        f"<section><h2>Detections</h2>{detection(run)}</section>",
        f"<section><h2>Image quality</h2>{image_quality(run)}</section>",
        f"<section><h2>Percentiles</h2>{percentiles(run)}</section>",
        *plots(run, keep),
        picture(run, "contact_sheet.png", "What the camera saw"),
        picture(run, "pointing_error.png", "Pointing error in detail"),
        f"<section><h2>About this run</h2>{about(run)}</section>",
    ]
    parts[3:3] = [f"<p class=missing>{html.escape(t)}</p>" for t in run.troubles]
    return ('<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width">'
            f"<title>Starloop: {name}</title><style>{PAGE_STYLE}</style></head><body>"
            + "\n".join(parts) + "</body></html>\n")


def main(arguments):
    if len(arguments) not in (1, 2):
        raise Unusable("call: report_html.py FOLDER [FOLDER_FOR_THE_PLOTS_AS_PNG]")
    run = Run(arguments[0])
    keep = Path(arguments[1]) if len(arguments) == 2 else None
    text = page(run, keep)
    (run.folder / "report.html").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    try:  # the imports too: without matplotlib, one line is to say so
        import matplotlib

        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
        import numpy as np

        import report_plots

        main(sys.argv[1:])
    except (Unusable, OSError, ValueError, ImportError) as e:
        print(f"report_html.py: {e}", file=sys.stderr)
        sys.exit(2)
