"""CSV files of track irregularity: their required content, and its conversion to a line."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.errors import ParameterError, shown
from railenv.files import write_whole

Array = NDArray[np.float64]

UNITS = {"m": 1.0, "mm": 1e-3}

DISTANCE = "distance"
OF_LINE = ("align", "vert", "cross")
OF_RAILS = ("alignment_left", "alignment_right", "level_left", "level_right")
CROSS_LEVEL = "cross_level"

LARGEST = 0.5
"""m; no track is that irregular, so a file with larger values has another unit."""

STEEPEST = 0.3
"""rad; no cross-level angle is that large."""

_WIDEST_GAP = 5.0  # m; largest distance of rows to interpolate between if they are usually closer
_FAR = 4.0  # times the median spacing
_UNIFORM = 1e-6  # of the spacing: files have rounded distances
_LARGEST_FILE = 2**28  # bytes


def read(
    path: str | PathLike[str], *, unit: str, base: float, opposite: Sequence[str]
) -> tuple[dict[str, Array], float]:
    """Return align, vert (m) and cross (rad) of a file, and their spacing (m).

    See :meth:`railenv.irregularity.Line.from_file` for the content of a file.

    Raises
    ------
    ParameterError
        If the file is not such a table; the message names file, column and row.
    UnknownNameError
        If a column in ``opposite`` is not read.
    """
    checks.choice("unit", unit, tuple(UNITS))
    base = checks.number("base", base, low=0.0, open_low=True, unit="m")
    file = Path(path)
    names, rows, lines = _rows(file)
    wanted = _wanted(file, names)
    if isinstance(opposite, str):
        raise ParameterError(f"opposite is {opposite!r}; it must be a sequence of names of columns")
    checks.known("column in opposite", opposite, [n for n in wanted if n != DISTANCE])
    columns = {name: _column(file, name, names.index(name), rows, lines) for name in wanted}
    for name, values in columns.items():
        if name in opposite:
            values *= -1.0
        if name not in (DISTANCE, "cross"):
            values *= UNITS[unit]
            _check_size(file, name, values, lines, LARGEST, "m", f"its unit may not be {unit}")
        elif name == "cross":
            _check_size(file, name, values, lines, STEEPEST, "rad", "it must be an angle in rad")
    distance = columns.pop(DISTANCE)
    return _uniform(distance, _spacing(file, distance, lines), _of_line(columns, base))


def write(path: str | PathLike[str], spacing: float, records: Mapping[str, Array]) -> None:
    """Write distance (m) and the records of a line as a CSV file; numbers keep all their digits."""
    table = zip(*(records[name].tolist() for name in OF_LINE), strict=True)
    body = (",".join(map(repr, (k * spacing, *values))) for k, values in enumerate(table))
    write_whole(Path(path), "\n".join([",".join((DISTANCE, *OF_LINE)), *body, ""]))


def _rows(file: Path) -> tuple[list[str], list[list[str]], list[int]]:
    """Return the names of the columns, the rows as texts, and the number of each row in the file."""
    size = file.stat().st_size
    if size > _LARGEST_FILE:
        raise ParameterError(f"{str(file)!r} has {size} bytes; a line has at most {_LARGEST_FILE}")
    text = file.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    kept = [(n, row) for n, row in enumerate(text, 1) if row.strip() and not row.startswith("#")]
    if not kept:
        raise ParameterError(f"{str(file)!r} is empty; its first row must name the columns")
    mark = next((c for c in ",;\t" if c in kept[0][1]), ",")
    cells = [[cell.strip() for cell in row] for row in csv.reader((r for _, r in kept), delimiter=mark)]
    names = [name.lower().replace(" ", "_") for name in cells[0]]
    for n, row in zip((n for n, _ in kept), cells, strict=True):
        if len(row) != len(names):
            raise ParameterError(
                f"row {n} of {str(file)!r} has {len(row)} columns; the first row names {len(names)}"
            )
    return names, cells[1:], [n for n, _ in kept[1:]]


def _wanted(file: Path, names: list[str]) -> list[str]:
    """Return the columns to read."""
    of_line = any(name in names for name in OF_LINE)
    wanted = [DISTANCE, *(OF_LINE if of_line else OF_RAILS)]
    missing = [name for name in wanted if name not in names]
    if missing:
        raise ParameterError(
            f"{str(file)!r} has no column {', '.join(missing)}; it needs {DISTANCE} and either "
            f"{', '.join(OF_LINE)} or {', '.join(OF_RAILS)}, and has {', '.join(map(shown, names))}"
        )
    if not of_line and CROSS_LEVEL in names:
        wanted.append(CROSS_LEVEL)
    twice = [name for name in wanted if names.count(name) > 1]
    if twice:
        raise ParameterError(f"{str(file)!r} has the column {twice[0]} more than once")
    return wanted


def _column(file: Path, name: str, place: int, rows: list[list[str]], lines: list[int]) -> Array:
    """Return the numbers of a column."""
    values = np.empty(len(rows))
    for k, row in enumerate(rows):
        try:
            values[k] = float(row[place])
        except ValueError:
            values[k] = np.nan
        if not np.isfinite(values[k]):
            raise ParameterError(
                f"{name} in row {lines[k]} of {str(file)!r} is {shown(row[place])}; it must be a "
                "finite number"
            )
    return values


def _check_size(
    file: Path, name: str, values: Array, lines: list[int], most: float, unit: str, cause: str
) -> None:
    if len(values) and np.abs(values).max() > most:
        k = int(np.argmax(np.abs(values)))
        raise ParameterError(
            f"{name} in row {lines[k]} of {str(file)!r} is {values[k]:g} {unit}; it must be at most "
            f"{most:g} {unit} either way: {cause}"
        )


def _spacing(file: Path, distance: Array, lines: list[int]) -> float:
    """Return the median spacing (m) of the rows."""
    if len(distance) < 2:
        raise ParameterError(f"{str(file)!r} has {len(distance)} rows; a line needs at least 2")
    steps = np.diff(distance)
    if not (steps > 0.0).all():
        k = int(np.flatnonzero(steps <= 0.0)[0])
        raise ParameterError(
            f"{DISTANCE} in row {lines[k + 1]} of {str(file)!r} is {distance[k + 1]:g} m after "
            f"{distance[k]:g} m; it must increase"
        )
    spacing = float(np.median(steps))
    widest = int(np.argmax(steps))
    if steps[widest] > max(_WIDEST_GAP, _FAR * spacing):
        raise ParameterError(
            f"{DISTANCE} in row {lines[widest + 1]} of {str(file)!r} is {distance[widest + 1]:g} m "
            f"after {distance[widest]:g} m; there must be no such gap, where rows are usually "
            f"{spacing:g} m apart"
        )
    return spacing


def _of_line(columns: Mapping[str, Array], base: float) -> dict[str, Array]:
    """Return the columns of a line, from its own or from those of both rails."""
    if "align" in columns:
        return dict(columns)
    left, right = columns["level_left"], columns["level_right"]
    return {
        "align": (columns["alignment_left"] + columns["alignment_right"]) / 2.0,
        "vert": (left + right) / 2.0,
        "cross": columns.get(CROSS_LEVEL, left - right) / base,
    }


def _uniform(
    distance: Array, spacing: float, records: dict[str, Array]
) -> tuple[dict[str, Array], float]:
    """Return the records at a uniform spacing (m), and the spacing; uniform ones are unchanged."""
    from_start = distance - distance[0]
    mean = from_start[-1] / (len(distance) - 1)
    if np.abs(from_start - mean * np.arange(len(distance))).max() <= _UNIFORM * mean:
        return records, mean
    grid = spacing * np.arange(int(from_start[-1] / spacing * (1.0 + 1e-12)) + 1)
    return {name: np.interp(grid, from_start, values) for name, values in records.items()}, spacing
