"""The complete equations of each kind of curve."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from design.curves import features
from design.curves.conditions import Condition, OnLimit, Singular
from design.curves.features import Features
from design.curves.motions import Motion, Periodic, Steady
from design.curves.normal_forms import bogdanov_takens, cusp_coefficient
from design.curves.plane import Plane

Array = NDArray[np.float64]


class System:
    """Equations of a motion, and the condition that makes it critical.

    Parameters
    ----------
    motion : Motion
    condition : Condition
    told_by : callable
        Returns the features from the motion, the condition and the data of a point.
    """

    def __init__(
        self, motion: Motion, condition: Condition, told_by: Callable[[Any, Any, Any], Features]
    ) -> None:
        self.motion = motion
        self._condition = condition
        self._told_by = told_by

    def scale(self, z: Array) -> Array:
        """Return the size of one unit of arclength near a point."""
        return self.motion.scale(z)

    def system(self, z: Array, scale: Array) -> tuple[Array, Array]:
        """Return residual and derivatives in scaled unknowns."""
        local = self.motion.local(z, scale)
        value, row = self._condition.row(local)
        return np.append(local.residual, value), np.vstack([local.rows, row])

    def settle(self, z: Array, scale: Array) -> Array:
        """Refer phase, borders and mesh to a point; return the derivatives there."""
        self.motion.settle(z)
        self._condition.settle(self.motion.local(z, scale))
        return self.system(z, scale)[1]

    def features(self, z: Array, scale: Array) -> Features:
        """Return the features of a point."""
        return self._told_by(self.motion, self._condition, self.motion.local(z, scale))

    def numbers(self, kind: str, z: Array, scale: Array) -> dict[str, float]:
        """Return the numbers of a special point of a kind."""
        motion, condition = self.motion, self._condition
        if kind == "cusp" and isinstance(condition, Singular):
            return {"c": cusp_coefficient(motion, condition, motion.local(z, scale))}
        if kind == "Bogdanov-Takens":
            a, b = bogdanov_takens(motion, motion.local(z, scale))
            return {"a": a, "b": b}
        if kind == "Hopf-Hopf":
            return {"frequency": self.second_frequency(z, scale)}
        return {}

    def second_frequency(self, z: Array, scale: Array) -> float:
        """Return the frequency (Hz) of the second least damped pair of a Hopf point."""
        told = self.features(z, scale)
        pairs = told.spectrum[told.spectrum.imag > 0.0]
        others = np.delete(pairs, int(np.argmin(np.abs(pairs - told.critical))))
        nearest = others[np.argmin(np.abs(others.real))]
        return float(nearest.imag / (2.0 * np.pi))


def hopf_system(plane: Plane, eigenvalue: complex) -> System:
    """Return the equations of Hopf points whose pair of eigenvalues is near one."""
    motion = Steady(plane)
    return System(motion, OnLimit(motion, eigenvalue), features.hopf_features)


def equilibrium_fold_system(plane: Plane) -> System:
    """Return the equations of folds of equilibria."""
    motion = Steady(plane)
    return System(motion, Singular(motion), features.fold_features)


def cycle_fold_system(plane: Plane, states: Array, period: float) -> System:
    """Return the equations of folds of periodic motions near one."""
    motion = Periodic(plane, states, period)
    return System(motion, Singular(motion), features.cycle_fold_features)


def flip_system(plane: Plane, states: Array, period: float, signs: Array | None = None) -> System:
    """Return the equations of period doublings; with ``signs``, of symmetry breakings.

    A motion that is its own mirror image half a period later is a fixed point of half a period followed
    by the mirror. Where the symmetry breaks, the multiplier of that map is -1.
    """
    motion = Periodic(plane, states, period, signs)
    return System(motion, Singular(motion, -1), features.flip_features)


def torus_system(plane: Plane, states: Array, period: float, multiplier: complex) -> System:
    """Return the equations of torus points whose pair of multipliers is near one."""
    motion = Periodic(plane, states, period)
    return System(motion, OnLimit(motion, multiplier), features.torus_features)
