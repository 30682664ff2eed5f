"""Views of a vehicle that moves in a mode: from above, from the side, and from behind."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from design.style import NEUTRAL, STABLE, UNSTABLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.stability.mode_geometry import Geometry, Outline
    from design.stability.mode_shape import ModeShape

Moved = Mapping[str, float]
Point = tuple[float, float]

_DARK = "#333333"
_LARGEST_OFFSET = 0.28  # m, to which displacements are magnified
_LARGEST_ANGLE = 0.22  # rad, likewise
_LARGEST_END = 0.5  # m, likewise at the ends of a vehicle's body
_OVERHANG = 0.9  # m of track beyond the axles
_CLEAR = 0.3  # m of track beyond frames and other bodies
_BEAM, _SIDE = 0.62, 1.3  # of half the gauge: a frame's side beams, the sides of other bodies
_WHEEL = 0.42  # m, length of a wheel in plan view
_BOX = 1.5  # m, half the height of a vehicle's body, least; it starts above the wheels
_GAP = (math.nan, math.nan)

_STYLES: dict[str, dict[str, Any]] = {
    "body": {"color": _DARK, "lw": 1.2, "ls": "--", "zorder": 2},
    "frame": {"color": _DARK, "lw": 2.0, "zorder": 2},
    "axle": {"color": STABLE, "lw": 2.2, "zorder": 3},
    "wheels": {"color": STABLE, "lw": 5.0, "zorder": 4, "solid_capstyle": "butt"},
    "wheel": {"color": STABLE, "lw": 2.2, "zorder": 4},
    "centre": {"color": UNSTABLE, "marker": "o", "ms": 4, "ls": "", "zorder": 5},
}


def magnification(shape: ModeShape) -> float:
    """Return the factor of all displacements, as in a motion that is so much larger."""
    assert shape.geometry is not None
    sizes = [1e-6]
    for body in shape.geometry.bodies:
        across, up = (_size(shape, name) for name in (body.y, body.z))
        angle = max(_size(shape, name) for name in (body.phi, body.theta, body.psi))
        sizes += [max(across, up) / _LARGEST_OFFSET, angle / _LARGEST_ANGLE]
    for body in shape.geometry.others:
        for shift, turn in ((body.y, body.psi), (body.z, body.theta)):
            end = _size(shape, shift) + body.half_length * _size(shape, turn)
            sizes.append(end / _LARGEST_END)
    return 1.0 / max(sizes)


def _size(shape: ModeShape, name: str | None) -> float:
    return 0.0 if name is None else abs(shape[name])


class View:
    """A picture of a vehicle in some axes: lines that are moved from phase to phase."""

    def __init__(self, shape: ModeShape, ax: Axes) -> None:
        assert shape.geometry is not None
        self.shape, self.geometry = shape, shape.geometry
        self.a = self.geometry.half_gauge
        self.ax = ax
        self.factor = magnification(shape)
        self._lines: dict[str, Any] = {}
        ax.set_aspect("equal")
        ax.grid(visible=False)

    def draw(self, phase: float) -> list[Any]:
        """Place the bodies at a phase (rad)."""
        moved = dict(zip(self.shape.names, self.factor * self.shape.at(phase), strict=True))
        self._place(moved)
        return list(self._lines.values())

    def _place(self, moved: Moved) -> None:
        raise NotImplementedError

    def _line(self, name: str, kind: str, points: Sequence[Point]) -> None:
        """Draw a line through points, or move the one of that name there."""
        if name not in self._lines:
            self._lines[name] = self.ax.plot([], [], **_STYLES[kind])[0]
        self._lines[name].set_data(*np.transpose(points))


def _along(geometry: Geometry) -> Point:
    """Return where along the track a view of a whole vehicle starts and ends."""
    ends = [(w.x, _OVERHANG) for w in geometry.wheelsets]
    ends += [(b.x, b.half_length + _CLEAR) for b in (*geometry.frames, *geometry.others)]
    return min(x - reach for x, reach in ends), max(x + reach for x, reach in ends)


def _value(moved: Moved, name: str | None) -> float:
    return 0.0 if name is None else moved[name]


def _turned(point: Point, angle: float) -> Point:
    cos, sin = math.cos(angle), math.sin(angle)
    return point[0] * cos - point[1] * sin, point[0] * sin + point[1] * cos


class PlanView(View):
    """A vehicle seen from above; it runs to the right, left is up."""

    def __init__(self, shape: ModeShape, ax: Axes) -> None:
        super().__init__(shape, ax)
        start, end = _along(self.geometry)
        for rail in (-self.a, self.a):
            ax.plot([start, end], [rail, rail], color=NEUTRAL, lw=2.5, zorder=1)
        ax.plot([start, end], [0.0, 0.0], color=NEUTRAL, lw=0.8, ls=":", zorder=1)
        ax.set_xlim(start, end)
        side = 0.9 if self.geometry.others else 0.62
        ax.set_ylim(-self.a - side, self.a + side)
        ax.set_xlabel("along the track (m)")
        ax.set_ylabel("across (m)")

    def _place(self, moved: Moved) -> None:
        for body in self.geometry.wheelsets:
            self._wheelset(body, moved)
        beam, side = _BEAM * self.a, _SIDE * self.a
        for body in self.geometry.frames:  # an H: two side beams and a cross beam
            end = body.half_length
            sides = [(-end, beam), (end, beam), None, (-end, -beam), (end, -beam), None]
            self._shape(body, moved, "frame", [*sides, (0.0, -beam), (0.0, beam)])
        for body in self.geometry.others:
            end = body.half_length
            corners = [(-end, side), (end, side), (end, -side), (-end, -side), (-end, side)]
            self._shape(body, moved, "body", corners)

    def _wheelset(self, body: Outline, moved: Moved) -> None:
        """Draw an axle with its wheels."""
        ends = [self._moved(body, moved, (0.0, side * self.a)) for side in (-1.0, 1.0)]
        self._line(f"{body.name} axle", "axle", ends)
        wheels = [
            [self._moved(body, moved, (along * _WHEEL, side * self.a)) for along in (-1.0, 1.0)]
            for side in (-1.0, 1.0)
        ]
        self._line(f"{body.name} wheels", "wheels", [*wheels[0], _GAP, *wheels[1]])
        self._line(f"{body.name} centre", "centre", [self._moved(body, moved, (0.0, 0.0))])

    def _shape(self, body: Outline, moved: Moved, kind: str, points: Sequence[Point | None]) -> None:
        placed = [_GAP if p is None else self._moved(body, moved, p) for p in points]
        self._line(body.name, kind, placed)

    @staticmethod
    def _moved(body: Outline, moved: Moved, point: Point) -> Point:
        """Return where a point of a body lies that has shifted by y and yawed by psi."""
        x, y = _turned(point, _value(moved, body.psi))
        return body.x + x, _value(moved, body.y) + y


class SideView(View):
    """A vehicle seen from its right; it runs to the right."""

    def __init__(self, shape: ModeShape, ax: Axes) -> None:
        super().__init__(shape, ax)
        start, end = _along(self.geometry)
        radius = self.geometry.wheel_radius
        ax.plot([start, end], [-radius, -radius], color=NEUTRAL, lw=2.5, zorder=1)
        ax.set_xlim(start, end)
        ax.set_ylim(-radius - 0.3, _top(self.geometry) + 0.6)
        ax.set_xlabel("along the track (m)")
        ax.set_ylabel("above the axles (m)")

    def _place(self, moved: Moved) -> None:
        turn = np.linspace(0.0, 2.0 * np.pi, 33)
        radius = self.geometry.wheel_radius
        for body in self.geometry.wheelsets:
            z = _value(moved, body.z)
            circle = zip(body.x + radius * np.cos(turn), z + radius * np.sin(turn), strict=True)
            self._line(f"{body.name} wheels", "wheel", list(circle))
            self._line(f"{body.name} centre", "centre", [(body.x, z)])
        for body in self.geometry.frames:
            end = body.half_length
            self._shape(body, moved, "frame", [(-end, 0.0), (end, 0.0)])
        for body in self.geometry.others:
            end, (low, high) = body.half_length, _box(body)
            corners = [(-end, low), (end, low), (end, high), (-end, high), (-end, low)]
            self._shape(body, moved, "body", corners)

    def _shape(self, body: Outline, moved: Moved, kind: str, points: Sequence[Point]) -> None:
        """Draw a body that has shifted by z and pitched by theta, nose down."""
        theta, up = _value(moved, body.theta), body.height + _value(moved, body.z)
        turned = [_turned(point, -theta) for point in points]
        self._line(body.name, kind, [(body.x + x, up + z) for x, z in turned])


class FrontView(View):
    """The leading end of a vehicle, seen from behind: left is left."""

    def __init__(self, shape: ModeShape, ax: Axes) -> None:
        super().__init__(shape, ax)
        radius = self.geometry.wheel_radius
        for rail in (-self.a, self.a):
            ax.plot([rail - 0.08, rail + 0.08], [-radius, -radius], color=NEUTRAL, lw=4.0, zorder=1)
        ax.plot([0.0, 0.0], [-radius, _top(self.geometry)], color=NEUTRAL, lw=0.8, ls=":", zorder=1)
        ax.set_xlim(-_SIDE * self.a - 1.0, _SIDE * self.a + 1.0)
        ax.set_ylim(-radius - 0.2, _top(self.geometry) + 0.4)
        ax.set_xticks([-1, 0, 1])
        ax.set_xlabel("from behind (m)")
        first = max(self.geometry.wheelsets, key=lambda w: w.x)
        self._at = first.x
        self._drawn: list[tuple[Outline, str]] = [(first, "axle")]
        if self.geometry.frames:
            frame = min(self.geometry.frames, key=lambda f: abs(f.x - first.x))
            self._at = frame.x
            self._drawn.append((frame, "frame"))
        if self.geometry.others:
            longest = max(self.geometry.others, key=lambda b: (b.half_length, b.x))
            self._drawn.append((longest, "body"))

    def _place(self, moved: Moved) -> None:
        for body, kind in self._drawn:
            if kind == "axle":
                self._wheelset(body, moved)
            elif kind == "frame":
                beam = 1.25 * self.a
                self._shape(body, moved, kind, body.name, [(-beam, 0.0), (beam, 0.0)])
            else:
                side, (low, high) = _SIDE * self.a, _box(body)
                corners = [(-side, low), (side, low), (side, high), (-side, high), (-side, low)]
                self._shape(body, moved, kind, body.name, corners)

    def _wheelset(self, body: Outline, moved: Moved) -> None:
        radius = self.geometry.wheel_radius
        self._shape(body, moved, "axle", f"{body.name} axle", [(-self.a, 0.0), (self.a, 0.0)])
        wheels = [(-self.a, -radius), (-self.a, radius), None, (self.a, -radius), (self.a, radius)]
        self._shape(body, moved, "wheels", f"{body.name} wheels", wheels)

    def _shape(
        self, body: Outline, moved: Moved, kind: str, name: str, points: Sequence[Point | None]
    ) -> None:
        """Draw a body that has shifted by y and z and rolled by phi, its left side up.

        Of a vehicle's body, its end over the leading bogie is seen, which its yaw moves too.
        """
        phi, up = _value(moved, body.phi), body.height + _value(moved, body.z)
        left = _value(moved, body.y)
        if kind == "body":
            left += (self._at - body.x) * _value(moved, body.psi)
        placed: list[Point] = []
        for point in points:
            if point is None:
                placed.append(_GAP)
                continue
            across, z = _turned(point, -phi)
            placed.append((across - left, up + z))
        self._line(name, kind, placed)


def _box(body: Outline) -> Point:
    """Return floor and roof of a vehicle's body from its centre (m); a mass between is flat."""
    if body.half_length <= 1.0:
        return -0.15, 0.15
    low = min(0.75 - body.height, -0.2)
    return low, low + 2.0 * _BOX - 0.2


def _top(geometry: Geometry) -> float:
    """Return the height of the highest roof, or of the frames, m."""
    tops = [body.height + _box(body)[1] for body in geometry.others]
    return max([*tops, *(frame.height for frame in geometry.frames), geometry.wheel_radius])
