"""What a controller is: it is started, reads observations and gives actions.

The observations and actions are those of the environments. A controller of one's own is a class with
two methods, ``reset`` and ``act``; everything that the package ships can also be linearised (it is a
:class:`design.Feedback`), saved and loaded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from railenv import Bogie, DualWheelset, Equipped
from railenv.errors import ParameterError

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
