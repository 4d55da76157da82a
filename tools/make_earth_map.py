#!/usr/bin/env python3
"""Prints engine/scene/earth_map_cells.inc: what covers the Earth, in cells of 2 x 2 degrees.

    npm pack world-atlas@2.0.2 && tar xzf world-atlas-2.0.2.tgz
    tools/make_earth_map.py package/land-110m.json > engine/scene/earth_map_cells.inc

Land is Natural Earth's, 1:110 million, in the public domain. Deserts and ice sheets are drawn here
by hand, as ellipses and boxes: the dry ones, whose ground is bright, and the great ones.
"""

import json
import sys

import numpy as np

CELL_DEG = 2
SUB = 8  # places on a cell's side

# Latitude and longitude of the middle, half height, half width, in degrees.
DESERTS = [
    (23.5, 6, 8.5, 23), (21, 27, 8, 8),                                      # Sahara
    (29, 3, 4, 9), (22, 48, 9, 8), (30, 43, 5, 5),                           # Arabia
    (32, 57, 4, 6), (28.5, 65, 3, 4), (27, 71, 3, 3),                        # Iran to Thar
    (41, 59, 4, 6), (39.5, 84, 3, 8), (42, 104, 4, 9), (37.5, 94, 2, 4),     # Karakum to Gobi
    (-24, 129, 7, 12), (-28, 138, 4, 4), (-21, 123, 3, 5),                   # Australia
    (-23, 16, 7, 4), (-24, 21, 4, 3),                                        # Namib, Kalahari
    (-22, -69, 5, 2), (-42, -68, 6, 3),                                      # Atacama, Patagonia
    (33, -114, 4, 4), (38, -116, 3, 3), (28, -105, 4, 2),                    # North America
    (8, 48, 4, 3), (13, 42, 2, 2),                                           # Horn of Africa
]
# South, north, west, east: land in there is under ice.
ICE = [(-90, -60, -180, 180), (61, 70, -50, -32), (70, 82.5, -55, -24), (76, 81, -68, -55)]


def unrolled(ring):
    """Longitudes without the step at the date line; round the south pole by way of it."""
    ring = ring.copy()
    ring[:, 0] = np.degrees(np.unwrap(np.radians(ring[:, 0])))
    if abs(ring[-1, 0] - ring[0, 0]) > 180:
        below = [[ring[-1, 0], -90], [ring[0, 0], -90], ring[0]]
        ring = np.concatenate([ring, below])
    return ring


def rings(topology):
    """The rings of the land, in degrees; holes are rings like others."""
    scale, shift = topology["transform"]["scale"], topology["transform"]["translate"]
    arcs = [np.cumsum(np.array(arc), axis=0) * scale + shift for arc in topology["arcs"]]

    def ring(indices):
        parts = [arcs[i] if i >= 0 else arcs[~i][::-1] for i in indices]
        return np.concatenate([parts[0]] + [p[1:] for p in parts[1:]])

    for geometry in topology["objects"]["land"]["geometries"]:
        polygons = geometry["arcs"] if geometry["type"] == "MultiPolygon" else [geometry["arcs"]]
        for polygon in polygons:
            for indices in polygon:
                yield unrolled(ring(indices))


def inside(land, latitude, longitude):
    """Which places lie inside an odd number of rings."""
    odd = np.zeros(latitude.shape, dtype=bool)
    for ring in land:
        for (x0, y0), (x1, y1) in zip(ring[:-1], ring[1:]):
            if y0 == y1 or max(y0, y1) < latitude.min() or min(y0, y1) > latitude.max():
                continue
            crosses = (latitude > y0) != (latitude > y1)
            east = x0 + (latitude - y0) * (x1 - x0) / (y1 - y0) - longitude
            for turn in (-360, 0, 360):
                odd ^= crosses & (east + turn > 0)
    return odd


def kinds(land, latitude, longitude):
    """One letter a place: ~ sea, + land, . desert, # ice."""
    on_land = inside(land, latitude, longitude)
    kind = np.where(on_land, "+", "~")
    for lat, lon, high, wide in DESERTS:
        dry = ((latitude - lat) / high) ** 2 + ((longitude - lon) / wide) ** 2 < 1
        kind[on_land & dry] = "."
    for south, north, west, east in ICE:
        cold = (latitude > south) & (latitude < north) & (longitude > west) & (longitude < east)
        kind[on_land & cold] = "#"
    return kind


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        land = list(rings(json.load(file)))
    print("// Made by tools/make_earth_map.py; land by Natural Earth, 1:110 million (public domain).")
    print("// Cells of 2 x 2 degrees, the commonest kind of each: ~ sea, + land, . desert, # ice.")
    print("// From the north southwards, and from 180 deg west; then from 0 deg.")
    steps = (np.arange(SUB) + 0.5) / SUB * CELL_DEG
    halves = ([], [])
    for top in range(90, -90, -CELL_DEG):
        longitudes = (np.arange(-180, 180, CELL_DEG)[:, None] + steps).ravel()
        lat, lon = np.meshgrid(top - steps, longitudes, indexing="ij")
        kind = kinds(land, lat, lon).reshape(SUB, -1, SUB)
        row = ""
        for cell in range(kind.shape[1]):
            letters, counts = np.unique(kind[:, cell], return_counts=True)
            row += letters[np.argmax(counts)]
        halves[0].append(row[: len(row) // 2])
        halves[1].append(row[len(row) // 2 :])
    for name, rows in zip(("kWesternCells", "kEasternCells"), halves):
        print(f"constexpr std::string_view {name} =")
        for i, row in enumerate(rows):
            print(f'    "{row}"' + (";" if i + 1 == len(rows) else ""))


if __name__ == "__main__":
    main()
