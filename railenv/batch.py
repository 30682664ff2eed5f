"""Many systems at once: the same equations in lanes of the processor's vector units."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import ParameterError, shown
from railenv.kernels import buffers, loader, pool
from railenv.model import Model
from railenv.tables import pack
from railenv.threads import usable_threads

THREAD_PAYS_FROM = 1000
"""Steps of one system that give a thread enough work (some 0.1 ms)."""

MOST_STEPS = 10**9
"""Steps of one call, which cannot be interrupted."""


class Batch:
    """States, inputs, conditions and parameters of many systems that share their equations.

    Parameters
    ----------
    models : sequence of Model
        One per system, all with the same equations; their parameters may differ.
    dtype : {"float64", "float32"}
        Precision; float32 is about twice as fast.

    Raises
    ------
    ParameterError
        If there is no model, the models differ in their equations, or the dtype is unknown.

    Examples
    --------
    >>> import railenv
    >>> from railenv.batch import Batch
    >>> model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    >>> batch = Batch([model.replace(conicity=c) for c in (0.05, 0.1, 0.2)])
    >>> batch.conditions = [100.0, 0.0, 0.0]
    >>> batch.states = railenv.find_equilibrium(model, speed=100.0).state
    >>> batch.integrate(step=1e-3, steps=100)
    >>> batch.states.shape
    (3, 24)
    """

    def __init__(self, models: Sequence[Model], dtype: str = "float64") -> None:
        if not models:
            raise ParameterError("models is empty; a batch needs at least one model")
        given: Any
        for given in models:
            if not isinstance(given, Model):
                raise ParameterError(f"models contains {shown(given)}, which is not a railenv.Model")
        checks.choice("dtype", dtype, list(loader.LANES))
        first = models[0]
        if any(model.structure != first.structure for model in models):
            raise ParameterError("models of a batch must share their equations")
        self._model = first
        self.n = len(models)
        self._names = (first.state_names, first.input_names, ("speed", "curvature", "cant"))
        self._lanes = loader.LANES[dtype]
        self._kernels = first.kernels(self._lanes, dtype)
        self._layout = self._kernels.LAYOUT
        n_blocks = -(-self.n // self._lanes)
        self._blocks = buffers.zeros((n_blocks, self._layout.j * self._lanes), dtype)
        tables, starts = pack([model.tables for model in models])
        self._tables = None if tables is None else tables.astype(dtype)
        self._write(
            self._layout.p,
            self._layout.dx,
            [
                [*m.parameters.values(), *own, *[0.0] * len(m.site_names)]
                for m, own in zip(models, starts, strict=True)
            ],
        )
        self.conditions = [1.0, 0.0, 0.0]

    def _rows(self, start: int, stop: int) -> NDArray[np.floating]:
        view = self._blocks.reshape(len(self._blocks), self._layout.j, self._lanes)
        return view[:, start:stop, :]

    def _read(self, start: int, stop: int) -> NDArray[np.floating]:
        rows = self._rows(start, stop).transpose(0, 2, 1)
        return rows.reshape(-1, stop - start)[: self.n].copy()

    def _write(self, start: int, stop: int, values: ArrayLike) -> None:
        width = stop - start
        array = np.broadcast_to(np.asarray(values, dtype=float), (self.n, width))
        # the lanes that fill up the last block repeat the first system
        spare = len(self._blocks) * self._lanes - self.n
        full = np.concatenate([array, np.repeat(array[:1], spare, axis=0)])
        blocks = full.reshape(len(self._blocks), self._lanes, width)
        self._rows(start, stop)[:] = blocks.transpose(0, 2, 1)

    def _checked(self, name: str, values: ArrayLike, labels: Sequence[str]) -> ArrayLike:
        try:
            array = np.asarray(values, dtype=float)
        except (OverflowError, TypeError, ValueError):
            raise ParameterError(
                f"{name} is {shown(values)}, which is not an array of numbers"
            ) from None
        if array.shape not in ((len(labels),), (self.n, len(labels))):
            raise ParameterError(
                f"{name} has shape {array.shape}; it must be ({self.n}, {len(labels)}), or "
                f"({len(labels)},) for all systems: {', '.join(labels)}"
            )
        if not np.isfinite(array).all():
            *_, entry = place = tuple(np.argwhere(~np.isfinite(array))[0])
            raise ParameterError(f"{labels[entry]} is {array[place]:g} in {name}; it must be finite")
        return array

    @property
    def states(self) -> NDArray[np.floating]:
        """States, shape (n, n_states); assign an array of this shape, or one state for all."""
        return self._read(self._layout.x, self._layout.u)

    @states.setter
    def states(self, values: ArrayLike) -> None:
        self._write(self._layout.x, self._layout.u, self._checked("states", values, self._names[0]))

    @property
    def inputs(self) -> NDArray[np.floating]:
        """Inputs, shape (n, n_inputs); assign an array of this shape, or one set for all."""
        return self._read(self._layout.u, self._layout.c)

    @inputs.setter
    def inputs(self, values: ArrayLike) -> None:
        self._write(self._layout.u, self._layout.c, self._checked("inputs", values, self._names[1]))

    @property
    def conditions(self) -> NDArray[np.floating]:
        """Speed (m/s), curvature (1/m) and cant (rad), shape (n, 3); or assign one row for all."""
        return self._read(self._layout.c, self._layout.p)

    @conditions.setter
    def conditions(self, values: ArrayLike) -> None:
        array = np.asarray(self._checked("conditions", values, self._names[2]))
        for row in np.unique(array.reshape(-1, 3), axis=0):
            self._model.check_conditions(*row.tolist())
        self._write(self._layout.c, self._layout.p, array)

    def rhs(self) -> NDArray[np.floating]:
        """Time derivatives of the states, shape (n, n_states)."""
        self._kernels.rhs_blocks(self._blocks, self._tables)
        return self._read(self._layout.dx, self._layout.work)

    def integrate(self, *, step: float, steps: int, parallel: bool | None = None) -> None:
        """Advance all systems by some RK4 steps, with inputs and conditions held.

        The states of a system that diverges do not stay finite; the other systems go on.

        Parameters
        ----------
        step : float
            s.
        steps : int
        parallel : bool, optional
            Use all threads; by default as many as there is work for. ``RAILENV_NUM_THREADS`` sets how
            many there are.
        """
        h = self._kernels.real(checks.number("step", step, low=0.0, open_low=True, unit="s"))
        steps = checks.whole("steps", steps, low=0, high=MOST_STEPS)
        threads = 1
        if parallel is not False:
            work = len(self._blocks) if parallel else self.n * steps // THREAD_PAYS_FROM
            threads = min(usable_threads(), len(self._blocks), max(1, work))
        pool.run(partial(self._kernels.rk4_blocks, self._blocks, self._tables, h, steps), threads)
