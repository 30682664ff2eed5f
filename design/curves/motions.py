"""The motions on curves: equilibria and periodic motions, with two parameters as further unknowns.

All unknowns are scaled: a state, a period or a parameter divided by its unit of arclength. In them all
second derivatives along a direction come from a difference of exact first ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from design.curves.bordering import NoPoint
from design.curves.plane import Plane
from design.cycles.periodic import half_peak_to_peak
from design.cycles.shooting import Shooting

Array = NDArray[np.float64]

_RELATIVE_UNIT = 0.1  # of an equilibrium's state
_PERIOD_UNIT = 0.5  # of the period
_HALVINGS = 3  # of the time steps, when no step succeeds
_COARSE = 1.25  # times the first step in time, above which a period gets more steps
DIFFERENCE = 1e-4
"""Length of the differences of first derivatives, in units of arclength."""


@dataclass(frozen=True)
class Local:
    """The equations of a motion and their derivatives about a guess, in scaled unknowns.

    Attributes
    ----------
    z, scale : ndarray, shape (size,)
        Unknowns, and one unit of arclength of each.
    residual : ndarray, shape (size - 2,)
        Residual of the equations.
    rows : ndarray, shape (size - 2, size)
        Their derivatives.
    map : ndarray, shape (n_states, size)
        Derivatives of the time derivatives (equilibria), or of the end of a period.
    phase : ndarray, shape (n_states,)
        Normal of the phase condition; empty for equilibria.
    """

    z: Array
    scale: Array
    residual: Array
    rows: Array
    map: Array
    phase: Array


class Motion(Protocol):
    """Equilibria or periodic motions."""

    plane: Plane
    shooting: Shooting
    n: int
    inner: int  # unknowns besides the two parameters

    def scale(self, z: Array) -> Array:
        """Return the size of one unit of arclength near a motion."""

    def local(self, z: Array, scale: Array) -> Local:
        """Return equations and derivatives; raise NoPoint if there are none."""

    def settle(self, z: Array) -> None:
        """Refer phase and mesh to a new motion."""

    def refine(self) -> bool:
        """Integrate with more steps, if possible."""

    def displaced(self, local: Local, direction: Array, length: float) -> Array:
        """Return ``map`` at a distance along a direction, shape (inner,)."""


def second(motion: Motion, local: Local, direction: Array, length: float = DIFFERENCE) -> Array:
    """Return the second derivatives, of ``map`` along a direction, shape (n_states, size).

    Parameters
    ----------
    motion : Motion
    local : Local
    direction : ndarray, shape (inner,)
        Direction of the state, and of the period if there is one.
    length : float
        Length of the difference.
    """
    size = float(np.linalg.norm(direction))
    if size == 0.0:
        return np.zeros_like(local.map)
    unit = direction / size
    ahead, behind = (motion.displaced(local, unit, sign * length) for sign in (1.0, -1.0))
    return (ahead - behind) * (size / (2.0 * length))


class Steady:
    """Equilibria; the unknowns are the state and the two parameters."""

    def __init__(self, plane: Plane) -> None:
        self.plane = plane
        self.shooting = Shooting(plane, 1)
        self.n = self.inner = plane.model.n_states

    def scale(self, z: Array) -> Array:
        """Return the size of one unit of arclength near an equilibrium."""
        typical = self.plane.model.scale + _RELATIVE_UNIT * np.abs(z[: self.n])
        return np.concatenate([math.sqrt(self.n) * typical, self.plane.units])

    def local(self, z: Array, scale: Array) -> Local:
        """Return the time derivatives and their derivatives."""
        n = self.n
        slope = self.shooting.slope(z[:n], z[n:]) / scale[:n]
        rows = self._map(z, scale)
        if not (np.isfinite(slope).all() and np.isfinite(rows).all()):
            raise NoPoint
        return Local(z, scale, slope, rows, rows, np.zeros(0))

    def _map(self, z: Array, scale: Array) -> Array:
        n = self.n
        return self.shooting.linear(z[:n], z[n:]) * scale / scale[:n, None]

    def settle(self, z: Array) -> None:
        """Do nothing: an equilibrium has no phase."""

    def refine(self) -> bool:
        """Do nothing: an equilibrium is not integrated."""
        return False

    def displaced(self, local: Local, direction: Array, length: float) -> Array:
        """Return ``map`` at a distance along a direction, shape (inner,)."""
        z = local.z.copy()
        z[: self.inner] += length * direction * local.scale[: self.inner]
        return self._map(z, local.scale)


class Periodic:
    """Periodic motions; the unknowns are the state at the start, the period and the two parameters.

    Parameters
    ----------
    plane : Plane
    states : ndarray, shape (steps + 1, n_states)
        A motion near the first one, over one period.
    period : float
        s.
    signs : ndarray, shape (n_states,), optional
        Signs of the states for a motion that is its own mirror image half a period later. Then half a
        period is integrated and mirrored.
    """

    def __init__(self, plane: Plane, states: Array, period: float, signs: Array | None = None) -> None:
        self.plane = plane
        self.n = plane.model.n_states
        self.inner = self.n + 1
        self.signs = signs
        self.part = 1.0 if signs is None else 0.5
        self.shooting = Shooting(plane, max(1, round(self.part * (len(states) - 1))))
        self._step = self.part * period / self.shooting.steps
        self._halvings = 0
        self.states = states
        self.reference = states[0].copy()
        self.direction = self.shooting.slope(states[0], plane.start)

    def scale(self, z: Array) -> Array:
        """Return the size of one unit of arclength near the motion integrated last."""
        typical = self.plane.model.scale + half_peak_to_peak(self.states)
        states = math.sqrt(self.n) * typical
        return np.concatenate([states, [_PERIOD_UNIT * z[self.n]], self.plane.units])

    def local(self, z: Array, scale: Array) -> Local:
        """Return the errors of closure and phase, and the derivatives."""
        n = self.n
        end, derived, self.states = self._shot(z)
        closure = (end - z[:n]) / scale[:n]
        derived = derived * scale / scale[:n, None]
        phase = self.direction / scale[:n]
        phase = phase / np.linalg.norm(phase)
        missed = phase @ ((z[:n] - self.reference) / scale[:n])
        rows = np.zeros((n + 1, n + 3))
        rows[:n] = derived
        rows[:n, :n] -= np.eye(n)
        rows[n, :n] = phase
        return Local(z, scale, np.append(closure, missed), rows, derived, phase)

    def _shot(self, z: Array) -> tuple[Array, Array, Array]:
        """Return the end of the (half) period, its derivatives, and the motion over a whole period."""
        n = self.n
        if not (np.isfinite(z).all() and z[n] > 0.0):
            raise NoPoint
        shot = self.shooting.shoot(z[:n], self.part * float(z[n]), z[n + 1 :])
        if not np.isfinite(shot.derivatives).all():
            raise NoPoint
        end, derived, states = shot.states[-1], shot.derivatives, shot.states
        derived[:, n] *= self.part
        if self.signs is not None:
            end, derived = self.signs * end, self.signs[:, None] * derived
            states = np.vstack([states[:-1], self.signs * states])
        return end, derived, states

    def settle(self, z: Array) -> None:
        """Refer phase and mesh to a motion that was found."""
        n = self.n
        self.reference = z[:n].copy()
        self.direction = self.shooting.slope(z[:n], z[n + 1 :])
        needed = math.ceil(self.part * z[n] / self._step)
        if needed > _COARSE * self.shooting.steps:
            self.shooting.steps = needed

    def refine(self) -> bool:
        """Halve the time steps, up to three times; return whether they were halved."""
        if self._halvings == _HALVINGS:
            return False
        self._halvings += 1
        self._step /= 2.0
        self.shooting.steps *= 2
        return True

    def displaced(self, local: Local, direction: Array, length: float) -> Array:
        """Return ``map`` at a distance along a direction, shape (inner,)."""
        z = local.z.copy()
        z[: self.inner] += length * direction * local.scale[: self.inner]
        return self._shot(z)[1] * local.scale / local.scale[: self.n, None]

    def slope(self, local: Local) -> Array:
        """Return the direction of the motion at its start, in scaled unknowns."""
        n = self.n
        return self.shooting.slope(local.z[:n], local.z[n + 1 :]) / local.scale[:n]
