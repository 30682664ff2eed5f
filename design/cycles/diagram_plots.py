"""Drawings of simulated bifurcation diagrams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from design.cycles.labels import INK, axis_label, clearance_line, unit_of
from design.style import SERIES, axes_or_new, curve_title, drawn_on, style
from railenv import checks
from railenv.errors import ParameterError

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.cycles.diagram import SimulatedDiagram

_MOST_LABELS = 8  # in the legend; with more, only the first start of every curve has one
_MOST_NAMED = 2  # states of a start; a start with more has a number instead


def plot_diagram(
    diagram: SimulatedDiagram,
    state: str | None = None,
    radius: float | None = None,
    ax: Axes | None = None,
) -> control.ControlPlot:
    """Draw simulated amplitudes over speed as points: a colour per curve, a marker per start."""
    name = diagram.state_names[0] if state is None else state
    checks.known("state", [name], diagram.state_names)
    factor, _ = unit_of(name)
    chosen = [i for i, r in enumerate(diagram.radius) if radius in (None, r)]
    if not chosen:
        known = ", ".join(f"{r:g}" for r in diagram.radius)
        raise ParameterError(f"radius is {radius:g} m; simulated were {known}")
    fresh = ax is None
    with style():
        ax = axes_or_new(ax, (6.8, 4.6))
        labelled = len(chosen) * len(diagram.starts) <= _MOST_LABELS
        for colour, i in zip(_colours(len(chosen)), chosen, strict=True):
            for j in range(len(diagram.starts)):
                label = _label(diagram, i, j, several=len(chosen) > 1)
                ax.plot(
                    diagram.speed,
                    factor * diagram.amplitude[name][i, :, j],
                    ".o^sD"[j % 5] if fresh else "o",
                    color=colour if fresh else INK,
                    mfc="white" if j or not fresh else colour,
                    ms=3.5 + 1.5 * (j > 0),
                    mew=0.9,
                    label=label if labelled or not j else None,
                )
        if fresh:
            clearance_line(ax, diagram.clearance if name.startswith("y_w") else None, factor)
            ax.set_xlabel("speed (m/s)")
            ax.set_ylabel(axis_label(name, "amplitude"))
            where = _curve(diagram, chosen[0]) if len(chosen) == 1 else "curves"
            ax.set_title(f"{diagram.model_name}, {where}: motion at the end")
            ax.set_ylim(0.0, None)
        ax.legend(loc="best", fontsize=8)
        return drawn_on(ax)


def _label(diagram: SimulatedDiagram, i: int, j: int, *, several: bool) -> str:
    """Return the legend of curve i, named if there are several, and start j."""
    place = f"{_curve(diagram, i)}, " if several else ""
    start = diagram.starts[j]
    if len(start) > _MOST_NAMED:
        return f"{place}simulated from start {j + 1}"
    units = {k: unit_of(k) for k in start}
    given = (f"{k} {units[k][0] * v:g} {units[k][1]}" for k, v in start.items())
    return f"{place}simulated from {', '.join(given)}"


def _curve(diagram: SimulatedDiagram, i: int) -> str:
    return curve_title(float(diagram.radius[i]), diagram.cant)


def _colours(count: int) -> list[str]:
    if count <= len(SERIES):
        return list(SERIES[:count])
    import matplotlib as mpl
    from matplotlib.colors import to_hex

    return [to_hex(c) for c in mpl.colormaps["viridis"](np.linspace(0.0, 0.9, count))]
