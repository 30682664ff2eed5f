"""How mode shapes are drawn: a plan view of the bodies, bars, and an animation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import control
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation
from numpy.typing import NDArray

from design.style import NEUTRAL, STABLE, UNSTABLE, axes_or_new, drawn_on, style
from railenv import checks
from railenv.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from design.stability.mode_shape import ModeShape, Outline

Array = NDArray[np.float64]

_DARK = "#333333"
_LARGEST_OFFSET = 0.28  # m, to which displacements are magnified
_LARGEST_ANGLE = 0.22  # rad, likewise
_OVERHANG = 0.9  # m of track beyond the axles
_CLEAR = 0.3  # m of track beyond frames and other bodies
_BEAM, _SIDE = 0.62, 1.3  # of half the gauge: a frame's side beams, the sides of other bodies
_WHEEL = 0.42  # m, length of a wheel in plan view
_VISIBLE = 1e-3  # of the largest displacement
_LONG = 6.0  # m between the outermost wheelsets, from which a view takes a row
_MOST_ROLLS = 3  # bodies of which is said how they roll, the largest


def plot_bars(shape: ModeShape, ax: Axes | None = None) -> control.ControlPlot:
    """Draw magnitude of each displacement, with its phase written above."""
    with style():
        ax = axes_or_new(ax)
        n = len(shape.names)
        magnitude, phase = np.abs(shape.displacements), np.degrees(np.angle(shape.displacements))
        ax.bar(range(n), magnitude, color=STABLE, width=0.7)
        for i in np.flatnonzero(magnitude > _VISIBLE):
            ax.text(float(i), magnitude[i] + 0.02, f"{phase[i] + 0.0:.0f}°", ha="center", fontsize=8)
        ax.set_xticks(range(n), shape.names, rotation=45, ha="right")
        ax.set_ylim(0.0, 1.15)
        metric = shape.geometry is not None
        ax.set_ylabel(f"magnitude ({'m and rad, ' if metric else ''}largest = 1)")
        ax.set_title(f"{shape.model_name}: {shape.condition}")
        ax.grid(axis="x", visible=False)
        return drawn_on(ax)


def plot_plan(shape: ModeShape, ax: Axes | None, phases: Sequence[float]) -> control.ControlPlot:
    """Draw the bodies from above at some phases (degrees); roll is written as text."""
    chosen = [checks.number("phase", phase, unit="degrees") for phase in phases]
    if not chosen:
        raise ParameterError("phases is empty; give at least one phase, in degrees")
    with style():
        if ax is not None:
            _Plan(shape, ax).draw(math.radians(chosen[0]))
            ax.set_title(_title(shape))
            return drawn_on(ax)
        figure, axes = _panels(shape, len(chosen))
        for place, phase in zip(axes.flat, chosen, strict=False):
            plan = _Plan(shape, place)
            plan.draw(math.radians(phase))
            place.set_title(f"phase {phase:g}°: {plan.roll(math.radians(phase))}", fontsize=9)
        for place in axes.flat[len(chosen) :]:
            place.set_visible(False)
        for place in axes[:-1].flat:
            place.set_xlabel("")
        for place in axes[:, 1:].flat:
            place.set_ylabel("")
        figure.suptitle(
            _title(shape) + "\ndisplacements magnified; roll as a share of the largest displacement",
            fontsize=10,
            x=0.01,
            ha="left",
        )
        lines = np.empty(axes.shape, dtype=object)
        for index, place in np.ndenumerate(axes):
            lines[index] = list(place.lines)
        return control.ControlPlot(lines, axes, figure)


def _panels(shape: ModeShape, count: int) -> tuple[Figure, Any]:
    """Return a figure with axes for some plan views: two in a row, or one of a long vehicle."""
    assert shape.geometry is not None
    places = [wheelset.x for wheelset in shape.geometry.wheelsets]
    long = max(places) - min(places) > _LONG
    columns = 1 if long else min(2, count)
    rows = math.ceil(count / columns)
    width, height = (8.4, 1.7) if long else (4.2 * columns, 2.6)
    return plt.subplots(rows, columns, figsize=(width, 0.9 + height * rows), squeeze=False)


def _title(shape: ModeShape) -> str:
    return (
        f"{shape.model_name}, {shape.condition}: {shape.frequency:.2f} Hz, damping ratio "
        f"{shape.damping:+.4f}"
    )


class _Plan:
    """A vehicle seen from above; it runs to the right, left is up."""

    def __init__(self, shape: ModeShape, ax: Axes) -> None:
        assert shape.geometry is not None
        self.shape, self.geometry = shape, shape.geometry
        self.a = self.geometry.half_gauge
        # one factor for offsets and angles, as in a motion that is so much larger
        offset = self._largest([body.y for body in self.geometry.bodies])
        angle = self._largest([body.psi for body in self.geometry.bodies])
        self.factor = 1.0 / max(offset / _LARGEST_OFFSET, angle / _LARGEST_ANGLE, 1e-6)
        start = min([w.x - _OVERHANG for w in self.geometry.wheelsets] + self._ends(-1.0))
        end = max([w.x + _OVERHANG for w in self.geometry.wheelsets] + self._ends(1.0))
        for rail in (-self.a, self.a):
            ax.plot([start, end], [rail, rail], color=NEUTRAL, lw=2.5, zorder=1)
        ax.plot([start, end], [0.0, 0.0], color=NEUTRAL, lw=0.8, ls=":", zorder=1)
        self.lines = {part: ax.plot([], [], **style)[0] for part, style in self._parts().items()}
        ax.set_aspect("equal")
        ax.set_xlim(start, end)
        ax.set_ylim(-self.a - 0.62, self.a + 0.62)
        ax.grid(visible=False)
        ax.set_xlabel("along the track (m)")
        ax.set_ylabel("across (m)")

    def _ends(self, side: float) -> list[float]:
        """Return where bodies over the wheelsets end, with some track beyond."""
        return [
            body.x + side * (body.half_length + _CLEAR)
            for body in (*self.geometry.frames, *self.geometry.others)
        ]

    def _largest(self, names: Sequence[str | None]) -> float:
        return max((abs(self.shape[n]) for n in names if n is not None), default=0.0)

    def _parts(self) -> dict[str, dict[str, Any]]:
        parts: dict[str, dict[str, Any]] = {}
        for body in self.geometry.others:
            parts[body.name] = {"color": _DARK, "lw": 1.2, "ls": "--", "zorder": 2}
        for body in self.geometry.frames:
            parts[body.name] = {"color": _DARK, "lw": 2.0, "zorder": 2}
        for body in self.geometry.wheelsets:
            parts[f"{body.name} axle"] = {"color": STABLE, "lw": 2.2, "zorder": 3}
            parts[f"{body.name} wheels"] = {
                "color": STABLE,
                "lw": 5.0,
                "zorder": 4,
                "solid_capstyle": "butt",
            }
            parts[f"{body.name} centre"] = {
                "color": UNSTABLE,
                "marker": "o",
                "ms": 4,
                "ls": "",
                "zorder": 5,
            }
        return parts

    def draw(self, phase: float) -> list[Any]:
        """Place the bodies at a phase (rad)."""
        moved = dict(zip(self.shape.names, self.factor * self.shape.at(phase), strict=True))
        for body in self.geometry.wheelsets:
            self._wheelset(body, moved)
        for body in self.geometry.frames:
            self._frame(body, moved)
        for body in self.geometry.others:
            self._rectangle(body, moved)
        return list(self.lines.values())

    def _wheelset(self, body: Outline, moved: Mapping[str, float]) -> None:
        """Draw an axle with its wheels."""
        centre = self._moved(body, moved, 0.0, 0.0)
        ends = [self._moved(body, moved, 0.0, side * self.a) for side in (-1.0, 1.0)]
        self.lines[f"{body.name} axle"].set_data(*np.transpose(ends))
        gap = [(math.nan, math.nan)]
        wheels = [
            [self._moved(body, moved, along * _WHEEL, side * self.a) for along in (-1.0, 1.0)]
            for side in (-1.0, 1.0)
        ]
        self.lines[f"{body.name} wheels"].set_data(*np.transpose([*wheels[0], *gap, *wheels[1]]))
        self.lines[f"{body.name} centre"].set_data([centre[0]], [centre[1]])

    def _frame(self, body: Outline, moved: Mapping[str, float]) -> None:
        """Draw a frame as an H: two side beams and a cross beam."""
        beam, end = _BEAM * self.a, body.half_length
        corners = [(-end, beam), (end, beam), None, (-end, -beam), (end, -beam), None]
        corners += [(0.0, -beam), (0.0, beam)]
        points = [
            (math.nan, math.nan) if c is None else self._moved(body, moved, c[0], c[1]) for c in corners
        ]
        self.lines[body.name].set_data(*np.transpose(points))

    def _rectangle(self, body: Outline, moved: Mapping[str, float]) -> None:
        """Draw any other body."""
        side, end = _SIDE * self.a, body.half_length
        corners = [(-end, side), (end, side), (end, -side), (-end, -side), (-end, side)]
        points = [self._moved(body, moved, *corner) for corner in corners]
        self.lines[body.name].set_data(*np.transpose(points))

    @staticmethod
    def _moved(
        body: Outline, moved: Mapping[str, float], along: float, across: float
    ) -> tuple[float, float]:
        """Return where a point of a body lies that has shifted by y and yawed by psi."""
        y = 0.0 if body.y is None else moved[body.y]
        psi = 0.0 if body.psi is None else moved[body.psi]
        cos, sin = math.cos(psi), math.sin(psi)
        return body.x + along * cos - across * sin, y + along * sin + across * cos

    def roll(self, phase: float) -> str:
        """Say how the bodies roll, relative to the largest displacement."""
        moved = dict(zip(self.shape.names, self.shape.at(phase), strict=True))
        rolling = [(b.name, moved[b.phi]) for b in self.geometry.bodies if b.phi is not None]
        largest = sorted((abs(angle) for _, angle in rolling), reverse=True)[:_MOST_ROLLS]
        said = ", ".join(f"{n} {a + 0.0:+.3f}" for n, a in rolling if abs(a) >= largest[-1])
        return f"roll {said}" if said else "no roll"


def animate(shape: ModeShape, frames: int, interval: float) -> FuncAnimation:
    """Animate one period, in plan view or as bars that swing."""
    if not hasattr(frames, "__index__") or frames < 2:
        raise ParameterError(f"frames is {frames!r}; it must be a whole number, at least 2")
    interval = checks.number("interval", interval, low=0.0, open_low=True, unit="ms")
    with style():
        figure, ax = plt.subplots(figsize=(6.0, 3.6))
        moving = _Plan(shape, ax).draw if shape.geometry is not None else _swinging_bars(shape, ax)
        ax.set_title(_title(shape), fontsize=9)
        figure.canvas.draw()
        figure.set_layout_engine("none")  # laid out once; doing it for every picture takes long
    return _animation(figure, moving, frames, interval)


def _animation(figure: Figure, moving: Any, frames: int, interval: float) -> FuncAnimation:
    phases = np.linspace(0.0, 2.0 * math.pi, frames, endpoint=False)

    def update(frame: int) -> Any:
        return moving(float(phases[frame]))

    return FuncAnimation(figure, update, frames=frames, interval=interval, blit=False)


def _swinging_bars(shape: ModeShape, ax: Axes) -> Any:
    bars = ax.bar(range(len(shape.names)), np.zeros(len(shape.names)), color=STABLE, width=0.7)
    ax.set_xticks(range(len(shape.names)), shape.names, rotation=45, ha="right")
    ax.set_ylim(-1.15, 1.15)
    ax.set_ylabel("displacement (largest = 1)")
    ax.grid(axis="x", visible=False)

    def draw(phase: float) -> list[Any]:
        for bar, height in zip(bars, shape.at(phase), strict=True):
            bar.set_height(height)
        return list(bars)

    return draw
