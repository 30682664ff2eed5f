"""The parts of a vehicle: bodies, wheelsets and force elements, as frozen records.

See :mod:`railenv.fields` for what their fields may hold. Places are those of the vehicle, from an
origin of your choice: ``x`` forward, ``y`` to the left, ``z`` up.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from railenv import checks
from railenv.contact.given import contact_law, resolved
from railenv.contact.laws import ContactLaw
from railenv.equations import elements as laws
from railenv.errors import ParameterError, shown
from railenv.fields import (
    Number,
    Numbered,
    Points,
    as_points,
    characteristic,
    choice,
    nonnegative,
    number,
    positive,
)
from railenv.tables import Table

GRAVITY = 9.81
"""m/s^2, unless a vehicle has another value."""


@dataclass(frozen=True, kw_only=True)
class Part(Numbered):
    """Base of bodies and elements: a name, numbers and tables, checked."""

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
        self.check_fields()
        for field in type(self).table_fields():
            value = getattr(self, field)
            if value is not None:
                object.__setattr__(self, field, as_points(f"{field} of {self.name}", value))

    @property
    def called(self) -> str:
        """Name of the part in messages."""
        return self.name

    def groups(self) -> dict[str, tuple[str, Numbered]]:
        """Return the groups of the part's numbers, with the prefix of their names as parameters.

        The part itself has the name ``""``; any other group has its own name.
        """
        return {"": (f"{self.name}_", self)}

    def like(self, name: str, **changes: Any) -> Self:
        """Return another part that shares this one's numbers, except for some fields.

        A change of this part's parameters (``conicity`` of a wheelset) then changes both.
        """
        checks.known("field", changes, [f.name for f in dataclasses.fields(self) if f.name != "name"])
        return dataclasses.replace(self, name=name, **{**self._shared(), **changes})

    def _shared(self) -> dict[str, Any]:
        """Return the fields by which another part reads this one's numbers."""
        return dict(self.shared(f"{self.name}_"))

    def with_changes(self, changes: Mapping[str, float]) -> Self:
        """Return the part with its own numbers in ``changes`` changed."""
        return self.renumbered(f"{self.name}_", changes)


# ------------------------------------------------------------------------------- bodies


@dataclass(frozen=True, kw_only=True)
class Clamped(Part):
    """Something at rest in the track frame, such as a held body, to which elements are attached."""

    kind = "clamped"

    x: Number = number("m", "place of its centre along the vehicle, forward; 0 when left out")
    z: Number = number("m", "height of its centre of mass; 0 when left out")

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Coordinates, in the order of the state vector: it has none."""
        return ()


@dataclass(frozen=True, kw_only=True)
class Body(Clamped):
    """A rigid body with the coordinates y, z, phi, psi, and theta where it has a pitch inertia.

    A body carries its own weight; ``lateral_load_mass`` and ``vertical_load_mass`` change that for a
    body that carries (half of) a body that is not modelled.
    """

    kind = "body"

    mass: Number = positive("kg", "mass of the body")
    roll_inertia: Number = positive("kg m^2", "moment of inertia about x, at its centre of mass")
    yaw_inertia: Number = positive("kg m^2", "moment of inertia about z, at its centre of mass")
    pitch_inertia: Number = nonnegative(
        "kg m^2", "moment of inertia about y; a body without it does not pitch"
    )
    lateral_load_mass: Number = nonnegative(
        "kg", "mass whose centrifugal and cant force it carries; its own when left out"
    )
    vertical_load_mass: Number = nonnegative(
        "kg", "mass whose weight it carries; its own when left out"
    )
    load_height: Number = number(
        "m",
        "height at which the lateral load of masses beyond its own acts; its centre when left out",
    )

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Coordinates of the body, in the order of the state vector."""
        return ("y", "z", "phi", *(() if self.pitch_inertia is None else ("theta",)), "psi")


@dataclass(frozen=True, kw_only=True)
class Wheelset(Body):
    """Two wheels on an axle, on the rails: coordinates y, z, phi and psi."""

    kind = "wheelset"

    pitch_inertia: Number = nonnegative(
        "kg m^2", "moment of inertia about the axle, which gives the gyroscopic moments", needed=True
    )
    wheel_radius: Number = positive("m", "nominal rolling radius")
    radius_difference: Number = number(
        "m", "nominal radius of the left wheel less that of the right one; none when left out"
    )
    half_gauge: Number = positive("m", "half the distance between the contact points")
    conicity: Number = dataclasses.field(
        default=None, metadata={"unit": "1", "meaning": "short form of contact: conicity of a cone"}
    )
    contact: ContactLaw | None = dataclasses.field(
        default=None,
        metadata={"meaning": "contact law of both wheels, with its numbers; or give conicity"},
    )
    right_contact: ContactLaw | None = dataclasses.field(
        default=None, metadata={"meaning": "contact law of the right wheel where it has its own"}
    )
    friction: Number = number(
        "1", "friction coefficient of wheel and rail", needed=True, low=0.0, open_low=True, high=2.0
    )
    flange_clearance: Number = positive(
        "m", "lateral clearance up to flange contact, for contact laws without a flange"
    )
    lateral_creep: Number = positive("N", "creep coefficient f_11 of a wheel, lateral")
    lateral_spin_creep: Number = nonnegative(
        "N m", "creep coefficient f_12 of a wheel, lateral by spin", needed=True
    )
    spin_creep: Number = nonnegative("N m^2", "creep coefficient f_22 of a wheel, spin", needed=True)
    longitudinal_creep: Number = positive("N", "creep coefficient f_33 of a wheel, longitudinal")
    creep_load: Number = number(
        "N",
        "wheel load for which the creep coefficients hold; with it they follow the load as Hertz says",
        low=0.0,
        open_low=True,
    )
    saturation: str = choice("creep saturation law", ("heuristic", "polach"), "heuristic")
    saturation_of: str = choice(
        "whether creep is saturated for the whole wheelset or each wheel",
        ("wheelset", "wheel"),
        "wheelset",
    )
    polach_adhesion: Number = number(
        "1", "Polach's k_A, of the area of adhesion", low=0.0, open_low=True, high=1.0
    )
    polach_slip: Number = number(
        "1", "Polach's k_S, of the area of slip", low=0.0, open_low=True, high=1.0
    )
    vertical_rail_stiffness: Number = positive("N/m", "vertical stiffness of the rail under one wheel")
    lateral_rail_stiffness: Number = positive("N/m", "lateral stiffness of the rail behind the flange")

    def __post_init__(self) -> None:
        law: Any = self.contact
        conicity, contact = resolved(str(self.name), self.conicity, law)
        object.__setattr__(self, "conicity", conicity)
        object.__setattr__(self, "contact", contact)
        if self.right_contact is not None:
            object.__setattr__(self, "right_contact", contact_law(self.right_contact))
        super().__post_init__()
        for field in ("polach_adhesion", "polach_slip"):
            if (self.saturation == "polach") != (getattr(self, field) is not None):
                verb = "lacks" if self.saturation == "polach" else "has"
                raise ParameterError(
                    f"{self.name} {verb} {field}; it belongs to the saturation law 'polach'"
                )

    def groups(self) -> dict[str, tuple[str, Numbered]]:
        """Return the wheelset and its contact laws, with the prefix of the names of their numbers."""
        assert self.contact is not None
        found = {**super().groups(), "left": (f"{self.name}_", self.contact)}
        if self.right_contact is not None:
            found["right"] = (f"{self.name}_right_", self.right_contact)
        return found

    def settings(self) -> list[Any]:
        """Return all that is neither number nor table, to distinguish structures."""
        laws = {"conicity", "contact", "right_contact"}
        return [setting for setting in super().settings() if setting[0] not in laws]

    def _shared(self) -> dict[str, Any]:
        return {**super()._shared(), **self._laws(lambda prefix, law: law.reading(prefix))}

    def with_changes(self, changes: Mapping[str, float]) -> Self:
        """Return the wheelset with its own numbers in ``changes`` changed."""
        laws = self._laws(lambda prefix, law: law.renumbered(prefix, changes))
        return dataclasses.replace(super().with_changes(changes), **laws)

    def _laws(self, changed: Callable[[str, ContactLaw], ContactLaw]) -> dict[str, Any]:
        """Return the fields of the contact laws, changed."""
        groups = self.groups()
        found: dict[str, Any] = {"conicity": None}
        for role, field in (("left", "contact"), ("right", "right_contact")):
            if role in groups:
                prefix, law = groups[role]
                assert isinstance(law, ContactLaw)
                found[field] = changed(prefix, law)
        return found

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
    x: Number = number("m", "place along the vehicle; that of the first body when left out")
    y: Number = number("m", "lateral place, to the left, or arm of a pair; 0 when left out")
    z: Number = number("m", "height; 0 when left out")

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
    """An element that exists once, or twice at +-y."""

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

    k_x: Number = nonnegative("N/m", "longitudinal stiffness")
    k_y: Number = nonnegative("N/m", "lateral stiffness")
    k_z: Number = nonnegative("N/m", "vertical stiffness")
    c_x: Number = nonnegative("N s/m", "longitudinal damping")
    c_y: Number = nonnegative("N s/m", "lateral damping")
    c_z: Number = nonnegative("N s/m", "vertical damping")
    k_roll: Number = nonnegative("N m/rad", "stiffness against rolling of its ends, about x")
    k_pitch: Number = nonnegative("N m/rad", "stiffness against pitching of its ends, about y")
    k_yaw: Number = nonnegative("N m/rad", "stiffness against yawing of its ends, about z")


_AXIS = ("x", "y", "z")


@dataclass(frozen=True, kw_only=True)
class Damper(_Paired):
    """Damper along one axis, with a constant or a table of force over speed; each of a pair."""

    kind = "damper"
    law = staticmethod(laws.damper)

    axis: str = choice("axis along which it acts", _AXIS, "y")
    c: Number = nonnegative("N s/m", "damping constant; or give force")
    force: Points | None = characteristic(
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

    axis: str = choice("axis along which it acts", _AXIS, "x")
    k: Number = positive("N/m", "stiffness of its rubber ends together, in series with the damper")
    c: Number = number("N s/m", "damping constant; or give force", low=0.0, open_low=True)
    force: Points | None = characteristic(
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

    axis: str = choice("axis along which it acts", _AXIS, "y")
    force: Points | None = characteristic(
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

    k: Number = positive("N m/rad", "stiffness against roll of one body on the other")
    c: Number = nonnegative("N m s/rad", "damping of that roll")


@dataclass(frozen=True, kw_only=True)
class TractionRod(Element):
    """Longitudinal rod between two bodies; it acts on bodies that pitch, or off their middle."""

    kind = "traction_rod"
    law = staticmethod(laws.traction_rod)

    k: Number = positive("N/m", "longitudinal stiffness")
    c: Number = nonnegative("N s/m", "longitudinal damping")


@dataclass(frozen=True, kw_only=True)
class FrictionElement(_Paired):
    """Dry friction along one axis, smooth over a width of speed; each of a pair."""

    kind = "friction"
    law = staticmethod(laws.friction)

    axis: str = choice("axis along which it acts", _AXIS, "y")
    force: Number = nonnegative("N", "friction force when sliding", needed=True)
    width: Number = positive("m/s", "speed at which the force is 71 % of that")


@dataclass(frozen=True, kw_only=True)
class YawDamper(Element):
    """The paper's yaw damper (eqs 7 and 8): a quartic of speed, at the arm y."""

    kind = "yaw_damper"
    law = staticmethod(laws.yaw_damper)

    y: Number = positive("m", "lateral arm of its force")
    c1: Number = number("N s/m", "linear term of force over speed", needed=True)
    c2: Number = number("N s^2/m^2", "quadratic term of force over speed", needed=True)
    c3: Number = number("N s^3/m^3", "cubic term of force over speed", needed=True)
    c4: Number = number("N s^4/m^4", "quartic term of force over speed", needed=True)


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
