"""Features of the points of a curve, and the functions whose zeros are its special points."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from design.curves.conditions import OnLimit, Singular
from design.curves.motions import Local, Motion, Periodic
from design.curves.normal_forms import flip_coefficient, fold_coefficient, lyapunov, unit_vectors
from design.cycles.periodic import half_peak_to_peak

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_REAL = 1e-7  # of the magnitude: imaginary parts below count as none
VANISHING = "vanishing"
"""Name of the test for motions that shrink to an equilibrium."""


@dataclass(frozen=True)
class Features:
    """The features of a point of a curve.

    Attributes
    ----------
    critical : complex
        The critical eigenvalue (1/s) or multiplier.
    spectrum : ndarray of complex
        All eigenvalues (1/s), or all multipliers except the trivial one.
    coefficient : float or None
        Coefficient of the normal form; see :class:`design.CurvePoint`.
    period : float or None
        s.
    amplitudes : ndarray or None, shape (n_states,)
    smooth : mapping of str to float
        Smooth functions along the curve, by the name of the point at which they are zero.
    growths : mapping of str to ndarray
        Growths of further eigenvalues, the largest first, by the name of the point where one is zero.
    error : float
        Distance of the trivial multiplier from 1.
    steps : int
        Number of time steps in a period.
    """

    critical: complex
    spectrum: Complex
    coefficient: float | None
    period: float | None = None
    amplitudes: Array | None = None
    smooth: Mapping[str, float] = field(default_factory=dict)
    growths: Mapping[str, Array] = field(default_factory=dict)
    error: float = 0.0
    steps: int = 0


# -------------------------------------------------------------------------- equilibria


def hopf_features(motion: Motion, condition: OnLimit, local: Local) -> Features:
    """Return the features of a Hopf point."""
    n = motion.n
    spectrum = _eigenvalues(local.map[:, :n])
    pair = condition.pair(local)
    rest = _without(spectrum, pair.eigenvalues)
    smooth = {"Bogdanov-Takens": pair.product}
    coefficient = None
    if pair.product > 0.0:
        coefficient = lyapunov(motion, local, math.sqrt(pair.product))
        if coefficient is not None:
            smooth["Bautin"] = coefficient
    growths = {
        "Hopf-Hopf": _falling(rest[rest.imag > 0.0].real),
        "fold-Hopf": _falling(rest[rest.imag == 0.0].real),
    }
    critical = complex(0.0, math.sqrt(max(pair.product, 0.0)))
    period = 2.0 * math.pi / critical.imag if critical.imag > 0.0 else None
    return Features(critical, spectrum, coefficient, period, None, smooth, growths)


def fold_features(motion: Motion, condition: Singular, local: Local) -> Features:
    """Return the features of a fold of equilibria."""
    n = motion.n
    spectrum = _eigenvalues(local.map[:, :n])
    rest = _without(spectrum, np.zeros(1))
    right, left = unit_vectors(condition, local)
    quadratic = fold_coefficient(motion, local, right, left)
    smooth = {"cusp": quadratic, "Bogdanov-Takens": float(left @ right)}
    growths = {"fold-Hopf": _falling(rest[rest.imag > 0.0].real)}
    return Features(0j, spectrum, quadratic, None, None, smooth, growths)


# --------------------------------------------------------------------- periodic motions


def cycle_fold_features(motion: Periodic, condition: Singular, local: Local) -> Features:
    """Return the features of a fold of periodic motions."""
    n = motion.n
    multipliers, error = _multipliers(motion, local)
    right, left = unit_vectors(condition, local)
    quadratic = fold_coefficient(motion, local, right, left)
    smooth = {
        "cusp": quadratic,
        "1:1 resonance": float(left[:n] @ right[:n]),
        VANISHING: _heading(motion, local),
    }
    negative, _, pairs = _classes(_without(multipliers, np.ones(1)))
    growths = {"fold-flip": negative, "fold-torus": pairs}
    return _periodic(motion, local, 1.0 + 0j, multipliers, quadratic, smooth, growths, error)


def flip_features(motion: Periodic, condition: Singular, local: Local) -> Features:
    """Return the features of a period doubling, or of a symmetry breaking."""
    multipliers, error = _multipliers(motion, local)
    right, left = unit_vectors(condition, local)
    cube = flip_coefficient(motion, local, right, left)
    _, positive, pairs = _classes(_without(multipliers, -np.ones(1)))
    meeting = float(left @ right)
    smooth = {VANISHING: _heading(motion, local)}
    if motion.signs is None:
        degenerate = "degenerate period doubling"
        smooth["1:2 resonance"] = meeting
        growths = {"fold-flip": positive, "flip-torus": pairs}
        critical = -1.0 + 0j
    else:
        degenerate = "degenerate symmetry breaking"
        smooth["1:1 resonance"] = meeting
        growths = {"fold and symmetry breaking": positive, "torus and symmetry breaking": pairs}
        critical, multipliers = 1.0 + 0j, multipliers**2
    if cube is not None:
        smooth[degenerate] = cube
    return _periodic(motion, local, critical, multipliers, cube, smooth, growths, error)


def torus_features(motion: Periodic, condition: OnLimit, local: Local) -> Features:
    """Return the features of a torus point."""
    multipliers, error = _multipliers(motion, local)
    pair = condition.pair(local)
    negative, positive, pairs = _classes(_without(multipliers, pair.eigenvalues))
    smooth = {
        "1:1 resonance": 2.0 - pair.sum,
        "1:2 resonance": 2.0 + pair.sum,
        "1:3 resonance": 1.0 + pair.sum,
        "1:4 resonance": pair.sum,
        VANISHING: _heading(motion, local),
    }
    growths = {"fold-torus": positive, "flip-torus": negative, "double torus": pairs}
    critical = max(pair.eigenvalues, key=lambda v: float(v.imag))
    return _periodic(motion, local, complex(critical), multipliers, None, smooth, growths, error)


def _periodic(
    motion: Periodic,
    local: Local,
    critical: complex,
    multipliers: Complex,
    coefficient: float | None,
    smooth: Mapping[str, float],
    growths: Mapping[str, Array],
    error: float,
) -> Features:
    amplitudes = half_peak_to_peak(motion.states)
    period = float(local.z[motion.n])
    steps = len(motion.states) - 1
    return Features(
        critical, multipliers, coefficient, period, amplitudes, smooth, growths, error, steps
    )


def _multipliers(motion: Periodic, local: Local) -> tuple[Complex, float]:
    """Return the multipliers without the trivial one, and the latter's error."""
    n = motion.n
    slope = motion.slope(local)
    direction = (slope / np.linalg.norm(slope))[:, None]
    basis, _ = np.linalg.qr(direction, mode="complete")
    map_ = local.map[:, :n]
    found = _eigenvalues((basis.T @ map_ @ basis)[1:, 1:])
    return found, float(np.linalg.norm(map_ @ direction - direction))


def _heading(motion: Periodic, local: Local) -> float:
    """Return the motion's slope in the direction of the reference, whose sign changes at rest."""
    return float(local.phase @ motion.slope(local))


# ------------------------------------------------------------------------------ spectra


def _eigenvalues(A: Array) -> Complex:
    """Return eigenvalues, the largest first, with imaginary rounding errors set to zero."""
    values = np.linalg.eigvals(A).astype(complex)
    real = np.abs(values.imag) < _REAL * np.abs(values)
    values = np.where(real, values.real, values)
    return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])


def _without(values: Complex, removed: NDArray[np.generic]) -> Complex:
    """Return eigenvalues without those nearest to given ones."""
    for v in removed:
        values = np.delete(values, int(np.argmin(np.abs(values - v))))
    return values


def _falling(growths: Array) -> Array:
    return np.sort(growths)[::-1]


def _classes(multipliers: Complex) -> tuple[Array, Array, Array]:
    """Return the growths of negative, positive and complex multipliers."""
    log = np.log(np.maximum(np.abs(multipliers), 1e-300))
    real = multipliers.imag == 0.0
    return (
        _falling(log[real & (multipliers.real < 0.0)]),
        _falling(log[real & (multipliers.real >= 0.0)]),
        _falling(log[multipliers.imag > 0.0]),
    )
