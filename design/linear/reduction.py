"""Smaller linear models, through slycot: minimal realisations and balanced reductions, names kept.

Entries of a vehicle's matrices span twelve decades (metres against newtons, rail against body). Both
methods choose the parts to remove by the size of numbers, so states, inputs, outputs and time are
scaled first, and scaled back afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self

import control
import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.errors import ParameterError

Array = NDArray[np.float64]

_TOLERANCE = 1e-8
_LARGEST_CHANGE = 1e-3  # of the frequency response, relative, for a minimal realisation


def minimal(system: control.StateSpace, *, tolerance: float = _TOLERANCE) -> control.StateSpace:
    """Remove states that the inputs cannot reach or the outputs cannot show.

    Examples are double modes (both wheelsets of a dual wheelset hunt in the same way), vertical motion
    on tangent track, and the motion of a wheelset that no input drives.

    Parameters
    ----------
    system : control.StateSpace
    tolerance : float
        Size that counts as zero, relative to the scaled matrices.

    Returns
    -------
    control.StateSpace
        Inputs and outputs keep their names; states are combinations of the original ones.

    Raises
    ------
    ParameterError
        If the frequency response changes: the tolerance is too large for this system.
    """
    scaled = _Scaled.of(system)
    return scaled.restored(scaled.minimal(tolerance))


def balanced(
    system: control.StateSpace,
    order: int,
    *,
    method: Literal["truncate", "matchdc"] = "truncate",
) -> control.StateSpace:
    """Reduce a model to some states by balanced truncation; unstable modes are all kept.

    Parameters
    ----------
    system : control.StateSpace
    order : int
        Number of states to keep.
    method : {"truncate", "matchdc"}
        As in ``control.balred``; "matchdc" keeps the steady response, for stable systems.

    Returns
    -------
    control.StateSpace
        Inputs and outputs keep their names.

    Raises
    ------
    ParameterError
        If the order is not from 1 to the system's, or is below the number of unstable modes.
    """
    if not hasattr(order, "__index__") or not 1 <= order <= system.nstates:
        raise ParameterError(
            f"order is {order!r}; it must be a whole number from 1 to {system.nstates}"
        )
    checks.known("method", [method], ["truncate", "matchdc"])
    poles = system.poles()
    unstable = poles.real >= 0.0 if system.isctime() else np.abs(poles) >= 1.0
    if order < np.count_nonzero(unstable):
        raise ParameterError(
            f"order is {order}; it must be at least {np.count_nonzero(unstable)}, the number of "
            "unstable modes, which are all kept"
        )
    scaled = _Scaled.of(system)
    smallest = scaled.minimal(_TOLERANCE)
    if order >= smallest.nstates:
        return scaled.restored(smallest)
    return scaled.restored(control.balred(smallest, order, method=method))


def transfer_function(system: control.StateSpace) -> control.TransferFunction:
    """Return the transfer functions of a model's minimal realisation.

    Returns
    -------
    control.TransferFunction
        Inputs and outputs keep their names. Roots of polynomials of high degree are ill-conditioned;
        for computations, use the state-space model.
    """
    smallest = minimal(system)
    result = control.ss2tf(smallest)
    result.update_names(
        inputs=smallest.input_labels, outputs=smallest.output_labels, name=smallest.name
    )
    return result


@dataclass(frozen=True)
class _Scaled:
    """A system in units in which its matrices' entries have similar sizes."""

    system: control.StateSpace
    original: control.StateSpace
    time: float
    inputs: Array
    outputs: Array

    @classmethod
    def of(cls, system: control.StateSpace) -> Self:
        from scipy.linalg import matrix_balance

        n, m, p = system.nstates, system.ninputs, system.noutputs
        time = 1.0
        if system.isctime():
            rates = np.abs(np.linalg.eigvals(system.A))
            time = float(np.median(rates[rates > 0.0])) if (rates > 0.0).any() else 1.0
        # a loop closed around all signals lets balancing find scales for inputs and outputs too
        loop = np.zeros((n + m + p, n + m + p))
        loop[:n, : n + m] = np.hstack([system.A, system.B]) / time
        loop[n : n + m, n + m :] = 1.0
        loop[n + m :, :n] = system.C
        _, (scale, _) = matrix_balance(loop, permute=False, separate=True)
        x, u, y = np.split(scale, [n, n + m])
        return cls(
            control.ss(
                system.A / time * x / x[:, None],
                system.B / time * u / x[:, None],
                system.C * x / y[:, None],
                system.D * u / y[:, None],
                system.dt if system.isdtime() else 0,
            ),
            system,
            time,
            u,
            y,
        )

    def minimal(self, tolerance: float) -> control.StateSpace:
        """Return a minimal realisation of the scaled system."""
        checks.number("tolerance", tolerance, low=0.0, high=0.1, open_low=True)
        smallest = control.minreal(self.system, tolerance, verbose=False)
        points = 1j * np.logspace(-2.0, 1.0, 7)
        if self.system.isdtime():
            points = np.exp(1j * np.linspace(0.1, 3.0, 7))
        before = np.array([_response(self.system, s) for s in points])
        after = np.array([_response(smallest, s) for s in points])
        change = np.abs(after - before).max() / max(float(np.abs(before).max()), 1e-300)
        if change > _LARGEST_CHANGE:
            raise ParameterError(
                f"tolerance is {tolerance:g}; with it the frequency response changes by {change:.2g} "
                "of its largest value, so it must be smaller for this system"
            )
        return smallest

    def restored(self, reduced: control.StateSpace) -> control.StateSpace:
        """Return a reduction of the scaled system in the units of the original."""
        return control.ss(
            reduced.A * self.time,
            reduced.B * self.time / self.inputs,
            reduced.C * self.outputs[:, None],
            reduced.D / self.inputs * self.outputs[:, None],
            self.original.dt,
            inputs=self.original.input_labels,
            outputs=self.original.output_labels,
            name=self.original.name,
        )


def _response(system: control.StateSpace, s: complex) -> NDArray[np.complex128]:
    resolvent = np.linalg.solve(s * np.eye(system.nstates) - system.A, system.B.astype(complex))
    return system.C @ resolvent + system.D
