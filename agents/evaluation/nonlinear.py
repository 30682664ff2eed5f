"""Nonlinear critical speeds of a controlled vehicle, by simulation in the environment (Polach's two).

From a disturbance: the speed up to which a lateral offset of all bodies dies out. In a ramp: hunting is
established at high speed, then the vehicle slows down; the speed at which hunting stops.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller
from agents.evaluation.rollout import Case, Rollout, leading, startable
from railenv import Equipped, checks

Array = NDArray[np.float64]

OFFSET = 9e-3
"""Lateral offset of all bodies, m: just short of the flange."""

QUIET = 1e-3
"""Amplitude (m) of the leading wheelset below which a vehicle does not hunt."""

_WINDOW = 1.0  # s over which an amplitude is read
_COARSE, _FINE = 24, 12  # speeds side by side, first over the range, then where it changes
_SETTLING = 6.0  # s
_TOGETHER = 8  # speeds that get more time side by side
_PATIENCE = 20.0  # s, for motions that have not died out by then: a slow decay is still a decay
_RAMP, _FAST = 0.05, 1.0  # m/s^2
_LAG = 8.0  # s, the largest lag of a quick ramp's reading
_ESTABLISHING = 4.0  # s without control, in which hunting grows to its full size


@dataclass(frozen=True)
class Place:
    """The curve on which a vehicle runs, and changes of the vehicle.

    Attributes
    ----------
    radius, cant : float
        m (``math.inf`` on tangent track), rad.
    vehicle : mapping of str to float
    """

    radius: float = math.inf
    cant: float = 0.0
    vehicle: Mapping[str, float] = field(default_factory=dict)

    def case(self, speed: float, offset: float = 0.0) -> Case:
        """Return a run there."""
        return Case(speed, self.radius, self.cant, offset, self.vehicle)


def amplitudes(
    model: Equipped,
    controller: Controller | None,
    place: Place,
    speeds: Sequence[float],
    *,
    offset: float = OFFSET,
    duration: float = _SETTLING,
) -> Array:
    """Return the final amplitude after a lateral offset at several speeds: half the range, m.

    It is read at the leading wheelset.

    Speeds without a running equilibrium give infinity.
    """
    cases = [place.case(v, offset) for v in speeds]
    possible = np.flatnonzero(startable(model, cases))
    result = np.full(len(speeds), math.inf)
    if len(possible):
        rollout = Rollout(model, controller, [cases[k] for k in possible])
        motion = rollout.run(duration)
        last = motion[leading(model)][-round(_WINDOW / rollout.period) :]
        left = np.where(np.isfinite(last).all(axis=0), np.ptp(last, axis=0) / 2.0, math.inf)
        result[possible] = left
    return result


def disturbed_critical_speed(
    model: Equipped,
    controller: Controller | None,
    place: Place | None = None,
    *,
    speed_range: tuple[float, float] = (20.0, 400.0),
    offset: float = OFFSET,
) -> float | None:
    """Return the speed (m/s) up to which an offset of all bodies dies out at every speed tried.

    None if it does not die out at the lowest speed; the highest speed if it always does.
    """
    where = Place() if place is None else place
    low, high = checks.speeds(speed_range)
    speeds = np.geomspace(low, high, _COARSE)
    for count in (_FINE, _FINE):
        lasting = _first_lasting(model, controller, where, speeds.tolist(), offset)
        if lasting is None:
            return float(speeds[-1])
        if lasting == 0:
            return None
        speeds = np.linspace(speeds[lasting - 1], speeds[lasting], count)
    lasting = _first_lasting(model, controller, where, speeds.tolist(), offset)
    return float(speeds[-1] if lasting is None else speeds[max(lasting - 1, 0)])


def _first_lasting(
    model: Equipped,
    controller: Controller | None,
    where: Place,
    speeds: Sequence[float],
    offset: float,
) -> int | None:
    """Return the index of the first speed at which an offset does not die out, in two rounds."""
    left = amplitudes(model, controller, where, speeds, offset=offset)
    doubtful = np.flatnonzero(~(left < QUIET))
    for first in range(0, len(doubtful), _TOGETHER):
        chosen = doubtful[first : first + _TOGETHER]
        again = [speeds[k] for k in chosen]
        longer = amplitudes(model, controller, where, again, offset=offset, duration=_PATIENCE)
        lasting = chosen[~(longer < QUIET)]
        if len(lasting):
            return int(lasting[0])
    return None


@dataclass(frozen=True)
class Ramp:
    """Hunting while a vehicle slows down.

    Attributes
    ----------
    stops : float or None
        Speed (m/s) at which hunting stops; None if it goes on at the lowest speed.
    start : float
        Speed at which the ramp began, m/s.
    established : bool
        Whether the vehicle hunted at the start; if not, ``stops`` is the start.
    speed, amplitude : ndarray
        Half the range of the leading wheelset's lateral displacement (m) in each second, with the speed
        at its middle.
    """

    stops: float | None
    start: float
    established: bool
    speed: Array
    amplitude: Array


def ramp_down(
    model: Equipped,
    controller: Controller | None,
    place: Place | None = None,
    *,
    start: float,
    lowest: float = 20.0,
    rate: float = _RAMP,
) -> Ramp:
    """Establish hunting without control at a speed, switch the controller on, and slow down.

    Parameters
    ----------
    model : Equipped
    controller : Controller or None
    place : Place, optional
    start, lowest : float
        m/s.
    rate : float
        Deceleration, m/s^2; a quick ramp first finds the start of the slow one.

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium at the start.
    """
    where = Place() if place is None else place
    rollout = Rollout(model, None, [where.case(start, OFFSET)], like=controller)
    rollout.run(_ESTABLISHING)
    if controller is not None:
        controller.reset(1)
        rollout.controller = controller
    # first the controller acts at the start
    settled = rollout.run(_SETTLING)[leading(model)][-round(_WINDOW / rollout.period) :]
    first = float(np.ptp(settled) / 2.0)
    if not first >= QUIET:
        return Ramp(start, start, False, np.array([start]), np.array([first]))
    quick = _Descent(rollout, start, _FAST)
    if not quick.run(lowest):
        return Ramp(None, start, True, *quick.records)
    # a quick ramp lags: once more from a little before, slowly
    slow = _Descent(rollout, quick.back_to(quick.speed + _LAG * _FAST), rate)
    stopped = slow.run(lowest)
    return Ramp(slow.speed if stopped else None, start, True, *slow.records)


class _Descent:
    """A vehicle that slows down steadily, its hunting read in windows."""

    def __init__(self, rollout: Rollout, speed: float, rate: float) -> None:
        self.rollout = rollout
        self.speed = speed
        self.rate = rate
        self._read: list[tuple[float, float]] = []
        self._kept: list[tuple[float, Any, Any]] = []

    @property
    def records(self) -> tuple[Array, Array]:
        """Speeds (m/s) at the middle of each window and amplitudes (m)."""
        read = np.array(self._read).reshape(-1, 2)
        return read[:, 0], read[:, 1]

    def run(self, lowest: float) -> bool:
        """Slow down until hunting stops, or to the lowest speed; return whether it stopped."""
        rollout, period = self.rollout, self.rollout.period
        model = rollout.fleet.model
        column = model.state_names.index(leading(model))
        record = np.empty(round(_WINDOW / period))
        while self.speed - self.rate * _WINDOW > lowest:
            self._kept.append((self.speed, rollout.fleet.snapshot(), copy.deepcopy(rollout.controller)))
            for k in range(len(record)):
                rollout.fleet.set_speeds(np.array([self.speed]))
                rollout.step()
                record[k] = rollout.fleet.all_states()[0, column]
                self.speed -= self.rate * period
            size = float(np.ptp(record) / 2.0)
            self._read.append((self.speed + 0.5 * self.rate * _WINDOW, size))
            if not size >= QUIET:
                return True
        return False

    def back_to(self, speed: float) -> float:
        """Go back to the last moment above a speed, and return the speed there."""
        above = [kept for kept in self._kept if kept[0] >= speed]
        there, fleet, controller = above[-1] if above else self._kept[0]
        self.rollout.fleet.restore(fleet)
        self.rollout.controller = controller
        return there
