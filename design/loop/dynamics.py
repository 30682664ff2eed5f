"""Linear dynamics at an equilibrium: of the vehicle alone, or under a sampled controller."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from design.loop.sampled import SampledDynamics
from railenv.equilibrium import Point
from railenv.errors import ParameterError
from railenv.models import Model

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Conditions = tuple[float, float, float]
"""Speed (m/s), curvature (1/m), cant (rad)."""


class Dynamics(Protocol):
    """Linear dynamics at the points of a branch of a vehicle's equilibria."""

    @property
    def period(self) -> float | None:
        """Return the control period, s; None for a vehicle alone."""

    def matrix_at(self, point: Point, conditions: Conditions) -> Array:
        """Return the matrix of the linear system: of its rates, or of its map over a period."""

    def eigenvalues(self, point: Point, conditions: Conditions) -> Complex:
        """Return the eigenvalues, 1/s."""

    def modes(self, point: Point, conditions: Conditions) -> tuple[Complex, Complex]:
        """Return eigenvalues (1/s) and eigenvectors, whose first entries are the vehicle's states."""


class OpenLoop:
    """A vehicle without a controller, in continuous time."""

    period: float | None = None

    def matrix_at(self, point: Point, conditions: Conditions) -> Array:
        """Return the vehicle's Jacobian with respect to its states."""
        return point.jacobian[:, : len(point.state)]

    def eigenvalues(self, point: Point, conditions: Conditions) -> Complex:
        """Return the eigenvalues of the vehicle's Jacobian, 1/s."""
        return np.linalg.eigvals(self.matrix_at(point, conditions)).astype(complex)

    def modes(self, point: Point, conditions: Conditions) -> tuple[Complex, Complex]:
        """Return the eigenvalues (1/s) and eigenvectors of the vehicle's Jacobian."""
        values, vectors = np.linalg.eig(self.matrix_at(point, conditions))
        return values.astype(complex), vectors.astype(complex)


def dynamics(model: Model, controller: Any | None, period: float | None, memory: int = 0) -> Dynamics:
    """Return the dynamics of a model, alone (controller None) or sampled under a controller.

    ``memory`` is the least number of periods for which commands are states of the sampled map.

    Raises
    ------
    ParameterError
        If a period is given without a controller, or the controller does not fit the model.
    """
    if controller is None:
        if period is not None:
            raise ParameterError(
                f"period is {period!r} s without a controller; give one, or leave it out"
            )
        return OpenLoop()
    return SampledDynamics(model, controller, period=period, memory=memory)
