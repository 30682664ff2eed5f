"""Coefficients of normal forms along curves and at their special points, in scaled unknowns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from design.curves.bordering import NoPoint, bordered
from design.curves.conditions import Singular
from design.curves.motions import Local, Motion, Periodic, second
from design.cycles.lyapunov import lyapunov_coefficient

Array = NDArray[np.float64]

_THIRD = 5e-4  # length of the differences of third derivatives, units of arclength
_SAME = 0.02  # of third derivatives: allowed difference between two lengths
_NOTHING = 1e-4  # of first derivatives: third ones below this are zero


def lyapunov(motion: Motion, local: Local, omega: float) -> float | None:
    """Return the first Lyapunov coefficient of a Hopf point, if it exists."""
    n, z = motion.n, local.z
    A = motion.shooting.linear(z[:n], z[n:])[:, :n]
    values, vectors = np.linalg.eig(A)
    mode = vectors[:, np.argmin(np.abs(values - 1j * omega))]
    mode = mode / float(np.abs(mode / motion.plane.model.scale).max())

    def jacobian(displacement: Array) -> Array:
        return motion.shooting.linear(z[:n] + displacement, z[n:])[:, :n]

    return lyapunov_coefficient(jacobian, np.asarray(mode, dtype=complex), omega)[0]


def unit_vectors(condition: Singular, local: Local) -> tuple[Array, Array]:
    """Return right and left null vectors of length 1, whose signs do not change along a curve."""
    found = condition.solved(local)
    return found.right / np.linalg.norm(found.right), found.left / np.linalg.norm(found.left)


def fold_coefficient(motion: Motion, local: Local, right: Array, left: Array) -> float:
    """Return the coefficient of the square in the normal form of a fold; zero at a cusp."""
    bent = second(motion, local, right)[:, : motion.inner]
    return float(left[: motion.n] @ bent @ right) / 2.0


def cusp_coefficient(motion: Motion, condition: Singular, local: Local) -> float:
    """Return the coefficient c of v' = b1 + b2 v + c v^3, or of v -> v + b1 + b2 v + c v^3, at a cusp.

    Kuznetsov, *Elements of Applied Bifurcation Theory*, section 8.2.
    """
    n = motion.n
    right, left = unit_vectors(condition, local)
    A = condition.matrix(local)
    matrix = np.block([[A, left[:, None]], [right, 0.0]])
    square = second(motion, local, right)[:, : motion.inner]
    cube = _cube(motion, local, right, _THIRD)
    rest = np.zeros(len(matrix))
    rest[:n] = -square @ right
    response = _solved(matrix, rest)[: motion.inner]
    sides = left[:n] @ right[:n]
    return float(left[:n] @ (cube / 6.0 + square @ response / 2.0) / sides)


def flip_coefficient(motion: Periodic, local: Local, right: Array, left: Array) -> float | None:
    """Return the coefficient b of the normal form v -> -v + b v^3 of a flip.

    None if differences of two lengths give different coefficients, as at kinks of the equations.

    This is Kuznetsov's formula for maps (section 5.4), on the section normal to the left null vector of
    the trivial multiplier: the return time then changes with v to second order only.
    """
    n = motion.n
    slope = motion.slope(local)
    moved = local.map[:, :n] - np.eye(n)
    section = bordered(moved, slope, slope).left
    v = np.append(right, 0.0)
    square = second(motion, local, v)[:, : n + 1]
    matrix = np.block([[moved, local.map[:, n : n + 1]], [section, 0.0]])
    response = _solved(matrix, np.append(-square @ v, 0.0))
    parts = [_cube(motion, local, v, length) / 6.0 for length in (_THIRD, _THIRD / 2.0)]
    first, last = (float(left @ (p + square @ response / 2.0) / (left @ right)) for p in parts)
    largest = max(float(np.linalg.norm(p)) for p in parts)
    allowed = _SAME * largest + _NOTHING * float(np.linalg.norm(local.map[:, :n]))
    return last if abs(first - last) * abs(left @ right) < allowed else None


def bogdanov_takens(motion: Motion, local: Local) -> tuple[float, float]:
    """Return the coefficients a and b of v'' = b1 + b2 v + a v^2 + b v v'.

    Kuznetsov, section 8.4; the sign of a b gives the stability of the periodic motions.
    """
    n = motion.n
    A = local.map[:, :n]
    u, _, vt = np.linalg.svd(A)
    q0, p1 = vt[-1], u[:, -1]
    q1, p0 = (np.linalg.lstsq(matrix, side, rcond=None)[0] for matrix, side in ((A, q0), (A.T, p1)))
    size = p1 @ q1
    p1, p0 = p1 / size, p0 / size
    q1 = q1 - q0 * (p0 @ q1)
    bent = second(motion, local, q0)[:, :n]
    a = float(p1 @ bent @ q0) / 2.0
    return a, float(p0 @ bent @ q0 + p1 @ bent @ q1)


def _cube(motion: Motion, local: Local, v: Array, length: float) -> Array:
    """Return the third derivatives, three times along a direction."""
    ahead, middle, behind = (motion.displaced(local, v, h * length) for h in (1.0, 0.0, -1.0))
    return np.asarray((ahead - 2.0 * middle + behind)[:, : motion.inner] @ v / length**2)


def _solved(matrix: Array, right: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        raise NoPoint from None
