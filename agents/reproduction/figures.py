"""Figures of the section on controllers, at the width of the report's panels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agents.evaluation.colors import colors
from agents.evaluation.diagram import ClosedLoopDiagram
from agents.evaluation.evaluation import Evaluation
from agents.evaluation.evaluation_plots import plot_comparison
from agents.evaluation.growth_plots import plot_growth
from design.cycles.cycle import CycleBranch
from design.reproduction import Drawing
from design.reproduction.drawing import legend_below, panel, retitle, take_handles

_SHOWN = 25.0  # 1/s, of growth rates: beyond it a vehicle is at rest, or hunts, almost at once


def pushes(found: Sequence[Evaluation]) -> tuple[Drawing, ...]:
    """Draw the shift of the critical speeds by each controller, a figure for each curve."""
    drawings = []
    for i, curve in enumerate(found[0].curves):
        figure, ax = panel("", 2.6 + 0.26 * len(found))
        plot_comparison(found, i, ax)
        retitle(
            ax, curve.name if math.isinf(curve.radius) else f"{curve.name}, cant {curve.cant:g} rad"
        )
        legend_below(figure, take_handles(ax))
        place = "tangent" if math.isinf(curve.radius) else f"{curve.radius:g}m"
        where = "on tangent track" if math.isinf(curve.radius) else f"at R = {curve.radius:g} m"
        caption = f"Critical speeds with each controller {where}; dotted: without control."
        drawings.append(Drawing(f"hopf_push_{place}", figure, caption, "How far the Hopf point moves"))
    return tuple(drawings)


def growth(found: Sequence[Evaluation], rates: Mapping[str, Any]) -> tuple[Drawing, ...]:
    """Draw growth rates over speed, for controllers that read sensors and for the others."""
    drawings = []
    speeds = next(iter(rates.values()))["speeds"]
    palette = colors(e.controller for e in found)
    for reads, text in (("sensors", "from sensors"), ("state", "from the full state")):
        names = [e.controller for e in found if e.observation == reads or e.controller == "passive"]
        if names == ["passive"] and reads == "state":
            continue
        figure, ax = panel("", 4.4)
        plot_growth({name: rates[name]["rates"] for name in names}, speeds, ax, palette)
        highest = max(float(np.max(rates[name]["rates"])) for name in names)
        ax.set_ylim(None, min(_SHOWN, 1.1 * max(highest, 1.0)))
        retitle(ax, f"controllers {text}")
        legend_below(figure, take_handles(ax))
        caption = (
            f"Growth rate of the least stable mode over speed, controllers {text}, tangent track. "
            "Steady running is stable below zero."
        )
        drawings.append(Drawing(f"growth_rates_{reads}", figure, caption, "Growth rates over speed"))
    return tuple(drawings)


def diagrams(
    simulated: Sequence[ClosedLoopDiagram],
    branch: CycleBranch | None,
) -> tuple[Drawing, ...]:
    """Draw the closed loops' bifurcation diagrams to one scale."""
    finite = [d.amplitude[np.isfinite(d.amplitude)] for d in simulated]
    top = 1e3 * max(float(a.max()) for a in finite if a.size)
    if branch is not None:
        top = max(top, 1e3 * float(branch.amplitude["y_w1"].max()))
    drawings = []
    for diagram in simulated:
        figure, ax = panel("", 4.6)
        diagram.plot(ax)
        handles = take_handles(ax)
        if branch is not None and diagram.controller == "passive":
            branch.plot("y_w1", ax=ax)
            handles += [
                h for h in take_handles(ax) if h.get_label() not in {x.get_label() for x in handles}
            ]
        ax.set_ylim(-0.03 * top, 1.1 * top)
        ax.set_xlim(0.0, 1.02 * float(diagram.speed.max()))
        ax.set_ylabel(f"amplitude of y_w1 after {diagram.duration:g} s (mm)")
        retitle(ax, diagram.controller)
        legend_below(figure, handles)
        caption = f"{diagram.controller}: what lateral offsets of all bodies settle at, tangent track."
        if branch is not None and diagram.controller == "passive":
            caption += " Lines: limit cycles by continuation, the unstable ones dashed."
        group = "Bifurcation diagrams of the closed loops"
        drawings.append(Drawing(f"closed_loop_{diagram.controller}", figure, caption, group))
    return tuple(drawings)
