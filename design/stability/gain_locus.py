"""Classical root locus: the poles of a feedback loop over its gain."""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.loop.sampled import continuous
from design.stability.critical_points import Family
from design.stability.locus import Locus
from design.stability.mode_shape import ModeShape, largest_of, normalized
from design.stability.modes import Complex, Modes
from railenv.errors import ParameterError

Array = NDArray[np.float64]

_GAINS = (0.0, 2.0, 201)


class GainLocus(Locus):
    """Poles of the negative feedback loop around ``gain * loop``.

    The attributes are those of :class:`Locus`; ``loci`` are poles in the plane of the loop: s (1/s) in
    continuous, z in discrete time. ``poles`` and ``zeros`` are those of the open loop.
    """

    def __init__(
        self, values: Array, modes: list[Modes], family: _Gains, loop: control.StateSpace
    ) -> None:
        self._discrete = family.period
        super().__init__(values, modes, family)
        self.poles = loop.poles()
        self.zeros = loop.zeros() if loop.issiso() else np.empty(0)
        self.dt = loop.dt
        self.sys = loop

    def _drawn(self, eigenvalues: Complex) -> Complex:
        """Return eigenvalues (1/s) as poles in the plane of the loop."""
        if self._discrete is None:
            return eigenvalues
        return np.exp(eigenvalues * self._discrete)

    def mode(self, value: float, mode: int | None = None) -> ModeShape:
        """Return the shape of a mode in the states of the loop, at any gain within the range.

        Parameters are those of :meth:`VehicleLocus.mode`.
        """
        vector, eigenvalue, condition = self._chosen(value, mode)
        names, shape = tuple(self.sys.state_labels), normalized(vector)
        largest = largest_of(dict(zip(names, shape.tolist(), strict=True)))
        return ModeShape(largest, self.sysname, names, shape, eigenvalue, condition, None, None)


def gain_locus(loop: control.StateSpace, gains: ArrayLike | None = None) -> GainLocus:
    """Compute the poles of a negative feedback loop over its gain, sorted into branches.

    The poles are eigenvalues of ``A - g B (I + g D)^-1 C``; a single loop has those of
    ``control.root_locus_map``, computed without polynomials. Several loops get the same gain.

    Parameters
    ----------
    loop : control.StateSpace
        Open loop, as many outputs as inputs, for instance :func:`design.open_loop`.
    gains : array_like, optional
        At least two increasing gains; 0 to 2 when left out, where 1 is the given loop.

    Returns
    -------
    GainLocus

    Raises
    ------
    ParameterError
        If the loop is not a square StateSpace, the gains do not increase, or ``I + g D`` is singular.

    Examples
    --------
    >>> import control, design
    >>> loop = control.ss(control.tf([1.0], [1.0, 3.0, 2.0, 0.0]))
    >>> print(design.gain_locus(loop, [0.5, 2.0, 8.0, 16.0]).critical_points[0])
    stability lost at gain = 6 at 0.2251 Hz
    """
    if not isinstance(loop, control.StateSpace) or loop.ninputs != loop.noutputs or not loop.nstates:
        raise ParameterError(
            f"loop is {loop!r}; it must be a control.StateSpace with states and as many outputs as "
            "inputs"
        )
    values = np.linspace(*_GAINS) if gains is None else np.atleast_1d(np.asarray(gains, dtype=float))
    if values.ndim != 1 or values.size < 2 or not (np.diff(values) > 0.0).all():
        raise ParameterError(f"gains is {gains!r}; they must be at least two that increase")
    if not np.isfinite(values).all():
        raise ParameterError(f"gains is {gains!r}; they must be finite")
    family = _Gains(loop)
    return GainLocus(values, [family.modes(float(g)) for g in values], family, loop)


@dataclass(frozen=True)
class _Gains(Family):
    """The closed loops over the gain."""

    loop: control.StateSpace
    parameter = "gain"
    unit = "1"

    @property
    def name(self) -> str:
        return str(self.loop.name)

    @property
    def period(self) -> float | None:
        if self.loop.isctime():
            return None
        return 1.0 if self.loop.dt is True else float(self.loop.dt)

    def modes(self, value: float) -> Modes:
        loop = self.loop
        through = np.eye(loop.ninputs) + value * loop.D
        if np.linalg.cond(through) > 1.0 / np.finfo(float).eps:
            raise ParameterError(
                f"gain is {value:g}; there I + gain * D is singular, so the loop is not well-posed"
            )
        matrix = loop.A - value * loop.B @ np.linalg.solve(through, loop.C)
        poles, vectors = np.linalg.eig(matrix)
        values = poles.astype(complex)
        if self.period is not None:
            values = continuous(values, self.period)
        return Modes(values, vectors.astype(complex), np.empty(0))
