"""What a vehicle is assembled from: bodies, wheelsets and force elements, as frozen records.

Numbers are SI. Each is a float, or a text that computes it from the names of parameters
(``"frame_mass + body_mass / 2"``). A field that is left out (None) is no part of the equations at all.
Places are those of the vehicle, from an origin of your choice: ``x`` forward, ``y`` to the left, ``z``
up.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from railenv import checks
from railenv.equations import elements as laws
from railenv.errors import ParameterError, shown
from railenv.vehicles.tables import Table

GRAVITY = 9.81
"""m/s^2, unless a vehicle has another."""

Number = float | str | None
Points = tuple[tuple[float, ...], tuple[float, ...]]


def _number(unit: str, meaning: str, *, needed: bool = False, **bounds: float | bool) -> Any:
    default = dataclasses.MISSING if needed else None
    metadata = {"unit": unit, "meaning": meaning, "bounds": bounds}
    return dataclasses.field(default=default, metadata=metadata)


def _positive(unit: str, meaning: str) -> Any:
    return _number(unit, meaning, needed=True, low=0.0, open_low=True)


def _nonnegative(unit: str, meaning: str, needed: bool = False) -> Any:
    return _number(unit, meaning, needed=needed, low=0.0)


def _characteristic(x: str, y: str, meaning: str, *, needed: bool = False) -> Any:
    metadata = {"unit": f"{x}, {y}", "meaning": meaning, "table": True}
    default = dataclasses.MISSING if needed else None
    return dataclasses.field(default=default, metadata=metadata)


def _choice(meaning: str, allowed: tuple[str, ...], default: str) -> Any:
    return dataclasses.field(default=default, metadata={"meaning": meaning, "allowed": allowed})


@dataclass(frozen=True, kw_only=True)
class Part:
    """Base of bodies and elements: a name, numbers and tables, checked."""

    kind: ClassVar[str]
    """What the part is called in files."""

    name: str = dataclasses.field(
        metadata={"meaning": "its name: a word of letters, digits and underscores"}
    )

    def __post_init__(self) -> None:
        name: Any = self.name
        if not (isinstance(name, str) and name.isidentifier()) or name.startswith("_"):
            raise ParameterError(
                f"name of a {self.kind} is {shown(name)}; it must be a word of letters, digits "
                "and underscores"
            )
        for f in dataclasses.fields(self):
            value = getattr(self, f.name)
            if "allowed" in f.metadata:
                checks.choice(f"{f.name} of {self.name}", value, f.metadata["allowed"])
            elif "bounds" in f.metadata and not isinstance(value, (str, type(None))):
                self.checked(f.name, value)
            elif "table" in f.metadata and value is not None:
                object.__setattr__(self, f.name, _as_points(f"{f.name} of {self.name}", value))

    def checked(self, field: str, value: Any) -> float:
        """Return the number of a field; raises ParameterError where it is not allowed."""
        f = next(f for f in dataclasses.fields(self) if f.name == field)
        label = f"{field} of {self.name}"
        return checks.number(label, value, unit=f.metadata["unit"], **f.metadata["bounds"])

    @classmethod
    def number_fields(cls) -> list[str]:
        """Names of the fields that hold a number or an expression."""
        return [f.name for f in dataclasses.fields(cls) if "bounds" in f.metadata]

    @classmethod
    def table_fields(cls) -> list[str]:
        """Names of the fields that hold a characteristic."""
        return [f.name for f in dataclasses.fields(cls) if "table" in f.metadata]

    def like(self, name: str, **changes: Any) -> Self:
        """Return another part that shares this one's numbers, but for some fields.

        A change of this part's parameters (``conicity`` of a wheelset) then changes both.
        """
        checks.known("field", changes, [f.name for f in dataclasses.fields(self) if f.name != "name"])
        shared = {
            field: f"{self.name}_{field}"
            for field in self.number_fields()
            if isinstance(getattr(self, field), (int, float))
        }
        return dataclasses.replace(self, name=name, **{**shared, **changes})

    def table(self, field: str) -> Table:
        """Return the characteristic of a field as the kernels read it."""
        return Table.through(*getattr(self, field), odd=True, name=f"{field} of {self.name}")


def _as_points(label: str, value: Any) -> Points:
    try:
        x, y = value
        points = tuple(map(float, x)), tuple(map(float, y))
    except (TypeError, ValueError):
        raise ParameterError(f"{label} is {shown(value)}; it must be two lists of numbers") from None
    Table.through(*points, odd=True, name=label)
    return points


# ------------------------------------------------------------------------------- bodies


@dataclass(frozen=True, kw_only=True)
class Clamped(Part):
    """Something at rest in the track frame to which elements are attached, such as a held body."""

    kind = "clamped"

    x: Number = _number("m", "place of its centre along the vehicle, forward; 0 when left out")
    z: Number = _number("m", "height of its centre of mass; 0 when left out")

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Coordinates, in the order of the state vector: it has none."""
        return ()


@dataclass(frozen=True, kw_only=True)
class Body(Clamped):
    """A rigid body with the coordinates y, z, phi, psi, and theta where it has a pitch inertia.

    A body carries its own weight; ``lateral_load_mass`` and ``vertical_load_mass`` change that, for one
    that carries (half of) a body which is not modelled.
    """

    kind = "body"

    mass: Number = _positive("kg", "mass of the body")
    roll_inertia: Number = _positive("kg m^2", "moment of inertia about x, at its centre of mass")
    yaw_inertia: Number = _positive("kg m^2", "moment of inertia about z, at its centre of mass")
    pitch_inertia: Number = _nonnegative(
        "kg m^2", "moment of inertia about y; a body without it does not pitch"
    )
    lateral_load_mass: Number = _nonnegative(
        "kg", "mass whose centrifugal and cant force it carries; its own when left out"
    )
    vertical_load_mass: Number = _nonnegative(
        "kg", "mass whose weight it carries; its own when left out"
    )

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Coordinates of the body, in the order of the state vector."""
        return ("y", "z", "phi", *(() if self.pitch_inertia is None else ("theta",)), "psi")


@dataclass(frozen=True, kw_only=True)
class Wheelset(Body):
    """Two wheels on an axle, on the rails: coordinates y, z, phi and psi."""

    kind = "wheelset"

    pitch_inertia: Number = _nonnegative(
        "kg m^2", "moment of inertia about the axle, which gives the gyroscopic moments", needed=True
    )
    wheel_radius: Number = _positive("m", "nominal rolling radius")
    half_gauge: Number = _positive("m", "half the distance between the contact points")
    conicity: Number = _number(
        "1", "cone angle of the treads", needed=True, low=0.0, open_low=True, high=0.7
    )
    friction: Number = _number(
        "1", "friction coefficient of wheel and rail", needed=True, low=0.0, open_low=True, high=2.0
    )
    flange_clearance: Number = _positive("m", "lateral way of the wheelset up to flange contact")
    lateral_creep: Number = _positive("N", "creep coefficient f_11 of a wheel, lateral")
    lateral_spin_creep: Number = _nonnegative(
        "N m", "creep coefficient f_12 of a wheel, lateral by spin", needed=True
    )
    spin_creep: Number = _nonnegative("N m^2", "creep coefficient f_22 of a wheel, spin", needed=True)
    longitudinal_creep: Number = _positive("N", "creep coefficient f_33 of a wheel, longitudinal")
    vertical_rail_stiffness: Number = _positive("N/m", "vertical stiffness of the rail under one wheel")
    lateral_rail_stiffness: Number = _positive("N/m", "lateral stiffness of the rail behind the flange")

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Coordinates of the wheelset; it rolls about its axle and does not pitch."""
        return ("y", "z", "phi", "psi")


# ----------------------------------------------------------------------- force elements


@dataclass(frozen=True, kw_only=True)
class Element(Part):
    """A force element between two bodies, or a body and ``"ground"``."""

    law: ClassVar[Callable[..., laws.Action]]
    n_inputs: ClassVar[int] = 0
    magnitudes: ClassVar[float] = 1e-3
    """Typical magnitude of the element's own states."""

    between: tuple[str, str] = dataclasses.field(
        metadata={"meaning": 'the two bodies to which it is attached, or one and "ground", the track'}
    )
    x: Number = _number("m", "place along the vehicle; that of the first body when left out")
    y: Number = _number("m", "lateral place, to the left, or arm of a pair; 0 when left out")
    z: Number = _number("m", "height; 0 when left out")

    pair: ClassVar[bool] = False

    def __post_init__(self) -> None:
        between: Any = self.between
        names = tuple(between) if isinstance(between, (list, tuple)) else ()
        if len(names) != 2 or not all(isinstance(name, str) for name in names):
            raise ParameterError(
                f"between of {shown(self.name)} is {shown(between)}; it must be two names of "
                'bodies, or of one and "ground"'
            )
        object.__setattr__(self, "between", tuple(between))
        super().__post_init__()

    @property
    def own_states(self) -> tuple[str, ...]:
        """Names of the element's own states."""
        return ()

    @property
    def n_states(self) -> int:
        """Number of the element's own states."""
        return len(self.own_states)


@dataclass(frozen=True, kw_only=True)
class _Paired(Element):
    """An element that stands once, or twice at +-y."""

    pair: bool = dataclasses.field(  # type: ignore[misc]
        default=False, metadata={"meaning": "true: one stands at +y and one at -y; it needs y then"}
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.pair, bool):
            raise ParameterError(f"pair of {self.name} is {shown(self.pair)}; it must be true or false")
        if self.pair and self.y is None:
            raise ParameterError(f"{self.name} is a pair without y; give the arm at which each stands")


@dataclass(frozen=True, kw_only=True)
class Spring(_Paired):
    """Linear springs and dampers in parallel along x, y and z, and against turning; each of a pair."""

    kind = "spring"
    law = staticmethod(laws.spring)

    k_x: Number = _nonnegative("N/m", "longitudinal stiffness")
    k_y: Number = _nonnegative("N/m", "lateral stiffness")
    k_z: Number = _nonnegative("N/m", "vertical stiffness")
    c_x: Number = _nonnegative("N s/m", "longitudinal damping")
    c_y: Number = _nonnegative("N s/m", "lateral damping")
    c_z: Number = _nonnegative("N s/m", "vertical damping")
    k_roll: Number = _nonnegative("N m/rad", "stiffness against rolling of its ends, about x")
    k_pitch: Number = _nonnegative("N m/rad", "stiffness against pitching of its ends, about y")
    k_yaw: Number = _nonnegative("N m/rad", "stiffness against yawing of its ends, about z")


_AXIS = ("x", "y", "z")


@dataclass(frozen=True, kw_only=True)
class Damper(_Paired):
    """Damper along one axis, with a constant or a table of force over speed; each of a pair."""

    kind = "damper"
    law = staticmethod(laws.damper)

    axis: str = _choice("axis along which it acts", _AXIS, "y")
    c: Number = _nonnegative("N s/m", "damping constant; or give force")
    force: Points | None = _characteristic(
        "m/s", "N", "speeds and forces from (0, 0) on, the same either way; linear beyond the last"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        _one_of(self, "c", "force")


@dataclass(frozen=True, kw_only=True)
class SeriesDamper(_Paired):
    """Damper on a rubber end (Maxwell), such as a yaw damper: constant or table, and stiffness."""

    kind = "series_damper"
    law = staticmethod(laws.series_damper)

    axis: str = _choice("axis along which it acts", _AXIS, "x")
    k: Number = _positive("N/m", "stiffness of its rubber ends together, in series with the damper")
    c: Number = _number("N s/m", "damping constant; or give force", low=0.0, open_low=True)
    force: Points | None = _characteristic(
        "m/s",
        "N",
        "speeds and rising forces from (0, 0) on, the same either way; linear beyond the last",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        _one_of(self, "c", "force")
        if self.force is not None:
            super().table("force").inverse(name=f"force of {self.name}")

    def table(self, field: str) -> Table:
        """Return speed over force, which the damper's own state follows."""
        return super().table(field).inverse(name=f"force of {self.name}")

    @property
    def own_states(self) -> tuple[str, ...]:
        """Stretch of the damper itself (m), on each side of a pair."""
        return tuple(f"s_{self.name}{side}" for side in (("_left", "_right") if self.pair else ("",)))


@dataclass(frozen=True, kw_only=True)
class Stop(_Paired):
    """Bump stop along one axis: free within its clearance, then a table of force; each of a pair."""

    kind = "stop"
    law = staticmethod(laws.stop)

    axis: str = _choice("axis along which it acts", _AXIS, "y")
    force: Points | None = _characteristic(
        "m",
        "N",
        "displacements and forces, the same either way; the first is the clearance, with force 0",
        needed=True,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.force or self.force[1][0] != 0.0:
            raise ParameterError(
                f"force of {self.name} is {shown(self.force)}; it must be a table whose first point is "
                "the clearance, with the force 0"
            )


@dataclass(frozen=True, kw_only=True)
class RollBar(Element):
    """Anti-roll bar between two bodies."""

    kind = "roll_bar"
    law = staticmethod(laws.roll_bar)

    k: Number = _positive("N m/rad", "stiffness against roll of one body on the other")
    c: Number = _nonnegative("N m s/rad", "damping of that roll")


@dataclass(frozen=True, kw_only=True)
class TractionRod(Element):
    """Longitudinal rod between two bodies; it acts on bodies that pitch, or off their middle."""

    kind = "traction_rod"
    law = staticmethod(laws.traction_rod)

    k: Number = _positive("N/m", "longitudinal stiffness")
    c: Number = _nonnegative("N s/m", "longitudinal damping")


@dataclass(frozen=True, kw_only=True)
class FrictionElement(_Paired):
    """Dry friction along one axis, smooth over a width of speed; each of a pair."""

    kind = "friction"
    law = staticmethod(laws.friction)

    axis: str = _choice("axis along which it acts", _AXIS, "y")
    force: Number = _nonnegative("N", "friction force when sliding", needed=True)
    width: Number = _positive("m/s", "speed at which the force is 71 % of that")


@dataclass(frozen=True, kw_only=True)
class YawDamper(Element):
    """The paper's yaw damper (eqs 7 and 8): a quartic of speed, at the arm y."""

    kind = "yaw_damper"
    law = staticmethod(laws.yaw_damper)

    y: Number = _positive("m", "lateral arm of its force")
    c1: Number = _number("N s/m", "linear term of force over speed", needed=True)
    c2: Number = _number("N s^2/m^2", "quadratic term of force over speed", needed=True)
    c3: Number = _number("N s^3/m^3", "cubic term of force over speed", needed=True)
    c4: Number = _number("N s^4/m^4", "quartic term of force over speed", needed=True)


@dataclass(frozen=True, kw_only=True)
class YawMoment(Element):
    """Input of the model: a yaw moment (N m) on the first body, with its reaction on the second."""

    kind = "yaw_moment"
    law = staticmethod(laws.yaw_moment)
    n_inputs = 1


@dataclass(frozen=True, kw_only=True)
class LateralForce(Element):
    """Input of the model: a lateral force (N) on the first body, with its reaction on the second."""

    kind = "lateral_force"
    law = staticmethod(laws.lateral_force)
    n_inputs = 1


BODIES: tuple[type[Clamped], ...] = (Wheelset, Body, Clamped)
"""All bodies, in the order in which states and files list them."""

ELEMENTS: tuple[type[Element], ...] = (
    Spring,
    Damper,
    SeriesDamper,
    Stop,
    RollBar,
    TractionRod,
    FrictionElement,
    YawDamper,
    YawMoment,
    LateralForce,
)
"""All force elements, in the order in which inputs, states and files list them."""


def _one_of(part: Part, first: str, second: str) -> None:
    """Raise unless exactly one of two fields is given."""
    given = [name for name in (first, second) if getattr(part, name) is not None]
    if len(given) != 1:
        has = f"both {first} and {second}" if given else f"neither {first} nor {second}"
        raise ParameterError(f"{part.name} has {has}; give one of them")
