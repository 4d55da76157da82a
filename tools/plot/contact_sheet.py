# The contact sheet of run_report.py: approach on the left, closest picture large in the middle,
# departure on the right; all crops are of one pixel size, so that the target is seen to grow.
"""Draws contact_sheet.png."""

import math

import matplotlib.image
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LinearSegmentedColormap

ROWS = 3  # of small tiles; the large one is as high as all of them
SIDE_COLUMNS = 4  # of small tiles, left and right of the large one together
WIDTH, CELL, GAP, CAPTION, MARGIN = 2000, 252, 14, 34, 42  # px on the sheet
HEADER, CURVE, FOOTER = 150, 150, 46
PAGE, INK, DIM, ACCENT = "#0b0e14", "#eef1f5", "#8b95a5", "#f0b04a"
GREYS = LinearSegmentedColormap.from_list("night", ["#000000", "#7d8086", "#fffdf8"])
GREYS.set_bad("#141922")  # beyond the detector's edge


def points(px):
    """Text height in points for the sheet's 100 dpi."""
    return px * 0.72


def spread(run, rows, n):
    """n of the rows, even steps in time and in apparent size together, both ends included."""
    if len(rows) <= n:
        return list(rows)
    size = 1.0 / run.range_km[rows]
    step = np.abs(np.diff(size)) / max(np.ptp(size), 1e-12)
    step = step + np.diff(run.time_s[rows]) / max(np.ptp(run.time_s[rows]), 1e-12)
    along = np.concatenate([[0.0], np.cumsum(step)])
    chosen = []
    for k, goal in enumerate(np.linspace(0.0, along[-1], n)):
        first = chosen[-1] + 1 if chosen else 0
        last = len(rows) - (n - k)  # leaves one row for each that is still to be chosen
        chosen.append(first + int(np.argmin(np.abs(along[first : last + 1] - goal))))
    return [rows[i] for i in chosen]


def choose(run):
    """Rows of the table: those before the closest, the closest, those after it."""
    lit = [i for i in sorted(run.pictures) if target_shows(run, i)]
    if not lit:
        return [], None, []
    hero = min(lit, key=lambda i: run.range_km[i])
    before = [i for i in lit if i < hero]
    after = [i for i in lit if i > hero]
    columns = [math.ceil(len(side) / ROWS) for side in (before, after)]
    half = SIDE_COLUMNS // 2
    left = min(columns[0], max(half, SIDE_COLUMNS - columns[1]))
    right = min(columns[1], SIDE_COLUMNS - left)
    # One more than fits, as the closest itself ends either spread.
    before = spread(run, before + [hero], left * ROWS + 1)[:-1]
    after = spread(run, [hero] + after, right * ROWS + 1)[1:]
    return before, hero, after


def target_shows(run, i):
    """False once only the wings of its light reach the detector: such a picture is black."""
    u, v = run.target_u_px[i], run.target_v_px[i]
    width, height = (2 * b for b in run.boresight_px)
    has_light = np.isfinite(run.photocentre_u_px[i]) and np.isfinite(run.photocentre_v_px[i])
    return bool(has_light and -0.5 < u < width - 0.5 and -0.5 < v < height - 0.5)


def read_pictures(run, rows):
    """Row -> picture as fractions of full scale; what cannot be read is left out."""
    pictures = {}
    for i in rows:
        try:
            image = np.asarray(matplotlib.image.imread(run.pictures[i]), dtype=float)
        except (OSError, SyntaxError, ValueError):
            del run.pictures[i]  # so that another can be chosen in its place
            continue
        pictures[i] = image if image.ndim == 2 else image[..., :3].mean(axis=2)
    return pictures


def choose_readable(run):
    """Like choose, but over again while a chosen picture turns out to be broken."""
    while True:
        before, hero, after = choose(run)
        rows = before + ([] if hero is None else [hero]) + after
        pictures = read_pictures(run, rows)
        if len(pictures) == len(rows):
            return before, hero, after, pictures


def crop_side(run, pictures, black):
    """Pixels of a side that hold the target in every picture, its photocentre in the middle."""
    reach = 32.0
    for i, image in pictures.items():
        v, u = np.nonzero(image - black > 0.03)
        if len(u) > 20:
            far = np.maximum(abs(u - run.photocentre_u_px[i]), abs(v - run.photocentre_v_px[i]))
            reach = max(reach, float(np.quantile(far, 0.9995)))
    return 2 * int(math.ceil(min(reach * 1.10, 256.0)))


def crop(image, u, v, side):
    """A square about (u, v), not a number where it hangs over the detector's edge."""
    tile = np.full((side, side), np.nan)
    left, top = int(round(u)) - side // 2, int(round(v)) - side // 2
    rows = slice(max(top, 0), min(top + side, image.shape[0]))
    columns = slice(max(left, 0), min(left + side, image.shape[1]))
    if rows.start < rows.stop and columns.start < columns.stop:
        part = image[rows, columns]
        tile[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left] = part
    return tile


def stretch(tile, black, white):
    """asinh: nearly linear for the dim body, logarithmic for glints, so that both show."""
    fraction = np.clip((tile - black) / (white - black), 0.0, None)
    return np.arcsinh(30.0 * fraction) / math.asinh(30.0)


def bar_length_m(run, hero, side):
    """The longest round length that takes at most 0.6 of the closest tile."""
    most = 0.6 * side * run.range_km[hero] * 1e3 * run.ifov_rad
    power = 10.0 ** math.floor(math.log10(most))
    return max(m * power for m in (1, 2, 5) if m * power <= most)


def place(figure, x, y, width, height):
    """Axes at a place given in pixels from the sheet's upper left corner."""
    w, h = figure.get_size_inches() * 100
    return figure.add_axes([x / w, 1 - (y + height) / h, width / w, height / h])


def write(figure, x, y, text, px, **style):
    w, h = figure.get_size_inches() * 100
    style = {"color": INK, "va": "baseline", **style}
    figure.text(x / w, 1 - y / h, text, fontsize=points(px), **style)


def draw_tile(figure, run, i, tile, x, y, size, bar_m):
    """One picture with its scale bar inside and its caption below."""
    axes = place(figure, x, y, size, size)
    axes.imshow(tile, cmap=GREYS, vmin=0, vmax=1, interpolation="bicubic")
    axes.axis("off")
    side, big = tile.shape[0], size > 2 * CELL
    bar = bar_m / (run.range_km[i] * 1e3 * run.ifov_rad) * size / side
    inset = 26 if big else 12
    line = axes.transAxes
    axes.plot([inset / size, (inset + bar) / size], [inset / size] * 2, transform=line,
              color=INK, lw=2.0 if big else 1.3, solid_capstyle="butt")
    axes.text(inset / size, (inset + (9 if big else 5)) / size, f"{bar_m:g} m", transform=line,
              color=INK, fontsize=points(19 if big else 13), va="bottom")
    px = 22 if big else 15
    below = y + size + (30 if big else 22)
    write(figure, x, below, f"T+{run.time_s[i]:.1f} s", px, color=DIM)
    write(figure, x + size / 2, below, f"{run.range_km[i]:.{1 if big else 0}f} km", px,
          ha="center", weight="bold", color=ACCENT if big else INK)
    write(figure, x + size, below, f"phase {run.phase_deg[i]:.0f}°", px, ha="right", color=DIM)


def draw_header(figure, run):
    kind = "without commands" if run.open_loop else "pointed by commands"
    lost_s = run.figure(run.pointing, "lost_after_s")
    if lost_s is not None:
        kind += f", out of the field from T+{lost_s:.1f} s"
    write(figure, MARGIN, 82, run.scenario.upper(), 50, weight="bold")
    write(figure, MARGIN, 118, f"{run.time_s[-1]:.1f} s of the pass, {run.range_km[0]:.0f} km "
          f"to {run.range_km.min():.0f} km to {run.range_km[-1]:.0f} km, {kind}", 21, color=DIM)
    write(figure, WIDTH - MARGIN, 82, f"{run.closest_km:.2f} km", 50, ha="right", color=ACCENT)
    write(figure, WIDTH - MARGIN, 118, f"closest, at T+{run.closest_s:.1f} s", 21, ha="right",
          color=DIM)


def draw_curve(figure, run, rows, hero, y):
    """Range over the pass, with a dot for each picture: where the tiles lie between the ends."""
    axes = place(figure, MARGIN, y, WIDTH - 2 * MARGIN, CURVE - 60)
    axes.set_facecolor("none")
    axes.plot(run.time_s, run.range_km, color="#4a5568", lw=1.5, zorder=1)
    axes.scatter(run.time_s[rows], run.range_km[rows], s=26, color=INK, zorder=2)
    axes.scatter(run.time_s[hero], run.range_km[hero], s=60, color=ACCENT, zorder=3)
    axes.margins(x=0.014, y=0.12)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_yticks([])
    if len(run.time_s) == 1:
        axes.set_xticks(run.time_s)
    axes.tick_params(axis="x", colors=DIM, labelsize=points(15), length=0, pad=6)
    axes.xaxis.set_major_formatter(lambda t, _: f"T+{t:g} s")


def draw(run, path):
    """Writes the sheet; False if there is no picture with the target in it."""
    before, hero, after, pictures = choose_readable(run)
    if hero is None:
        return False
    black = float(np.median([np.median(image) for image in pictures.values()]))
    side = crop_side(run, pictures, black)
    tiles = {i: crop(m, run.photocentre_u_px[i], run.photocentre_v_px[i], side)
             for i, m in pictures.items()}
    white = max(max(float(np.nan_to_num(t).max()) for t in tiles.values()), black + 1e-3)
    tiles = {i: stretch(t, black, white) for i, t in tiles.items()}
    bar_m = bar_length_m(run, hero, side)

    row_height = CELL + CAPTION + GAP
    block = ROWS * row_height - GAP
    large = block - CAPTION
    height = HEADER + block + CURVE + FOOTER
    figure = plt.figure(figsize=(WIDTH / 100, height / 100), dpi=100, facecolor=PAGE)
    draw_header(figure, run)
    columns = [math.ceil(len(s) / ROWS) for s in (before, after)]
    x = (WIDTH - large - sum(columns) * (CELL + GAP)) / 2
    for part, n in ((before, columns[0]), ([hero], 0), (after, columns[1])):
        for k, i in enumerate(part):
            size = large if i == hero else CELL
            row, column = divmod(k, max(n, 1))
            draw_tile(figure, run, i, tiles[i], x + column * (CELL + GAP),
                      HEADER + row * row_height, size, bar_m)
        x += n * (CELL + GAP) if n else (large + GAP if part == [hero] else 0)
    draw_curve(figure, run, before + [hero] + after, hero, HEADER + block + 22)
    edge = any(np.isnan(t).any() for t in tiles.values())
    write(figure, MARGIN, height - 24, f"Each tile is {side} × {side} pixels about the photocentre,"
          f" all with one asinh stretch. Bar: {bar_m:g} m at the target. "
          "Curve: range, with a dot for each tile."
          + (" Lighter ground: beyond the detector's edge." if edge else ""), 15, color=DIM)
    figure.savefig(path, facecolor=PAGE)
    plt.close(figure)
    return True
