"""Integration of one period of a motion, with the exact derivatives of its steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.stability.mode_shape import displacement_rows
from railenv import checks
from railenv.models import Model

Array = NDArray[np.float64]

CONDITIONS = ("speed", "curvature", "cant")

STEPS_PER_PERIOD = 400
"""Least number of Runge-Kutta steps of a period."""

STEP_PER_MODE = 1.0
"""Longest step in units of 1/|eigenvalue| of the fastest mode, a third of the stable one."""

_SPEED_UNIT = 0.1  # of the speed: one unit of arclength
_STILL = 1e-7  # amplitude, in units of the model's scale, below which a part does not oscillate


@dataclass(frozen=True)
class Setting:
    """The setting of a periodic motion, with the parameter that is varied.

    Attributes
    ----------
    model : Model
    parameter : str
        "speed", "curvature", "cant" or a parameter of the model.
    speed, curvature, cant : float
        m/s, 1/m, rad; the value of the one that is varied does not matter.
    inputs : ndarray, shape (n_inputs,)
    unit : float or None
        Change of the parameter that is one unit of arclength; None for a tenth of its value.
    """

    model: Model
    parameter: str
    speed: float
    curvature: float
    cant: float
    inputs: Array
    unit: float | None = None

    def __post_init__(self) -> None:
        checks.known("parameter", [self.parameter], [*CONDITIONS, *self.model.parameters])

    @property
    def parameters(self) -> tuple[str, ...]:
        """The parameter as the only varying one."""
        return (self.parameter,)

    def conditions(self, value: ArrayLike) -> tuple[float, float, float]:
        """Return speed, curvature and cant at a value of the parameter."""
        held = {"speed": self.speed, "curvature": self.curvature, "cant": self.cant}
        if self.parameter in held:
            held[self.parameter] = float(np.asarray(value).item())
        return held["speed"], held["curvature"], held["cant"]

    def unit_at(self, value: float) -> float:
        """Return the change of the parameter that is one unit of arclength."""
        return self.unit if self.unit is not None else _SPEED_UNIT * abs(value)

    def model_at(self, value: float) -> Model:
        """Return the model with the parameter at a value, if it is one of the model's own."""
        if self.parameter in CONDITIONS:
            return self.model
        return self.model.replace(**{self.parameter: value})


@dataclass(frozen=True)
class Shot:
    """One period: states (rows), and derivatives of the last by the first, period and values."""

    states: Array
    derivatives: Array


class Shooting:
    """The integration of periods of a model, with exact derivatives.

    Parameters
    ----------
    setting : Setting
        Defines what varies; ``value`` below is one number for each of its ``parameters``.
    steps : int
        Number of Runge-Kutta steps of one period.
    """

    def __init__(self, setting: Setting, steps: int) -> None:
        self.setting = setting
        model = setting.model
        self.n = model.n_states
        self._kernels = model.kernels()
        layout = self._kernels.LAYOUT
        self._layout = layout
        self._w = np.zeros(layout.all_rows)
        self._w[layout.p : layout.dx], self._t = model.rows()
        self._w[layout.u : layout.c] = setting.inputs
        self._cells = _columns(self._kernels.CELLS)
        self._entries = _by_state(self._kernels.CELLS, self.n)
        self._parameter_cells = _columns(self._kernels.PARAMETER_CELLS)
        self._parameter_entries = _by_state(self._kernels.PARAMETER_CELLS, self.n)
        names, count = list(model.parameters), len(setting.parameters)
        self._directions = np.zeros((model.n_inputs + 3, count))
        self._parameter_directions = np.zeros((len(names), count))
        own = [(k, names.index(p)) for k, p in enumerate(setting.parameters) if p in names]
        self._own = [k for k, _ in own]  # indices of the varying ones that are the model's own
        self._index = [index for _, index in own]
        self._parameter_directions[self._index, self._own] = 1.0
        for k, name in enumerate(setting.parameters):
            if name in CONDITIONS:
                self._directions[model.n_inputs + CONDITIONS.index(name), k] = 1.0
        self.steps = steps

    def _set(self, x: Array, value: ArrayLike) -> None:
        self._w[: self.n] = x
        self._w[self._layout.c : self._layout.p] = self.setting.conditions(value)
        values = np.atleast_1d(value)
        for k, index in zip(self._own, self._index, strict=True):
            self._w[self._layout.p + index] = values[k]

    def slope(self, x: Array, value: ArrayLike) -> Array:
        """Return the time derivatives of a state."""
        self._set(x, value)
        self._kernels.rhs(self._w, self._t)
        return self._w[self._layout.dx : self._layout.work].copy()

    def jacobian(self, x: Array, value: ArrayLike) -> Array:
        """Return the derivatives of the time derivatives with respect to the state."""
        self._set(x, value)
        full = np.zeros((self.n, self.n + len(self._directions)))
        self._kernels.dense_jacobian(self._w, self._t, *self._cells, full)
        return full[:, : self.n]

    def fastest(self, x: Array, value: ArrayLike) -> float:
        """Return the largest magnitude (1/s) of the eigenvalues at a state."""
        return float(np.abs(np.linalg.eigvals(self.jacobian(x, value))).max())

    def linear(self, x: Array, value: ArrayLike) -> Array:
        """Return the derivatives of the time derivatives with respect to the state and the values."""
        self._set(x, value)
        n = self.n
        full = np.zeros((n, n + len(self._directions)))
        self._kernels.dense_jacobian(self._w, self._t, *self._cells, full)
        by_value = full[:, n:] @ self._directions
        if self._own:
            of_own = np.zeros((n, len(self._parameter_directions)))
            self._kernels.dense_parameter_jacobian(self._w, self._t, *self._parameter_cells, of_own)
            by_value += of_own @ self._parameter_directions
        return np.hstack([full[:, :n], by_value])

    def shoot(self, x: Array, period: float, value: ArrayLike) -> Shot:
        """Integrate one period with its derivatives."""
        self._set(x, value)
        mesh = np.linspace(0.0, 1.0, self.steps + 1)
        width, block = self.n + 1 + self._directions.shape[1], self._kernels.BLOCK
        blocks = np.empty((math.ceil(width / block), self.n, block))
        states = np.empty((self.steps + 1, self.n))
        if self._own:
            self._kernels.rk4_parameter_sensitivity(
                self._w,
                self._t,
                period,
                mesh,
                self._entries,
                self._directions,
                self._parameter_entries,
                self._parameter_directions,
                blocks,
                states,
            )
        else:
            self._kernels.rk4_sensitivity(
                self._w, self._t, period, mesh, self._entries, self._directions, blocks, states
            )
        derivatives = blocks.transpose(1, 0, 2).reshape(self.n, -1)[:, :width]
        return Shot(states, np.ascontiguousarray(derivatives))

    def end(self, x: Array, period: float, value: ArrayLike) -> Array:
        """Return the state after one period, without derivatives: a twentieth of the time."""
        self._set(x, value)
        self._kernels.rk4_hold(self._w, self._t, period / self.steps, self.steps)
        return self._w[: self.n].copy()

    def parts(self, states: Array) -> tuple[NDArray[np.intp], ...]:
        """Return the uncoupled parts of the model (their states) that oscillate in a motion.

        Each of them may be shifted in phase separately, so each needs a phase condition.
        """
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        rows, columns = self._cells[:, self._cells[1] < self.n]
        graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(self.n, self.n))
        _, label = connected_components(graph, directed=False)
        swing = np.ptp(states, axis=0) / self.setting.model.scale
        parts = [np.flatnonzero(label == k) for k in np.unique(label)]
        return tuple(part for part in parts if swing[part].max() > _STILL)


def _columns(cells: tuple[tuple[int, int], ...]) -> NDArray[np.int64]:
    return np.ascontiguousarray(np.array(cells, dtype=np.int64).reshape(-1, 2).T)


def _by_state(cells: tuple[tuple[int, int], ...], n: int) -> tuple[NDArray[np.int64], ...]:
    """Return the entries of n rows, row by row.

    These are the start of each row, its first entry from column n on, then columns and places.
    """
    rows, columns = _columns(cells)
    order = np.lexsort((columns, rows))
    starts = np.searchsorted(rows[order], np.arange(n + 1))
    splits = starts[:-1] + np.bincount(rows[columns < n], minlength=n)
    return starts.astype(np.int64), splits.astype(np.int64), columns[order], order.astype(np.int64)


def steps_for(shooting: Shooting, x: Array, period: float, value: ArrayLike) -> int:
    """Return the number of Runge-Kutta steps that a period needs about a state."""
    stable = period * shooting.fastest(x, value) / STEP_PER_MODE
    return max(STEPS_PER_PERIOD, math.ceil(stable))


def swings_of(states: Array, scale: Array) -> int:
    """Return the number of swings per period of the state that swings most: 2 after a doubling."""
    spread = np.ptp(states, axis=0) / scale
    signal = states[:-1, int(np.argmax(spread))]
    above = signal > (signal.max() + signal.min()) / 2.0
    return max(1, int(np.count_nonzero(above & ~np.roll(above, 1))))


def displacement(model: Model, amplitudes: Array) -> float:
    """Return the largest displacement of amplitudes, in units of the model's scale."""
    return float(np.max((amplitudes / model.scale)[displacement_rows(model)]))
