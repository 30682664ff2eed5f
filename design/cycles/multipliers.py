"""Floquet multipliers: their computation for a motion, and their changes along a branch."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from design.cycles.cycle import Cycle
from design.cycles.periodic import PeriodicProblem, Solution
from design.cycles.shooting import Shooting

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

REAL = 1e-6
"""Imaginary parts below this count as zero."""

_MIRRORED = 1e-3  # of the amplitude
_DISTINCT = 1e-2  # from the trivial multiplier


def floquet(problem: PeriodicProblem, found: Solution) -> tuple[Complex, float]:
    """Return the multipliers without the trivial ones, the largest first, and the latter's error.

    The direction of motion (of each uncoupled part) is split off by an orthogonal change of
    coordinates, so that a multiplier which passes 1 at a fold is never taken for the trivial one.
    """
    n = problem.n
    scale = found.scale[:n]
    slope = problem.shooting.slope(found.z[:n], float(found.z[n + 1])) / scale
    scaled = found.monodromy * scale / scale[:, None]
    directions = _directions(slope, problem.parts)
    _, turned = _turned(scaled, directions)
    k = len(problem.parts)
    multipliers = np.linalg.eigvals(turned[k:, k:]).astype(complex)
    error = float(np.linalg.norm(scaled @ directions - directions, axis=0).max())
    return multipliers[np.argsort(-np.abs(multipliers), kind="stable")], error


def _directions(slope: Array, parts: tuple[NDArray[np.intp], ...]) -> Array:
    """Return the direction of motion of each uncoupled part."""
    directions = np.zeros((len(slope), len(parts)))
    for column, part in zip(directions.T, parts, strict=True):
        column[part] = slope[part] / np.linalg.norm(slope[part])
    return directions


def _turned(monodromy: Array, directions: Array) -> tuple[Array, Array]:
    """Return an orthogonal basis that begins with the directions, and the monodromy matrix in it."""
    basis, _ = np.linalg.qr(directions, mode="complete")
    return basis, basis.T @ monodromy @ basis


def direction_of(shooting: Shooting, cycle: Cycle, multiplier: complex) -> Complex:
    """Return the eigenvector of the multiplier nearest to a given one, at the start of a motion.

    For the multiplier 1 of a branch point it is the part across the direction of motion.
    """
    n, scale = shooting.n, cycle.scale[: shooting.n]
    shot = shooting.shoot(cycle.states[0], cycle.period, cycle.value)
    scaled = shot.derivatives[:, :n] * scale / scale[:, None]
    parts = shooting.parts(cycle.states)
    slope = shooting.slope(cycle.states[0], cycle.value) / scale
    basis, turned = _turned(scaled, _directions(slope, parts))
    k = len(parts)
    values, vectors = np.linalg.eig(turned[k:, k:])
    i = int(np.argmin(np.abs(values - multiplier)))
    across = vectors[:, i].astype(complex)
    along = np.zeros(k, dtype=complex)
    if abs(values[i] - 1.0) > _DISTINCT:
        along = turned[:k, k:] @ across / (values[i] - 1.0)
    return np.asarray(basis @ np.concatenate([along, across]) * scale)


def nearest_one(cycle: Cycle) -> float:
    """Return the real multiplier nearest to 1, or infinity if there is none."""
    real = cycle.multipliers[np.abs(cycle.multipliers.imag) < REAL].real
    return float(real[np.argmin(np.abs(real - 1.0))]) if real.size else math.inf


def mirrored(cycle: Cycle) -> bool:
    """Return whether every state repeats itself, or its negative, after half a period."""
    half = (len(cycle.states) - 1) / 2.0
    at = np.arange(len(cycle.states))
    size = cycle.amplitudes + 1e-9 * np.abs(cycle.states).max()
    for name in range(cycle.states.shape[1]):
        column = cycle.states[:, name]
        later = np.interp((at + half) % (len(at) - 1), at, column)
        difference = min(np.abs(later - column).max(), np.abs(later + column).max())
        if difference > _MIRRORED * size[name] and size[name] > _MIRRORED * cycle.scale[name]:
            return False
    return True


def off_positive(cycle: Cycle) -> Complex:
    """Return the multipliers that are not real and positive."""
    mu = cycle.multipliers
    return mu[(np.abs(mu.imag) >= REAL) | (mu.real < 0.0)]


def outside(multipliers: Complex) -> int:
    """Return the number of multipliers outside the unit circle."""
    return int(np.count_nonzero(np.abs(multipliers) > 1.0))


def log_modulus(cycle: Cycle, k: int) -> float:
    """Return the logarithm of the modulus of the k-th multiplier that is not real and positive."""
    off = off_positive(cycle)
    return math.log(max(float(np.abs(off[k])), 1e-300)) if off.size > k else -1.0
