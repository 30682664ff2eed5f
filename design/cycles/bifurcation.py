"""The whole bifurcation diagram of a vehicle over speed: every branch that can be found.

Branches start at every Hopf point of the range, at period doublings, broken symmetries and branch
points of other branches, and at motions that simulations from large disturbances end in and that no
branch found so far contains. What simulations see and no branch can be, is told too: irregular motions.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.branch import cycle_branch
from design.cycles.cycle import Cycle, CycleBranch, CycleError, SpecialPoint
from design.cycles.diagram import equilibria
from design.cycles.onset import HuntingOnset
from design.cycles.simulated_cycle import simulated_cycle
from design.cycles.survivors import STILL, Survivor, survivors
from design.stability.critical_speed import SPEED_RANGE, hopf_points
from design.stability.loss import CriticalSpeed
from railenv import checks
from railenv.errors import EquilibriumError, ParameterError
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
OriginKind = Literal["Hopf", "period doubling", "symmetry breaking", "branch point", "simulation"]

_SAME_SPEED = 1e-4  # relative: two Hopf points, or two starts of branches, are one
_SAME_MOTION = 0.03  # of the amplitude (plus that which counts as still), simulated and computed
_SAME_BRANCH, _SAME_PERIOD, _SAMPLES = (
    0.01,
    0.01,
    5,
)  # of amplitude and period, so many motions compared
_ABOVE = 1.5  # of the range's end, up to which Hopf points are looked for
_ON_OTHER = 4  # motions in turn that are those of another branch
_SWITCHED = ("period doubling", "symmetry breaking", "branch point")
_GRID, _LOWEST = 32, 0.3  # speeds simulated unless others are given, from so much of the onset up


@dataclass(frozen=True)
class Origin:
    """Where a branch starts.

    Attributes
    ----------
    kind : {"Hopf", "period doubling", "symmetry breaking", "branch point", "simulation"}
    speed : float
        m/s.
    parent : int or None
        Which branch of the diagram it leaves.
    """

    kind: OriginKind
    speed: float
    parent: int | None = None

    def __str__(self) -> str:
        of = "" if self.parent is None else f" of branch {self.parent}"
        return f"{self.kind} at {self.speed:.6g} m/s{of}"


@dataclass(frozen=True)
class BifurcationDiagram:
    """All branches of limit cycles of a vehicle over speed, as far as they were found.

    Attributes
    ----------
    model : Model
    radius, cant : float
        m, rad.
    speed_range : (float, float)
        m/s.
    hopf : tuple of CriticalSpeed
        Where a pair of eigenvalues of the running equilibrium crosses the imaginary axis.
    branches : tuple of CycleBranch
    origins : tuple of Origin
        Where each branch starts.
    irregular : tuple of Survivor
        Simulated motions that persist and are of no branch: quasi-periodic or chaotic ones, or such of
        branches that could not be followed.
    simulated : ndarray
        Speeds (m/s) that were simulated.
    notes : tuple of str
        What could not be followed, and why.
    ended : str or None
        Why the diagram is not whole, if it was interrupted.
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
        """Lowest speed at which hunting can persist, of all branches and simulations; None without any.

        Above the first Hopf point the running equilibrium is unstable, so that it is never above that
        where one was found in the range.
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
        """Lowest speed (m/s) at which hunting can persist; what it rests on is told by ``onset``."""
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
        Increasing; those (m/s) that are simulated from large disturbances, to find branches that hang
        together with no Hopf point. 32 of the range, half of them below the onset of hunting that the
        branches of Hopf points show, when left out; none are simulated where it is empty.
    depth : int
        How often branches may leave branches one after the other: 0 follows those of Hopf points and
        simulations only.
    points, longest_step
        Of each branch, as in :func:`design.cycle_branch`.
    progress : bool
        Show progress bars. An interrupt (Ctrl-C) returns what has been computed.

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium at the lowest speed.

    Notes
    -----
    Where a motion gives way to one of two frequencies (a torus point), the motion beyond is simulated,
    not followed. A branch that hangs together with no other and that no simulation ends in is not seen.
    Inputs other than zero are not simulated.
    """
    low, high = checks.speeds(speed_range)
    u = checks.vector("inputs", inputs, model.input_names)
    depth = checks.whole("depth", depth, low=0)
    search = _Search(model, radius, cant, u, (low, high), points, longest_step, progress)
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
    """Return the speeds to simulate at; there may be none."""
    return np.zeros(0) if np.size(given) == 0 else checks.numbers("speeds", given)


class _Search:
    """A diagram while it is being computed."""

    def __init__(
        self,
        model: Model,
        radius: float,
        cant: float,
        inputs: Array,
        limits: tuple[float, float],
        points: int,
        longest_step: float,
        progress: bool,
    ) -> None:
        self.model, self.radius, self.cant, self.inputs = model, radius, cant, inputs
        self.limits, self.points = limits, points
        self.longest_step, self.progress = longest_step, progress
        self.hopf: list[CriticalSpeed] = []
        self.branches: list[CycleBranch] = []
        self.origins: list[Origin] = []
        self.depths: list[int] = []
        self.irregular: list[Survivor] = []
        self.notes: list[str] = []
        self._interrupted = False
        self._switched = 0  # branches whose special points have been looked at

    # ------------------------------------------------------------------------------ branches

    def from_hopf_points(self) -> None:
        """Follow a branch from every Hopf point that no branch so far ends in.

        Points somewhat above the range are looked at too: their branches may reach down into it.
        """
        low, high = self.limits
        found = hopf_points(
            self.model,
            radius=self.radius,
            cant=self.cant,
            speed_range=(low, _ABOVE * high),
            inputs=self.inputs,
        )
        self.hopf.extend(h for h in found if h.speed is not None and h.speed <= high)
        for hopf in found:
            assert hopf.speed is not None
            ends = [s.value for s in self._special() if s.kind == "Hopf"]
            if any(abs(v - hopf.speed) < _SAME_SPEED * hopf.speed for v in ends):
                continue
            branch = self._followed(Origin("Hopf", hopf.speed), hopf)
            if branch is not None and branch.value.min() <= high:
                self._add(Origin("Hopf", hopf.speed), 0, branch)

    def from_branches(self, depth: int) -> None:
        """Follow the branches that leave those found, so many one after the other."""
        while self._switched < len(self.branches):
            k = self._switched
            self._switched += 1
            if self.depths[k] >= depth:
                continue
            for point in self.branches[k].special:
                if point.kind in _SWITCHED:
                    self._leave(point, k)

    def _leave(self, point: SpecialPoint, parent: int) -> None:
        kind: Any = point.kind
        sides: tuple[Literal[1, -1], ...] = (1, -1) if kind == "branch point" else (1,)
        for side in sides:
            origin = Origin(kind, point.value, parent)
            branch = self._followed(origin, point, side)
            if branch is None:
                continue
            samples = np.linspace(1, len(branch) - 1, _SAMPLES).astype(int)
            if sum(self._known(branch.cycles[i]) for i in samples) <= _SAMPLES // 2:
                self._add(origin, self.depths[parent] + 1, branch)

    def _followed(
        self,
        origin: Origin,
        start: CriticalSpeed | SpecialPoint | Cycle,
        direction: Literal[1, -1] = 1,
    ) -> CycleBranch | None:
        """Return the branch from somewhere; None, with a note, where there is none."""
        try:
            branch = cycle_branch(
                self.model,
                radius=self.radius,
                cant=self.cant,
                inputs=self.inputs,
                start=start,
                direction=direction,
                parameter_range=self.limits,
                points=self.points,
                longest_step=self.longest_step,
                progress=self.progress,
            )
        except (CycleError, EquilibriumError, ParameterError) as error:
            self.notes.append(f"no branch from {origin}: {error}")
            return None
        self._interrupted = "interrupted" in branch.ended
        return branch

    def _add(self, origin: Origin, depth: int, branch: CycleBranch | None) -> None:
        if branch is None:
            return
        if not branch.complete:
            self.notes.append(f"branch {len(self.branches)} is not whole: {branch.ended}")
        self.branches.append(branch)
        self.origins.append(origin)
        self.depths.append(depth)
        if self._interrupted:
            raise KeyboardInterrupt

    def _special(self) -> Iterator[SpecialPoint]:
        for branch in self.branches:
            yield from branch.special

    # --------------------------------------------------------------------------- simulations

    def grid(self) -> Array:
        """Return speeds to simulate at: most of them below the onset of hunting known so far."""
        low, high = self.limits
        known = [b.nonlinear_critical_speed for b in self.branches]
        onset = min([v for v in known if v is not None], default=math.nan)
        if not low < onset < high:
            return np.linspace(low, high, _GRID)
        below = np.linspace(max(low, _LOWEST * onset), 0.99 * onset, _GRID // 2)
        above = np.linspace(min(1.01 * onset, high), high, _GRID - len(below))
        return np.unique(np.concatenate([below, above]))

    def from_simulations(self, speeds: Array) -> None:
        """Follow a branch through every motion that persists in simulations and is not known."""
        if speeds.size == 0:
            return
        slowest = max([1.0 / h.frequency for h in self.hopf if h.frequency], default=0.0)
        duration = max(20.0, 20.0 * slowest)
        simulate = partial(
            survivors,
            self.model,
            radius=self.radius,
            cant=self.cant,
            duration=duration,
            window=max(2.0, 2.0 * slowest),
        )
        beyond = [simulate([v], starts=[away]) for v, away in self._beyond_torus_points()]
        for found in (*simulate(speeds), *chain.from_iterable(beyond)):
            if self._explained(found):
                continue
            try:
                cycle = simulated_cycle(
                    self.model,
                    speed=found.speed,
                    radius=self.radius,
                    cant=self.cant,
                    initial_state=found.state,
                    duration=duration / 2.0,
                )
            except CycleError:
                self.irregular.append(found)
                continue
            if self._known(cycle) or not cycle.stable:
                continue
            self._through(cycle)

    def _beyond_torus_points(self) -> Iterator[tuple[float, dict[str, float]]]:
        """Yield speeds and disturbances next to torus points, on motions that have become unstable."""
        for branch in self.branches:
            for point in branch.special:
                if point.kind != "torus":
                    continue
                sides = branch.cycles[point.after - 1 : point.after + 1]
                motion = min(sides, key=lambda c: c.stable)
                rest, _ = equilibria(self.model, np.array([motion.speed]), self.radius, self.cant)
                away = (motion.states[0] - rest[0]).tolist()
                yield motion.speed, dict(zip(self.model.state_names, away, strict=True))

    def _through(self, cycle: Cycle) -> None:
        """Follow a branch to both sides of a motion."""
        origin = Origin("simulation", cycle.speed)
        branch = self._followed(origin, cycle, 1)
        if branch is not None and not (self._interrupted or "closes on itself" in branch.ended):
            down = self._followed(origin, cycle, -1)
            if down is not None:
                branch = joined(self._own_part(down), self._own_part(branch))
        self._add(origin, 0, branch)

    def _own_part(self, branch: CycleBranch) -> CycleBranch:
        """Return a branch up to where it runs on to another, whose motions it has from there on."""
        known = np.array([self._known(c) for c in branch.cycles])
        runs = np.convolve(known, np.ones(_ON_OTHER), mode="valid") == _ON_OTHER
        if not runs.any():
            return branch
        end = int(np.argmax(runs)) + 1
        return replace(
            branch,
            cycles=branch.cycles[:end],
            special=tuple(s for s in branch.special if s.after < end),
            ended=f"it runs on to another branch near {branch.cycles[end - 1].value:.6g} m/s",
            complete=True,
        )

    def _explained(self, found: Survivor) -> bool:
        """Whether a simulated motion is a stable one of a branch."""
        return any(
            self._alike(found.amplitudes, near.amplitudes, _SAME_MOTION, STILL)
            for branch in self.branches
            for near in passages(branch, found.speed)
            if near.stable
        )

    def _known(self, cycle: Cycle) -> bool:
        """Whether a motion is one of a branch."""
        return any(
            abs(near.period / cycle.period - 1.0) < _SAME_PERIOD
            and self._alike(cycle.amplitudes, near.amplitudes, _SAME_BRANCH, _SAME_BRANCH)
            and self._alike(_middle(cycle), near.middle, _SAME_BRANCH, _SAME_BRANCH)
            for branch in self.branches
            for near in passages(branch, cycle.value)
        )

    def _alike(self, a: Array, b: Array, share: float, least: float) -> bool:
        """Whether displacements are alike, and rates: by a share of the largest, plus the least."""
        size, gap = np.maximum(a, b) / self.model.scale, np.abs(a - b) / self.model.scale
        halves = np.array_split(np.arange(len(a)), min(2, len(a)))
        return all((gap[k] < share * size[k].max() + least).all() for k in halves)


@dataclass(frozen=True)
class _Passage:
    """Where a branch passes a value: between two of its motions."""

    amplitudes: Array
    middle: Array
    period: float
    stable: bool


def _middle(cycle: Cycle) -> Array:
    """Return how far the middle of each state's swing is from zero, to whichever side."""
    return np.asarray(np.abs(cycle.states.max(axis=0) + cycle.states.min(axis=0)) / 2.0)


def passages(branch: CycleBranch, value: float) -> Iterator[_Passage]:
    """Yield what a branch has at a value, by linear interpolation; stable if either neighbour is."""
    values = branch.value
    for i in np.flatnonzero((values[:-1] - value) * (values[1:] - value) <= 0.0):
        p, q = branch.cycles[i], branch.cycles[i + 1]
        t = 0.5 if p.value == q.value else (value - p.value) / (q.value - p.value)
        yield _Passage(
            (1.0 - t) * p.amplitudes + t * q.amplitudes,
            (1.0 - t) * _middle(p) + t * _middle(q),
            (1.0 - t) * p.period + t * q.period,
            p.stable or q.stable,
        )


def joined(down: CycleBranch, up: CycleBranch) -> CycleBranch:
    """Join two branches that leave the same motion to either side."""
    count = len(down)
    before = [replace(s, after=count - s.after) for s in reversed(down.special)]
    after = [replace(s, after=s.after + count - 1) for s in up.special]
    turned = [replace(c, tangent=-c.tangent, orientation=-c.orientation) for c in down.cycles[:0:-1]]
    return CycleBranch(
        cycles=(*turned, *up.cycles),
        special=(*before, *after),
        ended=f"{up.ended}; at its other end, {down.ended}",
        complete=up.complete and down.complete,
        hopf=None,
        setting=up.setting,
        step=up.step,
    )
