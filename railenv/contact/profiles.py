"""Profiles of wheels and rails: checked points and the smooth curve through them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import ParameterError, UnknownNameError, shown

Array = NDArray[np.float64]
Kind = Literal["wheel", "rail"]

SHIPPED: Mapping[str, Kind] = MappingProxyType(
    {
        "S1002": "wheel",
        "S1002_WORN": "wheel",
        "UIC60": "rail",
        "LMA": "wheel",
        "CHN60": "rail",
        "UIC519_A": "wheel",
        "UIC519_B": "wheel",
        "UIC519_H": "wheel",
        "UIC519_I": "wheel",
        "UIC519_RAIL_A": "rail",
    }
)
"""Names of the profiles that come with the package."""

KINDS = ("wheel", "rail")

LEAST_POINTS = 5
WIDTHS = (0.02, 0.3)
"""m; a profile narrower or wider than this is in other units."""

_LARGEST_HEIGHT = 0.2  # m
_FLANGE = 0.012  # m; the flange stands out of the tread by more than this
_RAIL_DEPTH = 0.010  # m below its top, down to which the face of a rail must not fold
_TREAD_WIDTH = 0.040  # m from the tape circle outwards, on which a wheel must not fold
_SAME_POINT = 1e-10  # m
_NEWTON_STEPS = 5


@dataclass(frozen=True, eq=False, repr=False)
class Profile:
    """Cross section of a wheel or a rail.

    The axes are the same for left and right: ``y`` points outwards, to the field side, and ``z``
    upwards. The flange of a wheel is at negative ``y`` and hangs down, and ``y = 0`` is its tape
    circle. The gauge face of a rail is at negative ``y``; where its origin lies does not matter.

    Make one with :meth:`named`, :meth:`read` or :meth:`of`, which check the points.

    Attributes
    ----------
    name : str
    kind : {"wheel", "rail"}
    y, z : ndarray, shape (n,)
        Points in m, with rising ``y``.
    source : str
        Where the points come from.
    """

    name: str
    kind: Kind
    y: Array
    z: Array
    source: str = ""

    @classmethod
    def named(cls, name: str) -> Profile:
        """Return a profile that comes with the package.

        Raises
        ------
        UnknownNameError
            If there is no profile of this name; :data:`SHIPPED` lists them.
        """
        if name not in SHIPPED:
            raise UnknownNameError("profile", [name], tuple(SHIPPED))
        from railenv.contact import files

        path = Path(__file__).parent / "data" / f"{name.lower()}.csv"
        return files.read(path, kind=SHIPPED[name], name=name)

    @classmethod
    def read(
        cls,
        path: str | PathLike[str],
        *,
        kind: Kind | None = None,
        units: Literal["m", "mm"] | None = None,
        name: str | None = None,
        mirror: bool = False,
        tape_circle: float = 0.0,
    ) -> Profile:
        """Read a profile from a file.

        The ending gives the format: ``.prw``, ``.prr`` (SIMPACK), ``.whl``, ``.ban`` (MiniProf), and
        ``.csv``, ``.txt``, ``.dat`` with two columns. The direction of the axes is found from the
        flange of a wheel, and up or down of a rail from the sides of its head.

        Parameters
        ----------
        path : path-like
        kind : {"wheel", "rail"}, optional
            Kind of profile in a text file; the other formats state it themselves.
        units : {"m", "mm"}, optional
            Units, if the file does not state them, or in place of those it states.
        name : str, optional
            Name of the profile; the file's name without ending if left out.
        mirror : bool
            Whether the ``y`` of a rail's file points to the gauge side. Wheels do not need it.
        tape_circle : float
            Place of a wheel's tape circle in the file, m, along the file's own ``y``.

        Raises
        ------
        ParameterError
            If the file or its points are not valid; the message says where.
        FileNotFoundError
            If the file does not exist.
        """
        from railenv.contact import files

        return files.read(
            path, kind=kind, units=units, name=name, mirror=mirror, tape_circle=tape_circle
        )

    @classmethod
    def of(
        cls, points: ArrayLike, *, kind: Kind, name: str = "given points", source: str = ""
    ) -> Profile:
        """Return the profile through some points.

        Parameters
        ----------
        points : array_like, shape (n, 2)
            ``y`` (outwards) and ``z`` (upwards), m, in the order of the profile, from either end.
        kind : {"wheel", "rail"}
        name, source : str

        Raises
        ------
        ParameterError
            If the points are too few, not finite, in other units, or fold.
        """
        checks.choice("kind of profile", kind, KINDS)
        what = f"{kind} {name}"
        y, z = _points(what, points)
        if y[-1] < y[0]:
            y, z = y[::-1], z[::-1]
        _check_size(what, y, z)
        y, z = _without_overhang(what, kind, y, z)
        if len(y) < LEAST_POINTS:
            raise ParameterError(f"{what} has {len(y)} points; it needs at least {LEAST_POINTS}")
        if kind == "wheel":
            _check_flange(what, y, z)
        for side in (y, z):
            side.setflags(write=False)
        return cls(name, kind, y, z, source)

    @property
    def points(self) -> Array:
        """Points as an array of shape (n, 2), m."""
        return np.stack([self.y, self.z], axis=1)

    def to_plain(self) -> str | dict[str, Any]:
        """Return the profile for files: the name of one that comes with the package, or its points."""
        if self.name in SHIPPED and self == Profile.named(self.name):
            return self.name
        return {"name": self.name, "source": self.source, "points": self.points.tolist()}

    @classmethod
    def from_plain(cls, value: Mapping[str, Any], *, kind: Kind) -> Profile:
        """Return the profile that :meth:`to_plain` gave as points.

        Raises
        ------
        ParameterError
            If it lacks points, or they are not valid.
        UnknownNameError
            If it has an unknown field.
        """
        checks.known(f"field of {kind}", value, ["name", "source", "points"])
        if "points" not in value:
            raise ParameterError(f"{kind} lacks points")
        return cls.of(value["points"], kind=kind, **{n: value[n] for n in value if n != "points"})

    def curve(self) -> Curve:
        """Return the smooth curve through the points."""
        return Curve.through(self.y, self.z)

    def turned(self, angle: float) -> Profile:
        """Return the profile turned by an angle (rad), with its top towards the track's centre.

        Raises
        ------
        ParameterError
            If the turned profile folds.
        """
        c, s = math.cos(angle), math.sin(angle)
        turned = np.stack([c * self.y - s * self.z, s * self.y + c * self.z], axis=1)
        return Profile.of(turned, kind=self.kind, name=self.name, source=self.source)

    def write(self, path: str | PathLike[str]) -> None:
        """Write the profile in the format of the file's ending.

        Raises
        ------
        ParameterError
            If the ending is unknown, or belongs to the other kind of profile.
        """
        from railenv.contact import files

        files.write(self, path)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Profile) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        return f"Profile({self.name!r}, {self.kind!r}, {len(self.y)} points)"

    def _key(self) -> tuple[str, str, bytes, bytes]:
        return self.name, self.kind, self.y.tobytes(), self.z.tobytes()


class Sampled(NamedTuple):
    """A curve at some places: height (m) and slope."""

    z: Array
    slope: Array


@dataclass(frozen=True, eq=False)
class Curve:
    """Smooth curve z(y) through points, by Akima's cubics over the length of the chords.

    They stay straight on straight lines, do not swing at corners, and follow arcs of circles closely
    even where these are steep, unlike cubics over ``y``.
    """

    y: Array
    length: Array
    cubics: Array
    """Coefficients, shape (4, cells, 2), of y and z in each cell, the highest power first."""

    @classmethod
    def through(cls, y: Array, z: Array) -> Curve:
        """Return the curve through points with rising y."""
        from scipy.interpolate import Akima1DInterpolator

        length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))])
        return cls(y, length, Akima1DInterpolator(length, np.stack([y, z], axis=1)).c)

    def __call__(self, y: Array) -> Sampled:
        """Return height and slope at places within the curve's ends."""
        cell = np.clip(np.searchsorted(self.y, y, side="right") - 1, 0, len(self.y) - 2)
        size = np.diff(self.length)[cell]
        c3, c2, c1, c0 = self.cubics[:, cell, :]
        t = size * (y - self.y[cell]) / np.diff(self.y)[cell]
        for _ in range(_NEWTON_STEPS):
            miss = c0[:, 0] + t * (c1[:, 0] + t * (c2[:, 0] + t * c3[:, 0])) - y
            rate = c1[:, 0] + t * (2.0 * c2[:, 0] + 3.0 * t * c3[:, 0])
            # in a nearly vertical face the rate may vanish; any point of the cell will do there
            t = np.clip(t - miss / np.where(rate > 1e-9, rate, 1.0), 0.0, size)
        rate = np.maximum(c1[:, 0] + t * (2.0 * c2[:, 0] + 3.0 * t * c3[:, 0]), 1e-9)
        rise = c1[:, 1] + t * (2.0 * c2[:, 1] + 3.0 * t * c3[:, 1])
        return Sampled(c0[:, 1] + t * (c1[:, 1] + t * (c2[:, 1] + t * c3[:, 1])), rise / rate)


def _points(what: str, points: ArrayLike) -> tuple[Array, Array]:
    """Return y and z of finite points, without points that repeat the one before."""
    try:
        values = np.array(points, dtype=float)
    except (OverflowError, TypeError, ValueError):
        raise ParameterError(f"{what} is {shown(points)}, which is not an array of points") from None
    if values.ndim != 2 or values.shape[1] != 2:
        raise ParameterError(f"{what} has shape {values.shape}; it must be (points, 2): y and z")
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if bad.size:
        raise ParameterError(
            f"{what}, point {bad[0] + 1} of {len(values)} is {_said(values[bad[0]])}; it must be finite"
        )
    if len(values) > 1:
        step = np.abs(np.diff(values, axis=0)).max(axis=1)
        values = values[np.concatenate([[True], step > _SAME_POINT])]
    if len(values) < LEAST_POINTS:
        raise ParameterError(f"{what} has {len(values)} points; it needs at least {LEAST_POINTS}")
    return values[:, 0].copy(), values[:, 1].copy()


def _check_size(what: str, y: Array, z: Array) -> None:
    """Raise unless the size is plausible for a profile in metres."""
    width, height = float(np.ptp(y)), float(np.ptp(z))
    low, high = WIDTHS
    if low <= width <= high and height <= _LARGEST_HEIGHT:
        return
    guess = ""
    if low <= width / 1e3 <= high:
        guess = "; the points seem to be in mm and were taken for m"
    elif low <= width * 1e3 <= high:
        guess = "; the points seem to be in m and were taken for mm"
    raise ParameterError(
        f"{what} is {width:g} m wide and {height:g} m high; a profile is {low:g} to {high:g} m wide "
        f"and at most {_LARGEST_HEIGHT:g} m high{guess}"
    )


def _without_overhang(what: str, kind: Kind, y: Array, z: Array) -> tuple[Array, Array]:
    """Return the part of a profile on which z is a function of y.

    No contact is possible on an overhanging face, so such faces are cut off below the head of a rail,
    behind the tip of a flange, and beyond the tread of a wheel. Elsewhere points that go back are
    mistakes.
    """
    middle = int(np.argmax(z) if kind == "rail" else np.argmin(np.abs(y)))
    ends = []
    for way in (-1, 1):
        last = middle
        while 0 <= last + way < len(y) and way * (y[last + way] - y[last]) > 0.0:
            last += way
        ends.append(last)
        if last in (0, len(y) - 1):
            continue
        if kind == "rail":
            allowed = z[middle] - z[last] >= _RAIL_DEPTH
        elif way < 0:
            allowed = z[last:].min() == z.min() and z[middle] - z.min() >= _FLANGE
        else:
            allowed = y[last] >= _TREAD_WIDTH
        if not allowed:
            raise ParameterError(
                f"{what} folds at point {_said((y[last], z[last]))}: the next one is "
                f"{_said((y[last + way], z[last + way]))}, and y must go on in one direction"
            )
    first, last = ends
    return y[first : last + 1].copy(), z[first : last + 1].copy()


def _check_flange(what: str, y: Array, z: Array) -> None:
    """Raise if the flange of a wheel is not at negative y and z."""
    side, up = flange_side(y, z)
    if side > 0.0 or up > 0.0:
        where = " and ".join(["y > 0"] * (side > 0.0) + ["z > 0"] * (up > 0.0))
        raise ParameterError(
            f"{what} has its flange at {where}; y points outwards and z upwards, so it must be at "
            "y < 0 and z < 0"
        )
    if not y[0] < 0.0 < y[-1]:
        raise ParameterError(
            f"{what} reaches from y = {y[0]:g} to {y[-1]:g} m; y = 0 must lie within because it is the "
            "tape circle"
        )


def flange_side(y: Array, z: Array) -> tuple[float, float]:
    """Return the signs of y and z of a wheel's flange, and zeros if there is none."""
    tread = float(np.median(z))
    tip = int(np.argmax(np.abs(z - tread)))
    out = z[tip] - tread
    if abs(out) < _FLANGE:
        return 0.0, 0.0
    return float(np.sign(y[tip] - 0.5 * (y.min() + y.max()))), float(np.sign(out))


def _said(point: ArrayLike) -> str:
    y, z = np.asarray(point, dtype=float).tolist()
    return f"(y = {y:.6g}, z = {z:.6g})"
