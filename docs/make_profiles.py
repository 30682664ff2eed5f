"""Compute the profiles LMA and CHN60 from their arcs: ``python docs/make_profiles.py``.

Writes ``lma.csv`` and ``chn60.csv`` in ``railenv/contact/data``. The arcs are those that public tables
of points of both profiles lie on, within 0.03 mm; the radii come out as whole numbers.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DATA = Path(__file__).resolve().parent.parent / "railenv" / "contact" / "data"
FINE, MIDDLE, COARSE = 0.3, 0.5, 0.8
"""Spacing of points, mm."""

LMA_HEADER = (
    "Wheel LMA, new (CRH2, CRH380A), computed by docs/make_profiles.py from its arcs: flange R25, R12, "
    "R15, a line at 70 degrees; tread R14, R90, R450, 1:40, 1:15, chamfer.",
    "y outwards from the tape circle, 70 mm from the back; z upwards.",
)
CHN60_HEADER = (
    "Rail CHN60, upright, computed by docs/make_profiles.py from its arcs: R300 over 20 mm, R80, R13 "
    "to a width of 70.8 mm, sides 1:20.",
    "y outwards from the middle of the head, z upwards from its top.",
)


def arc(centre: Array, start: Array, end: Array, spacing: float) -> Array:
    """Return points on a circle about a centre, from one point to another, the short way."""
    radius = float(np.hypot(*(start - centre)))
    first, last = (math.atan2(*(p - centre)[::-1]) for p in (start, end))
    last += 2.0 * math.pi * round((first - last) / (2.0 * math.pi))
    angles = np.linspace(first, last, max(4, math.ceil(abs(last - first) * radius / spacing)) + 1)
    return centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def line(start: Array, end: Array, spacing: float) -> Array:
    """Return points on a straight line."""
    return np.linspace(start, end, max(1, math.ceil(float(np.hypot(*(end - start))) / spacing)) + 1)


def joined(*parts: Array) -> Array:
    """Return parts as one chain, whose ends must meet."""
    for before, after in pairwise(parts):
        assert np.hypot(*(before[-1] - after[0])) < 2e-3, (before[-1], after[0])
    return np.vstack([parts[0], *(part[1:] for part in parts[1:])])


def lma() -> Array:
    """Return the wheel's points (mm), from its back outwards; built with z down, the flange up."""
    cone = math.atan(1.0 / 40.0)
    steep = np.array([math.sin(math.radians(70.0)), math.cos(math.radians(70.0))])  # across the line
    tread = np.array([15.5, math.sqrt(450.0**2 - 15.5**2)])  # R450, through the tape circle
    to_cone = tread - 450.0 * np.array([math.sin(cone), math.cos(cone)])
    to_tread = np.array([-10.75, tread[1] - math.sqrt(450.0**2 - 26.25**2)])
    throat = to_tread + (tread - to_tread) * 90.0 / 450.0  # R90
    tip = np.array([-54.0, 16.0])  # R12, whose top is 28 mm high
    # R14 touches R90 from within and passes a point 32.9 mm from the back, 10 mm up
    through = np.array([-37.1, 10.0])
    apart = throat - through
    distance = float(np.hypot(*apart))
    along = (14.0**2 - 76.0**2 + distance**2) / (2.0 * distance)
    across = math.sqrt(14.0**2 - along**2)
    normal = np.array([apart[1], -apart[0]]) / distance
    root = max((through + apart / distance * along + s * across * normal for s in (1, -1)), key=tuple)
    # R15 touches R12 from outside and the line
    gap = float((root - 14.0 * steep) @ steep - 15.0 - tip @ steep)
    face = tip + gap * steep + math.sqrt(9.0 - gap * gap) * np.array([steep[1], -steep[0]])
    on_face, on_root = face + 15.0 * steep, root - 14.0 * steep
    to_throat = throat + (root - throat) / 76.0 * 90.0
    to_face = tip + (tip - face) / 3.0 * 12.0
    back = np.array([-45.0, tip[1] - math.sqrt(13.0**2 - 9.0**2)])  # R25
    to_tip = tip + (tip - back) / 13.0 * 12.0
    end_of_cone = np.array([30.0, to_cone[1] - (30.0 - to_cone[0]) / 40.0])
    end_of_tread = end_of_cone + np.array([30.0, -2.0])
    points = joined(
        arc(back, np.array([-70.0, back[1]]), to_tip, COARSE),
        arc(tip, to_tip, to_face, MIDDLE),
        arc(face, to_face, on_face, MIDDLE),
        line(on_face, on_root, MIDDLE),
        arc(root, on_root, to_throat, FINE),
        arc(throat, to_throat, to_tread, MIDDLE),
        arc(tread, to_tread, to_cone, MIDDLE),
        line(to_cone, end_of_cone, COARSE),
        line(end_of_cone, end_of_tread, COARSE),
        line(end_of_tread, end_of_tread + np.array([5.0, -5.0]), COARSE),
    )
    return points * [1.0, -1.0]


def chn60() -> Array:
    """Return the rail's points (mm), from its left side to its right."""
    side = math.atan(1.0 / 20.0)
    crown = np.array([0.0, -300.0])
    to_80 = np.array([10.0, crown[1] + math.sqrt(300.0**2 - 10.0**2)])
    shoulder = crown + (to_80 - crown) * 220.0 / 300.0  # R80
    corner_y = 35.4 - 13.0 * math.cos(side)
    corner = np.array([corner_y, shoulder[1] + math.sqrt(67.0**2 - (corner_y - shoulder[0]) ** 2)])
    to_corner = shoulder + (corner - shoulder) / 67.0 * 80.0
    to_side = corner + 13.0 * np.array([math.cos(side), math.sin(side)])
    half = joined(
        arc(crown, np.zeros(2), to_80, MIDDLE),
        arc(shoulder, to_80, to_corner, MIDDLE),
        arc(corner, to_corner, to_side, FINE),
        line(to_side, to_side + np.array([1.1, -22.0]), COARSE),
    )
    return np.vstack([half[:0:-1] * [-1.0, 1.0], half])


def main() -> None:
    """Write both files."""
    for name, points, header in (("lma", lma(), LMA_HEADER), ("chn60", chn60(), CHN60_HEADER)):
        assert (np.diff(points[:, 0]) > 0.0).all(), name
        rows = "".join(f"{y:.6f},{z:.6f}\n" for y, z in points)
        text = "".join(f"# {sentence}\n" for sentence in header) + "y_mm,z_mm\n" + rows
        (DATA / f"{name}.csv").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
