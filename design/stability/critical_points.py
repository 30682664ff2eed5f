"""Critical values of a parameter, at which stability is lost or gained."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from design.stability.crossings import Step, followed, located, matched, upper
from design.stability.modes import Modes
from design.stability.samples import Sample, samples_of
from railenv.equilibrium import Stuck
from railenv.errors import EquilibriumError

Complex = NDArray[np.complex128]

_MARGINAL = 1e-9  # imaginary parts below this fraction of the largest eigenvalue are rounding error
_TINY_STEP = 1e-4  # of a step between values, over which eigenvalues are differentiated


class Family(Protocol):
    """Linear systems that depend on a parameter."""

    @property
    def parameter(self) -> str:
        """Name of the parameter."""

    @property
    def unit(self) -> str:
        """Its unit; empty if unknown."""

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
        Change as the parameter grows.
    eigenvalue : complex
        The critical eigenvalue (imaginary part not negative), 1/s.
    frequency : float
        Frequency, Hz; 0 if a real eigenvalue passes zero.
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
    """Locate the losses and gains of stability between values.

    Every mode is followed from value to value, and steps in which one may have crossed the axis
    unnoticed are halved (:mod:`design.stability.crossings`).

    Parameters
    ----------
    family : Family
    values : ndarray
        Increasing values.
    modes : sequence of Modes
        Modes at each value, in the order of the previous ones.
    """
    line = _ValueLine(family, float(values[-1] - values[0]))
    found: list[CriticalPoint] = []
    try:
        for step in followed(line, [line.given(values, modes)]):
            found += _changes(line, step)
    except Stuck as end:
        raise (end.__cause__ or end) from None
    return tuple(found)


def _changes(line: _ValueLine, step: Step) -> Iterator[CriticalPoint]:
    """Yield where, within a step, the last unstable mode becomes stable or the first one unstable."""
    unstable = len(upper(step, step.a.unstable))
    at = [(*located(line, step, k), bool(step.a.unstable[k])) for k in upper(step, step.crossing)]
    for sample, k, gained in sorted(at, key=lambda crossing: crossing[0].point):
        unstable += -1 if gained else 1
        if unstable == (0 if gained else 1):
            yield _point(line.family, sample, k, "gained" if gained else "lost")


class _Found(NamedTuple):
    """Modes at a value, as multipliers in discrete time, and the rates at which they change."""

    values: Complex
    rates: Complex
    modes: Modes

    def vector(self, k: int) -> Complex:
        """Return the eigenvector of a mode."""
        return self.modes.vectors[:, k]


@dataclass(frozen=True)
class _ValueLine:
    """A family over its parameter; the arclength is the parameter itself."""

    family: Family
    span: float

    @property
    def period(self) -> float | None:
        return self.family.period

    def given(self, values: NDArray[np.float64], modes: Sequence[Modes]) -> list[Sample]:
        """Return samples at values with known modes; the rates are from differences."""
        eigenvalues = np.array([self._eigenvalues(m) for m in modes])
        edge: Literal[1, 2] = 2 if len(values) > 2 else 1
        rates = np.gradient(eigenvalues, values, axis=0, edge_order=edge)
        return self._samples(values.tolist(), [*map(_Found, eigenvalues, rates, modes)])

    def between(self, a: Sample, b: Sample, fraction: float) -> Sample:
        way = float(b.point - a.point)
        value, beyond = (a.point + share * way for share in (fraction, fraction + _TINY_STEP))
        try:
            modes, near = self.family.modes(value), self.family.modes(beyond)
        except EquilibriumError as error:
            raise Stuck from error
        here, there = self._eigenvalues(modes), self._eigenvalues(near)
        (order,) = matched(here[None], there[None])
        rates = (there[order] - here) / (_TINY_STEP * way)
        return self._samples([value], [_Found(here, rates, modes)])[0]

    def paces(self, a: Sample, b: Sample) -> tuple[float, float]:
        return (float(b.point - a.point),) * 2

    def reach(self, sample: Sample) -> float:
        return 1.0 / self.span

    def gap(self, a: Sample, b: Sample) -> float:
        return abs(float(b.point - a.point)) / self.span

    def _eigenvalues(self, modes: Modes) -> Complex:
        """Return eigenvalues; in discrete time, because their phases wrap, the multipliers."""
        return modes.eigenvalues if self.period is None else np.exp(modes.eigenvalues * self.period)

    def _samples(self, values: list[float], found: list[_Found]) -> list[Sample]:
        sizes = np.array([float(np.abs(each.values).max()) for each in found])
        return samples_of(values, found, self.period, sizes)


def _point(
    family: Family, sample: Sample, k: int, stability: Literal["lost", "gained"]
) -> CriticalPoint:
    spectrum = sample.spectrum
    assert isinstance(spectrum, _Found)
    eigenvalue, vector = complex(spectrum.modes.eigenvalues[k]), spectrum.vector(k)
    if eigenvalue.imag < 0.0:
        eigenvalue, vector = eigenvalue.conjugate(), vector.conj()
    oscillates = eigenvalue.imag > _MARGINAL * float(np.abs(spectrum.modes.eigenvalues).max())
    return CriticalPoint(
        parameter=family.parameter,
        value=float(sample.point),
        stability=stability,
        eigenvalue=eigenvalue,
        frequency=eigenvalue.imag / (2.0 * math.pi) if oscillates else 0.0,
        vector=vector,
    )
