"""A curve of bifurcations in the plane of two parameters, and the special points on it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from design.curves.plane import Plane
from railenv import checks
from railenv.errors import RailenvError

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_SAME = 1e-7  # of the way between two points: passages closer than this are one
CurveKind = Literal[
    "Hopf",
    "fold of equilibria",
    "fold of cycles",
    "period doubling",
    "torus",
    "symmetry breaking",
]


class CurveError(RailenvError):
    """No curve of bifurcations can be followed from a point."""


@dataclass(frozen=True)
class CurvePoint:
    """A bifurcation at one pair of parameter values.

    Attributes
    ----------
    parameters : (str, str)
        Names of the two parameters.
    values : (float, float)
        Their values.
    speed, curvature, cant : float
        m/s, 1/m, rad.
    state : ndarray, shape (n_states,)
        The equilibrium, or the periodic motion where a period begins.
    period : float or None
        Period of the periodic motion or of the critical mode, s; None at a fold of equilibria.
    amplitudes : ndarray or None, shape (n_states,)
        Half the distance from peak to peak of every state; None for equilibria.
    critical : complex
        The critical eigenvalue (1/s) or Floquet multiplier, its imaginary part not negative.
    spectrum : ndarray of complex
        All eigenvalues (1/s), or all multipliers except the trivial one, the largest first.
    coefficient : float or None
        Coefficient of the normal form. Hopf: the first Lyapunov coefficient, as in
        :class:`design.HopfPoint` (None if the equations are not smooth enough); period doubling and
        symmetry breaking: that of the cube, positive where the new motion is stable (supercritical);
        folds: that of the square, zero at a cusp; None on torus curves. All but the first refer to
        states in units of the model's scale and the amplitude, so that only their signs matter.
    steps : int
        Number of Runge-Kutta steps over the period; 0 for equilibria.
    """

    parameters: tuple[str, str]
    values: tuple[float, float]
    speed: float
    curvature: float
    cant: float
    state: Array
    period: float | None
    amplitudes: Array | None
    critical: complex
    spectrum: NDArray[np.complex128]
    coefficient: float | None
    steps: int

    @property
    def frequency(self) -> float | None:
        """Frequency, Hz; None at a fold of equilibria."""
        return None if self.period is None else 1.0 / self.period


@dataclass(frozen=True)
class CurveSpecialPoint:
    """A point of a curve at which a second condition holds.

    Attributes
    ----------
    kind : str
        Equilibria: "Bautin" (the first Lyapunov coefficient is zero: hunting changes from growing
        gently to jumping), "Hopf-Hopf" (a second pair on the axis), "fold-Hopf" (a zero
        eigenvalue), "Bogdanov-Takens" (the frequency goes to zero), "cusp" (two folds meet).
        Periodic motions: "cusp", "fold-flip", "fold-torus", "flip-torus", "double torus", "1:1
        resonance" to "1:4 resonance", "degenerate period doubling", and "degenerate symmetry breaking"
        (the cube's coefficient is zero), "fold and symmetry breaking", "torus and symmetry breaking".
    point : CurvePoint
    numbers : mapping of str to float
        "c" of a cusp's cube, "a" and "b" of a Bogdanov-Takens point, "frequency" (Hz) of the second
        mode of a Hopf-Hopf point; else empty.
    """

    kind: str
    point: CurvePoint
    numbers: Mapping[str, float]

    @property
    def values(self) -> tuple[float, float]:
        """The two parameters."""
        return self.point.values

    def __str__(self) -> str:
        x, y = self.values
        return f"{self.kind} at ({x:.6g}, {y:.6g})"


@dataclass(frozen=True)
class BifurcationCurve:
    """A curve of bifurcations in the plane of two parameters.

    Attributes
    ----------
    kind : str
        "Hopf", "fold of equilibria", "fold of cycles", "period doubling", "torus" (Neimark-Sacker) or
        "symmetry breaking".
    plane : Plane
        Model, running conditions, and the two parameters with their ranges.
    points : tuple of CurvePoint
        Points in the order of the curve, which may turn back in either parameter.
    special : tuple of CurveSpecialPoint
        Special points in the order of the curve.
    ended : (str, str)
        Reasons why the curve ends at its first and at its last point.
    complete : bool
        Whether it ends on both sides as intended (end of a range or of the number of points, or a
        point at which such curves end), not by failure or interruption.
    """

    kind: CurveKind
    plane: Plane
    points: tuple[CurvePoint, ...]
    special: tuple[CurveSpecialPoint, ...]
    ended: tuple[str, str]
    complete: bool
    _pieces: tuple[Array, ...] = field(repr=False, compare=False)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def parameters(self) -> tuple[str, str]:
        """Names of the two parameters."""
        return self.plane.parameter, self.plane.second

    @property
    def model_name(self) -> str:
        """Name of the model."""
        return self.plane.model.name

    @property
    def value(self) -> dict[str, Array]:
        """Values of either parameter at every point, by name."""
        table = np.array([p.values for p in self.points]).T
        return dict(zip(self.parameters, table, strict=True))

    @property
    def speed(self) -> Array:
        """Speed (m/s) at every point."""
        return np.array([p.speed for p in self.points])

    @property
    def frequency(self) -> Array:
        """Frequency (Hz) at every point; NaN at folds of equilibria."""
        return np.array([math.nan if p.frequency is None else p.frequency for p in self.points])

    @property
    def coefficient(self) -> Array:
        """Coefficient of the normal form at every point; NaN where there is none."""
        return np.array([math.nan if p.coefficient is None else p.coefficient for p in self.points])

    @property
    def amplitude(self) -> dict[str, Array]:
        """Amplitude (half peak to peak) at every point, by state; empty for equilibria."""
        if self.points[0].amplitudes is None:
            return {}
        table = np.array([p.amplitudes for p in self.points]).T
        return dict(zip(self.plane.model.state_names, table, strict=True))

    def at(self, parameter: str, value: float) -> tuple[float, ...]:
        """Return the values of the other parameter where one has a given value.

        There is one for each passage, in the order of the curve; between points Hermite's cubic uses
        the exact direction of the curve at both.

        Parameters
        ----------
        parameter : str
            Name of one of the two.
        value : float
            Its value.
        """
        checks.known("parameter", [parameter], self.parameters)
        k = self.parameters.index(parameter)
        found: list[float] = []
        told = False  # a passage at the end of a piece is one at the beginning of the next
        for piece in self._pieces:
            polynomial = piece[k].copy()
            polynomial[-1] -= value
            roots = np.roots(np.trim_zeros(polynomial, "f"))
            real = np.sort(roots.real[np.abs(roots.imag) < _SAME])
            passages = real[(real > (_SAME if told else -_SAME)) & (real < 1.0 + _SAME)]
            found += [float(np.polyval(piece[1 - k], t)) for t in passages]
            told = bool((passages > 1.0 - _SAME).any())
        return tuple(found)

    def summary(self) -> dict[str, Any]:
        """Return the curve as plain numbers and strings, ready for JSON."""
        return {
            "kind": self.kind,
            "model": self.model_name,
            "parameters": list(self.parameters),
            "value": {name: v.tolist() for name, v in self.value.items()},
            "frequency": [p.frequency for p in self.points],
            "coefficient": [p.coefficient for p in self.points],
            "special": [
                {
                    "kind": s.kind,
                    "value": dict(zip(self.parameters, s.values, strict=True)),
                    "frequency": s.point.frequency,
                    **dict(s.numbers),
                }
                for s in self.special
            ],
            "ended": list(self.ended),
            "complete": self.complete,
        }

    def __str__(self) -> str:
        ranges = [f"{name} {v.min():.4g} to {v.max():.4g}" for name, v in self.value.items()]
        text = f"{self.kind} of {self.model_name}: {len(self)} points, {', '.join(ranges)}"
        return "; ".join([text, *map(str, self.special)])

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the curve in the plane of its parameters, with its special points.

        Axes of another curve may be given, to draw both in one plot.
        """
        from design.curves.curve_plots import plot_curve

        return plot_curve(self, ax)
