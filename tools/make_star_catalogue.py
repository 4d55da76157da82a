#!/usr/bin/env python3
"""Makes the star catalogue that Starloop has built in, data/stars.bin, out of two free sources.

    apt-get download astrometry-data-tycho2-07-littleendian && dpkg -x *.deb tycho2
    npm pack d3-celestial && tar xzf d3-celestial-*.tgz
    tools/make_star_catalogue.py \\
        tycho2/usr/share/astrometry/index-tycho2-07.littleendian.fits \\
        package/data/stars.14.json data/stars.bin [--limit 11]

Tycho-2 (Hog et al. 2000, A&A 355, L27) as astrometry.net's index has it: mean places at J2000 and VT,
BSD-2-Clause; of each 0.14 square degrees the ten brightest. It has no colours, no motions and not the
brightest stars. XHIP (Anderson & Francis 2012, Astron. Lett. 38, 331) as d3-celestial has it,
BSD-3-Clause: V, B-V and places at J2000, rounded to 1e-4 degrees, of the 118 216 stars of Hipparcos.
d3-celestial has left XHIP's motions out: its version 0.7.35 gives a star an id, `mag`, `bv` and
coordinates, and nothing else. Where both have a star, the place is Tycho-2's and the light XHIP's. The
motions of the brightest and of the fastest stars are copied from Hipparcos (ESA 1997, SP-1200), MOTIONS
below.

The format is described in engine/scene/star_catalogue.h. Needs numpy. Prints what it did."""

import argparse
import json
import os
import struct

import numpy as np

ZONES = 120
CELLS_AT_EQUATOR = 240
STEPS = 1 << 20
NO_COLOUR = 255
# V = VT - 0.090 (BT - VT) and B - V = 0.850 (BT - VT) (Hog et al. 2000), at the median colour of XHIP.
TYCHO_SLOPE = 0.090 / 0.850

# Hipparcos number: mas/yr in right ascension (times cos dec) and declination.
MOTIONS = {
    32349: (-546.01, -1223.08),  # Sirius
    30438: (19.99, 23.67),  # Canopus
    71683: (-3678.19, 481.84),  # Rigil Kentaurus
    71681: (-3600.35, 952.11),  # Toliman
    69673: (-1093.45, -1999.40),  # Arcturus
    91262: (201.02, 287.46),  # Vega
    24608: (75.52, -427.13),  # Capella
    24436: (1.87, -0.56),  # Rigel
    37279: (-716.57, -1034.58),  # Procyon
    7588: (88.02, -40.08),  # Achernar
    27989: (27.33, 10.86),  # Betelgeuse
    68702: (-33.96, -25.06),  # Hadar
    97649: (536.82, 385.54),  # Altair
    21421: (62.78, -189.36),  # Aldebaran
    80763: (-10.16, -23.21),  # Antares
    65474: (-42.50, -31.73),  # Spica
    37826: (-625.69, -45.95),  # Pollux
    113368: (329.22, -164.22),  # Fomalhaut
    102098: (1.56, 1.55),  # Deneb
    49669: (-249.40, 4.91),  # Regulus
    11767: (44.22, -11.74),  # Polaris
    36850: (-206.33, -148.18),  # Castor
    8102: (-1721.82, 854.07),  # tau Ceti
    16537: (-976.44, 17.97),  # epsilon Eridani
    19849: (-2239.33, -3419.86),  # 40 Eridani
    24186: (6506.05, -5731.39),  # Kapteyn's star
    54035: (-580.20, -4767.09),  # Lalande 21185
    57939: (4003.69, -5813.00),  # Groombridge 1830
    87937: (-797.84, 10326.93),  # Barnard's star
    104214: (4155.10, 3258.90),  # 61 Cygni A
    104217: (4107.40, 3143.72),  # 61 Cygni B
    108870: (3959.97, -2538.84),  # epsilon Indi
}


def tables_of(path):
    """Of a FITS file: for each table its first column's name, where its data begin and end."""
    tables = {}
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        at = 0
        while at < size:
            file.seek(at)
            header = {}
            ended = False
            while not ended:
                block = file.read(2880)
                if len(block) < 2880:
                    raise SystemExit(f"{path}: ends within a header")
                for i in range(0, 2880, 80):
                    card = block[i:i + 80].decode("latin1")
                    ended = ended or card.startswith("END ")
                    if card[8:9] == "=":
                        header[card[:8].strip()] = card[10:].split("/")[0].strip(" '")
            data = file.tell()
            length = 0
            if int(header["NAXIS"]) > 0:
                length = abs(int(header["BITPIX"])) // 8
                for k in range(int(header["NAXIS"])):
                    length *= int(header[f"NAXIS{k + 1}"])
            if "TTYPE1" in header:
                tables[header["TTYPE1"].strip()] = (data, data + length)
            at = data + (length + 2879) // 2880 * 2880
    return tables


def read_tycho2(path):
    tables = tables_of(path)
    with open(path, "rb") as file:
        raw = file.read()

    def column(name, kind):
        begin, end = tables[name]
        return np.frombuffer(raw[begin:end], kind)

    scale = column("kdtree_range_stars", "<f8")
    units = scale[:3] + column("kdtree_data_stars", "<u4").reshape(-1, 3) / scale[6]
    units /= np.linalg.norm(units, axis=1)[:, None]
    return units, column("MAG_VT", ">f4").astype(float), column("sweep", "u1")


def read_xhip(path):
    with open(path) as file:
        stars = json.load(file)["features"]
    number = np.array([s["id"] for s in stars])
    place = np.radians([s["geometry"]["coordinates"] for s in stars])
    ra, dec = place[:, 0], place[:, 1]
    units = np.stack([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)], axis=1)
    v = np.array([float(s["properties"]["mag"]) for s in stars])
    colour = np.array([float(s["properties"]["bv"] or "nan") for s in stars])
    return number, units, v, colour


ARCSECOND = np.pi / 648000


def match(tycho, v_tycho, xhip, v_xhip):
    """For each star of XHIP its star in Tycho-2, or -1. Nearest first; a second round looks further,
    since Tycho-2 has some fast stars where they stood in 1991, but only for the same light."""
    order = np.argsort(tycho[:, 2])
    z = tycho[order, 2]
    partner = np.full(len(xhip), -1)
    taken = np.zeros(len(tycho), bool)
    apart = np.zeros(len(xhip))
    for reach, most_light in ((3.0, 1.0), (1.5, 9.0), (40.0, 0.35)):
        r = reach * ARCSECOND
        low = np.searchsorted(z, xhip[:, 2] - r)
        high = np.searchsorted(z, xhip[:, 2] + r)
        for i in np.argsort(v_xhip):
            if partner[i] >= 0 or low[i] == high[i] or (reach > 3 and v_xhip[i] > 10):
                continue
            near = order[low[i]:high[i]]
            d = np.linalg.norm(tycho[near] - xhip[i], axis=1)
            good = (d < r) & (np.abs(v_tycho[near] - v_xhip[i]) < most_light) & ~taken[near]
            if good.any():
                k = np.argmin(np.where(good, d, 9.0))
                partner[i], taken[near[k]], apart[i] = near[k], True, d[k] / ARCSECOND
    return partner, apart


def cells_of(zone):
    middle = (zone + 0.5) * np.pi / ZONES - np.pi / 2
    return np.maximum(1, np.floor(CELLS_AT_EQUATOR * np.cos(middle) + 0.5)).astype(int)


def write(path, units, v, colour, motion):
    """`motion`: index -> (mas/yr, mas/yr)."""
    ra = np.degrees(np.arctan2(units[:, 1], units[:, 0])) % 360.0
    dec = np.degrees(np.arcsin(np.clip(units[:, 2], -1, 1)))
    zone = np.clip(((dec + 90.0) / 180.0 * ZONES).astype(int), 0, ZONES - 1)
    cells = cells_of(np.arange(ZONES))
    first = np.concatenate([[0], np.cumsum(cells)])
    across = ra / 360.0 * cells[zone]
    column = np.minimum(across.astype(int), cells[zone] - 1)
    up = (dec + 90.0) / 180.0 * ZONES - zone
    x = np.clip(((across - column) * STEPS).astype(np.int64), 0, STEPS - 1)
    y = np.clip((up * STEPS).astype(np.int64), 0, STEPS - 1)
    light = np.clip(np.round((v + 2.0) / 0.005), 0, 4095).astype(np.int64)
    shade = np.where(np.isnan(colour), NO_COLOUR,
                     np.clip(np.round((np.nan_to_num(colour) + 0.5) / 0.025), 0, 254))
    record = (x | y << 20 | light << 40 | shade.astype(np.int64) << 52).astype("<u8")
    cell = first[zone] + column
    order = np.lexsort((record, light, cell))
    counts = np.bincount(cell, minlength=first[-1])
    new_index = np.empty(len(order), int)
    new_index[order] = np.arange(len(order))
    moving = sorted((new_index[i], pm) for i, pm in motion.items())
    with open(path, "wb") as file:
        file.write(struct.pack("<8sIIIId", b"SLSTARS1", ZONES, CELLS_AT_EQUATOR, len(record),
                               len(moving), 2000.0))
        file.write(counts.astype("<u4").tobytes())
        file.write(record[order].tobytes())
        for i, (pm_ra, pm_dec) in moving:
            file.write(struct.pack("<Iff", i, pm_ra, pm_dec))
    return os.path.getsize(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tycho2")
    parser.add_argument("xhip")
    parser.add_argument("out")
    parser.add_argument("--limit", type=float, default=11.0, help="faintest V")
    options = parser.parse_args()

    tycho, vt, sweep = read_tycho2(options.tycho2)
    number, xhip, v_xhip, colour_xhip = read_xhip(options.xhip)
    median = float(np.nanmedian(colour_xhip))
    v_tycho = vt - TYCHO_SLOPE * median
    partner, apart = match(tycho, v_tycho, xhip, v_xhip)
    paired = partner >= 0
    exact = paired & (apart < 1.0)
    units = np.concatenate([np.where(exact[:, None], tycho[partner], xhip),
                            np.delete(tycho, partner[paired], axis=0)])
    v = np.concatenate([v_xhip, np.delete(v_tycho, partner[paired])])
    colour = np.concatenate([colour_xhip, np.full(len(v) - len(v_xhip), np.nan)])
    kept = np.flatnonzero(v <= options.limit)
    places = {int(number[i]): n for n, i in enumerate(kept) if i < len(number)}
    motion = {places[h]: pm for h, pm in MOTIONS.items() if h in places}
    size = write(options.out, units[kept], v[kept], colour[kept], motion)

    # The index numbers its sweeps over the cells in 256 equal shares; the tenth, and last, begins where
    # the magnitudes do so for the last time.
    first = np.array([vt[sweep == s].min() for s in range(256)])
    tenth = np.flatnonzero(np.diff(first) < -0.5)[-1] + 1
    full = (sweep > tenth) & (v_tycho <= options.limit)
    print(f"{options.out}: {len(kept)} stars to V {options.limit}, {size} bytes; "
          f"{np.sum(~np.isnan(colour[kept]))} with a colour (median B-V {median:.2f}), "
          f"{len(motion)} with a motion")
    print(f"XHIP: {paired.sum()} of {len(number)} found in Tycho-2, {exact.sum()} within 1\"; "
          f"median {np.median(apart[exact]):.3f}\" apart")
    print(f"{100.0 * full.sum() / (41252.96 / 0.14126):.1f} % of the sky has ten stars of Tycho-2 to "
          f"that limit in 0.14 square degrees, and may have more that are missing")


if __name__ == "__main__":
    main()
