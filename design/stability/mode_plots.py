"""Drawings of mode shapes: views of the bodies, bars, and an animation."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import control
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation

from design.stability.mode_views import FrontView, PlanView, SideView, View
from design.style import STABLE, axes_or_new, drawn_on, style
from railenv import checks
from railenv.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from design.stability.mode_shape import ModeShape

Moving = Callable[[float], list[Any]]
"""A function that places everything at a phase (rad)."""

_VISIBLE = 1e-3  # of the largest displacement
_WIDTHS = (5.2, 1.0)  # of the views from above and from behind
_LONG = 6.0  # m between the outermost wheelsets, above which a view takes a row
_MOST_ROLLS = 3  # largest number of bodies whose roll is described


def plot_bars(shape: ModeShape, ax: Axes | None = None) -> control.ControlPlot:
    """Draw the magnitude of each displacement, with its phase written above."""
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
        ax.set_title(_title(shape) if metric else f"{shape.model_name}: {shape.condition}")
        ax.grid(axis="x", visible=False)
        return drawn_on(ax)


def plot_views(shape: ModeShape, ax: Axes | None, phases: Sequence[float]) -> control.ControlPlot:
    """Draw the bodies at some phases (degrees), with a row for each if the vehicle is long."""
    chosen = [checks.number("phase", phase, unit="degrees") for phase in phases]
    if not chosen:
        raise ParameterError("phases is empty; give at least one phase, in degrees")
    with style():
        if ax is not None:
            _main_view(shape, ax).draw(math.radians(chosen[0]))
            ax.set_title(_title(shape))
            return drawn_on(ax)
        figure, axes = _panels(shape, len(chosen))
        rows = axes if _seen_from_behind(shape) else axes.reshape(-1, 1)
        for row, phase in zip(rows, chosen, strict=False):
            for view in _views(shape, row):
                view.draw(math.radians(phase))
            row[0].set_title(_caption(shape, phase), fontsize=9)
        for place in axes.flat[len(chosen) * rows.shape[1] :]:
            place.set_visible(False)
        for place in axes[:-1].flat:
            place.set_xlabel("")
        for place in axes[:, 1:].flat:
            place.set_ylabel("")
        figure.suptitle(f"{_title(shape)}\n{_explanation(shape)}", fontsize=10, x=0.01, ha="left")
        lines = np.empty(axes.shape, dtype=object)
        for index, place in np.ndenumerate(axes):
            lines[index] = list(place.lines)
        return control.ControlPlot(lines, axes, figure)


def _panels(shape: ModeShape, count: int) -> tuple[Figure, Any]:
    """Return a figure with axes for some phases: two in a row, or one for a long vehicle."""
    if _seen_from_behind(shape):
        size = (8.8, 0.8 + 1.45 * count)
        return plt.subplots(count, 2, figsize=size, squeeze=False, width_ratios=_WIDTHS)
    columns = 1 if _long(shape) else min(2, count)
    rows = math.ceil(count / columns)
    width, height = (8.4, 1.75) if columns == 1 and _long(shape) else (4.2 * columns, 2.9)
    return plt.subplots(rows, columns, figsize=(width, 0.9 + height * rows), squeeze=False)


def _long(shape: ModeShape) -> bool:
    assert shape.geometry is not None
    places = [wheelset.x for wheelset in shape.geometry.wheelsets]
    return max(places) - min(places) > _LONG


def _seen_from_behind(shape: ModeShape) -> bool:
    """Return whether a view from behind is added: for lateral modes of a whole vehicle."""
    assert shape.geometry is not None
    return _long(shape) and bool(shape.geometry.others) and not shape.vertical


def _main_view(shape: ModeShape, ax: Axes) -> View:
    return SideView(shape, ax) if shape.vertical else PlanView(shape, ax)


def _views(shape: ModeShape, axes: Sequence[Axes]) -> list[View]:
    """Return the views of one phase, in a row of axes."""
    found = [_main_view(shape, axes[0])]
    if _seen_from_behind(shape):
        found.append(FrontView(shape, axes[1]))
    return found


def _title(shape: ModeShape) -> str:
    return (
        f"{shape.model_name}: {shape.name}, {shape.frequency:.2f} Hz, damping ratio "
        f"{round(shape.damping, 4) + 0.0:+.4f}\n{shape.condition}"
    )


def _explanation(shape: ModeShape) -> str:
    """Return an explanation of the views."""
    if shape.vertical or _seen_from_behind(shape):
        return "displacements magnified"
    return "displacements magnified; roll as a share of the largest displacement"


def _caption(shape: ModeShape, phase: float) -> str:
    """Return the phase, and the roll of the bodies if no view shows it."""
    if shape.vertical or _seen_from_behind(shape):
        return f"phase {phase:g}°"
    return f"phase {phase:g}°: {_roll(shape, math.radians(phase))}"


def _roll(shape: ModeShape, phase: float) -> str:
    """Return the roll of the bodies relative to the largest displacement."""
    assert shape.geometry is not None
    moved = dict(zip(shape.names, shape.at(phase), strict=True))
    rolling = [(b.name, moved[b.phi]) for b in shape.geometry.bodies if b.phi is not None]
    largest = sorted((abs(angle) for _, angle in rolling), reverse=True)[:_MOST_ROLLS]
    said = ", ".join(f"{n} {a + 0.0:+.3f}" for n, a in rolling if abs(a) >= largest[-1])
    return f"roll {said}" if said else "no roll"


def animate(shape: ModeShape, frames: int, interval: float) -> FuncAnimation:
    """Animate one period, in plan view or as bars that swing."""
    if not hasattr(frames, "__index__") or frames < 2:
        raise ParameterError(f"frames is {frames!r}; it must be a whole number, at least 2")
    interval = checks.number("interval", interval, low=0.0, open_low=True, unit="ms")
    with style():
        if shape.geometry is None:
            figure, ax = plt.subplots(figsize=(6.0, 3.6))
            moving = _swinging_bars(shape, ax)
            ax.set_title(_title(shape), fontsize=9)
        else:
            figure, moving = _moving_views(shape)
        figure.canvas.draw()
        figure.set_layout_engine("none")  # laid out once; doing it for every picture takes long
    return _animation(figure, moving, frames, interval)


def _moving_views(shape: ModeShape) -> tuple[Figure, Moving]:
    """Return a figure with the views of a vehicle, and a function that sets a phase (rad)."""
    if _seen_from_behind(shape):
        figure, axes = plt.subplots(1, 2, figsize=(8.8, 2.4), width_ratios=_WIDTHS)
    else:
        figure, ax = plt.subplots(figsize=(8.4, 3.0) if _long(shape) else (6.0, 3.8))
        axes = [ax]
    views = _views(shape, axes)
    figure.suptitle(_title(shape), fontsize=9, x=0.01, ha="left")

    def draw(phase: float) -> list[Any]:
        return [line for view in views for line in view.draw(phase)]

    return figure, draw


def _animation(figure: Figure, moving: Moving, frames: int, interval: float) -> FuncAnimation:
    phases = np.linspace(0.0, 2.0 * math.pi, frames, endpoint=False)

    def update(frame: int) -> Any:
        return moving(float(phases[frame]))

    return FuncAnimation(figure, update, frames=frames, interval=interval, blit=False)


def _swinging_bars(shape: ModeShape, ax: Axes) -> Moving:
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
