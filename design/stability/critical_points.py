"""Critical values: where over a parameter stability is lost or gained."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from design.stability.modes import Modes

_MARGINAL = 1e-9  # growth rates below this fraction of the largest eigenvalue are rounding error
_ROOT = 1e-9  # of a step between values
_PEAK = 1e-3  # of a step, how close the top of a peak is looked for
_BEYOND = 3.0  # a peak between values is looked at if it may be this much higher than it is seen to be


class Family(Protocol):
    """Linear systems that depend on a parameter."""

    @property
    def parameter(self) -> str:
        """Name of the parameter."""

    @property
    def unit(self) -> str:
        """Its unit; empty where it is not known."""

    @property
    def name(self) -> str:
        """Name of the system."""

    @property
    def period(self) -> float | None:
        """Sampling period, s; None in continuous time."""

    def modes(self, value: float) -> Modes:
        """Return the modes at a value of the parameter."""


@dataclass(frozen=True)
class CriticalPoint:
    """A value of a parameter at which stability is lost or gained.

    Attributes
    ----------
    parameter : str
    value : float
    stability : {"lost", "gained"}
        What happens as the parameter grows.
    eigenvalue : complex
        The critical eigenvalue (imaginary part not negative), 1/s.
    frequency : float
        Hz; 0 where a real eigenvalue passes zero.
    vector : ndarray of complex
        Its eigenvector.
    """

    parameter: str
    value: float
    stability: Literal["lost", "gained"]
    eigenvalue: complex
    frequency: float
    vector: NDArray[np.complex128] = field(repr=False, compare=False)

    def __str__(self) -> str:
        at = f" at {self.frequency:.4f} Hz" if self.frequency else ""
        return f"stability {self.stability} at {self.parameter} = {self.value:.6g}{at}"


def find_critical_points(
    family: Family, values: NDArray[np.float64], modes: Sequence[Modes]
) -> tuple[CriticalPoint, ...]:
    """Locate the losses and gains of stability between values, by Brent's method.

    Where the growth rate peaks or dips between values without a change of sign that they show, the
    extremum is looked at too.

    Parameters
    ----------
    family : Family
    values : ndarray
        Increasing.
    modes : sequence of Modes
        At each value.
    """

    def rate(value: float) -> float:
        return _rate(family.modes(float(value)))

    rates = [_rate(m) for m in modes]
    seen = sorted([*zip(values.tolist(), rates, strict=True), *_extrema(rate, values, rates)])
    found = []
    for (a, rate_a), (b, rate_b) in pairwise(seen):
        if (rate_a > 0.0) == (rate_b > 0.0):
            continue
        if rate_a == 0.0 or rate_b == 0.0:
            root = a if rate_a == 0.0 else b
        else:
            root = float(optimize.brentq(rate, a, b, xtol=_ROOT * (b - a)))
        found.append(_point(family, root, rate_b > 0.0))
    return tuple(found)


def _rate(modes: Modes) -> float:
    """Return the growth rate (1/s), 0 where it is within rounding of that."""
    growth = modes.growth
    return 0.0 if abs(growth) < _MARGINAL * float(np.abs(modes.eigenvalues).max()) else growth


def _extrema(
    rate: Callable[[float], float], values: NDArray[np.float64], rates: list[float]
) -> Iterator[tuple[float, float]]:
    """Yield peaks of the growth rate above zero between stable values, and dips between unstable."""
    for k in range(1, len(rates) - 1):
        left, middle, right = rates[k - 1 : k + 2]
        sign = 1.0 if middle <= 0.0 else -1.0
        height = sign * middle
        lower, higher = sorted((sign * left, sign * right))
        if height <= higher or height + _BEYOND * (height - lower) <= 0.0:
            continue
        for a, b in pairwise(values[k - 1 : k + 2].tolist()):

            def depth(v: float, sign: float = sign) -> float:
                return -sign * rate(v)

            best = optimize.minimize_scalar(
                depth, bounds=(a, b), method="bounded", options={"xatol": _PEAK * (b - a)}
            )
            if best.fun < 0.0:
                yield float(best.x), -sign * float(best.fun)


def _point(family: Family, value: float, lost: bool) -> CriticalPoint:
    modes = family.modes(value)
    k = modes.least_damped
    eigenvalue = complex(modes.eigenvalues[k])
    oscillates = eigenvalue.imag > _MARGINAL * float(np.abs(modes.eigenvalues).max())
    return CriticalPoint(
        parameter=family.parameter,
        value=value,
        stability="lost" if lost else "gained",
        eigenvalue=eigenvalue,
        frequency=eigenvalue.imag / (2.0 * math.pi) if oscillates else 0.0,
        vector=modes.vectors[:, k],
    )
