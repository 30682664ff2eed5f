"""Drawings of a whole bifurcation diagram."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from design.cycles.cycle_plots import SPECIAL_MARKERS, stability_runs
from design.cycles.labels import INK, PARAMETER_LABELS, axis_label, clearance_line, unit_of
from design.style import NEUTRAL, STABLE, UNSTABLE, axes_or_new, curve_title, drawn_on, style
from railenv import checks

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.cycles.bifurcation import BifurcationDiagram
    from design.cycles.cycle import CycleBranch


def plot_bifurcation(
    diagram: BifurcationDiagram, state: str | None, ax: Axes | None, clearance: float | None
) -> control.ControlPlot:
    """Draw amplitude over speed: equilibrium, all branches, their special points, simulations."""
    names = diagram.model.state_names
    name = names[0] if state is None else state
    checks.known("state", [name], names)
    k, (factor, _) = names.index(name), unit_of(name)
    with style():
        ax = axes_or_new(ax, (7.2, 4.8))
        labels: set[str] = set()
        _equilibrium(ax, diagram)
        for branch in diagram.branches:
            _branch(ax, branch, k, factor, labels)
        _special(ax, diagram, k, factor)
        if diagram.irregular:
            x = [s.speed for s in diagram.irregular]
            y = [factor * s.amplitudes[k] for s in diagram.irregular]
            ax.plot(x, y, "x", color=NEUTRAL, ms=6, label="irregular motion (simulated)", zorder=4)
        if clearance is None and name.startswith("y_w"):
            clearance = diagram.model.flange_clearance
        clearance_line(ax, clearance, factor)
        onset = diagram.onset
        if onset is not None:
            text = f"hunting from {onset.value:.2f} m/s ({onset.rests_on})"
            ax.axvline(onset.value, color=NEUTRAL, ls=":", lw=1.2, label=text)
        ax.set_xlabel(PARAMETER_LABELS["speed"])
        ax.set_ylabel(axis_label(name, "amplitude"))
        ax.set_ylim(0.0, None)
        ax.set_title(f"{diagram.model.name}, {curve_title(diagram.radius, diagram.cant)}: limit cycles")
        ax.legend(loc="best", fontsize="small")
        return drawn_on(ax)


def _equilibrium(ax: Axes, diagram: BifurcationDiagram) -> None:
    """Draw the equilibrium, stable up to the first Hopf point, and the Hopf points on it."""
    values = [b.value for b in diagram.branches] + [diagram.simulated]
    speeds = np.concatenate([*values, [h.speed for h in diagram.hopf if h.speed is not None]])
    if speeds.size == 0:
        return
    low, high = float(speeds.min()), float(speeds.max())
    first = diagram.hopf[0].speed if diagram.hopf else None
    edge = high if first is None else first
    ax.plot([min(low, edge), edge], [0.0, 0.0], color=STABLE, lw=2.2, clip_on=False)
    if edge < high:
        ax.plot([edge, high], [0.0, 0.0], color=UNSTABLE, ls="--", lw=2.2, clip_on=False)
    at = [h.speed for h in diagram.hopf if h.speed is not None]
    if at:
        text = "Hopf point at " + ", ".join(f"{v:.2f}" for v in at[:3]) + " m/s"
        ax.plot(at, [0.0] * len(at), "*", color=INK, ms=11, label=text, zorder=5, clip_on=False)


def _branch(ax: Axes, branch: CycleBranch, k: int, factor: float, labels: set[str]) -> None:
    """Draw a branch, joined to the Hopf points at its ends."""
    value, stable = branch.value, branch.stable
    amplitude = factor * np.array([c.amplitudes[k] for c in branch.cycles])
    ends = [s.value for s in branch.special if s.kind == "Hopf"]
    if branch.hopf is not None and branch.hopf.speed is not None:
        value, amplitude = np.append(branch.hopf.speed, value), np.append(0.0, amplitude)
        stable = np.append(stable[:1], stable)
    for end in ends:
        value, amplitude = np.append(value, end), np.append(amplitude, 0.0)
        stable = np.append(stable, stable[-1])
    for part, is_stable in stability_runs(stable):
        label = "stable limit cycles" if is_stable else "unstable limit cycles"
        ax.plot(
            value[part],
            amplitude[part],
            color=STABLE if is_stable else UNSTABLE,
            ls="-" if is_stable else "--",
            label=None if label in labels else label,
        )
        labels.add(label)


def _special(ax: Axes, diagram: BifurcationDiagram, k: int, factor: float) -> None:
    for kind, marker in SPECIAL_MARKERS.items():
        points = [s for s in diagram.special if s.kind == kind]
        if not points or kind == "Hopf":
            continue
        x, y = [s.value for s in points], [factor * s.cycle.amplitudes[k] for s in points]
        more = ", ..." if len(x) > 3 else ""
        label = f"{kind} at {', '.join(f'{v:.2f}' for v in x[:3])}{more} m/s"
        ax.plot(x, y, marker, color=INK, mfc="white", mew=1.4, ms=6, label=label, zorder=5)
