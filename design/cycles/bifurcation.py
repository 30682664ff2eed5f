"""The whole bifurcation diagram of a vehicle over speed: every branch that can be found.

Branches start at every Hopf point of the range, at period doublings, broken symmetries and branch
points of other branches, and at motions in which simulations from large disturbances end and that no
branch contains yet. Irregular motions, which simulations find but no branch can contain, are reported.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.bifurcation_search import Origin, Search
from design.cycles.cycle import CycleBranch, SpecialPoint
from design.cycles.onset import HuntingOnset
from design.cycles.survivors import Survivor
from design.stability.critical_speed import SPEED_RANGE
from design.stability.loss import CriticalSpeed
from railenv import checks
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BifurcationDiagram:
    """All branches of limit cycles of a vehicle over speed that were found.

    Attributes
    ----------
    model : Model
    radius, cant : float
        m, rad.
    speed_range : (float, float)
        m/s.
    hopf : tuple of CriticalSpeed
        Hopf points, where a pair of eigenvalues of the running equilibrium crosses the imaginary axis.
    branches : tuple of CycleBranch
    origins : tuple of Origin
        Start of each branch.
    irregular : tuple of Survivor
        Simulated motions that persist and belong to no branch: quasi-periodic or chaotic ones, or those
        of branches that could not be followed.
    simulated : ndarray
        Speeds (m/s) that were simulated.
    notes : tuple of str
        Branches that could not be followed, and the reasons.
    ended : str or None
        Reason why the diagram is incomplete, if it was interrupted.
    """

    model: Model
    radius: float
    cant: float
    speed_range: tuple[float, float]
    hopf: tuple[CriticalSpeed, ...]
    branches: tuple[CycleBranch, ...]
    origins: tuple[Origin, ...]
    irregular: tuple[Survivor, ...]
    simulated: Array
    notes: tuple[str, ...]
    ended: str | None

    @property
    def onset(self) -> HuntingOnset | None:
        """Lowest speed at which hunting can persist in any branch or simulation; None if it never does.

        Above the first Hopf point the running equilibrium is unstable, so it is never above that point
        if one was found in the range.
        """
        found = [b.onset for b in self.branches]
        candidates = [o for o in found if o is not None]
        candidates += [HuntingOnset("speed", s.speed, "simulation", math.nan) for s in self.irregular]
        candidates += [
            HuntingOnset("speed", h.speed, "Hopf", h.frequency)
            for h in self.hopf[:1]
            if h.speed is not None and h.frequency is not None
        ]
        return min(candidates, key=lambda o: o.value, default=None)

    @property
    def nonlinear_critical_speed(self) -> float | None:
        """Lowest speed (m/s) at which hunting can persist; ``onset`` gives the evidence."""
        return None if self.onset is None else self.onset.value

    @property
    def special(self) -> tuple[SpecialPoint, ...]:
        """Special points of all branches."""
        return tuple(s for branch in self.branches for s in branch.special)

    def summary(self) -> dict[str, Any]:
        """Return the diagram as plain numbers and strings, ready for JSON."""
        onset, names = self.onset, self.model.state_names
        return {
            "model": self.model.name,
            "radius": None if math.isinf(self.radius) else self.radius,
            "cant": self.cant,
            "speed_range": list(self.speed_range),
            "hopf": [h.summary() for h in self.hopf],
            "branches": [
                {"origin": str(origin), **branch.summary()}
                for origin, branch in zip(self.origins, self.branches, strict=True)
            ],
            "irregular": [
                {"speed": s.speed, "amplitude": dict(zip(names, s.amplitudes.tolist(), strict=True))}
                for s in self.irregular
            ],
            "nonlinear_critical_speed": self.nonlinear_critical_speed,
            "rests_on": None if onset is None else onset.rests_on,
            "notes": list(self.notes),
            "ended": self.ended,
        }

    def __str__(self) -> str:
        lines = [f"{self.model.name}: {self.onset or 'no hunting was found'}"]
        for k, (origin, branch) in enumerate(zip(self.origins, self.branches, strict=True)):
            low, high = float(branch.value.min()), float(branch.value.max())
            special = "; ".join(str(s) for s in branch.special)
            text = f"branch {k}, from {origin}: {low:.5g} to {high:.5g} m/s"
            lines.append(f"{text}; {special}" if special else text)
        if self.irregular:
            speeds = sorted({round(s.speed, 3) for s in self.irregular})
            lines.append(f"irregular motion at {', '.join(f'{v:g}' for v in speeds)} m/s")
        return "\n".join([*lines, *self.notes, *([self.ended] if self.ended else [])])

    def plot(
        self, state: str | None = None, ax: Axes | None = None, clearance: float | None = None
    ) -> control.ControlPlot:
        """Draw amplitude of a state (the first) over speed: all branches, Hopf points, simulations."""
        from design.cycles.bifurcation_plots import plot_bifurcation

        return plot_bifurcation(self, state, ax, clearance)


def bifurcation_diagram(
    model: Model,
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    inputs: ArrayLike | None = None,
    speed_range: tuple[float, float] = SPEED_RANGE,
    speeds: ArrayLike | None = None,
    depth: int = 2,
    points: int = 150,
    longest_step: float = 0.12,
    progress: bool = False,
) -> BifurcationDiagram:
    """Find all branches of limit cycles over a range of speed.

    Parameters
    ----------
    model : Model
    radius : float
        Curve radius, m; ``math.inf`` is tangent track, negative the other hand.
    cant : float
        Cant angle, rad.
    inputs : array_like, shape (n_inputs,), optional
        Constant inputs; zero when left out.
    speed_range : (float, float)
        m/s.
    speeds : array_like, optional
        Increasing speeds (m/s) that are simulated from large disturbances, to find branches that are
        not connected to a Hopf point. When left out, 32 of the range, half of them below the onset of
        hunting in the branches of Hopf points; if empty, none.
    depth : int
        Number of times that branches may leave branches in succession: 0 follows only those of Hopf
        points and simulations.
    points, longest_step
        Numbers for each branch, as in :func:`design.cycle_branch`.
    progress : bool
        Show progress bars. An interrupt (Ctrl-C) returns what has been computed.

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium at the lowest speed.

    Notes
    -----
    Beyond a torus point, where a motion gives way to one of two frequencies, the motion is simulated,
    not followed. A branch that is not connected to another and in which no simulation ends is not
    found. Inputs other than zero are not simulated.
    """
    low, high = checks.speeds(speed_range)
    u = checks.vector("inputs", inputs, model.input_names)
    depth = checks.whole("depth", depth, low=0)
    search = Search(model, radius, cant, u, (low, high), points, longest_step, progress)
    ended: str | None = None
    grid: Array = np.zeros(0)
    try:
        search.from_hopf_points()
        search.from_branches(depth)
        if not u.any():
            grid = search.grid() if speeds is None else _speeds(speeds)
            search.from_simulations(grid)
            search.from_branches(depth)
    except KeyboardInterrupt:
        ended = "interrupted; branches and simulations still to be computed are missing"
    return BifurcationDiagram(
        model=model,
        radius=radius,
        cant=cant,
        speed_range=(low, high),
        hopf=tuple(search.hopf),
        branches=tuple(search.branches),
        origins=tuple(search.origins),
        irregular=tuple(search.irregular),
        simulated=grid,
        notes=tuple(search.notes),
        ended=ended,
    )


def _speeds(given: ArrayLike) -> Array:
    """Return the speeds to simulate; there may be none."""
    return np.zeros(0) if np.size(given) == 0 else checks.numbers("speeds", given)
