"""Whether a reading is steady at one speed and hunts at another: by eigenvalues, and by simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import railenv
from benchmarks.readings.equilibria import equilibria
from design.reproduction.computations import KEPT
from railenv.batch import Batch

Array = NDArray[np.float64]

HUNTING = 1e-3
"""m, half the peak to peak from which a motion counts as hunting; as in the report."""

STEP = 1e-3
"""s, of the Runge-Kutta steps."""

DURATION, WINDOW = 5.0, 1.0
"""s: simulated, as in the paper; and looked at, at the end and before half the time."""

_EVERY = 4  # steps from one look at the extremes to the next
_AT_ONCE = 4000  # models, for the memory of their Jacobians
_MARGIN = 1e-6  # 1/s, of growth rates


# --------------------------------------------------------------------------- eigenvalues


def by_eigenvalues(
    models: Sequence[railenv.Model], speed: float, curvature: float, cant: Sequence[float]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell which models have a stable equilibrium at a speed, and which one that is lost to hunting.

    Hunting is an unstable pair of complex eigenvalues. Equilibria on the tread and on either flange
    count alike, so that a model can do both.
    """
    steady = np.zeros(len(models), dtype=bool)
    hunts = steady.copy()
    for first in range(0, len(models), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        places, jacobians = equilibria(models[part], speed, curvature, cant[part])
        found = np.isfinite(places).all(axis=-1)
        poles = np.linalg.eigvals(jacobians[found])
        unstable = poles.real > _MARGIN
        stable = np.zeros(found.shape, dtype=bool)
        swings = stable.copy()
        stable[found] = ~unstable.any(axis=-1)
        swings[found] = (unstable & (np.abs(poles.imag) > _MARGIN)).any(axis=-1)
        steady[part], hunts[part] = stable.any(axis=-1), swings.any(axis=-1)
    return steady, hunts


# ---------------------------------------------------------------------------- simulation


def by_simulation(
    models: Sequence[railenv.Model], speed: float, curvature: float, cant: Sequence[float]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell of which models a simulation from zero ends at rest, and of which in hunting.

    Hunting is an amplitude of the leading wheelset that does not decay, of 1 mm or more. A wheelset
    that leaves two flange clearances does neither.
    """
    conditions = np.array([[speed, curvature, c] for c in cant])
    steady, hunts = np.zeros((2, len(models)), dtype=bool)
    middle = _half(models, conditions, np.zeros((len(models), models[0].n_states)))
    if not middle.kept.size:
        return steady, hunts
    kept = middle.kept
    end = _half([models[i] for i in kept], conditions[kept], middle.states)
    swings = (end.size > HUNTING) & (end.size > KEPT * middle.size[end.kept])
    steady[kept[end.kept[~swings]]] = hunts[kept[end.kept[swings]]] = True
    return steady, hunts


class _Run(NamedTuple):
    """What is left of a batch after half the time: on the track, with finite states."""

    kept: NDArray[np.intp]
    size: Array
    states: Array


def _half(models: Sequence[railenv.Model], conditions: Array, states: Array) -> _Run:
    """Integrate over half the time; the amplitude is that within the window at its end."""
    batch = Batch(models)
    batch.conditions, batch.states = conditions, states
    batch.integrate(step=STEP, steps=round((DURATION / 2.0 - WINDOW) / STEP))
    low, high = _extremes(batch)
    limit = 2.0 * models[0].parameters["flange_clearance"]
    with np.errstate(invalid="ignore"):  # where lost
        inside = np.maximum(np.abs(low), np.abs(high)) < limit
    found = np.asarray(batch.states, dtype=float)
    kept = np.flatnonzero(inside & np.isfinite(found).all(axis=1))
    return _Run(kept, (high - low)[kept] / 2.0, found[kept])


def _extremes(batch: Batch) -> tuple[Array, Array]:
    """Integrate over the window; return lowest and highest lateral place of the leading wheelset."""
    y = np.asarray(batch.states[:, 0], dtype=float)
    low, high = y.copy(), y.copy()
    for _ in range(round(WINDOW / STEP) // _EVERY):
        batch.integrate(step=STEP, steps=_EVERY)
        y = np.asarray(batch.states[:, 0], dtype=float)
        low, high = np.minimum(low, y), np.maximum(high, y)
    return low, high
