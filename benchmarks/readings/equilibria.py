"""Equilibria of many readings: Newton's method with a line search, compiled round the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

import railenv
from railenv.threads import one_blas_thread, usable_threads

Array = NDArray[np.float64]

SIDES = (0.0, 1.0, -1.0)
"""Where wheelsets start, in flange clearances: on the tread, and on either flange."""

_STEPS = 40  # of Newton's method
_HALVINGS = 10
_SMALL = 1e-10  # m and rad, a step that ends it
_RESIDUAL = 1e-6  # m/s^2 and rad/s^2 of an equilibrium


def equilibria(
    models: Sequence[railenv.Model], speed: float, curvature: float, cant: Sequence[float]
) -> tuple[Array, Array]:
    """Find the equilibria of readings from every start.

    Returns
    -------
    places : ndarray, shape (n_models, n_starts, n_coordinates)
        NaN where none is found.
    jacobians : ndarray, shape (n_models, n_starts, n_states, n_states)
    """
    kernels = models[0].kernels()
    layout = kernels.LAYOUT
    n = models[0].n_states // 2
    buffers = np.zeros((len(models), layout.rows))
    for row, model, angle in zip(buffers, models, cant, strict=True):
        row[layout.c : layout.p] = speed, curvature, angle
        row[layout.p : layout.dx] = model.rows()[0]
    cells = np.ascontiguousarray(np.array(kernels.CELLS, dtype=np.int64).reshape(-1, 2).T)
    wheels = [i for i, name in enumerate(models[0].state_names[:n]) if name.startswith("y_w")]
    starts = np.zeros((len(SIDES), n))
    starts[:, wheels] = np.outer(SIDES, models[0].parameters["flange_clearance"])
    places = np.empty((len(models), len(SIDES), n))
    jacobians = np.empty((len(models), len(SIDES), 2 * n, 2 * n))
    columns = 2 * n + models[0].n_inputs + 3

    def some(part: slice) -> None:
        _search(
            kernels.rhs,
            kernels.dense_jacobian,
            buffers[part],
            (layout.x, layout.dx),
            cells,
            columns,
            starts,
            places[part],
            jacobians[part],
        )

    count = usable_threads()
    edges = np.linspace(0, len(models), count + 1).astype(int)
    with one_blas_thread(), ThreadPoolExecutor(count) as threads:
        list(threads.map(some, (slice(a, b) for a, b in pairwise(edges))))
    return places, jacobians


@numba.njit(nogil=True)
def _search(
    rhs: Any,
    jacobian: Any,
    buffers: Array,
    layout: tuple[int, int],
    cells: NDArray[np.int64],
    columns: int,
    starts: Array,
    places: Array,
    jacobians: Array,
) -> None:
    """Fill in ``places`` and ``jacobians`` for every buffer and start."""
    n = starts.shape[1]
    x, dx = layout[0], layout[1] + n  # coordinates, and the rates of their rates
    full = np.zeros((2 * n, columns))
    for i in range(len(buffers)):
        w = buffers[i]
        w[x + n : x + 2 * n] = 0.0
        for k in range(len(starts)):
            place = starts[k].copy()
            w[x : x + n] = place
            rhs(w, None)
            residual = w[dx : dx + n].copy()
            size = np.abs(residual).max()
            for _ in range(_STEPS):
                w[x : x + n] = place
                full[:] = 0.0
                jacobian(w, None, cells[0], cells[1], full)
                matrix = np.ascontiguousarray(full[n:, :n])
                if not np.isfinite(matrix).all() or np.linalg.det(matrix) == 0.0:
                    break
                step = np.linalg.solve(matrix, -residual)
                share = 1.0
                for _ in range(_HALVINGS):
                    w[x : x + n] = place + share * step
                    rhs(w, None)
                    if np.abs(w[dx : dx + n]).max() < size:
                        break
                    share *= 0.5
                place = place + share * step
                w[x : x + n] = place
                rhs(w, None)
                residual = w[dx : dx + n].copy()
                size = np.abs(residual).max()
                if not np.isfinite(size) or np.abs(share * step).max() < _SMALL:
                    break
            if size < _RESIDUAL:
                places[i, k] = place
                w[x : x + n] = place
                full[:] = 0.0
                jacobian(w, None, cells[0], cells[1], full)
                jacobians[i, k] = full[:, : 2 * n]
            else:
                places[i, k] = np.nan
                jacobians[i, k] = np.nan
