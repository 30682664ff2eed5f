"""Files of profiles: SIMPACK (.prw, .prr), MiniProf (.whl, .ban), and two columns of text."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.contact.profiles import KINDS, Kind, Profile, flange_side
from railenv.errors import ParameterError, one_line
from railenv.files import write_whole

Array = NDArray[np.float64]

SIMPACK: dict[str, Kind] = {".prw": "wheel", ".prr": "rail"}
MINIPROF: dict[str, Kind] = {".whl": "wheel", ".ban": "rail"}
TEXT = (".csv", ".txt", ".dat")
ENDINGS = (*SIMPACK, *MINIPROF, *TEXT)

UNITS = {"m": 1.0, "mm": 1e-3}

_LARGEST = 2**24  # bytes
_WITH_COMMA = re.compile(r"[+-]?\d+(,\d+)?(e[+-]?\d+)?", re.IGNORECASE)
_DECLARED = re.compile(r"(?:\bin|\bunits?\s*[:=]|\by_|\[|\()\s*['\"]?(mm|m)\b", re.IGNORECASE)
_KEY = re.compile(r"^\s*([A-Za-z][\w. ]*?)\s*=\s*(.*)$")


@dataclass
class _Raw:
    """The content of a file before conversion to the package's axes."""

    rows: list[tuple[float, float]] = field(default_factory=list)
    scale: float | None = None
    """Metres per unit of length; None if the file does not state it."""
    source: str = ""


def read(
    path: str | PathLike[str],
    *,
    kind: Kind | None = None,
    units: Literal["m", "mm"] | None = None,
    name: str | None = None,
    mirror: bool = False,
    tape_circle: float = 0.0,
) -> Profile:
    """Read a profile; see :meth:`Profile.read`."""
    file = Path(path)
    _ending(file)
    size = file.stat().st_size
    if size > _LARGEST:
        raise ParameterError(f"{str(file)!r} has {size} bytes; a profile has at most {_LARGEST}")
    return parse(
        file.read_bytes(),
        file,
        kind=kind,
        units=units,
        name=name,
        mirror=mirror,
        tape_circle=tape_circle,
    )


def parse(
    content: bytes,
    path: str | PathLike[str],
    *,
    kind: Kind | None = None,
    units: Literal["m", "mm"] | None = None,
    name: str | None = None,
    mirror: bool = False,
    tape_circle: float = 0.0,
) -> Profile:
    """Return the profile in the content of a file; nothing is read from its path.

    The path's ending gives the format, and the path names the file in errors; see
    :meth:`Profile.read`.
    """
    file = Path(path)
    ending = _ending(file)
    own = {**SIMPACK, **MINIPROF}.get(ending)
    if kind is not None:
        checks.choice("kind of profile", kind, KINDS)
    if kind is not None and own not in (None, kind):
        raise ParameterError(f"{str(file)!r} is the profile of a {own}, not of a {kind}")
    kind = kind or own
    if kind is None:
        raise ParameterError(
            f"{str(file)!r} does not state its kind of profile; give kind='wheel' or 'rail'"
        )
    if units is not None:
        checks.choice("units", units, tuple(UNITS))
    if mirror and kind == "wheel":
        raise ParameterError("mirror is for rails; the flange of a wheel shows the direction of its y")
    place = checks.number("tape_circle", tape_circle, unit="m")
    raw = _read(content, file, ending)
    scale = raw.scale if units is None else UNITS[units]
    if scale is None:
        raise ParameterError(
            f"{str(file)!r} does not state its units; give units='mm' or 'm', or write them into its "
            "first line, as y_mm,z_mm"
        )
    if not raw.rows:
        raise ParameterError(f"{str(file)!r} has no points")
    points = scale * np.array(raw.rows)
    points[:, 0] -= place
    if np.isfinite(points).all():
        points *= _signs(kind, points, mirror)
    return Profile.of(points, kind=kind, name=name or file.stem, source=raw.source or file.name)


def write(profile: Profile, path: str | PathLike[str]) -> None:
    """Write a profile; see :meth:`Profile.write`."""
    file = Path(path)
    ending = _ending(file)
    own = {**SIMPACK, **MINIPROF}.get(ending)
    if own not in (None, profile.kind):
        raise ParameterError(f"{str(file)!r} is for the profile of a {own}, not of a {profile.kind}")
    rows = (1e3 * profile.points).tolist()
    said = one_line(f"{profile.name}: {profile.source}" if profile.source else profile.name)
    if ending in SIMPACK:
        said = said.replace("'", "")
        head = (
            f"header.begin\n  version = 1\n  type = {int(profile.kind == 'wheel')}\nheader.end\n"
            f"spline.begin\n  comment = '{said}'\n  units.len = 'mm'\n  units.len.f = 1000.0\n"
            "  point.begin\n"
        )
        body = "".join(f"    {y:.9f} {z:.9f}\n" for y, z in rows)
        text = f"{head}{body}  point.end\nspline.end\n"
    elif ending in MINIPROF:
        head = f"ProgramName=railenv\nComment={said}\nColumnDef=X,Y\nXYPoints={len(rows)}\n\n"
        text = head + "".join(f"{y:.9f} {z:.9f}\n" for y, z in rows)
    else:
        text = f"# {said}\ny_mm,z_mm\n" + "".join(f"{y:.9f},{z:.9f}\n" for y, z in rows)
    write_whole(file, text)


def _ending(file: Path) -> str:
    """Return the ending of a file of a known format."""
    ending = file.suffix.lower()
    if ending not in ENDINGS:
        raise ParameterError(f"{str(file)!r} must end in {', '.join(ENDINGS)}, the formats of profiles")
    return ending


def _read(content: bytes, file: Path, ending: str) -> _Raw:
    lines = content.decode("utf-8", errors="replace").splitlines()
    if ending in SIMPACK:
        return _simpack(file, lines, SIMPACK[ending])
    if ending in MINIPROF:
        return _miniprof(file, lines)
    return _text(file, lines)


def _simpack(file: Path, lines: list[str], kind: Kind) -> _Raw:
    """Read points between ``point.begin`` and ``point.end``, and the keys that describe them."""
    raw, inside, ended = _Raw(scale=1.0), False, False
    keys: dict[str, str] = {}
    header: dict[str, str] = {}
    section = ""
    for number, line in enumerate(lines, 1):
        text = re.split(r"[!%]", line, maxsplit=1)[0].strip()
        if not text:
            continue
        if text in ("header.begin", "spline.begin"):
            section = text.partition(".")[0]
        elif text == "point.begin":
            inside = True
        elif text == "point.end":
            inside, ended = False, True
        elif inside:
            raw.rows.append(_row(file, number, text, most=3))
        elif found := _KEY.match(text):
            (header if section == "header" else keys)[found[1]] = found[2].strip().strip("'\"")
    if not ended:
        raise ParameterError(
            f"{str(file)!r} has no point.begin ... point.end, so it is not a SIMPACK file"
        )
    told = header.get("type")
    if told is not None and _value(file, "type", told) != float(kind == "wheel"):
        raise ParameterError(
            f"{str(file)!r} says type = {told}, which is not that of a {kind} (rail 0, wheel 1)"
        )

    def number_of(key: str, without: float = 0.0) -> float:
        return _value(file, key, keys[key]) if key in keys else without

    if number_of("rotate") != 0.0:
        raise ParameterError(f"{str(file)!r} says rotate = {keys['rotate']}; only 0 can be read")
    if number_of("bound.z.min") < number_of("bound.z.max"):
        raise ParameterError(f"{str(file)!r} clips its points by bound.z; this cannot be read")
    factor = number_of("units.len.f", 1.0)
    if not factor > 0.0:
        raise ParameterError(f"{str(file)!r} says units.len.f = {factor:g}; it must be positive")
    shift = number_of("shift.y"), number_of("shift.z")
    low, high = number_of("bound.y.min"), number_of("bound.y.max")
    mirrored = [-1.0 if number_of(f"mirror.{axis}") == 1.0 else 1.0 for axis in "yz"]
    moved = [(y + shift[0], z + shift[1]) for y, z in raw.rows]
    raw.rows = [
        (mirrored[0] * y, mirrored[1] * z) for y, z in moved if not low < high or low <= y <= high
    ]
    raw.scale = 1.0 / factor
    raw.source = keys.get("comment", "")
    return raw


def _miniprof(file: Path, lines: list[str]) -> _Raw:
    """Read keys, and points below them in the columns that ``ColumnDef`` names; lengths are in mm."""
    raw = _Raw(scale=1e-3)
    keys: dict[str, str] = {}
    columns = ["X", "Y"]
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if not text or text[0] in '!"%#':
            continue
        if found := _KEY.match(text):
            if raw.rows:
                raise ParameterError(
                    f"{str(file)!r}, line {number} has the key {found[1]!r} after points"
                )
            keys[found[1]] = found[2].strip()
            columns = [c.strip() for c in keys.get("ColumnDef", "X,Y").split(",")]
            if not {"X", "Y"} <= set(columns):
                raise ParameterError(
                    f"{str(file)!r} says ColumnDef = {keys['ColumnDef']}; it must hold X and Y"
                )
        elif _is_row(text):
            raw.rows.append(_row(file, number, text, columns.index("X"), columns.index("Y")))
        elif raw.rows:
            raise ParameterError(f"{str(file)!r}, line {number} is {text[:40]!r}; it must hold a point")
    told = keys.get("XYPoints")
    if told is not None and _value(file, "XYPoints", told) != len(raw.rows):
        raise ParameterError(f"{str(file)!r} says XYPoints = {told} and has {len(raw.rows)} points")
    x0, y0 = (
        next((_value(file, k, keys[k]) for k in (f"{a}Offset", f"{a}offset") if k in keys), 0.0)
        for a in "XY"
    )
    raw.rows = [(x + x0, y + y0) for x, y in raw.rows]
    raw.source = keys.get("Comment", "")
    return raw


def _text(file: Path, lines: list[str]) -> _Raw:
    """Read two columns; comments and one line of titles before them may give the units."""
    raw = _Raw()
    comments = []
    titled = False
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if not text:
            continue
        if text[0] in "#!%":
            told = text.lstrip("#!% ")
            comments.append(told)
        elif not raw.rows and not titled and not _is_row(text):
            told, titled = text, True
        else:
            raw.rows.append(_row(file, number, text, most=2))
            continue
        if not raw.rows and (found := _DECLARED.search(told)):
            raw.scale = UNITS[found[1].lower()]
    raw.source = " ".join(comments)
    return raw


def _signs(kind: Kind, points: Array, mirror: bool) -> tuple[float, float]:
    """Return the factors that make y and z point outwards and upwards."""
    y, z = points.T
    if kind == "wheel":
        side, up = flange_side(y, z)
        return (-1.0 if side > 0.0 else 1.0), (-1.0 if up > 0.0 else 1.0)
    middle = float(np.median(z))  # near the top, since the sides of a head fall steeply
    return (-1.0 if mirror else 1.0), (-1.0 if z.max() - middle > middle - z.min() else 1.0)


def _row(
    file: Path, number: int, text: str, first: int = 0, second: int = 1, most: int | None = None
) -> tuple[float, float]:
    parts = _parts(text)
    try:
        if len(parts) <= max(first, second) or (most is not None and len(parts) > most):
            raise ValueError
        return float(parts[first]), float(parts[second])
    except ValueError:
        raise ParameterError(
            f"{str(file)!r}, line {number} is {text[:40]!r}; it must hold the two numbers of a point"
        ) from None


def _is_row(text: str) -> bool:
    try:
        return len([float(part) for part in _parts(text)]) >= 2
    except ValueError:
        return False


def _parts(text: str) -> list[str]:
    """Split a line; a comma is a decimal one if spaces or semicolons separate the numbers."""
    apart = [part for part in re.split(r"[;\s]+", text) if part]
    if len(apart) > 1 and "," in text and all(_WITH_COMMA.fullmatch(part) for part in apart):
        return [part.replace(",", ".") for part in apart]
    return [part for part in re.split(r"[,;\s]+", text) if part]


def _value(file: Path, key: str, text: str) -> float:
    try:
        return float(text.split(maxsplit=1)[0])
    except (IndexError, ValueError):
        raise ParameterError(f"{str(file)!r} says {key} = {text!r}; it must be a number") from None
