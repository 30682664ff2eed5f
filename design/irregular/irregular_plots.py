"""Drawings of Lyapunov exponents, Poincare sections and their diagrams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from design.cycles.labels import PARAMETER_LABELS, axis_label, unit_of
from design.style import NEUTRAL, SERIES, STABLE, axes_or_new, curve_title, drawn_on, style
from railenv import checks

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.irregular.lyapunov import LyapunovExponents
    from design.irregular.section import PoincareSection
    from design.irregular.section_diagram import SectionDiagram, Sweep

Array = NDArray[np.float64]


def plot_convergence(found: LyapunovExponents, ax: Axes | None = None) -> control.ControlPlot:
    """Draw the running means of exponents, with bands of one standard error at the end."""
    with style():
        ax = axes_or_new(ax)
        for k, (value, error) in enumerate(zip(found.exponents, found.error, strict=True)):
            color = SERIES[k % len(SERIES)]
            label = f"{value:.4g} ± {error:.1g} 1/s"
            ax.plot(found.time, found.history[:, k], color=color, lw=1.2, label=label)
            ax.axhspan(value - error, value + error, color=color, alpha=0.15, lw=0.0)
        ax.axhline(0.0, color=NEUTRAL, lw=1.0)
        ax.set_xlabel("averaged over (s)")
        ax.set_ylabel("Lyapunov exponents (1/s)")
        ax.set_title(f"{found.model_name} at {found.speed:g} m/s: {found.kind}")
        ax.legend(loc="best", fontsize=8)
        return drawn_on(ax)


def plot_section(
    section: PoincareSection, states: tuple[str, str] | None = None, ax: Axes | None = None
) -> control.ControlPlot:
    """Draw the points of a section in the plane of two states."""
    if states is None:
        swing = (section.highest - section.lowest) / section.scale
        varies = [n for n, s in zip(section.state_names, swing, strict=True) if s > swing.max() * 1e-6]
        others = [n for n in (*varies, *section.state_names) if n != section.section.state]
        states = section.section.state, (others or list(section.state_names))[0]
    checks.known("state", states, section.state_names)
    with style():
        ax = axes_or_new(ax, (5.2, 4.6))
        (fx, _), (fy, _) = (unit_of(name) for name in states)
        x, y = (section.values(name) for name in states)
        ax.plot(fx * x, fy * y, ".", color=STABLE, ms=3.0)
        ax.set_xlabel(axis_label(states[0]))
        ax.set_ylabel(axis_label(states[1]))
        where = curve_title(1.0 / section.curvature if section.curvature else np.inf, section.cant)
        ax.set_title(f"{section.model_name} at {section.speed:g} m/s, {where}")
        return drawn_on(ax)


def plot_return_map(
    section: PoincareSection, state: str | None = None, ax: Axes | None = None
) -> control.ControlPlot:
    """Draw a state at each point of a section over its value at the previous point."""
    name = section.section.state if state is None else state
    before, after = section.return_map(name)
    factor, _ = unit_of(name)
    with style():
        ax = axes_or_new(ax, (4.8, 4.6))
        both = factor * np.array([min(before.min(), after.min()), max(before.max(), after.max())])
        ax.plot(both, both, color=NEUTRAL, lw=1.0)
        ax.plot(factor * before, factor * after, ".", color=STABLE, ms=3.0)
        ax.set_xlabel(axis_label(name, "one point"))
        ax.set_ylabel(axis_label(name, "the next"))
        ax.set_title(f"{section.model_name} at {section.speed:g} m/s, {section.section}")
        return drawn_on(ax)


def plot_section_diagram(
    diagram: SectionDiagram, state: str | None = None, ax: Axes | None = None
) -> control.ControlPlot:
    """Draw sections over the parameter; in a new figure, also the largest exponents beneath."""
    name = diagram.section.state if state is None else state
    if diagram.points:
        checks.known("state", [name], diagram.points[0].section.state_names)
    below = ax is None and any(p.lyapunov is not None for p in diagram.points)
    with style():
        lower = None
        if below:
            _, (ax, lower) = plt.subplots(
                2, 1, sharex=True, figsize=(7.2, 6.0), height_ratios=(2.4, 1.0)
            )
        ax = axes_or_new(ax, (7.2, 4.6))
        for color, sweep in zip(SERIES, diagram.sweeps, strict=False):
            _draw_sweep(ax, lower, diagram, sweep, name, color)
        ax.set_ylabel(axis_label(name))
        ax.set_title(f"{diagram.model_name}: {diagram.section}{_curve(diagram)}")
        if len(diagram.sweeps) > 1:
            ax.legend(loc="best", fontsize=8, markerscale=4)
        last = ax if lower is None else lower
        last.set_xlabel(PARAMETER_LABELS.get(diagram.parameter, diagram.parameter))
        if lower is not None:
            lower.axhline(0.0, color=NEUTRAL, lw=1.0)
            lower.set_ylabel("largest exponent (1/s)")
        return drawn_on(ax)


def _draw_sweep(
    ax: Axes, lower: Axes | None, diagram: SectionDiagram, sweep: Sweep, name: str, color: str
) -> None:
    """Draw the sections of one sweep and its largest exponents."""
    factor, _ = unit_of(name)
    points = diagram.of(sweep)
    drawn = [_section_values(p.section, name) for p in points]
    at = np.concatenate([np.full(len(v), p.value) for p, v in zip(points, drawn, strict=True)])
    values = factor * np.concatenate(drawn)
    ax.plot(at, values, ".", color=color, ms=1.8, mew=0.0, label=_SWEEP_LABELS[sweep])
    if lower is not None:
        told = [p for p in points if p.lyapunov is not None]
        found = [p.lyapunov for p in told if p.lyapunov is not None]
        lower.errorbar(
            [p.value for p in told],
            [f.largest for f in found],
            [f.bound[0] for f in found],
            fmt=".",
            color=color,
            ms=3.0,
            lw=0.8,
        )


def _curve(diagram: SectionDiagram) -> str:
    """Return the curve of a diagram, if it is the same throughout."""
    curves = {(p.section.curvature, p.section.cant) for p in diagram.points}
    if len(curves) != 1:
        return ""
    ((curvature, cant),) = curves
    return f", {curve_title(1.0 / curvature if curvature else np.inf, cant)}"


_SWEEP_LABELS = {"up": "up", "down": "down", "apart": "each from the start"}


def _section_values(section: PoincareSection, name: str) -> Array:
    """Return the values of a section; without motion, the state at rest."""
    if section.moves:
        return section.values(name)
    return section.mean[[section.state_names.index(name)]]
