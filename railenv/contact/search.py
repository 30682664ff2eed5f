"""Search of the wheel-rail contact over the lateral shift, by weights of the gap or its minimum.

Both use one frame: ``Y`` outwards from the place of the tape circle when the wheel is not shifted, so
that the wheel's surface is W(Y - eta) and the rail's R(Y).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from railenv.contact.profiles import Curve
from railenv.errors import ParameterError

Array = NDArray[np.float64]

_SHARPEST = 2000.0
"""1/m: curvature of the gap where a flange of 70 degrees is on a gauge corner of 13 mm."""

_NODES = 2.0
"""Nodes on the rail per standard deviation of the weights; with two, sums equal integrals."""

_ROWS = 64  # shifts computed together, whose gaps stay in the cache
_LEAST_WEIGHT = 36.0  # widths of gap beyond which a weight is negligible in floats
_OUTSIDE = 1.0  # m; the gap where there is no wheel


class Surfaces(NamedTuple):
    """Curves of wheel and rail, and the offset (m) of the rail's ``Y`` from its own ``y``."""

    wheel: Curve
    rail: Curve
    rail_offset: float


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contact at each of some shifts.

    Attributes
    ----------
    eta : ndarray
        Shift of the wheel towards its own flange, m.
    height : ndarray
        Lift of the wheel, m, in the profiles' own heights.
    slope : ndarray
        Its derivative over the shift: the tangent of the contact angle against the axle.
    drop : ndarray
        Height of the wheel's surface at the contact, m: the radius is the nominal radius minus this.
    place : ndarray
        Contact place ``Y``, m.
    """

    eta: Array
    height: Array
    slope: Array
    drop: Array
    place: Array


class Weights(NamedTuple):
    """Weights of some neighbouring shifts: rows add up to 1.

    Attributes
    ----------
    first : int
        Number of the first shift.
    nodes : ndarray of int
        Node of each column.
    values : ndarray
        Weights, shape (shifts, nodes).
    wheel : ndarray of int
        Number of the wheel's sample at each weight.
    """

    first: int
    nodes: NDArray[np.intp]
    values: Array
    wheel: NDArray[np.intp]


class Search:
    """Quasi-elastic contact search on uniform grids.

    Grids of nodes on the rail, of samples of the wheel and of shifts have a common step, so that a
    shift moves the wheel by whole samples and nothing is interpolated.
    """

    def __init__(self, surfaces: Surfaces, *, step: float, width: float, reach: float) -> None:
        """Sample the surfaces for shifts from ``-reach`` to ``reach``."""
        self.width = width
        self.per = per = max(1, int(np.sqrt(width / _SHARPEST) / _NODES / step))
        node = per * step
        low = surfaces.rail.y[0] + surfaces.rail_offset
        high = surfaces.rail.y[-1] + surfaces.rail_offset
        first, last = int(np.ceil(low / node)), int(np.floor(high / node))
        self.Y: Array = node * np.arange(first, last + 1).astype(float)
        self.rail = surfaces.rail(self.Y - surfaces.rail_offset).z
        self.steps = round(reach / step)
        self.eta: Array = step * np.arange(-self.steps, self.steps + 1).astype(float)
        numbers = np.arange(per * first - self.steps, per * last + self.steps + 1)
        self.Yw: Array = step * numbers.astype(float)
        there = (self.Yw >= surfaces.wheel.y[0]) & (self.Yw <= surfaces.wheel.y[-1])
        self.wheel = np.full(len(numbers), _OUTSIDE)
        self.wheel_slope = np.zeros(len(numbers))
        on_wheel = surfaces.wheel(self.Yw[there])
        self.wheel[there], self.wheel_slope[there] = on_wheel.z, on_wheel.slope

    def contacts(self) -> Contacts:
        """Return the contact at all shifts."""
        found = np.empty((4, len(self.eta)))
        for first, least, nodes, values, sums in self._blocks():
            rows = slice(first, first + len(least))
            at = self._samples(first, len(least), nodes)
            weights = values / sums[:, None]
            found[0, rows] = self.width * np.log(sums) - least
            found[1, rows] = (weights * self.wheel_slope[at]).sum(axis=1)
            found[2, rows] = (weights * self.wheel[at]).sum(axis=1)
            found[3, rows] = weights @ self.Y[nodes]
        return Contacts(self.eta, *found)

    def weights(self) -> Iterator[Weights]:
        """Return the weights of all shifts, in blocks."""
        for first, least, nodes, values, sums in self._blocks():
            at = self._samples(first, len(least), nodes)
            yield Weights(first, nodes, values / sums[:, None], at)

    def _blocks(self) -> Iterator[tuple[int, Array, NDArray[np.intp], Array, Array]]:
        """Yield for blocks of shifts the first, least gaps, nodes, exp(-gap/width) and their sums."""
        # row k holds the wheel shifted by the k-th eta: its sample at node i is 2 steps + per i - k
        span = self.per * (len(self.Y) - 1) + 1
        shifted = sliding_window_view(self.wheel, span)[::-1, :: self.per]
        for first in range(0, len(self.eta), _ROWS):
            gap = shifted[first : first + _ROWS] - self.rail
            least = gap.min(axis=1)
            near = np.flatnonzero((gap < least[:, None] + _LEAST_WEIGHT * self.width).any(axis=0))
            values = np.exp((least[:, None] - gap[:, near]) / self.width)
            yield first, least, near, values, values.sum(axis=1)

    def _samples(self, first: int, rows: int, nodes: NDArray[np.intp]) -> NDArray[np.intp]:
        shift = 2 * self.steps - first - np.arange(rows)
        return shift[:, None] + self.per * nodes


def rigid(surfaces: Surfaces, eta: float, step: float) -> tuple[float, float, float, float]:
    """Return lift, slope, drop and place of the contact of rigid profiles, from the least gap.

    This plain search is independent of the other: it samples the gap in steps and refines its minimum
    by a parabola.
    """
    low = max(surfaces.rail.y[0] + surfaces.rail_offset, surfaces.wheel.y[0] + eta)
    high = min(surfaces.rail.y[-1] + surfaces.rail_offset, surfaces.wheel.y[-1] + eta)
    if not high - low > 4.0 * step:
        raise ParameterError(f"the wheel shifted by {eta:g} m is not above the rail")
    places = np.linspace(low, high, int((high - low) / step) + 1)
    gap = surfaces.wheel(places - eta).z - surfaces.rail(places - surfaces.rail_offset).z
    k = int(np.clip(np.argmin(gap), 1, len(gap) - 2))
    before, least, after = gap[k - 1 : k + 2]
    bend = before - 2.0 * least + after
    part = float(np.clip(0.5 * (before - after) / bend, -1.0, 1.0)) if bend > 0.0 else 0.0
    place = float(places[k] + part * (places[1] - places[0]))
    wheel = surfaces.wheel(np.array([place - eta]))
    rail = surfaces.rail(np.array([place - surfaces.rail_offset]))
    return float(rail.z[0] - wheel.z[0]), float(wheel.slope[0]), float(wheel.z[0]), place
