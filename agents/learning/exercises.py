"""Exercises for training a policy through the simulator: vehicles, speeds and small motions."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agents.controllers.service import CONICITY, CREEP_FACTOR, WEAR, varied
from agents.evaluation.rollout import Case
from railenv import Equipped, checks
from railenv.envs.settings import LOWEST_SPEED

_OFFSET_LIMIT = 0.02  # m


def _ranges() -> dict[str, tuple[float, float]]:
    return {"conicity": CONICITY, "wear": WEAR, "creep_factor": CREEP_FACTOR}


@dataclass(frozen=True, kw_only=True)
class Exercises:
    """The runs on which a policy is trained, and the requirements for them.

    Attributes
    ----------
    ranges : mapping of str to (float, float)
        Numbers of the vehicle that differ from run to run; those that a model lacks are left out.
    levels : int
        Number of values of each range, evenly from end to end. Every resulting vehicle runs at every
        speed: the worst ones are at the corners, but others between them become the worst if left out.
    speeds : (float, float)
        Range of speeds, m/s. A vehicle that no controller stabilises at the highest one costs most, and
        dominates the training.
    stops : int
        Number of speeds, both ends included, closer to each other towards the highest.
    horizon : float
        Duration of a run, s.
    decay : float
        Rate (1/s) at which every motion should decay; faster decay earns nothing.
    effort : float
        Weight of the mean squared command, in shares of the limit.
    rough : int
        Number of vehicles drawn from the same ranges, on irregular track (ERRI B176, low) and from an
        offset; 0 for none.
    rough_weight : float
        Weight of their cost: on irregular track no motion dies out, and its cost stays the largest.
    offset : float
        Largest offset, m; all bodies start displaced sideways, by at least half of it, either way.
    """

    ranges: Mapping[str, tuple[float, float]] = field(default_factory=_ranges)
    levels: int = 5
    speeds: tuple[float, float] = (15.0, 127.0)
    stops: int = 11
    horizon: float = 1.0
    decay: float = 0.6
    effort: float = 0.05
    rough: int = 16
    rough_weight: float = 0.1
    offset: float = 0.004

    def __post_init__(self) -> None:
        speeds = checks.interval("speeds", self.speeds, low=LOWEST_SPEED, unit="m/s")
        object.__setattr__(self, "speeds", speeds)
        ends = checks.mapping("ranges", self.ranges)
        found = {name: checks.interval(f"range of {name}", ends[name]) for name in ends}
        object.__setattr__(self, "ranges", found)
        for name, least in (("levels", 2), ("stops", 2), ("rough", 0)):
            checks.whole(f"{name} of exercises", getattr(self, name), low=least)
        checks.number("horizon", self.horizon, low=0.0, open_low=True, high=60.0, unit="s")
        checks.number("decay", self.decay, low=0.0, unit="1/s")
        checks.number("weight of the effort", self.effort, low=0.0)
        checks.number("weight of the rough group", self.rough_weight, low=0.0)
        checks.number("offset", self.offset, low=0.0, high=_OFFSET_LIMIT, unit="m")

    def plain(self) -> dict[str, Any]:
        """Return everything as plain numbers and lists, for a policy's file."""
        return {**dataclasses.asdict(self), "ranges": {k: list(v) for k, v in self.ranges.items()}}

    def small(self, model: Equipped) -> list[Case]:
        """Return the runs with small motions: every vehicle at every speed, slow ones first."""
        low, high = self.speeds
        ways = np.linspace(1.0, 0.0, self.stops)
        ranges = varied(model, dict(self.ranges))
        values = [np.linspace(*ends, self.levels).tolist() for ends in ranges.values()]
        vehicles = [dict(zip(ranges, numbers, strict=True)) for numbers in itertools.product(*values)]
        speeds = (high - (high - low) * ways**2).tolist()
        return [Case(speed, vehicle=vehicle) for speed in speeds for vehicle in vehicles]

    def large(self, model: Equipped, rng: np.random.Generator) -> list[Case]:
        """Draw the runs on irregular track, slow ones first."""
        low, high = self.speeds
        speeds = low + (high - low) * (np.arange(self.rough) + rng.random(self.rough)) / self.rough
        ranges = varied(model, dict(self.ranges))
        return [
            Case(
                float(speed),
                offset=self.offset * float(rng.choice((-1.0, 1.0)) * rng.uniform(0.5, 1.0)),
                vehicle={name: float(rng.uniform(*ends)) for name, ends in ranges.items()},
            )
            for speed in speeds
        ]
