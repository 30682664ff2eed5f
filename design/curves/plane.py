"""The plane of two parameters in which a curve of bifurcations lies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.shooting import CONDITIONS, Setting
from railenv import checks
from railenv.errors import ParameterError
from railenv.models import Model

Array = NDArray[np.float64]
Range = tuple[float, float]

_UNITS = 10.0  # of arclength across the range of a parameter


@dataclass(frozen=True)
class Plane(Setting):
    """The setting of an equilibrium or a periodic motion, with two varying parameters.

    Attributes
    ----------
    model, parameter, speed, curvature, cant, inputs
        As in :class:`Setting`; ``parameter`` is the first of the two.
    second : str
        The other parameter.
    ranges : tuple of (float, float)
        Range in which a curve is followed, for each of the two.
    """

    second: str = ""
    ranges: tuple[Range, Range] = ((0.0, 0.0), (0.0, 0.0))

    @classmethod
    def of(
        cls,
        model: Model,
        parameters: Mapping[str, Range],
        conditions: tuple[float, float, float],
        inputs: Array,
    ) -> Plane:
        """Return the plane of two parameters; the model must allow its corners.

        Parameters
        ----------
        model : Model
        parameters : mapping of str to (float, float)
            The two with their ranges.
        conditions : (float, float, float)
            Speed (m/s), curvature (1/m) and cant (rad), for those that do not vary.
        inputs : ndarray, shape (n_inputs,)
        """
        given = checks.mapping("parameters", parameters)
        if len(given) != 2:
            raise ParameterError(
                f"parameters has {len(given)} entries; it must map the names of two parameters to "
                "their ranges, as {'conicity': (0.02, 0.2), 'speed': (30.0, 200.0)}"
            )
        checks.known("parameter", given, [*CONDITIONS, *model.parameters])
        first, second = given
        low, high = (_range(name, limits) for name, limits in given.items())
        plane = cls(model, first, *conditions, inputs, None, second, (low, high))
        for corner in product(low, high):
            plane.model_at(np.array(corner)).check_conditions(*plane.conditions(corner))
        return plane

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the two parameters."""
        return self.parameter, self.second

    @property
    def units(self) -> Array:
        """Change of each parameter that is one unit of arclength."""
        return np.array([(high - low) / _UNITS for low, high in self.ranges])

    @property
    def start(self) -> Array:
        """Values of the two in the model and the running conditions."""
        held = {"speed": self.speed, "curvature": self.curvature, "cant": self.cant}
        return np.array([{**self.model.parameters, **held}[name] for name in self.parameters])

    def conditions(self, value: ArrayLike) -> tuple[float, float, float]:
        """Return speed, curvature and cant at values of the two."""
        held = {"speed": self.speed, "curvature": self.curvature, "cant": self.cant}
        for name, v in zip(self.parameters, np.asarray(value, dtype=float).tolist(), strict=True):
            if name in held:
                held[name] = v
        return held["speed"], held["curvature"], held["cant"]

    def model_at(self, value: ArrayLike) -> Model:
        """Return the model at values of those of the two that are its own."""
        values = zip(self.parameters, np.asarray(value, dtype=float).tolist(), strict=True)
        own = {name: v for name, v in values if name not in CONDITIONS}
        return self.model.replace(**own) if own else self.model

    def left(self, value: Array) -> tuple[int, float] | None:
        """Return the index of a parameter outside its range, and the end that it has passed."""
        for k, (low, high) in enumerate(self.ranges):
            if not low <= value[k] <= high:
                return k, low if value[k] < low else high
        return None


def _range(name: str, limits: Range) -> Range:
    low, high = checks.interval(f"range of {name}", limits)
    if low == high:
        raise ParameterError(f"range of {name} is {limits}; the lower end must be below the higher")
    return low, high
