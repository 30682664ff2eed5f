"""The leading wheelset on its rails, the bodies above it, and the clearances of both end wheelsets."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable
from functools import partial
from itertools import pairwise
from typing import Literal

from railenv.envs.rendering.canvas import Canvas
from railenv.envs.rendering.colours import (
    ALARM,
    BAND,
    GHOST,
    GRID,
    INK,
    LABEL,
    LEADING,
    NEUTRAL,
    RAIL,
    SLEEPER,
    TRAILING,
    WHITE,
    mix,
)
from railenv.envs.rendering.layout import FRONT, FRONT_ABOVE, FRONT_BELOW, FRONT_VIEW, Box
from railenv.envs.rendering.page import Page
from railenv.envs.rendering.scene import Scene, touching
from railenv.envs.rendering.text import number

_LIFT_ROLL = 2e-3
_FRONT_HALF_GAUGE = 84.0
_HALF_GAUGE_BELOW_A_BODY = 40.0
_LARGEST_ROLL = 0.15
_FRONT_CONE = 0.1


class Front:
    """The leading wheelset on its rails, looking forward: points are left + up * 1j, in page units."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        count = len(scene.wheelsets)
        numbered = list(enumerate(scene.outlines, count))
        self.body = next((i for i, outline in numbered if outline.kind == "body"), None)
        frames = [(outline.x, i) for i, outline in numbered if outline.kind == "frame"]
        self.frame = max(frames)[1] if frames else None
        self.gauge = _FRONT_HALF_GAUGE if self.body is None else _HALF_GAUGE_BELOW_A_BODY
        self.size = self.gauge / _FRONT_HALF_GAUGE
        self.scale = scale = self.gauge / scene.half_gauge
        self.radius = min(scale * scene.wheel_radius, 70.0 * self.size)
        self.clearance = scale * scene.exaggeration * scene.flange_clearance
        offset = scale * scene.exaggeration * float(scene.bodies[0, 0] - scene.rail[0])
        self.offset = max(-1.8 * self.clearance, min(1.8 * self.clearance, offset))
        self.roll = _FRONT_CONE * self.offset / self.gauge + self._lift()
        self.tilt = cmath.exp(1j * scene.cant)
        self.origin = FRONT_VIEW.centre + (44j if self.body is None else 66j)

    def _lift(self) -> float:
        """Return the drawn roll beyond rolling on the cones: only the roll of a wheel that lifts."""
        roll = float(self.scene.bodies[0, 2] - self.scene.equilibrium[0, 2])
        beyond = math.copysign(max(0.0, abs(roll) - _LIFT_ROLL), roll)
        return max(-0.3, min(0.3, self.scene.exaggeration * beyond))

    def track(self, points: Iterable[complex]) -> list[complex]:
        """Return points of the track on the page; the tops of the rails are at height 0."""
        return [self.origin - (z * self.tilt).real - 1j * (z * self.tilt).imag for z in points]

    def wheelset(self, points: Iterable[complex]) -> list[complex]:
        """Return points of the wheelset on the page; its axle is at height 0."""
        turn = cmath.exp(1j * self.roll)
        lift = self.gauge * abs(self.roll - _FRONT_CONE * self.offset / self.gauge)
        centre = complex(self.offset, self.radius + lift)
        return self.track(z * turn + centre for z in points)

    def above(self, i: int, height: float, points: Iterable[complex]) -> list[complex]:
        """Return points on the page, from points on a frame or body whose centre is at a height.

        Its steady shift and roll are drawn as they are, the motion about them larger.
        """
        steady, now = self.scene.equilibrium[i], self.scene.bodies[i]
        y, _, phi, _ = (steady + self.scene.exaggeration * (now - steady)).tolist()
        reach = 2.5 * self.clearance
        shift = max(-reach, min(reach, self.scale * y))
        turn = cmath.exp(1j * max(-_LARGEST_ROLL, min(_LARGEST_ROLL, phi)))
        return self.track(z * turn + complex(shift, height) for z in points)

    def tread(self, v: float) -> float:
        """Return the radius of the cone at a distance from the wheelset's middle."""
        return self.radius + _FRONT_CONE * (self.gauge - v)


def draw_front(canvas: Canvas, scene: Scene) -> None:
    """Draw rails and leading wheelset, and in a whole vehicle the frame above it and the body."""
    front = Front(scene)
    _draw_bed(canvas, front)
    axle = _box(140.0 * front.size, -5.0 * front.size, 5.0 * front.size)
    canvas.polygon(front.wheelset(axle), mix(LEADING, 0.8))
    for side in (1.0, -1.0):
        _draw_wheel_section(canvas, front, side)
    if front.body is not None:
        _draw_above(canvas, front, front.body)


def _box(half_width: float, low: float, high: float) -> list[complex]:
    corners = ((-half_width, low), (half_width, low), (half_width, high), (-half_width, high))
    return [complex(v, w) for v, w in corners]


def _draw_above(canvas: Canvas, front: Front, body: int) -> None:
    """Draw the leading frame and the body, and the springs between them."""
    floor, half, tall = 52.0, 84.0, 80.0  # floor above the axle, half width and height of the body
    height = front.radius + floor
    edge = [complex(v, w) for v, w in ((-half, 0.0), (half, 0.0), (half, 0.7 * tall))]
    edge += [complex(0.62 * half, tall), complex(-0.62 * half, tall), complex(-half, 0.7 * tall)]
    seats = [complex(side * 48.0, 0.0) for side in (1.0, -1.0)]
    upper = front.above(body, height, seats)
    if front.frame is not None:
        top = front.radius + 26.0
        for start, end in zip(front.above(front.frame, top, seats), upper, strict=True):
            _draw_spring(canvas, start, end)
        beam = front.above(front.frame, top, _box(62.0, -9.0, 0.0))
        canvas.polygon(beam, NEUTRAL, RAIL)
    canvas.polygon(front.above(body, height, edge), WHITE, INK, 2.0)
    left, right = front.above(body, height, [complex(-half, 10.0), complex(half, 10.0)])
    canvas.line(left, right, GHOST, 1.5)


def _draw_spring(canvas: Canvas, start: complex, end: complex) -> None:
    """Draw a coil spring between two points of the page."""
    coils, across = 5, 1j * (end - start) / max(abs(end - start), 1.0) * 6.0
    turns = [start + (end - start) * (k + 0.5) / coils for k in range(coils)]
    corners = [start, *(z + (across if k % 2 else -across) for k, z in enumerate(turns)), end]
    for a, b in pairwise(corners):
        canvas.line(a, b, RAIL, 1.5)


def _draw_bed(canvas: Canvas, front: Front) -> None:
    size = front.size
    half, top = front.gauge + 60.0 * size, -34.0 * size
    level = front.track([complex(0.0, top - 7.0 * size)])[0]
    if abs(front.scene.cant) > 1e-4:
        canvas.dashes(level - half, level + half, GHOST)
    canvas.polygon(front.track(_box(half, top - 14.0 * size, top)), SLEEPER, GRID)
    for side in (1.0, -1.0):
        gap = front.gauge - front.clearance + side * front.offset
        if gap < front.gauge:
            low = -11.0 * size
            free = [(gap, low), (front.gauge, low), (front.gauge, 0.0), (gap, 0.0)]
            canvas.polygon(front.track([complex(side * v, w) for v, w in free]), BAND)
        profile = [(0.0, 0.0), (0.0, -11.0), (4.5, -14.0), (4.5, -29.0), (-5.0, -34.0)]
        outline = profile + [(14.0 - v, w) for v, w in reversed(profile)]
        points = [complex(side * (front.gauge + size * v), size * w) for v, w in outline]
        canvas.polygon(front.track(points), RAIL)


def _draw_wheel_section(canvas: Canvas, front: Front, side: float) -> None:
    """Draw a wheel cut along its axle: flange, coned rim and web, above and below the axle."""
    paint = ALARM if touching(front.scene, 0, side) else LEADING
    size = front.size
    face = front.gauge - front.clearance
    outer = front.gauge + front.clearance + 16.0 * size
    flange = front.radius + 12.0 * size
    for way in (-1.0, 1.0):
        rim = [
            (face - 9.0 * size, front.radius - 12.0 * size),
            (face - 9.0 * size, flange - 3.0 * size),
            (face - 6.0 * size, flange),
            (face - 2.0 * size, flange - 1.0 * size),
            (face, front.tread(face)),
            (outer, front.tread(outer)),
            (outer, front.tread(outer) - 10.0 * size),
        ]
        section = front.wheelset([complex(side * v, way * w) for v, w in rim])
        canvas.polygon(section, paint)
        rise = front.radius - 8.0 * size
        near, far = face + 6.0 * size, face + 14.0 * size
        web = [(near, 0.0), (far, 0.0), (far, rise), (near, rise)]
        canvas.polygon(front.wheelset([complex(side * v, way * w) for v, w in web]), mix(paint, 0.6))
    near, far, thick = face - 6.0 * size, face + 26.0 * size, 11.0 * size
    hub = [(near, -thick), (far, -thick), (far, thick), (near, thick)]
    canvas.polygon(front.wheelset([complex(side * v, w) for v, w in hub]), paint)


def show_front(page: Page, scene: Scene) -> None:
    """Draw the view, its heading above, and the clearances of both end wheelsets below."""
    which = "leading wheelset" if len(scene.wheelsets) > 1 else "wheelset"
    if any(outline.kind == "body" for outline in scene.outlines):
        which = "leading bogie"
    key = which, scene.exaggeration
    page.kept(FRONT_ABOVE, key, partial(_draw_headings, page, *key))
    page.clear(FRONT_BELOW)
    page.layer(FRONT_VIEW, partial(draw_front, scene=scene))
    page.canvas.rectangle(FRONT, None, GRID)  # last, since in small pictures it touches the view
    ends = {0: "leading", len(scene.wheelsets) - 1: "trailing"} if len(scene.wheelsets) > 1 else {0: ""}
    tops = (FRONT_VIEW.bottom + 4, FRONT_VIEW.bottom + 52)
    for (i, name), top in zip(ends.items(), tops, strict=False):
        _draw_gauge(page, scene, i, top, name)


def _draw_headings(page: Page, which: str, exaggeration: float) -> None:
    used = page.text(which, complex(FRONT.left + 8, FRONT.top + 3), 12, LEADING, bold=True)
    at = complex(FRONT.left + 14 + used, FRONT.top + 3)
    page.text(f"looking forward, lateral \N{MULTIPLICATION SIGN} {exaggeration:g}", at, 12, LABEL)


def _draw_gauge(page: Page, scene: Scene, i: int, top: float, name: str) -> None:
    """Draw the clearance left and right of a wheelset as two bars that meet at the wheelset."""
    delta = scene.flange_clearance
    y = float(scene.bodies[i, 0] - scene.rail[i])
    box = Box(FRONT.left + 10, top + 19, FRONT.width - 20, 12)
    share = min(1.0, max(0.0, 0.5 * (1.0 - y / delta)))
    middle = box.left + share * box.width
    own = LEADING if i == 0 else TRAILING
    colour = ALARM if abs(y) >= delta else own
    page.canvas.rectangle(Box(box.left, box.top, middle - box.left, box.height), mix(colour, 0.45))
    page.canvas.rectangle(Box(middle, box.top, box.right - middle, box.height), mix(colour, 0.2))
    page.canvas.rectangle(box, None, NEUTRAL)
    page.canvas.rectangle(Box(middle - 2, box.top - 3, 4, box.height + 6), colour)
    page.text(name, complex(box.centre.real, top + 3), 12, own, align="centre", width=70)
    sides: tuple[tuple[Literal["left", "right"], float, float], ...]
    sides = (("left", delta - y, box.left), ("right", delta + y, box.right))
    for side, free, end in sides:
        words = f"{side} {number(1e3 * free)} mm" if free > 0.0 else f"{side}: contact"
        paint = own if free > 0.0 else ALARM
        page.text(words, complex(end, top + 2), 13, paint, align=side, bold=True, width=112)
