"""The leading wheelset on its rails, and the clearances of both wheelsets."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable
from typing import Literal

from railenv.envs.rendering.canvas import Canvas
from railenv.envs.rendering.colours import (
    ALARM,
    BAND,
    GHOST,
    GRID,
    LABEL,
    LEADING,
    NEUTRAL,
    RAIL,
    SLEEPER,
    TRAILING,
    mix,
)
from railenv.envs.rendering.layout import FRONT, FRONT_VIEW, Box
from railenv.envs.rendering.page import Page
from railenv.envs.rendering.scene import Scene, touching
from railenv.envs.rendering.text import number

_LIFT_ROLL = 2e-3
_FRONT_HALF_GAUGE = 84.0
_FRONT_CONE = 0.1


class Front:
    """The leading wheelset on its rails, looking forward: points are left + up * 1j, in page units."""

    def __init__(self, scene: Scene) -> None:
        scale = _FRONT_HALF_GAUGE / scene.half_gauge
        self.scene = scene
        self.gauge = _FRONT_HALF_GAUGE
        self.radius = min(scale * scene.wheel_radius, 70.0)
        self.clearance = scale * scene.exaggeration * scene.flange_clearance
        offset = scale * scene.exaggeration * float(scene.bodies[0, 0] - scene.rail[0])
        self.offset = max(-1.8 * self.clearance, min(1.8 * self.clearance, offset))
        self.roll = _FRONT_CONE * self.offset / self.gauge + self._lift()
        self.tilt = cmath.exp(1j * scene.cant)
        self.origin = FRONT_VIEW.centre + 44j

    def _lift(self) -> float:
        """Return the drawn roll beyond rolling on the cones: only the roll of a wheel that lifts."""
        roll = float(self.scene.bodies[0, 2] - self.scene.equilibrium[0, 2])
        beyond = math.copysign(max(0.0, abs(roll) - _LIFT_ROLL), roll)
        return max(-0.3, min(0.3, self.scene.exaggeration * beyond))

    def track(self, points: Iterable[complex]) -> list[complex]:
        """Return the page's points of points on the track; rails' tops are at height 0."""
        return [self.origin - (z * self.tilt).real - 1j * (z * self.tilt).imag for z in points]

    def wheelset(self, points: Iterable[complex]) -> list[complex]:
        """Return the page's points of points on the wheelset, whose axle is at height 0."""
        turn = cmath.exp(1j * self.roll)
        lift = self.gauge * abs(self.roll - _FRONT_CONE * self.offset / self.gauge)
        centre = complex(self.offset, self.radius + lift)
        return self.track(z * turn + centre for z in points)

    def tread(self, v: float) -> float:
        """Return the radius of the cone at a distance from the wheelset's middle."""
        return self.radius + _FRONT_CONE * (self.gauge - v)


def draw_front(canvas: Canvas, scene: Scene) -> None:
    """Draw rails and leading wheelset."""
    front = Front(scene)
    _draw_bed(canvas, front)
    axle = [complex(v, w) for v, w in ((-140, -5), (140, -5), (140, 5), (-140, 5))]
    canvas.polygon(front.wheelset(axle), mix(LEADING, 0.8))
    for side in (1.0, -1.0):
        _draw_wheel_section(canvas, front, side)


def _draw_bed(canvas: Canvas, front: Front) -> None:
    half, top = front.gauge + 60.0, -34.0
    level = front.track([complex(0.0, top - 7.0)])[0]
    if abs(front.scene.cant) > 1e-4:
        canvas.dashes(level - half, level + half, GHOST)
    sleeper = [
        complex(v, w) for v, w in ((-half, top - 14), (half, top - 14), (half, top), (-half, top))
    ]
    canvas.polygon(front.track(sleeper), SLEEPER, GRID)
    for side in (1.0, -1.0):
        gap = front.gauge - front.clearance + side * front.offset
        if gap < front.gauge:
            free = [(gap, -11.0), (front.gauge, -11.0), (front.gauge, 0.0), (gap, 0.0)]
            canvas.polygon(front.track([complex(side * v, w) for v, w in free]), BAND)
        g, m = front.gauge, front.gauge + 7.0
        profile = [(g, 0), (g, -11), (m - 2.5, -14), (m - 2.5, -29), (m - 12, -34)]
        outline = profile + [(2.0 * m - v, w) for v, w in reversed(profile)]
        canvas.polygon(front.track([complex(side * v, w) for v, w in outline]), RAIL)


def _draw_wheel_section(canvas: Canvas, front: Front, side: float) -> None:
    """Draw a wheel cut along its axle: flange, coned rim and web, above and below the axle."""
    paint = ALARM if touching(front.scene, 0, side) else LEADING
    face = front.gauge - front.clearance
    outer = front.gauge + front.clearance + 16.0
    flange = front.radius + 12.0
    for way in (-1.0, 1.0):
        rim = [
            (face - 9.0, front.radius - 12.0),
            (face - 9.0, flange - 3.0),
            (face - 6.0, flange),
            (face - 2.0, flange - 1.0),
            (face, front.tread(face)),
            (outer, front.tread(outer)),
            (outer, front.tread(outer) - 10.0),
        ]
        section = front.wheelset([complex(side * v, way * w) for v, w in rim])
        canvas.polygon(section, paint)
        web = [(face + 6.0, 0.0), (face + 14.0, 0.0), (face + 14.0, front.radius - 8.0)]
        web.append((face + 6.0, front.radius - 8.0))
        canvas.polygon(front.wheelset([complex(side * v, way * w) for v, w in web]), mix(paint, 0.6))
    hub = [(face - 6.0, -11.0), (face + 26.0, -11.0), (face + 26.0, 11.0), (face - 6.0, 11.0)]
    canvas.polygon(front.wheelset([complex(side * v, w) for v, w in hub]), paint)


def label_front(page: Page, scene: Scene) -> None:
    """Draw the frame, its headings and the clearances of both wheelsets."""
    page.canvas.rectangle(FRONT, None, GRID)
    which = "leading wheelset" if len(scene.wheelsets) > 1 else "wheelset"
    used = page.text(which, complex(FRONT.left + 8, FRONT.top + 3), 12, LEADING, bold=True)
    at = complex(FRONT.left + 14 + used, FRONT.top + 3)
    page.text(f"looking forward, lateral \N{MULTIPLICATION SIGN} {scene.exaggeration:g}", at, 12, LABEL)
    ends = {0: "leading", len(scene.wheelsets) - 1: "trailing"} if len(scene.wheelsets) > 1 else {0: ""}
    tops = (FRONT_VIEW.bottom + 4, FRONT_VIEW.bottom + 52)
    for (i, name), top in zip(ends.items(), tops, strict=False):
        _draw_gauge(page, scene, i, top, name)


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
