"""Right-hand side and Jacobian of a model through one buffer, for loops."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from railenv.model import Model

Array = NDArray[np.float64]


class Evaluator:
    """Right-hand side and Jacobian of a model through one buffer; not for several threads at once.

    Arguments are not checked; :meth:`Model.rhs` does that.
    """

    def __init__(self, model: Model) -> None:
        self._kernels = model.kernels()
        self._rhs, self._jacobian = self._kernels.rhs, self._kernels.dense_jacobian
        layout = self._kernels.LAYOUT
        self._w = np.zeros(layout.rows)
        self._w[layout.p : layout.dx], self._t = model.rows()
        self._x = self._w[layout.x : layout.u]
        self._u = self._w[layout.u : layout.c]
        self._c = self._w[layout.c : layout.p]
        self._sites = self._w[layout.sites : layout.dx]
        self._dx = self._w[layout.dx : layout.work]
        self._signals = self._w[layout.o : layout.j]
        cells = np.array(self._kernels.CELLS, dtype=np.int64).reshape(-1, 2).T
        self._rows, self._columns = np.ascontiguousarray(cells)
        self._shape = (model.n_states, model.n_states + model.n_inputs + 3)

    def set(
        self,
        x: ArrayLike,
        speed: float,
        curvature: float = 0.0,
        cant: float = 0.0,
        u: ArrayLike = 0.0,
        sites: ArrayLike = 0.0,
    ) -> None:
        """Set states, running conditions, inputs, and the track's differences at the bodies' places."""
        self._x[:] = x
        self._u[:] = u
        self._c[0] = speed
        self._c[1] = curvature
        self._c[2] = cant
        self._sites[:] = sites

    def rhs(self) -> Array:
        """Return the derivatives, shape (n_states,)."""
        self._rhs(self._w, self._t)
        return self._dx.copy()

    def signals(self) -> Array:
        """Return the signals, if the model has them."""
        self._kernels.signals(self._w, self._t)
        return self._signals.copy()

    def jacobian(self) -> Array:
        """Return the derivatives with respect to states, inputs, speed, curvature and cant.

        Shape (n_states, n_states + n_inputs + 3).
        """
        out = np.zeros(self._shape)
        self._jacobian(self._w, self._t, self._rows, self._columns, out)
        return out
