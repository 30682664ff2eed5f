"""The lowest value at which hunting of a branch can persist, with the evidence for it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Protocol

from design.stability.loss import CriticalSpeed


class Branch(Protocol):
    """The parts of a branch of limit cycles that are read."""

    @property
    def parameter(self) -> str:
        """Name of the parameter."""

    @property
    def cycles(self) -> Sequence[Any]:
        """Its motions, in order."""

    @property
    def special(self) -> Sequence[Any]:
        """Its special points, in order."""

    @property
    def hopf(self) -> CriticalSpeed | None:
        """Hopf point at which it starts, if any."""


@dataclass(frozen=True)
class HuntingOnset:
    """The lowest value of a parameter at which hunting can persist.

    Attributes
    ----------
    parameter : str
    value : float
        Value of the parameter; m/s for the speed.
    rests_on : str
        Evidence. "fold", "Hopf", "torus", "period doubling", "symmetry breaking" or "branch point": the
        point of the branch at which stable motions begin. "simulation": a motion of no branch persists
        (:func:`design.bifurcation_diagram`). "stable motion": stable motions were computed down to this
        value, but their beginning was not located. "end of the branch": they go on to the end of the
        computed branch, so that hunting may persist below.
    frequency : float
        Frequency of the motion, Hz; NaN for a motion that was only simulated.
    """

    parameter: str
    value: float
    rests_on: str
    frequency: float

    def __str__(self) -> str:
        unit = " m/s" if self.parameter == "speed" else ""
        at = "" if math.isnan(self.frequency) else f", {self.frequency:.4f} Hz"
        return f"hunting can persist from {self.parameter} {self.value:.6g}{unit} ({self.rests_on}{at})"


def onset_of(branch: Branch) -> HuntingOnset | None:
    """Return the lowest value at which a stable motion of a branch exists; None if there is none."""
    found = min(_beginnings(branch), key=lambda o: o.value, default=None)
    if found is not None:
        lowest = min(c.value for c in branch.cycles if c.stable)
        assert found.value <= lowest, f"{found}, but a motion at {lowest:.9g} is stable"
    return found


def _beginnings(branch: Branch) -> Iterator[HuntingOnset]:
    """Yield the possible beginnings of every stable stretch."""
    name, cycles = branch.parameter, branch.cycles
    for stable, run in groupby(range(len(cycles)), key=lambda i: cycles[i].stable):
        if not stable:
            continue
        members = list(run)
        first, last = members[0], members[-1]
        for point in branch.special:
            if first <= point.after <= last + 1:
                yield HuntingOnset(name, point.value, point.kind, point.cycle.frequency)
        lowest = min((cycles[i] for i in members), key=lambda c: c.value)
        open_ends = (cycles[i] for i in (first, last) if i in (0, len(cycles) - 1))
        kind = "end of the branch" if lowest in open_ends else "stable motion"
        yield HuntingOnset(name, lowest.value, kind, lowest.frequency)
        hopf = branch.hopf
        if first == 0 and name == "speed" and hopf is not None and hopf.speed is not None:
            yield HuntingOnset(name, hopf.speed, "Hopf", hopf.frequency or cycles[0].frequency)
