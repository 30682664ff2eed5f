"""Lines of a vehicle with displaced bodies: from above, from the side, and from behind.

Displacements may be numbers, or arrays of them over phases or time; the lines then have one more axis.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.stability.mode_geometry import Geometry, Outline

Complex = NDArray[np.complex128]
Moved = Mapping[str, ArrayLike]
"""Displacements (m, rad) by their names; those that are missing are 0."""

Kind = Literal["body", "frame", "axle", "wheels", "wheel", "centre"]
View = Literal["plan", "side", "front"]

SIDE = 1.3
"""Half the width of a vehicle's body, of half the gauge."""

_BEAM = 0.62  # of half the gauge: a frame's side beams
_WHEEL = 0.42  # m, half the length of a wheel in plan view
_BOX = 1.5  # m, half the height of a vehicle's body, least; it starts above the wheels
_OVERHANG = 0.9  # m of track beyond the axles
_CLEAR = 0.3  # m of track beyond frames and other bodies
_GAP = complex(math.nan, math.nan)


class Line(NamedTuple):
    """A line of a picture.

    Attributes
    ----------
    name : str
        Unique name, the same at all times.
    kind : {"body", "frame", "axle", "wheels", "wheel", "centre"}
        What the line shows.
    points : ndarray of complex, shape (n_points,) or (n_times, n_points)
        Points to the right and, as the imaginary part, upwards in the picture, m; NaN at a gap.
    """

    name: str
    kind: Kind
    points: Complex


def lines(geometry: Geometry, view: View, moved: Moved) -> list[Line]:
    """Return the lines of a view.

    Parameters
    ----------
    geometry : Geometry
    view : {"plan", "side", "front"}
        From above, running to the right; from the right; or the leading end from behind.
    moved : mapping of str to array_like
        Displacements (m, rad) as drawn, by their names in the geometry.
    """
    drawn = {"plan": _plan, "side": _side, "front": _front}
    return list(drawn[view](geometry, moved))


def along(geometry: Geometry) -> tuple[float, float]:
    """Return the start and end of a whole vehicle's view along the track, m."""
    ends = [(w.x, _OVERHANG) for w in geometry.wheelsets]
    ends += [(b.x, b.half_length + _CLEAR) for b in (*geometry.frames, *geometry.others)]
    return min(x - reach for x, reach in ends), max(x + reach for x, reach in ends)


def top(geometry: Geometry) -> float:
    """Return the height of the highest roof, or of the frames, above the axles, m."""
    tops = [body.height + _box(body)[1] for body in geometry.others]
    return max([*tops, *(frame.height for frame in geometry.frames), geometry.wheel_radius])


def _plan(geometry: Geometry, moved: Moved) -> Iterator[Line]:
    a = geometry.half_gauge
    beam, side = _BEAM * a, SIDE * a

    def placed(name: str, kind: Kind, body: Outline, points: Sequence[complex]) -> Line:
        centre = body.x + 1j * _value(moved, body.y)
        return Line(name, kind, centre + np.exp(1j * _value(moved, body.psi)) * np.array(points))

    for w in geometry.wheelsets:
        rims = [complex(end * _WHEEL, at) for at in (-a, a) for end in (-1.0, 1.0)]
        yield placed(f"{w.name} axle", "axle", w, [-1j * a, 1j * a])
        yield placed(f"{w.name} wheels", "wheels", w, [*rims[:2], _GAP, *rims[2:]])
        yield placed(f"{w.name} centre", "centre", w, [0j])
    for f in geometry.frames:  # an H: two side beams and a cross beam
        end = f.half_length
        sides = [complex(-end, beam), complex(end, beam), _GAP, complex(-end, -beam)]
        sides += [complex(end, -beam), _GAP, complex(0.0, -beam), complex(0.0, beam)]
        yield placed(f.name, "frame", f, sides)
    for b in geometry.others:
        yield placed(b.name, "body", b, _rectangle(b.half_length, side, -side))


def _side(geometry: Geometry, moved: Moved) -> Iterator[Line]:
    circle = geometry.wheel_radius * np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 33))
    for w in geometry.wheelsets:
        centre = w.x + 1j * _value(moved, w.z)
        yield Line(f"{w.name} wheels", "wheel", centre + circle)
        yield Line(f"{w.name} centre", "centre", centre + np.zeros(1))
    for kind, bodies in (("frame", geometry.frames), ("body", geometry.others)):
        for b in bodies:
            end = b.half_length
            points = [complex(-end), complex(end)] if kind == "frame" else _rectangle(end, *_box(b))
            turn = np.exp(-1j * _value(moved, b.theta))  # nose down
            centre = b.x + 1j * (b.height + _value(moved, b.z))
            yield Line(b.name, "frame" if kind == "frame" else "body", centre + turn * np.array(points))


def _front(geometry: Geometry, moved: Moved) -> Iterator[Line]:
    """Yield the leading end; for a body its end over the leading bogie, which yaw also moves."""
    a, radius = geometry.half_gauge, geometry.wheel_radius

    def placed(name: str, kind: Kind, body: Outline, points: Sequence[complex], ahead: float) -> Line:
        left = _value(moved, body.y) + ahead * _value(moved, body.psi)
        centre = 1j * (body.height + _value(moved, body.z)) - left
        return Line(name, kind, centre + np.exp(-1j * _value(moved, body.phi)) * np.array(points))

    first = max(geometry.wheelsets, key=lambda w: w.x)
    at = first.x
    wheels = [complex(-a, -radius), complex(-a, radius), _GAP, complex(a, -radius), complex(a, radius)]
    yield placed(f"{first.name} axle", "axle", first, [complex(-a), complex(a)], 0.0)
    yield placed(f"{first.name} wheels", "wheels", first, wheels, 0.0)
    if geometry.frames:
        frame = min(geometry.frames, key=lambda f: abs(f.x - first.x))
        at = frame.x
        yield placed(frame.name, "frame", frame, [complex(-1.25 * a), complex(1.25 * a)], 0.0)
    if geometry.others:
        longest = max(geometry.others, key=lambda b: (b.half_length, b.x))
        points = _rectangle(SIDE * a, *_box(longest))
        yield placed(longest.name, "body", longest, points, at - longest.x)


def _rectangle(end: float, low: float, high: float) -> list[complex]:
    ends = ((-end, low), (end, low), (end, high), (-end, high), (-end, low))
    return [complex(x, y) for x, y in ends]


def _box(body: Outline) -> tuple[float, float]:
    """Return floor and roof of a vehicle's body from its centre (m); a mass between is flat."""
    if body.half_length <= 1.0:
        return -0.15, 0.15
    low = min(0.75 - body.height, -0.2)
    return low, low + 2.0 * _BOX - 0.2


def _value(moved: Moved, name: str | None) -> Any:
    """Return a displacement so that points can be added on a last axis."""
    return np.asarray(0.0 if name is None else moved.get(name, 0.0), dtype=float)[..., None]
