"""The interface of controllers: they are reset, read observations and return actions.

The observations and actions are those of the environments. A controller of your own is a class with two
methods, ``reset`` and ``act``; all controllers of the package can also be linearised (they are
:class:`design.Feedback`), saved and loaded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from railenv import Equipped, Model, checks
from railenv.envs.fleet import BOUND
from railenv.envs.observation import Reading
from railenv.errors import ParameterError, shown

Array = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]


class Controller(ABC):
    """A controller of a vehicle's actuators, for one vehicle or for many side by side.

    Attributes
    ----------
    observation : {"state", "sensors"}
        The observation that it reads; ``"sensors"`` unless a class says otherwise.
    """

    observation: Literal["state", "sensors"] = "sensors"

    @abstractmethod
    def reset(self, count: int | None = None) -> None:
        """Start anew, for one vehicle (None) or for ``count`` vehicles side by side."""

    @abstractmethod
    def act(self, observation: Floats) -> Floats:
        """Return the action for an observation.

        Parameters
        ----------
        observation : ndarray, shape (m,) or (count, m)
            Observation of the environment.

        Returns
        -------
        ndarray, shape (n_actuators,) or (count, n_actuators)
            Commanded moments (or forces) as shares of each actuator's limit.
        """

    @property
    def name(self) -> str:
        """Name of the controller in tables and plots."""
        return type(self).__name__

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to a file from which :func:`agents.load` gives back its equal.

        Raises
        ------
        ParameterError
            If its class has no file format.
        """
        raise ParameterError(f"{type(self).__name__} does not say how it is saved")


def check_labels(readings: Sequence[Reading], commands: Sequence[str]) -> None:
    """Raise ParameterError unless a controller can have these readings and commands."""
    for reading in readings:
        texts = (reading.name, reading.unit, reading.signal)
        if not all(isinstance(text, str) for text in texts):
            raise ParameterError(f"a reading is {shown(reading)}; name, unit and signal must be texts")
        checks.number(f"scale of the reading {reading.name}", reading.scale, low=0.0, open_low=True)
    if not commands or not all(isinstance(command, str) for command in commands):
        raise ParameterError(f"commands is {shown(commands)}; it must be names of inputs")
    checks.known("reading", ["speed"], [reading.name for reading in readings])


def observation_rows(observation: Any, count: int | None, width: int) -> Array:
    """Return an observation as one row for each vehicle, within the bounds of the environments.

    Parameters
    ----------
    observation : array_like, shape (width,) or (count, width)
    count : int or None
        Number of vehicles side by side at the controller's reset; None for one.
    width : int
        Entries of an observation.

    Raises
    ------
    ParameterError
        If it has the wrong shape, or an entry is not finite.
    """
    expected = (width,) if count is None else (count, width)
    try:
        rows = np.asarray(observation, dtype=float)
    except (OverflowError, TypeError, ValueError):
        raise ParameterError(
            f"observation is {shown(observation)}; it must be an array of numbers"
        ) from None
    if rows.shape != expected:
        raise ParameterError(
            f"observation has shape {rows.shape}; the controller was reset for "
            + ("one vehicle" if count is None else f"{count} vehicles")
            + f", and it must be {expected}"
        )
    if not np.isfinite(rows).all():
        raise ParameterError(f"observation is {shown(rows)}; its entries must be finite")
    return np.atleast_2d(np.clip(rows, -BOUND, BOUND))


def equipped(model: Model) -> Equipped:
    """Return a vehicle with actuators and sensors: its own, or the default ones.

    The default ones are yaw actuators between frames and the body above them, or between wheelsets and
    the body that holds them if no frame moves.

    Raises
    ------
    ParameterError
        If the model cannot carry actuators, or has none.
    """
    if not isinstance(model, Model):
        raise ParameterError(f"model is {shown(model)}; it must be a railenv.Model")
    if isinstance(model, Equipped):
        if not model.command_names:
            raise ParameterError(
                f"{model.plant.name} has no actuators; place must be 'secondary', 'primary' or 'both', "
                "or actuators be given"
            )
        return model
    return Equipped(model)


def sensed_bodies(model: Equipped, what: str) -> list[str]:
    """Return for each yaw actuator the body whose sensors measure the motion that it damps.

    That is the first of the bodies on which it acts, else the second, else the only one with sensors.

    Raises
    ------
    ParameterError
        If an actuator is not a yaw actuator, or has no such body; ``what`` needs it.
    """
    found = []
    for mount in model.equipment.mounts:
        near = [body for body in mount.between if body in model.sensed]
        chosen = near or [*model.sensed]
        if mount.acts != "yaw" or not (near or len(chosen) == 1):
            raise ParameterError(
                f"{model.name} has the {mount.acts} actuator {mount.name} between "
                f"{' and '.join(mount.between)}, and sensors on {', '.join(model.sensed)}; {what} "
                "needs yaw actuators, with sensors on a body that each acts on"
            )
        found.append(chosen[0])
    return found


def check_limits(commands: Sequence[str], limit: Any) -> float | tuple[float, ...]:
    """Return the limits of some commands: one number if they are equal.

    Parameters
    ----------
    commands : sequence of str
    limit : float or sequence of float
        Limit of all commands, or of each; N m (N for a lateral actuator).

    Raises
    ------
    ParameterError
        If a limit is not a positive number, or the number of limits is wrong.
    """
    if not isinstance(limit, (list, tuple, np.ndarray)):
        return checks.number("limit", limit, low=0.0, open_low=True, unit="N m")
    values = tuple(checks.number("limit", v, low=0.0, open_low=True, unit="N m") for v in limit)
    if len(values) != len(commands):
        raise ParameterError(f"limit is {shown(limit)}; it must have {len(commands)} numbers")
    return values[0] if len(set(values)) == 1 else values
