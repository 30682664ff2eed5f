"""Linear sampled controllers scheduled over speed: every classical controller is one.

With y the observation in SI units and u the commanded moments (N m; N of a lateral actuator), each
control period

    u = C z + D y,        z' = A z + B y + E sat(u),

where sat() keeps each moment within its actuator's limit, so that an observer knows the applied moment.
Matrices are linear in speed between the speeds at which they were designed, and constant beyond.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, Literal, Self, get_args

import control
import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import Controller, check_labels, check_limits, observation_rows
from agents.controllers.files import ControllerFile, read, write
from railenv import Equipped, checks
from railenv.envs.observation import Observation, Reading, observation_table
from railenv.errors import ParameterError

Array = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]

CONTROL_PERIOD = 0.005
"""Control period of the environments, s."""

MOST_VEHICLES = 2**20
"""Largest number of vehicles side by side."""

_MATRICES = ("A", "B", "C", "D", "E")


@dataclass(frozen=True)
class Law:
    """Matrices of a scheduled controller.

    Attributes
    ----------
    speeds : ndarray, shape (k,)
        Increasing speeds, m/s; a single one for a controller that is not scheduled.
    A, B, C, D, E : ndarray
        Shapes (k, n, n), (k, n, p), (k, m, n), (k, m, p) and (k, n, m) for n states, p readings and m
        commands.
    """

    speeds: Array
    A: Array
    B: Array
    C: Array
    D: Array
    E: Array

    def __post_init__(self) -> None:
        for name in ("speeds", *_MATRICES):
            array = getattr(self, name)
            dimensions = 1 if name == "speeds" else 3
            if array.dtype.kind not in "fiu" or array.ndim != dimensions:
                raise ParameterError(
                    f"{name} has shape {array.shape} and type {array.dtype}; it must be an array of "
                    f"numbers with {dimensions} dimensions"
                )
        k, n, p, m = len(self.speeds), self.A.shape[1], self.D.shape[2], self.D.shape[1]
        shapes = {"A": (k, n, n), "B": (k, n, p), "C": (k, m, n), "D": (k, m, p), "E": (k, n, m)}
        for name, shape in shapes.items():
            matrix = getattr(self, name)
            if matrix.shape != shape:
                raise ParameterError(f"{name} has shape {matrix.shape}; it must be {shape}")
            if not np.isfinite(matrix).all():
                raise ParameterError(f"{name} has entries that are not finite")
        if k == 0 or not (np.isfinite(self.speeds).all() and (np.diff(self.speeds) > 0.0).all()):
            raise ParameterError(f"speeds is {self.speeds!r}; speeds must increase")

    @classmethod
    def of(
        cls,
        speeds: ArrayLike,
        D: ArrayLike,
        A: ArrayLike | None = None,
        B: ArrayLike | None = None,
        C: ArrayLike | None = None,
        E: ArrayLike | None = None,
    ) -> Self:
        """Return a law from matrices stacked over speed; without A, B, C it has no states."""
        gain = np.asarray(D, dtype=float)
        k, m, p = gain.shape
        n = 0 if A is None else np.shape(A)[1]
        given = {"A": (A, (k, n, n)), "B": (B, (k, n, p)), "C": (C, (k, m, n)), "E": (E, (k, n, m))}
        matrices = {
            name: np.zeros(shape) if value is None else np.asarray(value, dtype=float)
            for name, (value, shape) in given.items()
        }
        return cls(np.atleast_1d(np.asarray(speeds, dtype=float)), D=gain, **matrices)

    def at(self, speeds: Array) -> tuple[Array, ...]:
        """Return A, B, C, D, E for each of some speeds, shape (count, ...)."""
        low, share = self._place(speeds)
        part = share[:, None, None]
        return tuple(
            (1.0 - part) * matrix[low] + part * matrix[np.minimum(low + 1, len(self.speeds) - 1)]
            for matrix in self._matrices()
        )

    def at_one(self, speed: float) -> tuple[Array, ...]:
        """Return A, B, C, D, E at one speed."""
        places, shares = self._place(np.array([speed]))
        low, share = int(places[0]), float(shares[0])
        if share == 0.0:
            return tuple(matrix[low] for matrix in self._matrices())
        return tuple(
            (1.0 - share) * matrix[low] + share * matrix[low + 1] for matrix in self._matrices()
        )

    def _matrices(self) -> tuple[Array, ...]:
        return self.A, self.B, self.C, self.D, self.E

    def _place(self, speeds: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the node below each speed, and the fraction of the way to the next, from 0 to 1."""
        nodes = self.speeds
        if len(nodes) == 1:
            return np.zeros(len(speeds), dtype=np.intp), np.zeros(len(speeds))
        clipped = np.clip(speeds, nodes[0], nodes[-1])
        low = np.clip(np.searchsorted(nodes, clipped) - 1, 0, len(nodes) - 2)
        return low, (clipped - nodes[low]) / (nodes[low + 1] - nodes[low])


@dataclass(eq=False)
class ScheduledController(Controller):
    """A linear controller scheduled over speed; see the module's docstring.

    Attributes
    ----------
    law : Law
    readings : tuple of Reading
        Entries of the environment's observation.
    commands : tuple of str
        Inputs of the equipped model that it commands.
    limit : float or sequence of float
        Largest moment (N m; N of a lateral actuator), of all commands or of each.
    observation : {"state", "sensors"}
    period : float
        Control period, s.
    about : dict
        Record of its design: plain numbers and strings, kept in its file.
    """

    law: Law
    readings: tuple[Reading, ...]
    commands: tuple[str, ...]
    limit: float | Sequence[float] | Array
    observation: Literal["state", "sensors"]
    period: float = CONTROL_PERIOD
    about: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        checks.known("observation", [self.observation], get_args(Observation))
        checks.number("period", self.period, low=0.0, open_low=True, unit="s")
        check_labels(self.readings, self.commands)
        self.limit = check_limits(self.commands, self.limit)
        names = [reading.name for reading in self.readings]
        shape = (len(self.commands), len(names))
        if self.law.D.shape[1:] != shape:
            raise ParameterError(
                f"the law has {self.law.D.shape[2]} readings and {self.law.D.shape[1]} commands; it "
                f"must have {shape[1]} ({', '.join(names)}) and {shape[0]} ({', '.join(self.commands)})"
            )
        self._scales = np.array([reading.scale for reading in self.readings])
        self._speed_at = names.index("speed")
        self._limits = self.limits
        self.reset()

    def __str__(self) -> str:
        reads = {"state": "full state", "sensors": "sensors"}[self.observation]
        speeds = self.law.speeds
        laws = "one law" if len(speeds) == 1 else f"laws for {speeds[0]:g} to {speeds[-1]:g} m/s"
        limits = ", ".join(f"{limit:g}" for limit in dict.fromkeys(self.limits.tolist()))
        return (
            f"{self.name}: {laws} from {reads} to {', '.join(self.commands)}, "
            f"order {self.law.A.shape[1]}, within {limits} N m, every {1e3 * self.period:g} ms"
        )

    @property
    def limits(self) -> Array:
        """Largest moment (N m) or force (N) of each command."""
        return np.full(len(self.commands), self.limit)

    # ------------------------------------------------------------------ running

    def reset(self, count: int | None = None) -> None:
        """Start anew, for one vehicle (None) or for ``count`` vehicles side by side."""
        self._single = count is None
        count = None if count is None else checks.whole("count", count, high=MOST_VEHICLES)
        self._z = np.zeros((count or 1, self.law.A.shape[1]))
        self._speeds = np.full(count or 1, np.nan)
        self._now: tuple[Array, ...] = ()
        self._seen = np.zeros((count or 1, len(self.readings)))

    def reset_rows(self, rows: NDArray[np.bool_]) -> None:
        """Start anew for some of the vehicles side by side; ``rows`` is a mask of shape (count,)."""
        self._z[rows] = 0.0

    def act(self, observation: Floats) -> Floats:
        """Return commanded moments as shares of the limit, for one observation or for each row."""
        shares = np.clip(self.propose(observation), -1.0, 1.0)
        self.advance(shares)
        return shares

    @property
    def state(self) -> Array:
        """States of each vehicle's controller, shape (count, n)."""
        return self._z

    def propose(self, observation: Floats) -> Floats:
        """Return the demand of the law, as shares of the limit and not yet limited.

        Call :meth:`advance` next with the actual commands, to which another controller may have added.
        """
        count = None if self._single else len(self._z)
        y = observation_rows(observation, count, len(self.readings)) * self._scales
        if not np.array_equal(y[:, self._speed_at], self._speeds):
            self._speeds = y[:, self._speed_at].copy()
            self._now = self.law.at(self._speeds)
        C, D = (matrix.transpose(0, 2, 1) for matrix in self._now[2:4])
        self._seen = y
        shares = (self._z[:, None, :] @ C + y[:, None, :] @ D)[:, 0] / self._limits
        return shares[0] if self._single else shares

    def advance(self, shares: Floats) -> None:
        """Advance by a control period in which moments (shares of the limit) are commanded."""
        if self._z.shape[1]:
            A, B, E = (self._now[k].transpose(0, 2, 1) for k in (0, 1, 4))
            moments = np.reshape(shares, (len(self._z), 1, -1)) * self._limits
            self._z = (self._z[:, None, :] @ A + self._seen[:, None, :] @ B + moments @ E)[:, 0]

    # ------------------------------------------------------------------ design.Feedback

    @property
    def input_labels(self) -> list[str]:
        """Signals that it reads, by their names in :mod:`design.loop.feedback`."""
        return [reading.signal for reading in self.readings]

    @property
    def output_labels(self) -> list[str]:
        """Inputs of the model that it commands."""
        return list(self.commands)

    def linearize(self, signals: Array) -> control.StateSpace:
        """Return the law at a speed as a system in discrete time, from signals to moments (SI)."""
        A, B, C, D, E = self.law.at_one(float(signals[self._speed_at]))
        return control.ss(
            A + E @ C,
            B + E @ D,
            C,
            D,
            self.period,
            inputs=self.input_labels,
            outputs=self.output_labels,
        )

    def steady(self, signals: Array) -> Array:
        """Return the moments (N m) at which it settles under constant signals.

        They are not limited: above the limit the actuator saturates, and nothing is linear.
        """
        A, B, C, D, E = self.law.at_one(float(signals[self._speed_at]))
        if not len(A):
            return np.asarray(D @ signals)
        inner = np.eye(len(A)) - A - E @ C
        z = np.linalg.lstsq(inner, (B + E @ D) @ signals, rcond=None)[0]
        return np.asarray(C @ z + D @ signals)

    # ------------------------------------------------------------------ files

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to an npz file; :func:`agents.load` gives back its equal."""
        write(path, self.to_file())

    def to_file(self) -> ControllerFile:
        """Return the content of its file."""
        header = {
            "readings": [list(reading) for reading in self.readings],
            "commands": list(self.commands),
            "limit": self.limit,
            "observation": self.observation,
            "period": self.period,
            "about": self.about,
        }
        arrays = {name: getattr(self.law, name) for name in ("speeds", *_MATRICES)}
        return ControllerFile(type(self).__name__, header, arrays)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a controller of this class from its file.

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
        return cls(
            law=Law(**content.arrays_named("speeds", *_MATRICES)),
            readings=tuple(Reading(*row) for row in h["readings"]),
            commands=tuple(h["commands"]),
            limit=h["limit"],
            observation=h["observation"],
            period=h["period"],
            about=h["about"],
        )


def sensor_rows(model: Equipped, signals: Sequence[str]) -> Array:
    """Return the matrix from signals to the sensors' readings, shape (n_sensors, n_signals).

    The known effect of cant deficiency is subtracted from accelerometers.
    """
    rows = np.zeros((len(model.sensor_names), len(signals)))
    for row, name in zip(rows, model.sensor_names, strict=True):
        row[signals.index(name)] = 1.0
        if name.startswith("accel_"):
            row[signals.index("cant_deficiency")] = model.gravity
    return rows


def readings_of(
    model: Equipped, observation: Literal["state", "sensors"], period: float = CONTROL_PERIOD
) -> tuple[Reading, ...]:
    """Return the entries of an observation of a vehicle."""
    return tuple(observation_table(model, observation, period))
