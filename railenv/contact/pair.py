"""A pair of profiles in the track: lift, angle, rolling radius and place of contact over the shift."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.contact import conicity
from railenv.contact.conicity import Method
from railenv.contact.laws import ContactLaw, LinearContact
from railenv.contact.profiles import SHIPPED, Kind, Profile
from railenv.contact.search import Contacts, Search, Surfaces, rigid
from railenv.equations import shapes
from railenv.errors import ParameterError, UnknownNameError
from railenv.tables import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

WIDTH = 1.5e-5
"""m; the default of ``ProfilePair.width``."""

STEP = 1e-5
"""m; the default of ``ProfilePair.step``."""

RAIL_YIELD = 3.5e-3
"""m; the default of ``ProfilePair.rail_yield``."""

TREAD_SLOPE = 0.2
"""Tangent of the contact angle up to which friction holds the rail against the thrust of a wheel."""

GRID = 5e-5
"""m; the default of ``ProfilePair.grid``."""

FINEST_STEP = 2e-6
"""m; the least ``ProfilePair.step``."""

REACH = 0.020
"""Range (m) of the tables to both sides, if the profiles reach so far."""

FLANGE_SLOPE = 0.5
"""Tangent of the contact angle above which a wheel counts as running on its flange."""

STEEP = 0.98
"""Share of the largest slope down to which a flange counts as at its steepest."""

_NEWTON_STEPS = 6
_BLEND = 0.02  # of the tangent, within which a rail begins to give way
_ONWARDS = 0.05  # least change of the shift over that of the contact, on a rail that yields
_END = 5e-4  # m; contacts nearer to the end of a profile's points are not trusted
_FLANGE_DROP = 6e-3  # m below the tape circle, where no tread is
_RIGID_STEP = 1e-5  # m
_COARSE_STEP = 1e-4  # m
_FINE = 1001  # places in a cell of points, to find a level
_FURTHEST = 0.06  # m inwards, to find a place for the wheel
_RESOLVED = 1e-9
_GAUGES = (0.3, 2.5)  # m, from garden railways to more than Brunel's


class Tables(NamedTuple):
    """Columns over a uniform grid of shifts, for splines; all columns are 0 at the shift 0.

    Attributes
    ----------
    eta : ndarray
        Shift of the wheel towards its own flange, m.
    height, radius, place : ndarray
        Lift, rolling radius and contact place (outwards), m.
    """

    eta: Array
    height: Array
    radius: Array
    place: Array


class RigidContact(NamedTuple):
    """Contact of rigid profiles; fields are those of the methods of :class:`ProfilePair`."""

    height: Array
    angle: Array
    radius: Array
    place: Array


@dataclass(frozen=True)
class ProfilePair(ContactLaw):
    """A wheel's profile on a rail's.

    Everything is given for one wheel over ``eta``, its lateral shift towards its own flange, so that
    left and right are the same. The contact is quasi-elastic: lift, radius and place are means over the
    gap with weights exp(-gap/width), so that they are smooth where rigid contact jumps, and the slope
    of the lift is the tangent of the contact angle, as the work of the normal force requires.

    Parameters
    ----------
    wheel, rail : str, path, array_like of shape (n, 2), or Profile
        Name of a shipped profile, a file (see :meth:`Profile.read`), points in m (see
        :meth:`Profile.of`) or a profile. Kept as a :class:`Profile`.
    inclination : float
        Angle by which the rail leans towards the track's centre, rad; 0 for a rail that was measured as
        it lies in the track.
    gauge : float
        Distance of the rails, m.
    back_to_back : float
        Distance of the backs of the flanges, m.
    nominal_radius : float
        Radius of the wheel at its tape circle, m.
    tape_circle : float
        Distance of the tape circle from the back of the flange, m.
    gauge_depth : float
        Depth below the top of the rail at which the gauge is measured, m.
    width : float
        Width of the weights, m. A Hertzian patch of lateral semi-axis b on profiles of relative radius
        R is as wide as these weights for ``width`` = b^2 / (5 R): 1.5e-5 m for wheels of about 60 kN,
        5e-6 m for 10 kN. Narrower weights come closer to rigid contact.
    step : float
        Step of the tables, m; where the contact jumps, the slope of the lift changes within about 4
        ``width`` over the difference of the slopes, some 0.03 mm from tread to flange. With the default
        step, splines are accurate there to 0.001 in the slope and 1 um in the radius (which jumps by
        8 mm). Halve it with the width.
    rail_yield : float
        Lateral displacement of the rail if the wheel load pushed sideways (wheel load over lateral
        stiffness), m: 3.5e-3 m for 57 kN on the 16.2 MN/m of the paper. The equations of motion
        include it, and it gives the flange its stiffness: the rail yields to the thrust of a contact
        beyond that of a tread (:data:`TREAD_SLOPE`), which friction holds. The methods describe the
        profiles on unyielding rails. 0 is such a rail.
    grid : float
        Step of the tables that the equations of motion read, m.

    Raises
    ------
    ParameterError
        If a value is not allowed, the profiles do not touch, or the flange is on the rail at the
        centre.
    """

    kind = "profiles"
    law = shapes.PROFILES

    wheel: Any = "S1002"
    rail: Any = "UIC60"
    inclination: float = 1.0 / 40.0
    gauge: float = 1.435
    back_to_back: float = 1.360
    nominal_radius: float = 0.46
    tape_circle: float = 0.070
    gauge_depth: float = 0.014
    width: float = WIDTH
    step: float = STEP
    rail_yield: float = RAIL_YIELD
    grid: float = GRID

    def __post_init__(self) -> None:
        def keep(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        low, high = _GAUGES
        keep("wheel", profile_of(self.wheel, "wheel"))
        keep("rail", profile_of(self.rail, "rail"))
        keep(
            "inclination",
            checks.number("inclination", self.inclination, low=-0.2, high=0.2, unit="rad"),
        )
        keep("gauge", checks.number("gauge", self.gauge, low=low, high=high, unit="m"))
        keep(
            "back_to_back",
            checks.number("back_to_back", self.back_to_back, low=0.2, high=high, unit="m"),
        )
        keep(
            "nominal_radius",
            checks.number("nominal_radius", self.nominal_radius, low=0.05, high=2, unit="m"),
        )
        keep("tape_circle", checks.number("tape_circle", self.tape_circle, low=0.0, high=0.2, unit="m"))
        keep(
            "gauge_depth", checks.number("gauge_depth", self.gauge_depth, low=0.0, high=0.05, unit="m")
        )
        keep("width", checks.number("width", self.width, low=5e-7, high=2e-4, unit="m"))
        keep("step", checks.number("step", self.step, low=FINEST_STEP, high=1e-4, unit="m"))
        keep("rail_yield", checks.number("rail_yield", self.rail_yield, low=0.0, high=0.05, unit="m"))
        keep("grid", checks.number("grid", self.grid, low=FINEST_STEP, high=2e-4, unit="m"))
        self._check_centre()

    # ------------------------------------------------------------------- as a contact law

    @classmethod
    def table_fields(cls) -> list[str]:
        """Names of the fields that the equations read as tables."""
        return ["profiles"]

    def table(self, field: str) -> Table:
        """Return the table for the equations, with columns :class:`railenv.equations.shapes.Touch`."""
        return self._table

    @cached_property
    def _table(self) -> Table:
        """Columns over the shift of the wheel on a rail that yields to a flange.

        The rail moves aside until its spring holds the thrust. Lift and slope are then those of the
        contact found there, and the lift includes the work of the spring (it is a Moreau envelope), so
        the normal contact stays conservative. Beyond its steepest place a flange goes on straight.
        """
        lift, radius, place = self._splines
        at = self._onwards()
        shift = at + self.rail_yield * _way(lift(at, 1))[0]
        reach = (math.ceil(shift[0] / self.grid), math.floor(shift[-1] / self.grid))
        # The third derivative of a cubic jumps from cell to cell, so 0, where wheels rest, is to be in
        # the middle of a cell.
        eta = (np.arange(reach[0], reach[1]) + 0.5) * self.grid
        at = np.interp(eta, shift, at)
        for _ in range(_NEWTON_STEPS):
            way, rate, _ = _way(lift(at, 1))
            miss = at + self.rail_yield * way - eta
            at = at - miss / (1.0 + self.rail_yield * rate * lift(at, 2))
        height = lift(at) + self.rail_yield * _way(lift(at, 1))[2]
        columns = [column - np.interp(0.0, eta, column) for column in (height, radius(at), place(at))]
        return Table.spline(eta, *columns, name=str(self)).with_slope(0)

    def _onwards(self) -> Array:
        """Return the shifts of the contacts that follow one another on a yielding rail."""
        eta = self.tables.eta
        lift = self._splines[0]
        slope = lift(eta, 1)
        _, rate, _ = _way(slope)
        onwards = 1.0 + self.rail_yield * rate * lift(eta, 2) > _ONWARDS
        steepest = int(np.argmax(np.where(eta > 0.0, slope, -1.0)))
        zero = int(np.argmin(np.abs(eta)))
        bad = np.flatnonzero(~onwards)
        first = int(bad[bad < zero].max(initial=-1)) + 1
        last = min(steepest, int(bad[bad > zero].min(initial=len(eta))) - 1)
        return np.asarray(eta[first : last + 1])

    def to_mapping(self) -> dict[str, Any]:
        """Return the pair as plain values, for files: shipped profiles by name, others by points."""
        found = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        profiles = {name: found[name].to_plain() for name in ("wheel", "rail")}
        return {"law": self.kind, **found, **profiles}

    # ------------------------------------------------------------------------- over the shift

    @cached_property
    def tables(self) -> Tables:
        """Lift, rolling radius and contact place over a uniform grid, for the equations of motion.

        The grid extends 20 mm to both sides, less if the contact would leave the points of a profile or
        pass the tip of the flange.
        """
        found = self._contacts
        zero = int(np.argmin(np.abs(found.eta)))
        for column in (found.eta, found.height, found.drop, found.place):
            column.setflags(write=False)
        columns = (found.height, -found.drop, found.place)
        return Tables(found.eta, *(column - column[zero] for column in columns))

    def height(self, eta: ArrayLike) -> Any:
        """Return the lift of the wheel (m) over its shift (m); 0 at the shift 0."""
        return self._read(self._splines[0], eta)

    def angle(self, eta: ArrayLike) -> Any:
        """Return the contact angle against the wheelset's axle, rad."""
        return np.arctan(self._read(self._splines[0], eta, 1))

    def radius(self, eta: ArrayLike) -> Any:
        """Return the rolling radius, m."""
        return self.nominal_radius - self._centre[1] + self._read(self._splines[1], eta)

    def place(self, eta: ArrayLike, *, absolute: bool = False) -> Any:
        """Return the contact place, m outwards from its place at the shift 0.

        Parameters
        ----------
        eta : float or array_like
        absolute : bool
            Count outwards from the track's centre instead.
        """
        start = self.tape_place + self._centre[2] if absolute else 0.0
        return start + self._read(self._splines[2], eta)

    def rigid(self, eta: ArrayLike) -> RigidContact:
        """Search the contact of the rigid profiles, without tables and weights, as a check on both.

        ``height`` counts from the rigid contact at the shift 0, and so does ``place``.
        """
        wanted = np.atleast_1d(np.asarray(eta, dtype=float))
        at = [rigid(self.surfaces, e, _RIGID_STEP) for e in (0.0, *wanted.tolist())]
        height, slope, drop, place = (np.array(column) for column in zip(*at, strict=True))
        shape = np.shape(eta)
        return RigidContact(
            (height[1:] - height[0]).reshape(shape),
            np.arctan(slope[1:]).reshape(shape),
            (self.nominal_radius - drop[1:]).reshape(shape),
            (place[1:] - place[0]).reshape(shape),
        )

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest shift of the tables, m."""
        return float(self.tables.eta[0]), float(self.tables.eta[-1])

    @property
    def tape_place(self) -> float:
        """Distance of the tape circle from the centre of the wheelset, m."""
        return 0.5 * self.back_to_back + self.tape_circle

    @property
    def half_contact_distance(self) -> float:
        """Half the distance of the two contacts at the centre, m."""
        return float(self.place(0.0, absolute=True))

    @cached_property
    def flange_angle(self) -> float:
        """Largest contact angle on the way to the flange, rad."""
        eta = self.tables.eta
        return float(np.max(self.angle(eta[eta >= 0.0])))

    @cached_property
    def flange_clearance(self) -> float:
        """Shift at which the contact reaches the flange, m; infinite if it does not.

        There the tangent of the contact angle reaches 0.5, which is more than on any tread and less
        than on any flange.
        """
        eta = self.tables.eta
        slope = np.tan(self.angle(eta))
        on = np.flatnonzero((eta > 0.0) & (slope >= FLANGE_SLOPE))
        if not on.size:
            return math.inf
        k = int(on[0])
        return float(np.interp(FLANGE_SLOPE, slope[k - 1 : k + 1], eta[k - 1 : k + 1]))

    @cached_property
    def flange_top(self) -> tuple[float, float] | None:
        """Shift and lift (m) beyond which the flange becomes less steep; None without a flange."""
        if not math.isfinite(self.flange_clearance):
            return None
        eta = self.tables.eta[self.tables.eta >= 0.0]
        shift = flange_top(eta, np.tan(self.angle(eta)))
        return shift, float(self.height(shift))

    # ---------------------------------------------------------------------- of the wheelset

    def rolling_radius_difference(self, y: ArrayLike) -> Any:
        """Return left minus right rolling radius (m) of a wheelset displaced by ``y`` (m) to the left.

        Its roll is neglected, as in EN 15302: both wheels are shifted by ``y`` and have this profile.
        """
        shift = np.asarray(y, dtype=float)
        return self.radius(shift) - self.radius(-shift)

    def contact_angle_difference(self, y: ArrayLike) -> Any:
        """Return left minus right contact angle (rad) of a wheelset displaced to the left by y (m)."""
        shift = np.asarray(y, dtype=float)
        return self.angle(shift) - self.angle(-shift)

    def roll(self, y: ArrayLike) -> Any:
        """Return the roll (rad, left up) of a wheelset displaced to the left by ``y`` (m)."""
        shift = np.asarray(y, dtype=float)
        return (self.height(shift) - self.height(-shift)) / (2.0 * self.half_contact_distance)

    def equivalent_conicity(self, amplitude: ArrayLike, method: Method = "EN 15302") -> Any:
        """Return the equivalent conicity at an amplitude, or several, in m.

        Parameters
        ----------
        amplitude : float or array_like
        method : {"EN 15302", "harmonic"}
            See :func:`railenv.equivalent_conicity`.

        Raises
        ------
        ParameterError
            If an amplitude is not positive or goes beyond the tables.
        """
        eta, difference = self._difference
        return conicity.equivalent_conicity(eta, difference, amplitude, method)

    def linear(self, amplitude: float = 3e-3) -> LinearContact:
        """Return conicity, contact angle and its rate by harmonic linearisation at an amplitude (m)."""
        eta, difference = self._difference
        wanted = conicity.amplitudes(checks.number("amplitude", amplitude, unit="m"))
        slope = self._read(self._splines[0], eta, 1)
        return LinearContact(
            float(conicity.harmonic(eta, 0.5 * difference, wanted)[0]),
            float(self._read(self._splines[0], 0.0, 1)),
            float(conicity.harmonic(eta, 0.5 * (slope - slope[::-1]), wanted)[0]),
        )

    def plot(self) -> Figure:
        """Draw profiles with contacts, rolling-radius difference, contact angles and conicity."""
        from railenv.contact.pair_plots import plot_pair

        return plot_pair(self)

    # ------------------------------------------------------------------------------- inside

    def __str__(self) -> str:
        lean = f", inclination 1:{1.0 / self.inclination:.4g}" if self.inclination else ""
        return f"{self.wheel.name} on {self.rail.name}{lean}, gauge {1e3 * self.gauge:.6g} mm"

    @cached_property
    def search(self) -> Search:
        """Grids of the contact search."""
        return Search(self.surfaces, step=self.step, width=self.width, reach=REACH)

    @cached_property
    def surfaces(self) -> Surfaces:
        """Curves of wheel and rail, and their places."""
        rail = self.rail.turned(self.inclination)
        curve = rail.curve()
        top = int(np.argmax(rail.z))
        crown = np.linspace(rail.y[max(top - 1, 0)], rail.y[min(top + 1, len(rail.y) - 1)], _FINE)
        level = float(curve(crown).z.max()) - self.gauge_depth
        if rail.z[0] > level:
            lowest = 1e3 * (level + self.gauge_depth - rail.z[0])
            raise ParameterError(
                f"{rail.name} reaches {lowest:.4g} mm below its top on the gauge side; the gauge is "
                f"measured {1e3 * self.gauge_depth:.4g} mm below it (gauge_depth)"
            )
        # the innermost place above this level
        inner = int(np.flatnonzero(rail.z[: top + 1] <= level)[-1])
        face = np.linspace(rail.y[inner], rail.y[inner + 1], _FINE)
        face_y = float(np.interp(level, curve(face).z, face))
        offset = 0.5 * self.gauge - face_y - self.tape_place
        return Surfaces(self.wheel.curve(), curve, offset)

    def _check_centre(self) -> None:
        """Raise if the wheels do not run on their treads at the centre of the track."""
        wheel, rail, offset = self.surfaces
        at = self.tape_place
        there = [at + wheel.y[0], at + wheel.y[-1], at + offset + rail.y[0], at + offset + rail.y[-1]]
        said = (
            f"wheel {self.wheel.name} reaches from {there[0]:.4g} to {there[1]:.4g} m off the track's "
            f"centre, rail {self.rail.name} from {there[2]:.4g} to {there[3]:.4g} m"
        )
        overlap = min(there[1], there[3]) - max(there[0], there[2])
        if overlap < 10 * _END:
            raise ParameterError(
                f"the profiles do not touch: {said}, with gauge {self.gauge:g} m, back_to_back "
                f"{self.back_to_back:g} m and tape_circle {self.tape_circle:g} m"
            )
        if self._free(0.0):
            _, _, _, place = rigid(self.surfaces, 0.0, _COARSE_STEP)
            ends = place - wheel.y[0], wheel.y[-1] - place, place - offset - rail.y[0]
            if min(*ends, offset + rail.y[-1] - place) < _END:
                raise ParameterError(
                    f"the profiles touch at an end of their points only: {said}; the contact is at "
                    f"{at + place:.4g} m"
                )
            return
        inwards = np.arange(1, int(_FURTHEST / _COARSE_STEP)) * _COARSE_STEP
        reachable = inwards[inwards < overlap - 10 * _END]
        free = next((float(e) for e in reachable if self._free(-float(e))), None)
        more = (
            "and it comes free nowhere"
            if free is None
            else f"and comes free {1e3 * free:.2g} mm further in; the gauge is about {2e3 * free:.2g} "
            "mm too narrow, or back_to_back as much too wide"
        )
        raise ParameterError(
            f"wheel {self.wheel.name} is on its flange at the centre of the track already (gauge "
            f"{self.gauge:g} m, back_to_back {self.back_to_back:g} m) {more}"
        )

    def _free(self, eta: float) -> bool:
        """Return whether the rigid wheel is on its tread at a shift."""
        _, slope, drop, _ = rigid(self.surfaces, eta, _COARSE_STEP)
        return slope < FLANGE_SLOPE and drop > -_FLANGE_DROP

    @cached_property
    def _contacts(self) -> Contacts:
        """Contacts at the shifts where they are within the points of both profiles."""
        search = self.search
        found = search.contacts()
        wheel, rail, offset = self.surfaces
        on_wheel, on_rail = found.place - found.eta, found.place - offset
        tip = (
            self.wheel.y[int(np.argmin(self.wheel.z))] if np.min(self.wheel.z) < -_FLANGE_DROP else -1.0
        )
        inside = (on_wheel > max(wheel.y[0] + _END, tip)) & (on_wheel < wheel.y[-1] - _END)
        inside &= (on_rail > rail.y[0] + _END) & (on_rail < rail.y[-1] - _END)
        zero = search.steps
        if not inside[zero]:
            raise ParameterError(
                f"the contact of {self.wheel.name} on {self.rail.name} is at the end of a profile's "
                f"points at the centre already: {1e3 * on_wheel[zero]:.4g} mm on the wheel"
            )
        outside = np.flatnonzero(~inside)
        first = int(outside[outside < zero].max(initial=-1)) + 1
        last = int(outside[outside > zero].min(initial=len(inside)))
        kept = slice(first, last)
        return Contacts(
            found.eta[kept].copy(),
            found.height[kept].copy(),
            found.slope[kept].copy(),
            found.drop[kept].copy(),
            found.place[kept].copy(),
        )

    @cached_property
    def _centre(self) -> tuple[float, float, float]:
        """Lift, drop and place of the contact at the shift 0, in the profiles' own heights."""
        zero = int(np.argmin(np.abs(self._contacts.eta)))
        found = self._contacts
        return float(found.height[zero]), float(found.drop[zero]), float(found.place[zero])

    @cached_property
    def _splines(self) -> tuple[CubicSpline, CubicSpline, CubicSpline]:
        from scipy.interpolate import CubicSpline

        eta, *columns = self.tables
        height, radius, place = (CubicSpline(eta, column) for column in columns)
        return height, radius, place

    @cached_property
    def _difference(self) -> tuple[Array, Array]:
        """Symmetric shifts, and the rolling-radius difference there."""
        eta, _, radius, _ = self.tables
        zero = int(np.argmin(np.abs(eta)))
        count = min(zero, len(eta) - 1 - zero)
        kept = slice(zero - count, zero + count + 1)
        return eta[kept], radius[kept] - radius[kept][::-1]

    def _read(self, spline: CubicSpline, eta: ArrayLike, order: int = 0) -> Any:
        """Return values of a spline within the tables."""
        wanted = np.asarray(eta, dtype=float)
        low, high = self.reach
        if not ((wanted >= low - _RESOLVED) & (wanted <= high + _RESOLVED)).all():
            bad = wanted[~((wanted >= low) & (wanted <= high))].flat[0]
            raise ParameterError(f"shift is {bad:g} m; the tables go from {low:g} to {high:g} m")
        found = spline(wanted, order)
        return float(found) if wanted.ndim == 0 else found


def _way(slope: Array) -> tuple[Array, Array, Array]:
    """Return the yield of a rail, its derivative by the slope, and the work of its spring.

    All over ``rail_yield`` (and the wheel load); the slope is the tangent of the contact angle.
    """
    beyond = slope - TREAD_SLOPE
    root = np.sqrt(beyond * beyond + _BLEND * _BLEND)
    way = 0.5 * (beyond + root)
    stored = 0.25 * (beyond * (beyond + root) + _BLEND**2 * np.arcsinh(beyond / _BLEND))
    return way, 0.5 * (1.0 + beyond / root), slope * way - stored


def flange_top(eta: Array, slope: Array) -> float:
    """Return the last shift at which the contact is about as steep as it gets."""
    return float(eta[np.flatnonzero(slope >= STEEP * slope.max())[-1]])


def profile_of(value: Any, kind: Kind) -> Profile:
    """Return the profile of a name, a file, points or a profile.

    Raises
    ------
    ParameterError
        If it is not a profile, or one of the other kind.
    """
    if isinstance(value, Profile):
        found = value
    elif isinstance(value, Mapping):
        found = Profile.from_plain(value, kind=kind)
    elif isinstance(value, str) and value in SHIPPED:
        found = Profile.named(value)
    elif isinstance(value, PathLike) or (isinstance(value, str) and Path(value).suffix):
        found = Profile.read(value, kind=kind)
    elif isinstance(value, str):
        raise UnknownNameError(
            f"profile of a {kind}", [value], tuple(n for n, k in SHIPPED.items() if k == kind)
        )
    else:
        found = Profile.of(value, kind=kind)
    if found.kind != kind:
        raise ParameterError(f"{kind} is {found.name}, the profile of a {found.kind}")
    return found
