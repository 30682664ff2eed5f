"""Parameters of a vehicle as one frozen record, and the vehicles on the paper's contact."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal, Self, get_args

from railenv import checks
from railenv.contact.given import LAWS, contact_law, resolved
from railenv.contact.laws import Cone, ContactLaw, HollowTread
from railenv.errors import ParameterError, shown
from railenv.vehicles import files
from railenv.vehicles.further import BODY, FurtherParts, numbers_of
from railenv.vehicles.guided import KINEMATIC_AMPLITUDE, klingel_wavelength
from railenv.vehicles.records import ParameterRecord, nonnegative, positive, quantity

LoadBookkeeping = Literal["once", "printed"]
Saturation = Literal["heuristic", "polach"]
SaturationOf = Literal["wheelset", "wheel"]

CREEP_COEFFICIENTS = ("lateral_creep", "lateral_spin_creep", "spin_creep", "longitudinal_creep")
"""Fields that ``creep_factor`` multiplies."""

_BEYOND = "beyond the paper"


@dataclass(frozen=True, kw_only=True)
class _PapersBogie(ParameterRecord):
    """Fields of the paper's bogie, which every vehicle has."""

    name: str = dataclasses.field(metadata={"meaning": "what to call the vehicle", "source": ""})
    provenance: str = dataclasses.field(
        metadata={"meaning": "where its numbers come from", "source": ""}
    )
    # masses and inertias
    wheelset_mass: float = positive("m_w", "kg", "mass of one wheelset")
    wheelset_roll_inertia: float = positive("I_wx", "kg m^2", "roll inertia of a wheelset")
    wheelset_pitch_inertia: float = nonnegative(
        "I_wy",
        "kg m^2",
        "pitch inertia of a wheelset, about its axle (gyroscopic terms)",
        "eq 6; not in Table 1, from Zhai",
    )
    wheelset_yaw_inertia: float = positive("I_wz", "kg m^2", "yaw inertia of a wheelset")
    frame_mass: float = positive("m_b", "kg", "mass of the bogie frame")
    frame_roll_inertia: float = positive("I_bx", "kg m^2", "roll inertia of the bogie frame")
    frame_yaw_inertia: float = positive("I_bz", "kg m^2", "yaw inertia of the bogie frame")
    body_mass: float = nonnegative("m_vb", "kg", "mass of the vehicle body, on two bogies")
    gravity: float = positive("g", "m/s^2", "acceleration due to gravity")
    # geometry
    wheel_radius: float = positive("r_0", "m", "nominal rolling radius")
    half_gauge: float = positive("a", "m", "half the distance between the contact points")
    half_wheelbase: float = positive("L", "m", "half the wheelbase (L_t1, L_t2, L_w in print)")
    frame_height: float = nonnegative("h_G", "m", "height of the frame's centre above the axles")
    # wheel-rail contact
    conicity: float | None = dataclasses.field(
        default=None,
        metadata={
            "symbol": "lambda",
            "unit": "1",
            "meaning": "conicity of the wheel treads, short form of contact",
            "source": "Table 1",
        },
    )
    contact: ContactLaw | None = dataclasses.field(
        default=None,
        metadata={"meaning": "contact law of all wheels; a cone by its conicity", "source": _BEYOND},
    )
    friction: float = positive("mu", "1", "friction coefficient of wheel and rail", high=2.0)
    flange_clearance: float = positive(
        "delta", "m", "lateral clearance up to flange contact, for contact laws without a flange"
    )
    lateral_creep: float = positive("f_11", "N", "lateral creep coefficient")
    lateral_spin_creep: float = nonnegative("f_12", "N m", "lateral/spin creep coefficient")
    spin_creep: float = nonnegative("f_22", "N m^2", "spin creep coefficient")
    longitudinal_creep: float = positive("f_33", "N", "longitudinal creep coefficient")
    vertical_rail_stiffness: float = positive("K_rz", "N/m", "vertical stiffness under one wheel")
    lateral_rail_stiffness: float = positive("K_ry", "N/m", "lateral stiffness behind the flange")
    # primary suspension
    primary_longitudinal_stiffness: float = nonnegative("K_px", "N/m", "primary, per axle box")
    primary_lateral_stiffness: float = nonnegative("K_py", "N/m", "primary, per axle box")
    primary_vertical_stiffness: float = nonnegative("K_pz", "N/m", "primary, per axle box")
    primary_longitudinal_damping: float = nonnegative("C_px", "N s/m", "primary, per axle box")
    primary_lateral_damping: float = nonnegative("C_py", "N s/m", "primary, per axle box")
    primary_vertical_damping: float = nonnegative("C_pz", "N s/m", "primary, per axle box")
    primary_arm: float = positive(
        "b", "m", "lateral arm of primary springs and dampers (b_t1 to b_t4 in print)"
    )
    # nonlinear yaw damper between wheelset and frame: quartic in the speed, eq 7
    yaw_damper_c1: float = quantity("C_1", "N s/m", "yaw damper force (eq 7), linear term")
    yaw_damper_c2: float = quantity("C_2", "N s^2/m^2", "yaw damper force (eq 7), quadratic term")
    yaw_damper_c3: float = quantity("C_3", "N s^3/m^3", "yaw damper force (eq 7), cubic term")
    yaw_damper_c4: float = quantity("C_4", "N s^4/m^4", "yaw damper force (eq 7), quartic term")
    # secondary suspension, against a body at rest in the track frame
    secondary_longitudinal_stiffness: float = nonnegative("K_sx", "N/m", "secondary, per side", _BEYOND)
    secondary_lateral_stiffness: float = nonnegative("K_sy", "N/m", "secondary, per side", _BEYOND)
    secondary_vertical_stiffness: float = nonnegative("K_sz", "N/m", "secondary, per side", _BEYOND)
    secondary_longitudinal_damping: float = nonnegative(
        "C_sx", "N s/m", "secondary, per side: the passive yaw damper", _BEYOND
    )
    secondary_lateral_damping: float = nonnegative("C_sy", "N s/m", "secondary, per side", _BEYOND)
    secondary_vertical_damping: float = nonnegative("C_sz", "N s/m", "secondary, per side", _BEYOND)
    secondary_arm: float = positive(
        "b_s", "m", "lateral arm of the secondary springs and dampers", _BEYOND
    )


@dataclass(frozen=True, kw_only=True)
class Vehicle(FurtherParts, _PapersBogie):
    """Parameters of a vehicle: bogie, wheel-rail contact, and optional further parts; SI units.

    Stiffnesses, dampings and creep coefficients are per side (per axle box, per wheel), as in Table 1
    of the paper; the paper's nonlinear yaw damper is one per wheelset. A vehicle with the fields of the
    body is a whole one (:class:`railenv.Coach`); without them it is a bogie. ``railenv vehicles``
    prints every field with its unit, and ``railenv vehicles NAME`` with symbol, meaning and source.

    Raises
    ------
    ParameterError
        If a value is not a finite number in its range, or a part is not given as a whole; the message
        names field, value and range.
    """

    # creep
    saturation: Saturation = dataclasses.field(
        default="heuristic",
        metadata={"meaning": "creep saturation law: heuristic or polach", "source": "eq 2"},
    )
    saturation_of: SaturationOf = dataclasses.field(
        default="wheelset",
        metadata={"meaning": "creep is saturated for each wheelset or each wheel", "source": "eq 3"},
    )
    polach_adhesion: float = quantity(
        "k_A",
        "1",
        "Polach's factor of adhesion",
        _BEYOND,
        default=1.0,
        low=0.0,
        open_low=True,
        high=1.0,
    )
    polach_slip: float = quantity(
        "k_S", "1", "Polach's factor of slip", _BEYOND, default=1.0, low=0.0, open_low=True, high=1.0
    )
    load_dependent_creep: bool = dataclasses.field(
        default=False,
        metadata={
            "meaning": "creep coefficients follow the wheel load (Hertz), from that at rest",
            "source": _BEYOND,
        },
    )
    # switches
    overturning: bool = dataclasses.field(
        default=False,
        metadata={
            "meaning": "on a bogie alone, half the body's lateral force acts at the body's height",
            "source": _BEYOND,
        },
    )
    wheelbase_curving: bool = dataclasses.field(
        metadata={
            "meaning": "wheelsets are turned and displaced against the frame on a curve",
            "source": _BEYOND,
        }
    )
    load_bookkeeping: LoadBookkeeping = dataclasses.field(
        metadata={
            "meaning": "carry the load of a bogie once, or on each wheelset as printed",
            "source": "eq 6",
        }
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        given: Any = self.contact
        conicity, contact = resolved(str(self.name), self.conicity, given)
        for field in contact.number_fields():  # texts are only for the parts of an assembly
            contact.checked(field, getattr(contact, field))
        object.__setattr__(self, "conicity", conicity)
        object.__setattr__(self, "contact", contact)
        for label in ("name", "provenance"):
            if not isinstance(getattr(self, label), str):
                raise ParameterError(f"{label} is {getattr(self, label)!r}; it must be a string")
        for switch in ("wheelbase_curving", "load_dependent_creep", "overturning"):
            if not isinstance(getattr(self, switch), bool):
                raise ParameterError(f"{switch} is {getattr(self, switch)!r}; it must be true or false")
        if self.overturning and BODY not in self.groups:
            raise ParameterError(f"overturning of {self.name} is true, but it has no body_height")
        checks.choice("load_bookkeeping", self.load_bookkeeping, get_args(LoadBookkeeping))
        checks.choice("saturation", self.saturation, get_args(Saturation))
        checks.choice("saturation_of", self.saturation_of, get_args(SaturationOf))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        ``contact`` changes the contact law; the numbers of the present one (``conicity`` of a cone)
        change by their own names. ``creep_factor``, which is not a field, multiplies all four creep
        coefficients.

        Raises
        ------
        UnknownNameError
            If a name is neither a field, nor a number of the contact law, nor ``creep_factor``.
        ParameterError
            If a value is not allowed.

        Examples
        --------
        >>> import railenv
        >>> railenv.HIGH_SPEED_COACH.replace(conicity=0.2).conicity
        0.2
        """
        changes = self._with_contact(changes)
        checks.known("field", changes, [*(f.name for f in dataclasses.fields(self)), "creep_factor"])
        if "creep_factor" in changes:
            factor = checks.number("creep_factor", changes["creep_factor"], low=0.0, open_low=True)
            changes = {n: v for n, v in changes.items() if n != "creep_factor"}
            for name in CREEP_COEFFICIENTS:
                value = checks.number(name, changes.get(name, getattr(self, name)))
                if not 0.0 < factor * value < math.inf and value > 0.0:
                    raise ParameterError(
                        f"creep_factor is {factor:g}; {name} becomes {factor * value:g} N"
                    )
                changes[name] = factor * value
        return dataclasses.replace(self, **changes)

    def _with_contact(self, changes: dict[str, Any]) -> dict[str, Any]:
        """Return the changes with those of the contact law's numbers made changes of the law."""
        assert self.contact is not None
        law = self.contact if changes.get("contact") is None else contact_law(changes["contact"])
        numbers = {n: v for n, v in changes.items() if n in law.number_fields()}
        if "conicity" in changes and "conicity" not in numbers:
            raise ParameterError(
                f"conicity is {shown(changes['conicity'])}, but the contact of {self.name} is "
                f"{law.called}, which has no such number; give contact=railenv.Cone(conicity)"
            )
        others = {n: v for n, v in changes.items() if n not in numbers}
        return {**others, "contact": law.replace(**numbers), "conicity": None}

    @property
    def static_wheel_load(self) -> float:
        """Load (N) of one wheel of the bogie at rest."""
        return (self.wheelset_mass * self.gravity + self.external_load / 2.0) / 2.0

    @property
    def external_load(self) -> float:
        """Load (N) of one bogie: frame and half the vehicle body, the paper's W_ext."""
        return (self.body_mass / 2.0 + self.frame_mass) * self.gravity

    @property
    def klingel_wavelength(self) -> float:
        """Wavelength (m) of a free wheelset's kinematic oscillation, 2 pi sqrt(a r_0 / lambda)."""
        assert self.contact is not None
        conicity = self.contact.linear(KINEMATIC_AMPLITUDE).conicity
        return klingel_wavelength(self.half_gauge, self.wheel_radius, conicity)

    def parameters(self) -> dict[str, float]:
        """Return all numbers that the equations of motion read; switches become 0 or 1."""
        return self.parameters_of(self.groups)

    def parameters_of(self, groups: Iterable[str]) -> dict[str, float]:
        """Return the numbers for equations with some of the groups of further parts."""
        numbers = {n: getattr(self, n) for n in (*QUANTITIES, *numbers_of(groups))}
        assert self.contact is not None
        on = (self.wheelbase_curving, self.load_bookkeeping == "printed")
        switches = dict(zip(SWITCHES, map(float, on), strict=True))
        return {**numbers, **self.contact.numbers(""), **switches}

    def to_toml(self, path: str | PathLike[str] | None = None) -> str:
        """Return the vehicle as TOML, with units and meanings as comments, and write it to ``path``.

        ``Vehicle.from_toml`` gives back an equal vehicle, to the last bit.
        """
        import tomlkit

        document = tomlkit.document()
        assert self.contact is not None
        short = self.contact == Cone(self.conicity)
        for f in dataclasses.fields(self):
            if f.name == ("contact" if short else "conicity"):
                continue
            value = getattr(self, f.name)
            if value is None or isinstance(value, ContactLaw):
                continue  # a part that it lacks; or it has its own table, at the end
            if "table" in f.metadata:
                value = [list(points) for points in value]
            item = tomlkit.item(value)
            item.comment(files.comment(f.metadata.get("unit", ""), f.metadata["meaning"]))
            document.add(f.name, item)
        if not short:
            document.add("contact", tomlkit.item(self.contact.to_mapping()))
        text = tomlkit.dumps(document)
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text

    @classmethod
    def from_toml(cls, path: str | PathLike[str]) -> Self:
        """Read a vehicle from a TOML file; nothing in the file is ever executed.

        All fields must be given, or ``base = "HIGH_SPEED_COACH"`` (any shipped vehicle) names the one
        that supplies the rest.

        Raises
        ------
        ParameterError
            If the file is not TOML, a field is missing, or a value is not allowed.
        UnknownNameError
            If the file has a key that is not a field.
        """
        data = files.read(path)
        if files.describes_assembly(data):
            raise ParameterError(
                f"{path} describes the parts of a vehicle; it is read by railenv.Assembly.from_toml"
            )
        return cls.described(data, str(path))

    @classmethod
    def described(cls, data: Mapping[str, Any], source: str) -> Self:
        """Return the vehicle that the content of a file describes; ``source`` names it in errors.

        Raises
        ------
        ParameterError
            If a field is missing, or a value is not allowed.
        UnknownNameError
            If there is a key that is not a field.
        """
        names = [f.name for f in dataclasses.fields(cls)]
        checks.known(f"field in {source}", set(data) - {"base"}, names)
        given = {name: value for name, value in data.items() if name != "base"}
        if "base" in data:
            base = data["base"]
            if not isinstance(base, str):
                raise ParameterError(f"base in {source} is {base!r}; it must be a vehicle's name")
            if "conicity" in data or "contact" in data:
                contact = {"conicity": None, "contact": None}
            else:
                contact = {}
            return cls(**{**_values(preset(base)), **contact, **given})
        needed = [f.name for f in dataclasses.fields(cls) if f.default is dataclasses.MISSING]
        missing = [n for n in needed if n not in given]
        if missing:
            raise ParameterError(
                f"{source} lacks {', '.join(missing)}; give them, or a `base` vehicle to take them from"
            )
        return cls(**given)


def _values(vehicle: Vehicle) -> dict[str, Any]:
    return {f.name: getattr(vehicle, f.name) for f in dataclasses.fields(vehicle)}


COMMENTS: dict[str, str] = {
    **{
        f.name: files.comment(f.metadata["unit"], f.metadata["meaning"])
        for f in dataclasses.fields(Vehicle)
        if "bounds" in f.metadata or "table" in f.metadata
    },
    **{
        f.name: files.comment(f.metadata["unit"], f.metadata["meaning"])
        for law in reversed(LAWS)
        for f in dataclasses.fields(law)
        if "bounds" in f.metadata
    },
    "wheelbase_curving": "1: wheelsets and frame see the track turn between them on a curve; 0: not",
    "printed_loads": "1: the print's load bookkeeping, the load on wheelsets and frame; 0: once",
}
"""Unit and meaning of :meth:`Vehicle.parameters`, on any contact law, for files."""

QUANTITIES = tuple(
    f.name for f in dataclasses.fields(Vehicle) if "bounds" in f.metadata and "group" not in f.metadata
)
"""Names of the fields that hold a physical quantity of every vehicle."""

SWITCHES = ("wheelbase_curving", "printed_loads")
"""Names of the parameters that are 0 or 1."""

TABLE_1 = Vehicle(
    name="TABLE_1",
    provenance="Table 1 of the paper as printed; I_wy, which it omits, from Zhai",
    wheelset_mass=1800.0,
    wheelset_roll_inertia=915.0,
    wheelset_pitch_inertia=140.0,
    wheelset_yaw_inertia=915.0,
    frame_mass=3000.0,
    frame_roll_inertia=2260.0,
    frame_yaw_inertia=3160.0,
    body_mass=34000.0,
    gravity=9.81,
    wheel_radius=0.4575,
    half_gauge=0.7176,
    half_wheelbase=1.2,
    frame_height=0.44,
    conicity=0.05,
    friction=0.2,
    flange_clearance=0.00923,
    lateral_creep=6.563e6,
    lateral_spin_creep=1.2e3,
    spin_creep=16.0,
    longitudinal_creep=6.563e6,
    vertical_rail_stiffness=62e6,
    lateral_rail_stiffness=16.17e6,
    primary_longitudinal_stiffness=86.7e3,
    primary_lateral_stiffness=56.7e3,
    primary_vertical_stiffness=750e3,
    primary_longitudinal_damping=12e3,
    primary_lateral_damping=12e3,
    primary_vertical_damping=450e3,
    primary_arm=0.978,
    yaw_damper_c1=19.1e3,
    yaw_damper_c2=514e3,
    yaw_damper_c3=-3112.7e3,
    yaw_damper_c4=5140e3,
    secondary_longitudinal_stiffness=0.0,
    secondary_lateral_stiffness=0.0,
    secondary_vertical_stiffness=0.0,
    secondary_longitudinal_damping=0.0,
    secondary_lateral_damping=0.0,
    secondary_vertical_damping=0.0,
    secondary_arm=1.0,
    wheelbase_curving=False,
    load_bookkeeping="once",
)
"""The paper's bogie: Table 1 as printed, with the load carried once."""

TABLE_1_PRINTED_LOADS = TABLE_1.replace(
    name="TABLE_1_PRINTED_LOADS",
    provenance="as TABLE_1, with the print's own load bookkeeping",
    load_bookkeeping="printed",
)
"""The paper's bogie with the print's load bookkeeping: W_ext on each wheelset and on the frame."""

HIGH_SPEED_COACH = TABLE_1.replace(
    name="HIGH_SPEED_COACH",
    provenance=(
        "masses, inertias and suspension of the high-speed coach in Zhai, Vehicle-Track Coupled "
        "Dynamics (appendix); contact and geometry of Table 1; height of the body and lateral stop "
        "from public models of that coach (body 1.51 m, axle 0.43 m above the rails)"
    ),
    wheelset_mass=1400.0,
    primary_longitudinal_stiffness=10e6,
    primary_lateral_stiffness=5e6,
    primary_vertical_stiffness=0.55e6,
    primary_longitudinal_damping=0.0,
    primary_lateral_damping=0.0,
    primary_vertical_damping=6e3,
    primary_arm=1.0,
    yaw_damper_c1=0.0,
    yaw_damper_c2=0.0,
    yaw_damper_c3=0.0,
    yaw_damper_c4=0.0,
    secondary_longitudinal_stiffness=0.15e6,
    secondary_lateral_stiffness=0.15e6,
    secondary_vertical_stiffness=0.40e6,
    secondary_lateral_damping=60e3,
    secondary_vertical_damping=80e3,
    body_roll_inertia=75.06e3,
    body_pitch_inertia=2.277e6,
    body_yaw_inertia=2.086e6,
    body_height=1.08,
    half_pivot_distance=9.0,
    frame_pitch_inertia=2710.0,
    lateral_stop_force=(
        (0.020, 0.025, 0.030, 0.035, 0.040, 0.045),
        (0.0, 696.0, 2107.0, 5596.0, 12603.0, 30096.0),
    ),
    lateral_stop_height=0.25,
    wheelbase_curving=True,
)
"""A high-speed coach of the kind in Table 1; its critical speed is near the paper's."""

HIGH_SPEED_COACH_HOLLOW = HIGH_SPEED_COACH.replace(
    name="HIGH_SPEED_COACH_HOLLOW",
    provenance=(
        "as HIGH_SPEED_COACH, on hollow treads: contact angle of S1002 on UIC 60 at 1:40, rail head of "
        "300 mm, and a conicity of wheels that have run a little"
    ),
    contact=HollowTread(conicity=0.1, contact_angle=0.034, rail_profile_radius=0.3),
)
"""The coach on hollow treads, whose conicity and contact angle change together."""


def preset(name: str) -> Vehicle:
    """Return a shipped vehicle by its name.

    Raises
    ------
    UnknownNameError
        If there is no such vehicle.
    """
    from railenv.vehicles.presets import PRESETS

    by_name = {v.name: v for v in PRESETS}
    checks.known("vehicle", [name], list(by_name))
    return by_name[name]
