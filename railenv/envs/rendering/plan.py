"""Plan view of the running vehicle."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railenv.envs.rendering.canvas import Canvas
from railenv.envs.rendering.colours import (
    ALARM,
    BAND,
    GHOST,
    GRID,
    INK,
    LABEL,
    NEUTRAL,
    RAIL,
    SLEEPER,
    WHITE,
    Colour,
    mix,
    of_wheelset,
)
from railenv.envs.rendering.layout import PLAN, PLAN_ABOVE, PLAN_BELOW, PLAN_VIEW, Box
from railenv.envs.rendering.page import Page
from railenv.envs.rendering.scene import TANGENT, Outline, Scene, touching
from railenv.envs.rendering.text import number

GROUND_SLOWDOWN = 20.0
"""The sleepers pass this many times slower than in reality, so that they do not blur."""

_SLEEPER_SPACING = 0.6
_BEND_CURVATURE = 5e-4
_PLAN_HALF_GAUGE = 58.0
_LEAST_HALF_GAUGE = 34.0  # a longer vehicle is drawn narrower than that, but no less wide
_PLAN_BEND = 60.0

_Pose = Callable[[Iterable[complex]], list[complex]]
"""A map from a body's own points (forward + left * 1j, in page units) to the page."""


class Plan:
    """Plan view: maps track coordinates (along and to the left, in page units) to the page."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.scale = min(
            _PLAN_HALF_GAUGE / scene.half_gauge,
            0.36 * PLAN_VIEW.width / (scene.half_wheelbase + scene.wheel_radius),
        )
        self.gauge = max(self.scale * scene.half_gauge, _LEAST_HALF_GAUGE)
        self.lateral = self.gauge / scene.half_gauge * scene.exaggeration
        self.size = self.gauge / _PLAN_HALF_GAUGE
        self.places = [self.scale * x for x in scene.wheelsets]
        self.clearance = self.lateral * scene.flange_clearance
        self.reach = PLAN_VIEW.width / 2.0
        k = scene.curvature
        self.bend = _PLAN_BEND * k / (abs(k) + _BEND_CURVATURE)

    def track(self, along: Any, left: Any) -> Any:
        """Return the points on the page of track coordinates."""
        return self._track(along, left, self.heading(along))

    def _track(self, along: Any, left: Any, heading: Any) -> Any:
        plan = along - 1j * self.bend * (along / self.reach) ** 2 + 1j * heading * left
        return PLAN_VIEW.centre + plan.conjugate()

    def heading(self, along: Any) -> Any:
        """Return the direction of the track, a complex number of magnitude 1, y to the left."""
        slope = -2.0 * self.bend * along / self.reach**2
        return (1.0 + 1j * slope) / (1.0 + slope**2) ** 0.5

    def alignment(self, along: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement of the rails, joined smoothly from wheelset to wheelset."""
        at, shift = self.places[::-1], (self.lateral * self.scene.rail).tolist()[::-1]
        total = np.full(np.shape(along), shift[0])
        for k in range(1, len(at)):
            u = np.clip((along - at[k - 1]) / (at[k] - at[k - 1]), 0.0, 1.0)
            total = total + (shift[k] - shift[k - 1]) * u * u * (3.0 - 2.0 * u)
        return total

    def pose(self, along: float, y: float, yaw: float) -> _Pose:
        """Return the map from a body's own coordinates to the page."""
        heading = self.heading(along)
        return self._turned(self._track(along, self.lateral * y, heading), heading, yaw)

    def pose_on_chord(self, ends: tuple[float, float], y: float, yaw: float) -> _Pose:
        """Return the same map for a body that stands on two places of a curved track."""
        first, last = (self.track(along, 0.0) for along in ends)
        heading = (last - first).conjugate() / abs(last - first)
        centre = (first + last) / 2.0 + (1j * heading * self.lateral * y).conjugate()
        return self._turned(centre, heading, yaw)

    def _turned(self, centre: complex, heading: complex, yaw: float) -> _Pose:
        """Return the map from the coordinates of a body that yaws from a heading."""
        angle = heading * cmath.exp(1j * math.atan(self.scene.exaggeration * yaw))
        return lambda points: [centre + (z * angle).conjugate() for z in points]


def draw_plan(canvas: Canvas, scene: Scene) -> None:
    """Draw track, wheelsets, frames, other bodies, and, paler, their equilibrium."""
    plan = Plan(scene)
    _draw_ground(canvas, plan)
    along = np.linspace(-1.2 * plan.reach, 1.2 * plan.reach, 33)
    shift = plan.alignment(along)
    for side in (1.0, -1.0):
        edge, inner = side * plan.gauge, side * (plan.gauge - plan.clearance)
        _draw_strip(canvas, plan, along, shift, (inner, edge), BAND)
    count = len(plan.places)
    ends = [(at, i, of_wheelset(i, count)) for i, at in enumerate(plan.places)]
    for at, i, colour in ends:
        _draw_treads(canvas, plan, at, i, colour)
    for side in (1.0, -1.0):
        foot = side * (plan.gauge + 5.0 * plan.size)
        _draw_strip(canvas, plan, along, shift, (side * plan.gauge, foot), RAIL)
    for at, i, _ in ends:
        _draw_wheelset_ghost(canvas, plan, at, i)
    for at, i, colour in ends:
        _draw_axle(canvas, plan, at, i, colour)
    numbered = list(enumerate(scene.outlines, count))
    for kind, draw in (("frame", _draw_frame), ("body", _draw_body)):
        for i, outline in numbered:
            if outline.kind == kind:
                draw(canvas, plan, i, outline)


def _draw_ground(canvas: Canvas, plan: Plan) -> None:
    scene = plan.scene
    pitch = plan.scale * _SLEEPER_SPACING
    passed = scene.speed * scene.time / GROUND_SLOWDOWN * plan.scale
    half_length, half_width = 1.8 * plan.gauge, 0.2 * pitch
    start = -1.2 * plan.reach - passed % pitch
    at = np.arange(start, 1.2 * plan.reach, pitch)[:, None]
    along = at + np.array([-half_width, half_width, half_width, -half_width])
    ends = np.array([-half_length, -half_length, half_length, half_length])
    canvas.polygons(plan.track(along, ends), SLEEPER)
    middle = canvas.pixels(plan.track(np.arange(-1.2 * plan.reach, 1.2 * plan.reach, 12.0), 0.0))
    canvas.segments(middle, GHOST)


def _draw_strip(
    canvas: Canvas,
    plan: Plan,
    along: NDArray[np.float64],
    shift: NDArray[np.float64],
    edges: tuple[float, float],
    colour: Colour,
) -> None:
    there = plan.track(along, shift + edges[0])
    back = plan.track(along[::-1], shift[::-1] + edges[1])
    canvas.polygon(np.concatenate([there, back]), colour)


def _wheel(plan: Plan, side: float) -> tuple[float, float, float, float]:
    """Return inner edge of flange, outer edge of flange, outer edge of tread, half length."""
    face = plan.gauge - plan.clearance
    width, flange = 2.0 * plan.clearance + 8.0 * plan.size, 6.0 * plan.size
    half_length = plan.scale * plan.scene.wheel_radius
    return side * (face - flange), side * face, side * (face + width), half_length


def _rectangle(half_length: float, left: float, right: float) -> list[complex]:
    return [
        complex(-half_length, left),
        complex(half_length, left),
        complex(half_length, right),
        complex(-half_length, right),
    ]


def _body_pose(plan: Plan, at: float, i: int) -> _Pose:
    y, _, _, psi = plan.scene.bodies[i].tolist()
    return plan.pose(at, y, psi)


def _draw_treads(canvas: Canvas, plan: Plan, at: float, i: int, colour: Colour) -> None:
    """Draw the treads, below the rails in the picture so that these stay visible."""
    place = _body_pose(plan, at, i)
    for side in (1.0, -1.0):
        _, face, outer, half = _wheel(plan, side)
        paint = ALARM if touching(plan.scene, i, side) else colour
        canvas.polygon(place(_rectangle(half, face, outer)), mix(paint, 0.45), paint, 1.5)


def _draw_axle(canvas: Canvas, plan: Plan, at: float, i: int, colour: Colour) -> None:
    place = _body_pose(plan, at, i)
    end = plan.gauge + 1.0 * plan.clearance + 32.0 * plan.size
    canvas.polygon(place(_rectangle(4.0 * plan.size, -end, end)), mix(colour, 0.8), None)
    for side in (1.0, -1.0):
        inner, face, _, half = _wheel(plan, side)
        paint = ALARM if touching(plan.scene, i, side) else colour
        canvas.polygon(place(_rectangle(half + 5.0 * plan.size, inner, face)), paint)


def _draw_wheelset_ghost(canvas: Canvas, plan: Plan, at: float, i: int) -> None:
    y, _, _, psi = plan.scene.equilibrium[i].tolist()
    place = plan.pose(at, y, psi)
    for side in (1.0, -1.0):
        inner, _, outer, half = _wheel(plan, side)
        canvas.polygon(place(_rectangle(half + 5.0 * plan.size, inner, outer)), None, GHOST, 1.5)


def _frame_parts(plan: Plan, outline: Outline, grow: float = 0.0) -> list[list[complex]]:
    beam = plan.gauge + plan.clearance + 18.0 * plan.size
    half, thick = plan.scale * outline.half_length + 24.0 * plan.size + grow, 7.0 * plan.size + grow
    return [
        _rectangle(half, beam - thick, beam + thick),
        _rectangle(half, -beam - thick, -beam + thick),
        _rectangle(11.0 * plan.size + grow, -beam, beam),
    ]


def _draw_frame(canvas: Canvas, plan: Plan, i: int, outline: Outline) -> None:
    at = plan.scale * outline.x
    y, _, _, psi = plan.scene.equilibrium[i].tolist()
    place = plan.pose(at, y, psi)
    for part in _frame_parts(plan, outline):
        canvas.polygon(place(part), None, GHOST, 1.5)
    place = _body_pose(plan, at, i)
    for grow, colour in ((1.0, RAIL), (0.0, NEUTRAL)):
        for part in _frame_parts(plan, outline, grow):
            canvas.polygon(place(part), colour)
    canvas.circle(complex(place([0.0])[0]), 5.0 * plan.size, WHITE, RAIL)


def _draw_body(canvas: Canvas, plan: Plan, i: int, outline: Outline) -> None:
    """Draw the edge of a body above the frames, which would hide everything if it were filled.

    It stands on the outermost frames. Its steady shift on its springs is drawn to scale, since it
    would be metres if it were enlarged like the motion about it.
    """
    half = plan.scale * outline.half_length + 48.0
    edge = _rectangle(half, -2.0 * plan.gauge, 2.0 * plan.gauge)
    frames = [plan.scale * o.x for o in plan.scene.outlines if o.kind == "frame"]

    def pose(shift: float, psi: float) -> _Pose:
        if len(frames) > 1:
            return plan.pose_on_chord((min(frames), max(frames)), shift, psi)
        return plan.pose(plan.scale * outline.x, shift, psi)

    scene = plan.scene
    steady = scene.equilibrium[i].tolist()
    own_scale = steady[0] / scene.exaggeration
    canvas.polygon(pose(own_scale, steady[3])(edge), None, GHOST, 1.5)
    y, _, _, psi = scene.bodies[i].tolist()
    place = pose(y - steady[0] + own_scale, psi)
    canvas.polygon(place(edge), None, INK, 2.0)
    canvas.circle(complex(place([0.0])[0]), 3.0, INK)


def show_plan(page: Page, scene: Scene) -> None:
    """Draw the view, its heading and legend, and over it the reason of a derailment."""
    page.kept(PLAN_ABOVE, None, partial(_draw_heading, page))
    key = scene.exaggeration, scene.flange_clearance
    page.kept(PLAN_BELOW, key, partial(_draw_legend, page, *key))
    page.layer(PLAN_VIEW, partial(draw_plan, scene=scene))
    page.canvas.rectangle(PLAN, None, GRID)  # last, since in small pictures it touches the view
    _name_outer_rail(page, scene)
    if scene.derailed is not None:
        _draw_banner(page, scene.derailed)


def _draw_heading(page: Page) -> None:
    page.text("plan view", complex(PLAN.left + 8, PLAN.top + 3), 12, bold=True)
    travel = "travelling to the right \N{RIGHTWARDS ARROW}"
    page.text(travel, complex(PLAN.right - 8, PLAN.top + 3), 12, LABEL, align="right")


def _draw_legend(page: Page, exaggeration: float, flange_clearance: float) -> None:
    words = f"lateral motion and yaw \N{MULTIPLICATION SIGN} {exaggeration:g}"
    x, y = PLAN.left + 8, PLAN.bottom - 18
    x += page.text(words, complex(x, y), 12, LABEL) + 18
    page.canvas.rectangle(Box(x, y + 3, 14, 9), BAND)
    clearance = f"flange clearance {number(1e3 * flange_clearance)} mm"
    x += page.text(clearance, complex(x + 19, y), 12, LABEL) + 37
    page.canvas.rectangle(Box(x, y + 3, 14, 9), None, NEUTRAL)
    page.text("equilibrium", complex(x + 19, y), 12, LABEL)
    slow = f"ground speed \N{DIVISION SIGN} {GROUND_SLOWDOWN:g}"
    page.text(slow, complex(PLAN.right - 8, y), 12, LABEL, align="right")


def _name_outer_rail(page: Page, scene: Scene) -> None:
    if abs(scene.curvature) >= TANGENT:
        side = 1.0 if scene.curvature > 0.0 else -1.0
        plan = Plan(scene)
        wide = any(outline.kind == "body" for outline in scene.outlines)
        away = (2.0 if wide else 1.0) * plan.gauge + 18.0
        beside = complex(plan.track(40.0 - plan.reach, side * away)).imag
        page.text("outer rail", complex(PLAN.left + 8, beside - 7), 12, RAIL, bold=True)


def _draw_banner(page: Page, reason: str) -> None:
    """Write the reason of a derailment across the view."""
    box = Box(PLAN.left, PLAN.top, PLAN.width, 28)
    page.canvas.rectangle(box, ALARM)
    at = complex(box.centre.real, box.top + 5)
    page.text(f"DERAILED: {reason}", at, 15, WHITE, align="centre", bold=True, width=box.width - 20)
