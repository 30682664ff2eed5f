"""Lessons of a policy search: episodes in the environment, and the scores of policies in them.

A motion that should die out is judged by its rate of decay: an unstable vehicle shows long before its
motion is large, and a small limit cycle does not count as decay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller
from agents.evaluation.nonlinear import OFFSET
from agents.evaluation.rollout import Case, Rollout, Track
from railenv import HIGH_SPEED_COACH_HOLLOW, Equipped, checks
from railenv.envs.fleet import QUIET
from railenv.errors import ParameterError

Array = NDArray[np.float64]

TINY = 1e-8
"""Offset (m) of all bodies from which small motions start, far from every limit."""

_WINDOW = 0.2  # s over which the energy of a motion is read
_EFFORT = 4.0  # weight of the mean squared moment (share of the limit), beside the motion on a ride
_GROWING = 0.1  # 1/s, rate above which a growing motion costs 1 more
_UNIT = 9e-3  # m, an offset whose energy is about 1, since the reward scales by the flange clearance
_MOST = 1.0 - 1e-12  # cost of a motion that is no longer a number
_NOTHING = 1e-26  # energy in the terms of the reward, below which a motion has died out


def _small() -> tuple[Case, ...]:
    contact = ((0.05, 0.6), (0.05, 1.4), (0.2, 1.0), (0.4, 0.6), (0.4, 1.4))
    grid = [(c, k, v) for c, k in contact for v in (20.0, 30.0, 55.0, 85.0, 110.0, 125.0)]
    # above 129 m/s the second mode grows with the most worn wheels on the cleanest rails
    fast = [(0.4, 1.4, v) for v in (127.0, 129.0, 130.0, 131.0, 132.0, 133.0, 134.0)]
    fast += [(0.3, 1.4, 134.0), (0.12, 1.0, 140.0), (0.3, 1.0, 100.0), (0.4, 1.0, 100.0)]
    poor = [(0.15, 0.6, v) for v in (80.0, 130.0)] + [(0.25, 0.6, v) for v in (100.0, 130.0)]
    poor += [(0.2, 0.8, 130.0), (0.3, 0.8, 134.0)]
    tangent = (_tiny(v, conicity=c, creep_factor=k) for c, k, v in (*grid, *fast, *poor))
    own = (_tiny(v) for v in (180.0, 205.0, 230.0))
    return (*tangent, *own, *_curving(), *_other_vehicles())


def _tiny(speed: float, **vehicle: float) -> Case:
    return Case(speed, offset=TINY, vehicle=vehicle)


def _curving() -> tuple[Case, ...]:
    runs = {
        5000.0: (85.0, 97.0),
        8000.0: (110.0, 125.0, 138.0),
        12000.0: (140.0, 158.0, 172.0, 182.0),
    }
    return tuple(
        Case(v, radius, 0.0873, offset=2e-4) for radius, speeds in runs.items() for v in speeds
    )


def _other_vehicles() -> tuple[Case, ...]:
    own = HIGH_SPEED_COACH_HOLLOW
    spring = own.primary_longitudinal_stiffness
    frame = {"frame_mass": 1.07 * own.frame_mass, "frame_yaw_inertia": 1.07 * own.frame_yaw_inertia}
    return (
        *(_tiny(v, primary_longitudinal_stiffness=0.88 * spring) for v in (140.0, 165.0)),
        _tiny(200.0, primary_longitudinal_stiffness=1.1 * spring),
        _tiny(200.0, **frame),
    )


def _large() -> tuple[Case, ...]:
    worn = Case(110.0, offset=OFFSET, vehicle={"conicity": 0.25})
    return (*(Case(v, offset=OFFSET) for v in (140.0, 190.0, 220.0, 250.0)), worn)


def _rides() -> tuple[Case, ...]:
    return tuple(Case(v) for v in (80.0, 110.0, 140.0))


@dataclass(frozen=True, kw_only=True)
class Lessons:
    """Episodes that judge policies.

    Attributes
    ----------
    small, large : tuple of Case
        Runs on smooth track whose offset should die out.
    rides : tuple of Case
        Runs on irregular track (ERRI B176, low), on which motion and moment should stay small.
    duration : float
        Duration of an episode, s.
    decay : float
        Rate (1/s) at which offsets should die out; faster decay earns nothing.
    ride : float
        Weight of the rides.
    """

    small: tuple[Case, ...] = field(default_factory=_small)
    large: tuple[Case, ...] = field(default_factory=_large)
    rides: tuple[Case, ...] = field(default_factory=_rides)
    duration: float = 4.0
    decay: float = 0.6
    ride: float = 12.0

    def __post_init__(self) -> None:
        checks.number("duration", self.duration, low=10.0 * _WINDOW, unit="s")
        checks.number("decay", self.decay, low=0.0, unit="1/s")
        checks.number("weight of the rides", self.ride, low=0.0)
        for name in ("small", "large", "rides"):
            if not getattr(self, name):
                raise ParameterError(f"lessons {name} is empty; a search needs one case of each")
        if any(case.offset <= 0.0 for case in (*self.small, *self.large)):
            raise ParameterError("a case of small or large has no offset that could die out")

    @property
    def cases(self) -> tuple[Case, ...]:
        """All episodes; those that are not rides run on smooth track."""
        return (*self.small, *self.large, *self.rides)

    def plain(self) -> dict[str, Any]:
        """Return everything as plain numbers and lists, for a policy's file."""
        runs = {
            name: [
                [c.speed, _finite(c.radius), c.cant, c.offset, dict(c.vehicle)]
                for c in getattr(self, name)
            ]
            for name in ("small", "large", "rides")
        }
        return {**runs, "duration": self.duration, "decay": self.decay, "ride": self.ride}

    def scores(self, model: Equipped, controller: Controller, count: int = 1) -> Array:
        """Return the scores of ``count`` policies run side by side in one controller.

        The score is minus the sum of the cubes of the excesses of the growth rates over ``-decay``,
        minus 1 for every motion that grows (in proportion below 0.1 1/s), minus ``ride`` times the
        decimal logarithm of the mean motion and moment on the rides. The rate of a case is the slope of
        its motion's logarithm over the last half, and for small offsets at least that over the whole: a
        motion that has grown into a limit cycle does not count as steady.

        Parameters
        ----------
        model : Equipped
        controller : Controller
            Rows of the first policy's vehicles come first, then those of the second, and so on.
        count : int

        Returns
        -------
        ndarray, shape (count,)
        """
        smooth = len(self.small) + len(self.large)
        one = [
            Case(c.speed, c.radius, c.cant, c.offset, c.vehicle, c.roughness * (i >= smooth))
            for i, c in enumerate(self.cases)
        ]
        rollout = Rollout(model, controller, one * count, Track("low", repeats_after=len(one)))
        window = round(_WINDOW / rollout.period)
        windows = round(self.duration / _WINDOW)
        energies = np.empty((windows, len(rollout.cases)))
        ride = np.zeros(len(rollout.cases))
        for k in range(windows):
            energy = np.zeros(len(rollout.cases))
            for _ in range(window):
                rollout.step()
                hunting, excursion, _, effort, *_ = rollout.fleet.costs.T
                motion = _energy(hunting) + _energy(excursion)
                energy += motion
                ride += motion + _EFFORT * effort
            energies[k] = energy / window
        shaped = energies.reshape(windows, count, len(one))
        rates = self._rates(shaped[:, :, :smooth])
        cost = np.maximum(rates + self.decay, 0.0) ** 3 + np.clip(rates / _GROWING, 0.0, 1.0)
        motion = ride.reshape(count, len(one))[:, smooth:] / (windows * window)
        return np.asarray(-cost.sum(axis=1) - self.ride * np.log10(motion).mean(axis=1))

    def _rates(self, energies: Array) -> Array:
        """Return growth rates (1/s) from energies of shape (windows, ...)."""
        size = 0.5 * np.log(energies + _NOTHING)
        half = len(size) // 2
        time = _WINDOW * np.arange(len(size) - half)
        last = size[half:].reshape(len(time), -1)
        rates = np.polyfit(time, last, 1)[0].reshape(size.shape[1:])
        small = len(self.small)
        start = np.array([np.log(case.offset / _UNIT) for case in self.small])
        whole = (size[-1, :, :small] - start) / self.duration
        rates[:, :small] = np.maximum(rates[:, :small], whole)
        return np.asarray(rates)


def _energy(cost: Array) -> Array:
    """Return the bounded energy of a motion from its cost in the reward, which gives its amplitude."""
    energy = (QUIET * cost / (1.0 - np.minimum(cost, _MOST))) ** 2
    return np.asarray(energy / (1.0 + energy))


def _finite(radius: float) -> float | None:
    return None if math.isinf(radius) else radius
