"""What a controller is: it is started, reads observations and gives actions.

The observations and actions are those of the environments. A controller of one's own is a class with
two methods, ``reset`` and ``act``; everything that the package ships can also be linearised (it is a
:class:`design.Feedback`), saved and loaded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from railenv import Bogie, DualWheelset, Equipped, checks
from railenv.envs.fleet import BOUND
from railenv.envs.observation import Reading
from railenv.errors import ParameterError, shown

Array = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]


class Controller(ABC):
    """A yaw-damping controller, one for one vehicle or for many side by side.

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
            As the environment gives it.

        Returns
        -------
        ndarray, shape (n_actuators,) or (count, n_actuators)
            Commanded moments as shares of the limit.
        """

    @property
    def name(self) -> str:
        """What to call it in tables and plots."""
        return type(self).__name__

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to a file from which :func:`agents.load` gives back its equal.

        Raises
        ------
        ParameterError
            If its class does not say how.
        """
        raise ParameterError(f"{type(self).__name__} does not say how it is saved")


def check_labels(readings: Sequence[Reading], commands: Sequence[str]) -> None:
    """Raise ParameterError unless readings and commands are what a controller can have."""
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
        Vehicles side by side that the controller was reset for; None for one.
    width : int
        Entries of an observation.

    Raises
    ------
    ParameterError
        If it has another shape, or an entry is not finite.
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


def equipped(model: Bogie | DualWheelset | Equipped) -> Equipped:
    """Return a vehicle with actuators and sensors: its own, or the default ones.

    Raises
    ------
    ParameterError
        If the model can carry none, or has no actuators.
    """
    if isinstance(model, Bogie):
        return Equipped(model, "secondary")
    if isinstance(model, DualWheelset):
        return Equipped(model, "primary")
    if not isinstance(model, Equipped):
        raise ParameterError(f"model is {model!r}; it must be a Bogie, a DualWheelset or Equipped")
    if model.place == "none":
        raise ParameterError("the vehicle has no actuators; place must be 'secondary' or 'primary'")
    return model
