"""Drawings of limit cycles and their branches."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from design.cycles.labels import INK, PARAMETER_LABELS, axis_label, clearance_line, unit_of
from design.style import STABLE, UNSTABLE, axes_or_new, curve_title, drawn_on, style
from railenv import checks

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.cycles.cycle import Cycle, CycleBranch

Array = NDArray[np.float64]

SPECIAL_MARKERS = {
    "fold": "o",
    "torus": "D",
    "period doubling": "s",
    "symmetry breaking": "^",
    "branch point": "v",
    "Hopf": "*",
}
"""Marker of each kind of special point."""


def stability_runs(stable: NDArray[np.bool_]) -> Iterator[tuple[slice, bool]]:
    """Yield stretches of equal stability; each overlaps the next by a point, so that lines join."""
    edges = [0, *(np.flatnonzero(np.diff(stable)) + 1).tolist(), len(stable)]
    for a, b in pairwise(edges):
        yield slice(a, min(b + 1, len(stable))), bool(stable[a])


def plot_branch(
    branch: CycleBranch,
    state: str | None = None,
    ax: Axes | None = None,
    clearance: float | None = None,
) -> control.ControlPlot:
    """Draw amplitude over the parameter: stable solid, unstable dashed, special points marked."""
    name = branch.setting.model.state_names[0] if state is None else state
    checks.known("state", [name], branch.setting.model.state_names)
    factor, _ = unit_of(name)
    k = branch.setting.model.state_names.index(name)
    with style():
        ax = axes_or_new(ax, (6.8, 4.6))
        _branch_lines(ax, branch, k, factor)
        for kind, marker in SPECIAL_MARKERS.items():
            points = [s for s in branch.special if s.kind == kind]
            if points:
                x = [s.value for s in points]
                y = [factor * s.cycle.amplitudes[k] for s in points]
                text = ", ".join(f"{v:.2f}" if abs(v) >= 1.0 else f"{v:.4g}" for v in x[:3])
                more = ", ..." if len(x) > 3 else ""
                unit = " m/s" if branch.parameter == "speed" else ""
                label = f"{kind} at {text}{more}{unit}"
                ax.plot(x, y, marker, color=INK, mfc="white", mew=1.6, ms=7, label=label, zorder=5)
        if clearance is None and name.startswith("y_w"):
            clearance = branch.setting.model.flange_clearance
        clearance_line(ax, clearance, factor)
        curvature = branch.setting.curvature
        curve = curve_title(1.0 / curvature if curvature else math.inf, branch.setting.cant)
        ax.set_xlabel(PARAMETER_LABELS.get(branch.parameter, branch.parameter.replace("_", " ")))
        ax.set_ylabel(axis_label(name, "amplitude"))
        ax.set_ylim(0.0, None)
        ax.set_title(f"{branch.model_name}, {curve}: limit cycles")
        ax.legend(loc="best")
        return drawn_on(ax)


def _branch_lines(ax: Axes, branch: CycleBranch, k: int, factor: float) -> None:
    """Draw the branch with the equilibrium, whose amplitude is zero, below it."""
    value = branch.value
    amplitude = factor * np.array([c.amplitudes[k] for c in branch.cycles])
    stable = branch.stable
    hopf = branch.hopf
    if hopf is not None and hopf.speed is not None:
        value = np.concatenate([[hopf.speed], value])
        amplitude = np.concatenate([[0.0], amplitude])
        stable = np.concatenate([stable[:1], stable])
        low, high = float(value.min()), float(value.max())
        low -= 0.1 * (high - low)
        ax.plot([low, hopf.speed], [0.0, 0.0], color=STABLE, lw=2.2, clip_on=False)
        ax.plot([hopf.speed, high], [0.0, 0.0], color=UNSTABLE, ls="--", lw=2.2, clip_on=False)
        text = f"Hopf point at {hopf.speed:.2f} m/s"
        ax.plot(hopf.speed, 0.0, "*", color=INK, ms=11, label=text, zorder=5, clip_on=False)
    drawn = set()
    for part, is_stable in stability_runs(stable):
        label = "stable" if is_stable else "unstable"
        ax.plot(
            value[part],
            amplitude[part],
            color=STABLE if is_stable else UNSTABLE,
            ls="-" if is_stable else "--",
            label=None if label in drawn else f"{label} limit cycles",
        )
        drawn.add(label)


def plot_cycle(
    cycle: Cycle, states: tuple[str, str] | None = None, ax: Axes | None = None
) -> control.ControlPlot:
    """Draw a periodic motion in the plane of two states."""
    names = cycle.state_names
    chosen = (names[0], names[len(names) // 2]) if states is None else states
    checks.known("state", chosen, names)
    with style():
        ax = axes_or_new(ax, (5.2, 4.6))
        (fx, _), (fy, _) = (unit_of(name) for name in chosen)
        x, y = (cycle.states[:, names.index(name)] for name in chosen)
        ax.plot(
            fx * x,
            fy * y,
            color=STABLE if cycle.stable else UNSTABLE,
            ls="-" if cycle.stable else "--",
            label="stable" if cycle.stable else "unstable",
        )
        ax.set_xlabel(axis_label(chosen[0]))
        ax.set_ylabel(axis_label(chosen[1]))
        ax.set_title(f"limit cycle at {cycle.speed:.4g} m/s, {cycle.frequency:.4g} Hz")
        ax.legend()
        return drawn_on(ax)
