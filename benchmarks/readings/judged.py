"""Whether a reading is steady at one speed and hunts at another: by eigenvalues, and by simulation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import railenv
from benchmarks.readings.equilibria import equilibria
from design.reproduction.computations import KEPT
from railenv.batch import Batch

Array = NDArray[np.float64]
Kept = NDArray[np.intp]

HUNTING = 1e-3
"""m, half the peak to peak from which a motion counts as hunting; as in the report."""

STEP = 1e-3
"""s, of the Runge-Kutta steps."""

DURATION, WINDOW = 5.0, 1.0
"""s: simulated, as in the paper; and looked at, at the end and at half the time."""

_STRETCHES = (250, 250, 500, 500)  # steps before a window, after each of which the lost are left out
_EVERY = 4  # steps from one look at the extremes to the next
_AT_ONCE = 4000  # models, for the memory of their Jacobians
_MARGIN = 1e-6  # 1/s, of growth rates


# --------------------------------------------------------------------------- eigenvalues


def by_eigenvalues(
    models: Sequence[railenv.Model], speed: float, curvature: float, cant: Sequence[float]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell which models have a stable equilibrium at a speed, and which have lost theirs to hunting.

    Equilibria on the tread and on either flange count alike. Hunting is an unstable pair of complex
    eigenvalues where none of them is stable. What lies beyond two flange clearances does not count.
    """
    steady = np.zeros(len(models), dtype=bool)
    hunts = steady.copy()
    for first in range(0, len(models), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        places, jacobians = equilibria(models[part], speed, curvature, cant[part])
        found = np.isfinite(places).all(axis=-1) & _inside(places[..., 0], models[0])
        poles = np.linalg.eigvals(jacobians[found])
        unstable = poles.real > _MARGIN
        stable = np.zeros(found.shape, dtype=bool)
        swings = stable.copy()
        stable[found] = ~unstable.any(axis=-1)
        swings[found] = (unstable & (np.abs(poles.imag) > _MARGIN)).any(axis=-1)
        steady[part] = stable.any(axis=-1)
        hunts[part] = swings.any(axis=-1) & ~steady[part]
    return steady, hunts


# ---------------------------------------------------------------------------- simulation


def by_simulation(
    models: Sequence[railenv.Model], speed: float, curvature: float, cant: Sequence[float]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell of which models a simulation from zero ends at rest, and of which in hunting.

    Hunting is an amplitude of the leading wheelset that does not decay, of 1 mm or more. A wheelset
    that leaves two flange clearances does neither.
    """
    n = len(models)
    steady, hunts = np.zeros((2, n), dtype=bool)
    conditions = np.array([[speed, curvature, c] for c in cant])
    states = np.zeros((n, models[0].n_states))
    kept, size = np.arange(n), np.zeros((2, n))
    for k in range(2):
        for steps in _STRETCHES:
            kept = _run(models, conditions, states, kept, steps)
        kept, low, high = _look(models, conditions, states, kept)
        size[k, kept] = (high - low) / 2.0
    swings = (size[1, kept] > HUNTING) & (size[1, kept] > KEPT * size[0, kept])
    steady[kept[~swings]] = hunts[kept[swings]] = True
    return steady, hunts


def _run(
    models: Sequence[railenv.Model], conditions: Array, states: Array, kept: Kept, steps: int
) -> Kept:
    """Advance the states of those models that are kept; return which are still on the track."""
    if not kept.size:
        return kept
    batch = _batch(models, conditions, states, kept)
    batch.integrate(step=STEP, steps=steps)
    states[kept] = batch.states
    whole = np.isfinite(states[kept]).all(axis=1)
    return kept[whole & _inside(states[kept, 0], models[0])]


def _look(
    models: Sequence[railenv.Model], conditions: Array, states: Array, kept: Kept
) -> tuple[Kept, Array, Array]:
    """Advance them over the window, with lowest and highest lateral place of the leading wheelset."""
    if not kept.size:
        return kept, np.zeros(0), np.zeros(0)
    batch = _batch(models, conditions, states, kept)
    y = states[kept, 0]
    low, high = y.copy(), y.copy()
    for _ in range(round(WINDOW / STEP) // _EVERY):
        batch.integrate(step=STEP, steps=_EVERY)
        y = np.asarray(batch.states[:, 0], dtype=float)
        low, high = np.minimum(low, y), np.maximum(high, y)
    states[kept] = batch.states
    inside = np.isfinite(states[kept]).all(axis=1)
    inside &= _inside(low, models[0]) & _inside(high, models[0])
    return kept[inside], low[inside], high[inside]


def _batch(models: Sequence[railenv.Model], conditions: Array, states: Array, kept: Kept) -> Batch:
    batch = Batch([models[i] for i in kept])
    batch.conditions, batch.states = conditions[kept], states[kept]
    return batch


def _inside(y: Array, model: railenv.Model) -> NDArray[np.bool_]:
    """Tell which displacements are finite and within two flange clearances."""
    with np.errstate(invalid="ignore"):
        return np.abs(y) < 2.0 * model.parameters["flange_clearance"]
