# The sheet of `starloop stages`, after figure 14 of Li et al. 2023: what vibration and photon noise
# do to one radiance.
"""stages.py FILE.png: draws it from FILE_a.fits to FILE_d.fits."""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import PowerNorm
from matplotlib.ticker import MaxNLocator

from pointing_error import GREY, STYLE, Y

BLOCK, CARD = 2880, 80
SIDE_PX = 28  # of the detail
MAGNIFIED = 0.31  # of a picture's side


def read_fits(path):
    """Cards by name, and the image: what starloop writes, 16 bits with BZERO."""
    data = path.read_bytes()
    cards = {}
    for at in range(0, len(data), CARD):
        card = data[at:at + CARD].decode("ascii")
        if card.startswith("END"):
            break
        if card[8:10] == "= ":
            value = card[10:]
            value = value.split("'")[1].rstrip() if value.startswith("'") else value.split("/")[0]
            cards[card[:8].strip()] = value.strip()
    begin = -(-(at + CARD) // BLOCK) * BLOCK
    width, height = int(cards["NAXIS1"]), int(cards["NAXIS2"])
    image = np.frombuffer(data, ">i2", width * height, begin).reshape(height, width)
    return cards, image.astype(float) + float(cards.get("BZERO", 0))


def crop_about(lit, shape):
    """(rows, columns): a square about what is lit, with a margin; all of it when nothing is."""
    if not lit.any():
        return slice(0, shape[0]), slice(0, shape[1])
    places = [np.flatnonzero(lit.any(axis=axis)) for axis in (1, 0)]
    side = int(1.3 * max(p[-1] - p[0] + 1 for p in places)) + 8
    crop = []
    for p, size in zip(places, shape):
        begin = int(np.clip((p[0] + p[-1] + 1 - side) // 2, 0, max(size - side, 0)))
        crop.append(slice(begin, min(begin + side, size)))
    return tuple(crop)


def busiest(change, side):
    """(row, column) of the square that changes most."""
    sums = np.pad(np.cumsum(np.cumsum(change**2, axis=0), axis=1), ((1, 0), (1, 0)))
    boxes = sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]
    return np.unravel_index(np.argmax(boxes), boxes.shape)


def darkest_corner(image):
    """(left, top) of the detail's place, in shares of the picture: it hides what it lies on."""
    height, width = (int(MAGNIFIED * n) for n in image.shape)
    light = {(x, y): image[slice(height) if y else slice(-height, None),
                           slice(width) if not x else slice(-width, None)].sum()
             for x in (0, 1) for y in (0, 1)}
    x, y = min(light, key=light.get)
    return [0.99 - MAGNIFIED if end else 0.01 for end in (x, y)]


def main():
    path = Path(sys.argv[1])
    stages = [read_fits(path.with_name(f"{path.stem}_{letter}.fits")) for letter in "abcd"]
    cards, first = stages[0]
    black = float(cards["PEDESTAL"])
    mean_images = np.maximum(first, stages[1][1])
    crop = crop_about(mean_images - black > 0.02 * max(mean_images.max() - black, 1), first.shape)
    images = [image[crop] for _, image in stages]
    # A glint is brighter than all else: it may be white, the rest should be seen. On a scale of
    # roots photon noise is the same everywhere.
    lit = images[0][images[0] > black + 1]
    white = max(np.percentile(lit, 99) if lit.size else 0, black + 1)
    roots = [np.sqrt(np.clip(image - black, 0, white - black)) for image in images]
    # Where the second of them changes most, or, with no vibration, the third.
    side = min(SIDE_PX, *images[0].shape)
    second = roots[1] if np.any(images[1] != images[0]) else roots[2]
    top, left = busiest(second - roots[0], side)
    place = darkest_corner(roots[0])

    plt.rcParams.update(STYLE)
    figure, axes = plt.subplots(2, 2, figsize=(11, 12), layout="constrained")
    for axis, image, (card, _) in zip(axes.flat, images, stages):
        grey = {"cmap": "gray", "interpolation": "nearest",
                "norm": PowerNorm(0.5, vmin=black, vmax=white)}
        shown = axis.imshow(image, **grey)
        axis.add_patch(plt.Rectangle((left - 0.5, top - 0.5), side, side, fill=False,
                                     edgecolor=Y, linewidth=1))
        detail = axis.inset_axes((*place, MAGNIFIED, MAGNIFIED))
        detail.imshow(image[top:top + side, left:left + side], **grey)
        for each in (axis, detail):
            each.set(xticks=[], yticks=[])
            each.grid(False)
        for spine in detail.spines.values():
            spine.set(visible=True, color=Y, linewidth=1.2)
        for spine in axis.spines.values():
            spine.set_visible(False)
        shows = card["SHOWS"]
        if card["STAGE"] in "bd":
            shows = shows.replace("vibration", f"vibration of {float(card['VIBRAT']):g} µrad")
        axis.set_title(f"({card['STAGE']}) {shows}", loc="left", fontsize=12)
        off = "" if card["STAGE"] == "a" else f", rms off (a) {float(card['RMSOFF']):.1f} DN"
        axis.set_xlabel(f"peak {card['PEAK']} DN, mean {float(card['MEAN']):.1f} DN{off}",
                        loc="left", fontsize=10.5, color="#222222")
    bar = figure.colorbar(shown, ax=axes, shrink=0.5, aspect=40, pad=0.01, extend="max",
                          location="bottom", ticks=MaxNLocator(5))
    bar.set_label(f"DN, by their roots, one scale for all; means of {cards['LITPX']} px that the "
                  f"target lights\n{cards['SCENARIO']} at {float(cards['TIME']):.2f} s, "
                  f"exposure {1e3 * float(cards['EXPTIME']):g} ms, {images[0].shape[1]} × "
                  f"{images[0].shape[0]} px, details {side} × {side} px", color=GREY)
    bar.outline.set_visible(False)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
