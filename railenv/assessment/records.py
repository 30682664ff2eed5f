"""The parts of an assessment: quantities with their limits, and their courses over distance."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from railenv.assessment.limits import Limits
from railenv.assessment.readings import Readings

Array = NDArray[np.float64]
Group = Literal["running safety", "track loading", "ride", "information"]
Unit = Literal["N", "m/s^2", "1"]

SAME_CURVE = 0.99
"""Share of the sharpest curvature above which track belongs to the full curve."""

SHORTEST_CURVE = 50.0
"""Shortest full curve (m) from which quasi-static values are taken."""


@dataclass(frozen=True)
class Quantity:
    """One number of an assessment beside its limit.

    Attributes
    ----------
    name : str
        Name of the quantity.
    where : str
        Wheelset, wheel or place.
    value : float
        In ``unit``.
    limit : float, optional
        The largest value allowed; None where there is none.
    unit : str
    filter : str
        How the value was taken from the signal.
    group : {"running safety", "track loading", "ride", "information"}
        Purpose; values for information do not count in the verdict.
    """

    name: str
    where: str
    value: float
    limit: float | None
    unit: Unit
    filter: str
    group: Group

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", float(self.value))  # plain numbers for JSON
        if self.limit is not None:
            object.__setattr__(self, "limit", float(self.limit))

    @property
    def share(self) -> float | None:
        """Value over limit."""
        return None if self.limit is None else self.value / self.limit

    @property
    def passed(self) -> bool | None:
        """Whether the value is within its limit; None without one."""
        return None if self.limit is None else self.value <= self.limit


@dataclass(frozen=True, eq=False)
class History:
    """The course over distance from which a quantity is taken.

    Attributes
    ----------
    name, where : str
        Those of the quantity.
    distance, value : ndarray, shape (places,)
        m, and in ``unit``.
    limit : float, optional
        Limit of the magnitude.
    unit : str
    """

    name: str
    where: str
    distance: Array
    value: Array
    limit: float | None
    unit: Unit


@dataclass
class Findings:
    """The results of a part of an assessment, and what it had to leave out."""

    quantities: list[Quantity] = field(default_factory=list)
    histories: list[History] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Stretch:
    """The stretch of a run that is assessed.

    Attributes
    ----------
    readings : Readings
        Of the whole run.
    limits : Limits
    section : (float, float)
        m.
    """

    readings: Readings
    limits: Limits
    section: tuple[float, float]

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """Whether samples belong to the section, from the last at its start to the first at its end."""
        s = self.readings.distance
        slack = 1e-9 * s[-1]
        first = max(int(np.searchsorted(s, self.section[0] + slack)) - 1, 0)
        last = int(np.searchsorted(s, self.section[1] - slack))
        found = np.zeros(len(s), dtype=bool)
        found[first : last + 1] = True
        return found

    @property
    def distance(self) -> Array:
        """Places (m) of the samples in the section."""
        return self.readings.distance[self.inside]

    @cached_property
    def curvature(self) -> float:
        """The sharpest curvature in the section, 1/m, with its sign."""
        within = self.readings.curvature[self.inside]
        return float(within[np.argmax(np.abs(within))])

    @property
    def radius(self) -> float:
        """Radius of the sharpest curve, m."""
        return 1.0 / abs(self.curvature) if self.curvature else math.inf

    @cached_property
    def full_curve(self) -> NDArray[np.bool_] | None:
        """Whether samples lie in the full curve; None if there is none, or it is too short."""
        if not self.curvature:
            return None
        same = self.inside & (self.readings.curvature / self.curvature >= SAME_CURVE)
        s = self.readings.distance
        length = float(np.sum(np.diff(s) * (same[1:] & same[:-1])))
        return same if length >= SHORTEST_CURVE else None

    @property
    def speed(self) -> float:
        """The highest speed in the section, m/s."""
        return float(self.readings.speed[self.inside].max())
