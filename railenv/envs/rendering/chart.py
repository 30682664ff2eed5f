"""The strip chart: displacements and actions over time."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from railenv.envs.rendering.colours import ACTIONS, ALARM, GRID, LABEL, NEUTRAL, of_wheelset
from railenv.envs.rendering.layout import CHART, Box
from railenv.envs.rendering.page import Page
from railenv.envs.rendering.scene import History, Scene
from railenv.envs.rendering.text import number

_RANGES = (
    (5.0, 2.5),
    (10.0, 5.0),
    (15.0, 5.0),
    (20.0, 10.0),
    (30.0, 10.0),
    (50.0, 25.0),
    (100.0, 50.0),
)
_WINDOWS = (
    *((1.0, 0.2), (2.0, 0.5), (3.0, 0.5), (4.0, 1.0), (5.0, 1.0), (6.0, 1.0), (8.0, 2.0), (10.0, 2.0)),
    *((15.0, 5.0), (20.0, 5.0), (30.0, 5.0), (40.0, 10.0), (60.0, 10.0), (120.0, 20.0), (300.0, 60.0)),
)


class Axes(NamedTuple):
    """One diagram of the strip chart; values from -limit to limit, time up to ``now``."""

    box: Box
    limit: float
    now: float
    window: float
    every: float

    def x(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the places of instants."""
        return self.box.right + (time - self.now) / self.window * self.box.width

    def y(self, value: Any) -> Any:
        """Return the places of values; those beyond the limit are at the edge."""
        return self.box.centre.imag - np.clip(value / self.limit, -1.0, 1.0) * self.box.height / 2.0


class Scales(NamedTuple):
    """The constant parts of the frames: the diagrams, their scales and the clearance (mm)."""

    upper: Axes
    lower: Axes | None
    step: float
    clearance: float

    @classmethod
    def of(cls, scene: Scene) -> Scales:
        """Return the scales into which a scene's history fits."""
        history = scene.history
        span = float(history.time[-1] - history.time[0]) if len(history.time) else 0.0
        window, every = next((w for w in _WINDOWS if w[0] >= span - 1e-9), (span, span / 5.0))
        left, width = CHART.left + 40, CHART.width - 92
        actuated = history.action.shape[1] > 0
        box = Box(left, CHART.top + 22, width, 98 if actuated else 168)
        clearance = 1e3 * scene.flange_clearance
        largest = max(1.25 * clearance, 1e3 * float(np.abs(history.y).max(initial=0.0)))
        limit, step = next((r for r in _RANGES if r[0] >= largest), _RANGES[-1])
        upper, lower = Axes(box, limit, 0.0, window, every), None
        if actuated:
            below = Box(left, box.bottom + 26, width, CHART.bottom - 18 - box.bottom - 26)
            lower = Axes(below, 1.0, 0.0, window, every)
        return cls(upper, lower, step, clearance)


def draw_chart(page: Page, scene: Scene) -> None:
    """Draw displacements, and below them the actions if there are actuators."""
    history = scene.history
    scales = Scales.of(scene)
    page.kept(CHART, scales, partial(_draw_still, page, scales))
    now = float(history.time[-1]) if len(history.time) else scene.time
    _draw_displacements(page, scales.upper._replace(now=now), scene)
    if scales.lower is not None:
        _draw_action(page, scales.lower._replace(now=now), history)


def _draw_still(page: Page, scales: Scales) -> None:
    """Draw the frame, headings and scales."""
    page.canvas.rectangle(CHART, None, GRID)
    corner = complex(CHART.left + 8, CHART.top + 3)
    page.text("lateral displacement, mm (left +)", corner, 12, bold=True)
    _draw_scales(page, scales.upper, scales.step, bottom=scales.lower is None)
    _draw_clearance(page, scales.upper, scales.clearance)
    if scales.lower is not None:
        _draw_scales(page, scales.lower, 1.0, bottom=True)


def _draw_scales(page: Page, axes: Axes, step: float, *, bottom: bool) -> None:
    box = axes.box
    for k in range(-int(axes.limit / step), int(axes.limit / step) + 1):
        y = float(axes.y(k * step))
        page.canvas.line(complex(box.left, y), complex(box.right, y), NEUTRAL if k == 0 else GRID)
        if abs(k * step) < axes.limit or axes.limit == 1.0:
            words = number(k * step, 0 if step.is_integer() else 1)
            page.text(words, complex(box.left - 6, y - 7), 11, LABEL, align="right")
    for k in range(int(axes.window / axes.every + 1e-9) + 1):
        x = box.right - k * axes.every / axes.window * box.width
        page.canvas.line(complex(x, box.top), complex(x, box.bottom), GRID)
        if bottom:
            words = f"\N{MINUS SIGN}{k * axes.every:g} s" if k else "now"
            page.text(words, complex(x, box.bottom + 3), 11, LABEL, align="centre")


def _draw_clearance(page: Page, axes: Axes, delta: float) -> None:
    for side in (1.0, -1.0):
        y = float(axes.y(side * delta))
        page.canvas.dashes(complex(axes.box.left, y), complex(axes.box.right, y), ALARM)
        page.text("flange", complex(axes.box.right + 6, y - 7), 11, ALARM, width=44)


def _draw_displacements(page: Page, axes: Axes, scene: Scene) -> None:
    history, count = scene.history, len(scene.wheelsets)
    legend = CHART.right - 52
    between = list(range(count - 2, 0, -1))
    for i in (*between, *([count - 1] if count > 1 else []), 0):
        colour = of_wheelset(i, count)
        if len(history.time):
            page.canvas.curve(*trace(axes, history.time, 1e3 * history.y[:, i]), colour)
        if i in between:
            continue
        name = "" if count == 1 else "trailing " if i else "leading "
        words = f"{name}{number(1e3 * float(scene.bodies[i, 0]))}"
        page.text(words, complex(legend, CHART.top + 3), 12, colour, align="right", bold=True)
        legend -= 130


def _draw_action(page: Page, axes: Axes, history: History) -> None:
    box = axes.box
    n = history.action.shape[1]
    x = CHART.left + 8 + page.text("action", complex(CHART.left + 8, box.top - 23), 12, bold=True) + 12
    for i in range(n):
        colour = ACTIONS[i % len(ACTIONS)]
        # Held from one instant to the next.
        time = np.repeat(history.time, 2)[1:]
        value = np.repeat(history.action[:, i], 2)[:-1]
        page.canvas.steps(*trace(axes, time, value), colour)
        last = number(float(history.action[-1, i]), 2) if len(history.time) else ""
        words = f"{i + 1}:  {last}" if n > 1 else last
        x += page.text(words, complex(x, box.top - 23), 12, colour, bold=True) + 16


def trace(
    axes: Axes, time: NDArray[np.float64], value: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a signal on the page; for a long one, the extremes in every column, which scroll along."""
    columns = int(axes.box.width / 2.0)
    if len(time) > 2 * columns:
        column = np.floor(time * (columns / axes.window))
        first = np.concatenate([[0], np.flatnonzero(np.diff(column)) + 1])
        low, high = np.minimum.reduceat(value, first), np.maximum.reduceat(value, first)
        last = np.append(first[1:], len(value)) - 1
        value = np.where(value[last] >= value[first], [low, high], [high, low]).T.ravel()
        time = np.column_stack([time[first], time[last]]).ravel()
    return axes.x(time), np.asarray(axes.y(value))
