"""Control scheduled on an online estimate: a bank of LQG controllers, each for one vehicle.

Each Kalman filter of the bank predicts the readings as if the wheels had its own conicity (and its
vehicle's other numbers). The better its predictions, the more likely its vehicle, and the more weight
its command has (multiple-model adaptive control: D. T. Magill, Optimal adaptive estimation of sampled
stochastic processes, IEEE Transactions on Automatic Control 10, 1965). The roughness of the line need
not be known, because errors of prediction are compared with each other.

It can distinguish vehicles that move differently: on an irregular line it finds the conicity to within
0.1 in a second or two, from the frame's gyro and accelerometer alone. Low creep coefficients look like
a lower conicity because both slow hunting down; without motion it learns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller, equipped, observation_rows
from agents.controllers.files import ControllerFile, read, write
from agents.controllers.lqg import LQG
from agents.controllers.scheduled import CONTROL_PERIOD, MOST_VEHICLES, Law, sensor_rows
from design.linear.regulator import Disturbances, Weights, kalman, sensor_noise
from railenv import Equipped, Model, checks
from railenv.envs.observation import Reading
from railenv.errors import ParameterError

Array = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]

MEMORY = 2.0
"""Time (s) over which errors of prediction are forgotten."""

_SMALLEST = 1e-12  # of a sum of squared errors
_MATRICES = ("A", "B", "C", "D", "E")


@dataclass(frozen=True)
class Predictors:
    """The predictors of a bank of q filters at each of k speeds.

    Attributes
    ----------
    readings : ndarray, shape (q, k, s, n)
        Maps a filter's n states to its s predicted sensor readings.
    weights : ndarray, shape (q, k, s, s)
        Inverse covariance of the errors of prediction, as the filter expects them.
    sizes : ndarray, shape (q, k)
        Logarithm of the determinant of that covariance.
    """

    readings: Array
    weights: Array
    sizes: Array

    @classmethod
    def of(
        cls,
        vehicles: Sequence[Equipped],
        speeds: Sequence[float],
        disturbances: Disturbances,
        period: float,
    ) -> Self:
        """Return the predictors of some vehicles' filters."""
        rows = []
        for vehicle in vehicles:
            noise = np.diag(np.square(sensor_noise(vehicle, disturbances)))
            for speed in speeds:
                o = kalman(vehicle, speed=speed, disturbances=disturbances, period=period)
                # M = P C' / S and S = C P C' + noise give S = noise / (1 - C M)
                S = np.linalg.solve(np.eye(len(o.C)) - o.C @ o.M, noise)
                rows.append((o.C, np.linalg.inv(S), np.linalg.slogdet(S)[1]))
        shape = (len(vehicles), len(speeds))
        parts = (np.array(part) for part in zip(*rows, strict=True))
        return cls(*(part.reshape(*shape, *part.shape[1:]) for part in parts))

    def at(self, place: Array) -> tuple[Array, Array, Array]:
        """Return the values at places between the speeds, shapes (q, count, ...)."""
        last = self.sizes.shape[1] - 1
        low = np.clip(place.astype(int), 0, max(last - 1, 0))
        high, share = np.minimum(low + 1, last), place - low
        return tuple(
            (1.0 - part) * array[:, low] + part * array[:, high]
            for array in (self.readings, self.weights, self.sizes)
            for part in [share.reshape(1, -1, *[1] * (array.ndim - 2))]
        )


class AdaptiveLQG(Controller):
    """A bank of scheduled LQG controllers, with commands weighted by the likelihood of their vehicles.

    :meth:`design` makes one. It has no linearisation because its gains depend on past readings; its
    critical speeds are measured in the environment.

    Attributes
    ----------
    bank : tuple of LQG
    vehicles : tuple of mapping of str to float
        The vehicle of each, as changes of the model.
    memory : float
        Time over which errors of prediction are forgotten, s.
    likely : ndarray, shape (count, q)
        Probability of each vehicle after the last observation.
    """

    observation: Literal["state", "sensors"] = "sensors"

    def __init__(
        self,
        bank: Sequence[LQG],
        predictors: Predictors,
        vehicles: Sequence[Mapping[str, float]],
        sensors: Array,
        memory: float = MEMORY,
        about: Mapping[str, Any] | None = None,
    ) -> None:
        self.bank, self.predictors = tuple(bank), predictors
        self.vehicles = tuple(dict(vehicle) for vehicle in vehicles)
        self.memory = checks.number("memory", memory, low=0.0, open_low=True, unit="s")
        first = self.bank[0]
        self.readings: tuple[Reading, ...] = first.readings
        self.commands, self.period, self.limits = first.commands, first.period, first.limits
        self._sensors = sensors
        self._scales = np.array([reading.scale for reading in self.readings])
        self._speed = [reading.name for reading in self.readings].index("speed")
        self.about: dict[str, Any] = dict(about or {})
        self.reset()

    @classmethod
    def design(
        cls,
        model: Model,
        *,
        speeds: Sequence[float],
        vehicles: Sequence[Mapping[str, float]],
        weights: Weights | None = None,
        disturbances: Disturbances | None = None,
        memory: float = MEMORY,
        period: float = CONTROL_PERIOD,
    ) -> Self:
        """Design an adaptive controller.

        Parameters
        ----------
        model : Model
        speeds : sequence of float
            Speeds over which each LQG is scheduled, m/s.
        vehicles : sequence of mapping of str to float
            Changes of the model, such as ``[{"conicity": 0.05}, {"conicity": 0.4}]``; all of the same
            numbers.
        weights : design.Weights, optional
        disturbances : design.Disturbances, optional
            Disturbances by line, actuators and sensors; their relative sizes count.
        memory : float
            Time over which errors of prediction are forgotten, s.
        period : float
            Control period, s.

        Raises
        ------
        ParameterError
            If there are fewer than two vehicles, or they are changes of different numbers.
        UnknownNameError
            If the model has no such number.
        """
        vehicle = equipped(model)
        if len(vehicles) < 2 or len({frozenset(changes) for changes in vehicles}) > 1:
            raise ParameterError(
                f"vehicles is {list(vehicles)!r}; it must be two or more, changes of the same numbers"
            )
        d = Disturbances() if disturbances is None else disturbances
        own = [vehicle.replace(**changes) for changes in vehicles]
        bank = [
            LQG.design(one, speeds=speeds, weights=weights, disturbances=d, period=period)
            for one in own
        ]
        signals = [reading.signal for reading in bank[0].readings]
        sensors = sensor_rows(vehicle, signals)
        about = {k: bank[0].about[k] for k in ("weights", "disturbances")}
        predictors = Predictors.of(own, speeds, d, period)
        return cls(bank, predictors, vehicles, sensors, memory, about)

    # ------------------------------------------------------------------ running

    def reset(self, count: int | None = None) -> None:
        """Start anew, for one vehicle (None) or for ``count`` vehicles side by side."""
        self._single = count is None
        rows = 1 if count is None else checks.whole("count", count, high=MOST_VEHICLES)
        for controller in self.bank:
            controller.reset(rows)
        self._errors = np.zeros((rows, len(self.bank)))
        self._seen = 0.0
        self.likely = np.full((rows, len(self.bank)), 1.0 / len(self.bank))

    def estimate(self, name: str) -> Array:
        """Return the expected value of a vehicle's number, such as its conicity, shape (count,).

        Raises
        ------
        UnknownNameError
            If the bank's vehicles do not differ in it.
        """
        checks.known("number of the bank's vehicles", [name], list(self.vehicles[0]))
        return np.asarray(self.likely @ [vehicle[name] for vehicle in self.vehicles])

    def act(self, observation: Floats) -> Floats:
        """Return commanded moments as shares of the limits."""
        self.observe(observation)
        shares = np.clip(np.einsum("cq,cqm->cm", self.likely, self._asked), -1.0, 1.0)
        self.advance(shares)
        return np.asarray(shares[0] if self._single else shares)

    def observe(self, observation: Floats) -> None:
        """Update the likelihoods with an observation.

        Call :meth:`advance` next with the actual commands, which another controller may give.
        """
        count = None if self._single else len(self.likely)
        rows = observation_rows(observation, count, len(self.readings))
        self._judge(rows * self._scales)
        self._asked = np.stack([controller.propose(rows) for controller in self.bank], axis=1)

    def advance(self, shares: Floats) -> None:
        """Advance by a control period with commands (shares of the limits), shape (count, m)."""
        for controller in self.bank:
            controller.advance(shares)

    def _judge(self, y: Array) -> None:
        """Compare the filters' predictions with the readings, and update the likelihood of each."""
        keep = math.exp(-self.period / self.memory)
        speeds = self.bank[0].law.speeds
        place = np.interp(y[:, self._speed], speeds, np.arange(len(speeds), dtype=float))
        C, W, sizes = self.predictors.at(place)
        states = np.stack([controller.state for controller in self.bank])
        errors = y @ self._sensors.T - np.einsum("qcsn,qcn->qcs", C, states)
        self._errors = keep * self._errors + np.einsum("qcs,qcst,qct->cq", errors, W, errors)
        self._seen = keep * self._seen + 1.0
        # the level of all errors is unknown; its best value for each filter leaves this likelihood
        several = len(self._sensors) * np.log(np.maximum(self._errors, _SMALLEST))
        told = 0.5 * self._seen * (several + sizes.T)
        weight = np.exp(told.min(axis=1, keepdims=True) - told)
        self.likely = weight / weight.sum(axis=1, keepdims=True)

    # ------------------------------------------------------------------ files

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to an npz file; :func:`agents.load` gives back its equal."""
        write(path, self.to_file())

    def to_file(self) -> ControllerFile:
        """Return the content of its file."""
        laws = [controller.law for controller in self.bank]
        first = self.bank[0]
        header = {
            "readings": [list(reading) for reading in self.readings],
            "commands": list(self.commands),
            "limit": first.limit,
            "period": self.period,
            "vehicles": [dict(vehicle) for vehicle in self.vehicles],
            "memory": self.memory,
            "about": self.about,
        }
        arrays = {name: np.array([getattr(law, name) for law in laws]) for name in _MATRICES}
        arrays |= {"speeds": laws[0].speeds, "sensors": self._sensors}
        arrays |= {
            "predicted": self.predictors.readings,
            "weights": self.predictors.weights,
            "sizes": self.predictors.sizes,
        }
        return ControllerFile(type(self).__name__, header, arrays)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read an adaptive controller from its file.

        Raises
        ------
        ParameterError
            If the file is damaged or holds a controller of another class.
        """
        return cls.from_file(read(path, cls.__name__))

    @classmethod
    def from_file(cls, content: ControllerFile) -> Self:
        """Return the controller in a file."""
        h = content.header
        own = content.arrays_named(*_MATRICES, "speeds", "sensors", "predicted", "weights", "sizes")
        count = len(h["vehicles"])
        wrong = [n for n in (*_MATRICES, "predicted", "weights", "sizes") if len(own[n]) != count]
        if wrong:
            raise ParameterError(f"{wrong[0]} has {len(own[wrong[0]])} entries; it must have {count}")
        bank = [
            LQG(
                law=Law(own["speeds"], *(own[name][k] for name in _MATRICES)),
                readings=tuple(Reading(*row) for row in h["readings"]),
                commands=tuple(h["commands"]),
                limit=h["limit"],
                observation="sensors",
                period=h["period"],
                about={},
            )
            for k in range(count)
        ]
        predictors = Predictors(own["predicted"], own["weights"], own["sizes"])
        return cls(bank, predictors, h["vehicles"], own["sensors"], h["memory"], h["about"])
