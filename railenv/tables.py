"""Characteristics given as tables: a cubic on each cell of a uniform grid, linear beyond its ends.

A kernel reads a table as one row of numbers (:meth:`Table.packed`), cell after cell, each with the
constants of all columns, then the factors of t, and so on. Its parameters give the starts of the table
and of its grid, the grid's fineness, and its last cell (:func:`names_of`).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import ParameterError

Array = NDArray[np.float64]

WIDE = 4
"""Columns in the cells of a table of several; missing ones are filled with zeros."""

ALIGNED = 4 * WIDE
"""Numbers in the widest cell: tables start at multiples of it."""

_MOST_EXACT = 256
"""Cells of the largest grid tried for the points."""

_ON_GRID = 1e-6  # of a cell
_CELLS_PER_POINT = 4
_MOST_CELLS = 100_000


@dataclass(frozen=True, eq=False)
class Table:
    """Smooth characteristics y(x), exact in value and derivatives; one, or several as columns.

    Make one with :meth:`through` (measured points, monotone between them) or :meth:`spline` (samples of
    smooth functions).

    Attributes
    ----------
    x : ndarray, shape (cells + 1,)
        Uniform grid.
    coefficients : ndarray, shape (cells, 4 * columns)
        Coefficients of 1, t, t^2, t^3 in each cell, t from 0 to 1, column after column.
    points : tuple of two tuples of float
        Points from which it was made, for files; empty if it was made from samples.
    level : tuple of int
        Columns that are constant beyond the ends: slopes of columns that go on straight.
    """

    x: Array
    coefficients: Array
    points: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    level: tuple[int, ...] = ()

    @classmethod
    def through(cls, x: ArrayLike, y: ArrayLike, *, odd: bool = False, name: str = "table") -> Self:
        """Return a table that is straight between points and rounded at them.

        The corners are rounded within a quarter of the distance of the two closest points, so that the
        slope is continuous and the table rises where the points do (Fritsch and Butland); where the
        points are constant, such as within the clearance of a stop, so is the table.

        Parameters
        ----------
        x, y : array_like, shape (n,)
            Points with increasing ``x``, at least two.
        odd : bool
            Points for x >= 0 only, the first of them (0, 0); the other half is their mirror image.
        name : str
            What to call it in messages.

        Raises
        ------
        ParameterError
            If they are not such points.
        """
        from scipy.interpolate import PchipInterpolator

        px, py, cells = characteristic(x, y, odd=odd, name=name)
        kept = (tuple(np.asarray(x, float).tolist()), tuple(np.asarray(y, float).tolist()))
        grid = np.linspace(px[0], px[-1], cells + 1)
        curve = PchipInterpolator(grid, np.interp(grid, px, py))
        return cls(grid, _hermite(grid, curve(grid), curve.derivative()(grid)), kept)

    @classmethod
    def spline(cls, x: ArrayLike, *columns: ArrayLike, name: str = "table") -> Self:
        """Return the cubic splines, twice continuously differentiable, through a uniform grid.

        Parameters
        ----------
        x : array_like, shape (n,)
            Grid, n at least 4.
        *columns : array_like, shape (n,)
            Values of each function.
        name : str
            What to call it in messages.

        Raises
        ------
        ParameterError
            If the grid is not uniform or has fewer than four points, or a value is not finite.
        """
        from scipy.interpolate import CubicSpline

        parts = []
        for column in columns:
            px, py = _points(name, x, column)
            if len(px) < 4 or np.ptp(np.diff(px)) > 1e-9 * (px[-1] - px[0]):
                raise ParameterError(f"{name} needs a uniform grid of at least four points")
            parts.append(_hermite(px, py, CubicSpline(px, py)(px, 1)))
        return cls(px, np.concatenate(parts, axis=1))

    def with_slope(self, column: int) -> Table:
        """Return the table with the exact slope of a column after that column, also beyond its ends."""
        parts = self.coefficients.reshape(len(self.coefficients), -1, 4)
        per = 1.0 / np.diff(self.x)[:, None]
        slope = np.zeros_like(parts[:, column])
        slope[:, :3] = parts[:, column, 1:] * [1.0, 2.0, 3.0] * per
        added = np.insert(parts, column + 1, slope, axis=1)
        level = tuple(c + (c > column) for c in self.level)
        return dataclasses.replace(
            self, coefficients=added.reshape(len(parts), -1), level=(*level, column + 1)
        )

    def __call__(self, x: Any, order: int = 0, column: int = 0) -> Any:
        """Return value or derivative at a float, or at a complex number (by its real part)."""
        low, high = self.x[0], self.x[-1]
        real = x.real if isinstance(x, complex) else x
        inside = bool(low <= real <= high)
        held = x if inside else float(min(max(real, low), high))
        per = (len(self.x) - 1) / (high - low)
        cell = min(int((held.real - low) * per), len(self.coefficients) - 1)
        a, b, c, d = self.coefficients[cell, 4 * column : 4 * column + 4].tolist()
        t = (held - low) * per - cell
        value, slope = a + t * (b + t * (c + t * d)), per * (b + t * (2.0 * c + 3.0 * t * d))
        if not inside and column in self.level:
            slope = 0.0 * x
        if order == 0:
            return value + slope * (x - held)
        if order == 1:
            return slope
        if not inside:
            return 0.0 * x
        return per * per * (2.0 * c + 6.0 * t * d) if order == 2 else 6.0 * per**3 * d

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Table)
            and np.array_equal(self.x, other.x)
            and np.array_equal(self.coefficients, other.coefficients)
            and self.level == other.level
        )

    @cached_property
    def _hash(self) -> int:
        return hash((self.x.tobytes(), self.coefficients.tobytes()))

    def __hash__(self) -> int:
        return self._hash

    def packed(self) -> Array:
        """Return the table as a vector for kernels.

        There is a straight cell before the first and one after the last, for places beyond the grid.
        """
        inner = self.coefficients.reshape(len(self.coefficients), -1, 4)
        before, behind = np.zeros_like(inner[:1]), np.zeros_like(inner[:1])
        before[0, :, 1], before[0, :, 0] = inner[0, :, 1], inner[0, :, 0] - inner[0, :, 1]
        behind[0, :, 0] = inner[-1].sum(axis=1)
        behind[0, :, 1] = inner[-1] @ [0.0, 1.0, 2.0, 3.0]
        for column in self.level:
            before[0, column] = inner[0, column, 0], 0.0, 0.0, 0.0
            behind[0, column, 1] = 0.0
        cells = np.concatenate([before, inner, behind]).transpose(0, 2, 1)
        spare = width(cells.shape[2]) - cells.shape[2]
        return np.pad(cells, [(0, 0), (0, 0), (0, spare)]).ravel()

    @property
    def grid(self) -> tuple[float, float, float]:
        """Start of the cells that a kernel reads, number of cells per unit of x, and the last one.

        A kernel looks no further than the third number. It is a quarter into the last cell, because on
        the border a kernel may take the cell before, whose cubic must not extend beyond its end.
        """
        cells = len(self.coefficients)
        width = float(self.x[-1] - self.x[0]) / cells
        return float(self.x[0]) - width, 1.0 / width, cells + 1.25

    def inverse(self, *, name: str = "table") -> Table:
        """Return x over y, for a characteristic that rises everywhere.

        Raises
        ------
        ParameterError
            If it does not rise everywhere.
        """
        px, py = (np.asarray(side) for side in self.points)
        if not (np.diff(py) > 0.0).all():
            raise ParameterError(f"{name} must rise everywhere: its force is not a function of speed")
        odd = self.x[0] < 0.0 and px[0] >= 0.0
        return Table.through(py, px, odd=odd, name=name)


def width(columns: int) -> int:
    """Return the number of columns in a table's cells in kernels: one, or four read at once."""
    return 1 if columns == 1 else WIDE


def names_of(table: str) -> tuple[str, str, str, str]:
    """Return the names of the kernel parameters for the place of a table and its grid."""
    return table, f"{table}__first", f"{table}__per", f"{table}__last"


def pack(tables: Sequence[Mapping[str, Table]]) -> tuple[Array | None, list[list[float]]]:
    """Return all distinct tables in one vector, and for each system the numbers of :func:`names_of`.

    Without tables there is no vector: a kernel call is cheaper with None than with an array. Tables
    start at multiples of :data:`ALIGNED`, so that float32 can locate a cell, however many there are.

    Parameters
    ----------
    tables : sequence of mapping of str to Table
        One mapping per system, with the same names in the same order.
    """
    starts: dict[Table, float] = {}
    parts, end = [np.zeros(ALIGNED)], ALIGNED
    for system in tables:
        for table in system.values():
            if table not in starts:
                starts[table] = float(end)
                numbers = table.packed()
                parts.append(np.pad(numbers, (0, -len(numbers) % ALIGNED)))
                end += len(parts[-1])
    packed = np.concatenate(parts) if starts else None
    return packed, [
        [number for t in system.values() for number in (starts[t], *t.grid)] for system in tables
    ]


def characteristic(
    x: ArrayLike, y: ArrayLike, *, odd: bool = False, name: str = "table"
) -> tuple[Array, Array, int]:
    """Return the points of a characteristic and the cells of its grid, without its curve.

    Parameters are those of :meth:`Table.through`; points of an odd one include their mirror image.

    Raises
    ------
    ParameterError
        If they are not points of a characteristic.
    """
    px, py = _points(name, x, y)
    if odd:
        if px[0] < 0.0 or (px[0] == 0.0 and py[0] != 0.0):
            raise ParameterError(
                f"{name} starts at ({px[0]:g}, {py[0]:g}); an odd characteristic is given from "
                "(0, 0) on"
            )
        if px[0] > 0.0:
            px, py = np.concatenate([[0.0], px]), np.concatenate([[0.0], py])
        px, py = np.concatenate([-px[:0:-1], px]), np.concatenate([-py[:0:-1], py])
    return px, py, _cells_of(px, name)


def _cells_of(x: Array, name: str) -> int:
    """Return the number of cells of the grid: all points lie on it, unless that takes too many.

    On such a grid the table goes through every point; on another one it rounds off details within a
    cell.
    """
    place = (x - x[0]) / (x[-1] - x[0])
    for cells in range(len(x) - 1, _MOST_EXACT + 1):
        at = np.round(place * cells)
        if np.abs(place * cells - at).max() < _ON_GRID and np.diff(at).min() > 0.0:
            return max(_CELLS_PER_POINT * cells, 2)
    wanted = math.ceil(_CELLS_PER_POINT / float(np.diff(place).min()))
    if wanted > _MOST_CELLS:
        raise ParameterError(
            f"x of {name} has points {float(np.diff(x).min()):g} apart in a range of "
            f"{x[-1] - x[0]:g}; the closest may be "
            f"{(x[-1] - x[0]) * _CELLS_PER_POINT / _MOST_CELLS:g} apart"
        )
    cells = max(_CELLS_PER_POINT * _MOST_EXACT, wanted)
    return cells + cells % 2  # 0 is on the grid of an odd one


def _points(name: str, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    px = checks.numbers(f"x of {name}", x, least=2)
    py = checks.numbers(f"y of {name}", y, least=2)
    if px.shape != py.shape:
        raise ParameterError(f"{name} has {len(px)} x and {len(py)} y; they must be equal in number")
    if not (np.isfinite(px).all() and np.isfinite(py).all()):
        raise ParameterError(f"{name} has points that are not finite")
    if not (np.diff(px) > 0.0).all():
        raise ParameterError(f"x of {name} is {px.tolist()}; it must rise from point to point")
    return px, py


def _hermite(x: Array, y: Array, slopes: Array) -> Array:
    """Return the coefficients of cubics with given values and slopes at the ends of cells."""
    h = np.diff(x)
    y0, y1, m0, m1 = y[:-1], y[1:], slopes[:-1] * h, slopes[1:] * h
    return np.stack([y0, m0, 3 * (y1 - y0) - 2 * m0 - m1, 2 * (y0 - y1) + m0 + m1], axis=1)
