"""The boundary value problem of a periodic motion, solved by single shooting.

A period is integrated by a fixed number of Runge-Kutta steps. The unknowns are the state at its start,
its length and one parameter; Newton's method uses the exact derivatives of these steps
(``rk4_sensitivity`` of the kernels), so it converges quadratically and the Floquet multipliers
belong to the motion that was computed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv, dgetrs

from design.cycles.shooting import Shooting, Shot
from railenv.errors import ParameterError

Array = NDArray[np.float64]
Factors = tuple[Array, NDArray[np.int32]]  # triangular factors and pivots from LAPACK

_NEWTON_TOLERANCE = 1e-7  # last correction, in units of ``scale``; the remaining error is its square
_NEWTON_STEPS = 10
_FARTHEST_CORRECTION = 30.0
_IDLE = 2  # successive corrections that do not shrink: it will not converge
_CHORD, _CHORD_STEPS = 0.05, 5  # correction below which the derivatives are kept, and how often
_CHORD_TOLERANCE, _CONTRACTION = 1e-9, 0.3
_BROYDEN_STEPS, _BROYDEN_GROWTH = 16, 4.0  # corrections with the derivatives of the previous motion
_BROYDEN_TOLERANCE = 1e-8
_PERIOD_UNIT = 0.5  # of the period


class NoCycle(Exception):
    """Newton's method does not converge to a periodic motion."""


@dataclass(frozen=True)
class Solution:
    """A periodic motion with its linearisation, for the continuation.

    Attributes
    ----------
    z : ndarray, shape (n_states + 2,)
        State at the start of the period, period (s), value of the parameter.
    tangent : ndarray, shape (n_states + 2,)
        Unit tangent of the branch, divided by ``scale``.
    scale : ndarray, shape (n_states + 2,)
        Size of one unit of arclength here.
    states : ndarray, shape (steps + 1, n_states)
        The motion over one period, at equal intervals.
    monodromy : ndarray, shape (n_states, n_states)
    newton_steps : int
    orientation : int
        Sign of the determinant of the bordered system; it changes at a branch point, not at a fold.
        0 if there is more than one phase condition.
    """

    z: Array
    tangent: Array
    scale: Array
    states: Array
    monodromy: Array
    newton_steps: int
    orientation: int


def half_peak_to_peak(states: Array) -> Array:
    """Return the amplitude of every state over a period, its peaks refined by parabolas."""
    return (_peaks(states) + _peaks(-states)) / 2.0


def _peaks(states: Array) -> Array:
    samples = states[:-1]  # the last repeats the first
    at = np.argmax(samples, axis=0)
    column = np.arange(samples.shape[1])
    before, here, after = (samples[(at + k) % len(samples), column] for k in (-1, 0, 1))
    bend = before - 2.0 * here + after
    rise = (before - after) ** 2 / np.where(bend < 0.0, -8.0 * bend, np.inf)
    return np.asarray(here + rise)


class PeriodicProblem:
    """Newton's method for periodic motions along a branch.

    Parameters
    ----------
    shooting : Shooting
    reference : ndarray, shape (steps + 1, n_states)
        A motion near the one sought, whose start fixes the phase.
    value : float
        Value of the parameter for it.
    """

    def __init__(self, shooting: Shooting, reference: Array, value: float) -> None:
        self.shooting = shooting
        self.n = shooting.n
        self.parts = shooting.parts(reference)
        self._near: Array | None = None  # derivatives of the last motion found
        self.set_reference(reference, value)
        if not self.parts:
            raise ParameterError("the motion to start from does not oscillate")

    def set_reference(self, states: Array, value: float) -> None:
        """Fix the phase of the next motions by the start of this one."""
        self._start = states[0].copy()
        self._slope = self.shooting.slope(self._start, value)

    def scale(self, amplitude: Array, period: float, value: float) -> Array:
        """Return the size of one unit of arclength near a motion.

        For a state it is the model's typical magnitude plus the amplitude (in root mean square).
        """
        setting = self.shooting.setting
        states = math.sqrt(self.n) * (setting.model.scale + amplitude)
        return np.concatenate([states, [_PERIOD_UNIT * period, setting.unit_at(value)]])

    def in_phase(self, tangent: Array, scale: Array) -> Array:
        """Return a tangent of the branch for the present phase conditions, of length 1.

        A tangent holds the phase of the previous reference. The difference is a shift along the motion,
        which does not change it, but would move the prediction away from the next motion sought.
        """
        phases = self._phases(scale)
        held = tangent.copy()
        held[: self.n] -= phases.T @ (phases @ tangent[: self.n])
        return np.asarray(held / np.linalg.norm(held))

    def improved(self, guess: Array, normal: Array, scale: Array) -> Array:
        """Correct a guess by Broyden's method from the derivatives of the last motion found.

        It integrates no derivatives, so that a correction costs a twentieth of one of :meth:`solve`,
        which then has little left to do. Parameters are those of :meth:`solve`; the guess itself is
        returned if the method does not converge.
        """
        if self._near is None or len(self.parts) > 1:
            return guess
        plane, z = (guess, normal, scale), guess
        try:
            right = self._missed(z, plane)
            start, factors = _solved(self._bordered(self._near, scale, normal), right)
        except NoCycle:
            return guess
        assert factors is not None
        steps, last = [-start], math.inf
        for _ in range(_BROYDEN_STEPS):
            size = float(np.abs(steps[-1]).max())
            if not size < _BROYDEN_GROWTH * last:
                return guess
            z, last = z + steps[-1] * scale, size
            if size < _BROYDEN_TOLERANCE:
                return z
            right = self._missed(z, plane)
            if not np.isfinite(right).all():
                return guess
            change, _ = dgetrs(*factors, -right)
            for before, after in pairwise(steps):
                change = change + after * (before @ change) / (before @ before)
            steps.append(change / (1.0 - (steps[-1] @ change) / (steps[-1] @ steps[-1])))
        return guess

    def _missed(self, z: Array, plane: tuple[Array, Array, Array]) -> Array:
        """Return the residual of a motion integrated without derivatives."""
        end = self.shooting.end(z[: self.n], float(z[self.n]), float(z[self.n + 1]))
        return self._residual(end, z, *plane)

    def solve(self, guess: Array, normal: Array, scale: Array) -> Solution:
        """Find the periodic motion in the hyperplane through ``guess`` with a normal.

        Parameters
        ----------
        guess, normal, scale : ndarray, shape (n_states + 2,)
            As in Solution; the tangent found points to the side of ``normal``.

        Raises
        ------
        NoCycle
            If Newton's method does not converge.
        """
        n, z = self.n, guess.copy()
        right = np.zeros((n + 1 + len(self.parts), 2))
        right[-1, 1] = 1.0  # the second solution is the tangent
        smallest, idle = math.inf, 0
        for steps in range(1, _NEWTON_STEPS + 1):
            if not (z[n] > 0.0 and np.isfinite(z).all()):
                raise NoCycle
            shot = self.shooting.shoot(z[:n], float(z[n]), float(z[n + 1]))
            matrix = self._bordered(shot.derivatives, scale, normal)
            right[:, 0] = self._residual(shot.states[-1], z, guess, normal, scale)
            if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
                raise NoCycle
            solution, factors = _solved(matrix, right)
            change = solution[:, 0]
            size = float(np.abs(change).max())
            smallest, idle = (size, 0) if size < smallest else (smallest, idle + 1)
            if not size < _FARTHEST_CORRECTION or idle == _IDLE:
                raise NoCycle
            z = z - change * scale
            if size < _NEWTON_TOLERANCE:
                return self._solution(z, solution[:, 1], scale, shot, (steps, _orientation(factors)))
            if size < _CHORD and factors is not None:
                z = self._refined(z, factors, (guess, normal, scale))
        raise NoCycle

    def _refined(self, z: Array, factors: Factors, plane: tuple[Array, Array, Array]) -> Array:
        """Correct further with the present derivatives: steps without new ones cost little."""
        last = math.inf
        for _ in range(_CHORD_STEPS):
            right = self._missed(z, plane)
            if not np.isfinite(right).all():
                return z
            change, _ = dgetrs(*factors, right)
            size = float(np.abs(change).max())
            if not size < _CONTRACTION * last:
                return z
            z, last = z - change * plane[2], size
            if size < _CHORD_TOLERANCE:
                return z
        return z

    def _residual(self, end: Array, z: Array, guess: Array, normal: Array, scale: Array) -> Array:
        """Return the errors of closure, phase and arclength, in units of ``scale``."""
        n = self.n
        closure = (end - z[:n]) / scale[:n]
        phases = self._phases(scale) @ ((z[:n] - self._start) / scale[:n])
        return np.concatenate([closure, phases, [normal @ ((z - guess) / scale)]])

    def _phases(self, scale: Array) -> Array:
        """Return the normals of the phase conditions, one for each oscillating part."""
        rows = np.zeros((len(self.parts), self.n))
        for row, part in zip(rows, self.parts, strict=True):
            row[part] = self._slope[part] / scale[part]
            row /= np.linalg.norm(row)
        return rows

    def _bordered(self, derivatives: Array, scale: Array, normal: Array) -> Array:
        n = self.n
        matrix = np.zeros((n + 1 + len(self.parts), n + 2))
        matrix[:n] = derivatives
        matrix[:n, :n] -= np.eye(n)
        matrix[:n] *= scale
        matrix[:n] /= scale[:n, None]
        matrix[n:-1, :n] = self._phases(scale)
        matrix[-1] = normal
        return matrix

    def _solution(
        self, z: Array, along: Array, scale: Array, shot: Shot, found: tuple[int, int]
    ) -> Solution:
        self._near = shot.derivatives
        shot.states[[0, -1]] = z[: self.n]  # the last correction, too small for another integration
        amplitude = half_peak_to_peak(shot.states)
        here = self.scale(amplitude, float(z[self.n]), float(z[self.n + 1]))
        tangent = along * scale / here
        tangent /= np.linalg.norm(tangent)
        return Solution(z, tangent, here, shot.states, shot.derivatives[:, : self.n].copy(), *found)


def _solved(matrix: Array, right: Array) -> tuple[Array, Factors | None]:
    """Solve a square system, or one with more (consistent) phase conditions by least squares.

    Return the solution and the factors of the matrix (None for least squares).
    """
    if matrix.shape[0] > matrix.shape[1]:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0]), None
    factors, pivots, solution, singular = dgesv(matrix, right)
    if singular:
        raise NoCycle
    return np.asarray(solution), (factors, pivots)


def _orientation(factors: Factors | None) -> int:
    """Return the sign of the determinant from the factors of a matrix, 0 without them."""
    if factors is None:
        return 0
    triangle, pivots = factors
    swaps = np.count_nonzero(pivots != np.arange(len(pivots)))
    negative = np.count_nonzero(np.diag(triangle) < 0.0)
    return -1 if (swaps + negative) % 2 else 1
