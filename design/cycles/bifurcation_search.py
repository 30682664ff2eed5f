"""The search for all branches of limit cycles of a vehicle over speed.

It follows a branch from every Hopf point, from special points of the branches found, and from simulated
motions that belong to none of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from design.cycles.branch import cycle_branch
from design.cycles.cycle import Cycle, CycleBranch, CycleError, SpecialPoint
from design.cycles.diagram import equilibria
from design.cycles.passages import middle, passages
from design.cycles.simulated_cycle import simulated_cycle
from design.cycles.survivors import STILL, Survivor, survivors
from design.stability.critical_speed import hopf_points
from design.stability.loss import CriticalSpeed
from design.stability.mode_shape import displacement_rows
from railenv.errors import EquilibriumError, ParameterError
from railenv.models import Model

Array = NDArray[np.float64]
OriginKind = Literal["Hopf", "period doubling", "symmetry breaking", "branch point", "simulation"]

_SAME_SPEED = 1e-4  # relative: two Hopf points, or two starts of branches, are the same
_SAME_MOTION = 0.03  # of the amplitude (plus the one that counts as rest), simulated and computed
_SAME_BRANCH, _SAME_PERIOD = 0.01, 0.01  # of amplitude and period
_SAMPLES = 5  # motions of a branch that are compared
_ABOVE = 1.5  # times the range's end, up to which Hopf points are searched
_ON_OTHER = 4  # successive motions that are those of another branch
_SWITCHED = ("period doubling", "symmetry breaking", "branch point")
_DOWN, _DOWN_TO = 0.01, 1e-3  # of the speed: steps in which an irregular motion is followed down
_GRID, _LOWEST = 32, 0.3  # default number of simulated speeds, and the lowest as a share of the onset


@dataclass(frozen=True)
class Origin:
    """The start of a branch.

    Attributes
    ----------
    kind : {"Hopf", "period doubling", "symmetry breaking", "branch point", "simulation"}
    speed : float
        m/s.
    parent : int or None
        Index of the branch of the diagram that it leaves.
    """

    kind: OriginKind
    speed: float
    parent: int | None = None

    def __str__(self) -> str:
        of = "" if self.parent is None else f" of branch {self.parent}"
        return f"{self.kind} at {self.speed:.6g} m/s{of}"


class Search:
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
        moved = np.isin(np.arange(model.n_states), displacement_rows(model))
        self._compared = moved, ~moved  # displacements, and the other states
        self.limits, self.points = limits, points
        self.longest_step, self.progress = longest_step, progress
        self.hopf: list[CriticalSpeed] = []
        self.branches: list[CycleBranch] = []
        self.origins: list[Origin] = []
        self.depths: list[int] = []
        self.irregular: list[Survivor] = []
        self.notes: list[str] = []
        self._interrupted = False
        self._switched = 0  # number of branches whose special points have been tried

    # ------------------------------------------------------------------------------ branches

    def from_hopf_points(self) -> None:
        """Follow a branch from every Hopf point in which no branch ends yet.

        Points somewhat above the range are included, because their branches may reach down into it.
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
        """Follow the branches that leave those found, up to a depth."""
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
        """Return the branch from a start; None, with a note, if there is none."""
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
        """Return the speeds to simulate, most of them below the onset of hunting known so far."""
        low, high = self.limits
        known = [b.nonlinear_critical_speed for b in self.branches]
        onset = min([v for v in known if v is not None], default=math.nan)
        if not low < onset < high:
            return np.linspace(low, high, _GRID)
        below = np.linspace(max(low, _LOWEST * onset), 0.99 * onset, _GRID // 2)
        above = np.linspace(min(1.01 * onset, high), high, _GRID - len(below))
        return np.unique(np.concatenate([below, above]))

    def from_simulations(self, speeds: Array) -> None:
        """Follow a branch through every unknown motion that persists in simulations."""
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
            if not self._explained(found):
                self._from_survivor(found, duration / 2.0)
        if self.irregular:
            self._follow_down(simulate)

    def _follow_down(self, simulate: Callable[..., tuple[Survivor, ...]]) -> None:
        """Follow the slowest irregular motion down until it dies out or becomes a known one.

        The speeds simulated are far apart, and from rest a disturbance may miss an existing motion.
        """
        motion, dead = min(self.irregular, key=lambda found: found.speed), self.limits[0]
        step = _DOWN * motion.speed
        while step > _DOWN_TO * motion.speed:
            speed = motion.speed - step
            if speed <= dead:
                step /= 2.0
                continue
            rest, _ = equilibria(self.model, np.array([motion.speed]), self.radius, self.cant)
            away = (motion.state - rest[0]).tolist()
            found = simulate([speed], starts=[dict(zip(self.model.state_names, away, strict=True))])
            if found and not self._explained(found[0]):
                motion = found[0]
                self.irregular.append(motion)
            else:
                dead, step = speed, step / 2.0

    def _from_survivor(self, found: Survivor, duration: float) -> None:
        """Follow a branch through a simulated motion if it is periodic, stable and unknown."""
        try:
            cycle = simulated_cycle(
                self.model,
                speed=found.speed,
                radius=self.radius,
                cant=self.cant,
                initial_state=found.state,
                duration=duration,
            )
        except CycleError:
            self.irregular.append(found)
            return
        if cycle.stable and not self._known(cycle):
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
        """Return a branch up to where it continues along another one."""
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
        """Return whether a simulated motion is a stable one of a branch."""
        return any(
            self._alike(found.amplitudes, near.amplitudes, _SAME_MOTION, STILL)
            for branch in self.branches
            for near in passages(branch, found.speed)
            if near.stable
        )

    def _known(self, cycle: Cycle) -> bool:
        """Return whether a motion belongs to a branch."""
        return any(
            abs(near.period / cycle.period - 1.0) < _SAME_PERIOD
            and self._alike(cycle.amplitudes, near.amplitudes, _SAME_BRANCH, _SAME_BRANCH)
            and self._alike(middle(cycle), near.middle, _SAME_BRANCH, _SAME_BRANCH)
            for branch in self.branches
            for near in passages(branch, cycle.value)
        )

    def _alike(self, a: Array, b: Array, share: float, least: float) -> bool:
        """Return whether states agree, within a share of the largest displacement plus the least."""
        size, gap = np.maximum(a, b) / self.model.scale, np.abs(a - b) / self.model.scale
        return all(
            (gap[rows] < share * size[rows].max(initial=0.0) + least).all() for rows in self._compared
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
