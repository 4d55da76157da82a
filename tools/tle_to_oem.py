#!/usr/bin/python3
"""A two-line element set as a CCSDS ephemeris, for orbit.*.propagator = "ephemeris".

    tools/tle_to_oem.py FILE.tle --start 2022-01-01T00:00:00 --stop 2022-01-16T00:00:00 -o FILE.oem

SGP4 by python3-sgp4 (Vallado et al. 2006, AIAA 2006-6753), which is what such elements are made for;
any other model of motion misreads them. Its frame, the true equator and mean equinox of date (TEME),
is taken to the equinox of J2000 by IAU 1980's nutation and IAU 1976's precession (python3-erfa): the
frame EME2000. Between EME2000 and GCRF, which Starloop takes for the same, lies the frame bias,
.023", .8 m in low orbit; the nutation of 1980 is within .07" of the sky. Fresh elements are good to a
kilometre and lose one to three a day.

FILE may have a name above each pair of lines (3LE); of several sets --name chooses, or the number in
the catalogue."""

import argparse
import math
import sys

import erfa
import numpy
from sgp4.api import SGP4_ERRORS, Satrec

SECONDS_A_DAY = 86400.0


def read_sets(text):
    """(name, line 1, line 2) of each set."""
    sets, name, first = [], "", None
    for line in (raw.rstrip() for raw in text.splitlines()):
        if line.startswith("1 ") and len(line) >= 68:
            first = line
        elif line.startswith("2 ") and len(line) >= 63 and first is not None:
            sets.append((name, first, line))
            name, first = "", None
        elif line:
            name = line[2:] if line.startswith("0 ") else line
    return sets


def choose(sets, wanted):
    chosen = [s for s in sets if wanted in (None, s[0].strip(), s[1][2:7].strip())]
    if len(chosen) != 1:
        raise SystemExit(f"tle_to_oem.py: expected one set of elements, found {len(chosen)}"
                         + ("" if wanted else "; --name chooses") + ": "
                         + ", ".join(f"{s[0].strip()} ({s[1][2:7]})" for s in sets[:10]))
    return chosen[0]


def utc_date(text):
    """Two parts of a quasi Julian date, as ERFA has them."""
    try:
        day, clock = text.rstrip("Z").split("T")
        year, month, day = (int(x) for x in day.split("-"))
        hour, minute, second = clock.split(":")
        return erfa.dtf2d("UTC", year, month, day, int(hour), int(minute), float(second))
    except (ValueError, erfa.ErfaError) as e:
        raise SystemExit(f"tle_to_oem.py: expected a date like 2022-01-01T00:00:00, found {text!r}") from e


def utc_text(date):
    year, month, day, clock = erfa.d2dtf("UTC", 6, *date)
    h, m, s, f = (int(clock[k]) for k in "hmsf")
    return f"{int(year):04d}-{int(month):02d}-{int(day):02d}T{h:02d}:{m:02d}:{s:02d}.{f:06d}"


def j2000_from_teme(tt):
    """The matrix from TEME to the mean equator and equinox of J2000, at a date of terrestrial time."""
    # TEME's equinox is off the true one by the equation of the equinoxes in its short form (Vallado
    # 2013, section 3.7.4): the nutation along the equator.
    along, obliquity_off = erfa.nut80(*tt)
    obliquity = erfa.obl80(*tt)
    true_from_mean = erfa.numat(obliquity, along, obliquity_off)
    mean_from_j2000 = erfa.pmat76(*tt)
    turn = along * math.cos(obliquity)
    true_from_teme = erfa.rz(-turn, numpy.eye(3))
    return (true_from_mean @ mean_from_j2000).T @ true_from_teme


def states(satellite, start, stop, step_s):
    """(UTC date, place, velocity) in J2000, km and km/s, each `step_s` of SI seconds."""
    tai = erfa.utctai(*start)
    end = erfa.utctai(*stop)
    length_s = ((end[0] - tai[0]) + (end[1] - tai[1])) * SECONDS_A_DAY
    if not length_s > 0.0:
        raise SystemExit("tle_to_oem.py: expected --stop after --start")
    for i in range(int(math.ceil(length_s / step_s)) + 1):
        now = (tai[0], tai[1] + i * step_s / SECONDS_A_DAY)
        utc = erfa.taiutc(*now)
        error, place, velocity = satellite.sgp4(*(float(part) for part in utc))
        if error != 0:
            raise SystemExit(f"tle_to_oem.py: SGP4 has no answer at {utc_text(utc)}: "
                             + SGP4_ERRORS[error])
        matrix = j2000_from_teme(erfa.taitt(*now))
        yield utc, matrix @ place, matrix @ velocity


def oem_text(name, number, designator, rows):
    head = ["CCSDS_OEM_VERS = 2.0", "COMMENT SGP4, TEME to EME2000 by IAU 1976 and 1980",
            f"CREATION_DATE = {utc_text(rows[0][0])}", "ORIGINATOR = STARLOOP", "",
            "META_START", f"OBJECT_NAME = {name or number}", f"OBJECT_ID = {designator or number}",
            "CENTER_NAME = EARTH", "REF_FRAME = EME2000", "TIME_SYSTEM = UTC",
            f"START_TIME = {utc_text(rows[0][0])}", f"STOP_TIME = {utc_text(rows[-1][0])}",
            "INTERPOLATION = HERMITE", "INTERPOLATION_DEGREE = 7", "META_STOP", ""]
    for date, place, velocity in rows:
        head.append(utc_text(date) + "".join(f" {x:.9f}" for x in place)
                    + "".join(f" {x:.12f}" for x in velocity))
    return "\n".join(head) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("file", help="two-line elements, with or without names")
    parser.add_argument("--start", required=True, help="UTC")
    parser.add_argument("--stop", required=True, help="UTC")
    parser.add_argument("--step", type=float, default=60.0, help="seconds between rows; default 60")
    parser.add_argument("--name", help="of the set in the file, or its number in the catalogue")
    parser.add_argument("-o", "--out", help="default: standard output")
    options = parser.parse_args()
    if not 0.1 <= options.step <= 600.0:
        raise SystemExit("tle_to_oem.py: expected --step from 0.1 to 600 s")
    with open(options.file, encoding="ascii", errors="replace") as file:
        name, first, second = choose(read_sets(file.read()), options.name)
    try:
        satellite = Satrec.twoline2rv(first, second)
    except ValueError as e:
        raise SystemExit(f"tle_to_oem.py: {options.file}: {e}") from e
    rows = list(states(satellite, utc_date(options.start), utc_date(options.stop), options.step))
    if len(rows) < 4:
        raise SystemExit("tle_to_oem.py: expected at least four rows from --start to --stop")
    text = oem_text(name.strip(), first[2:7].strip(), first[9:17].strip(), rows)
    if options.out:
        with open(options.out, "w", encoding="ascii") as file:
            file.write(text)
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()
