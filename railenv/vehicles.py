"""Vehicle parameters: one frozen record, and the vehicles that the package ships.

Every field carries its symbol in the paper, unit, meaning, allowed range and source in its metadata,
from which the parameter tables of the command line and of the documentation are made.
"""

from __future__ import annotations

import dataclasses
import math
import tomllib
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal, Self, get_args

from railenv import checks
from railenv.errors import ParameterError

LoadBookkeeping = Literal["once", "printed"]

CREEP_COEFFICIENTS = ("lateral_creep", "lateral_spin_creep", "spin_creep", "longitudinal_creep")
"""Fields that ``creep_factor`` multiplies."""

_TABLE = "Table 1"
_BEYOND = "beyond the paper"
_ADDED = "an addition to the benchmark, which has none"


def quantity(
    symbol: str,
    unit: str,
    meaning: str,
    source: str = _TABLE,
    *,
    default: Any = dataclasses.MISSING,
    **bounds: float | bool,
) -> Any:
    """Return a dataclass field that holds a physical quantity; bounds as in ``checks.number``."""
    metadata = {"symbol": symbol, "unit": unit, "meaning": meaning, "source": source}
    return dataclasses.field(default=default, metadata={**metadata, "bounds": bounds})


def _positive(
    symbol: str, unit: str, meaning: str, source: str = _TABLE, **bounds: float | bool
) -> Any:
    return quantity(symbol, unit, meaning, source, low=0.0, open_low=True, **bounds)


def _nonnegative(
    symbol: str, unit: str, meaning: str, source: str = _TABLE, **bounds: float | bool
) -> Any:
    return quantity(symbol, unit, meaning, source, low=0.0, **bounds)


@dataclass(frozen=True, kw_only=True)
class ParameterRecord:
    """Base of the frozen records of physical quantities: checks on creation, and ``replace``."""

    def __post_init__(self) -> None:
        """Check every quantity against its metadata and make it a float."""
        for f in dataclasses.fields(self):
            if "bounds" in f.metadata:
                value = checks.number(
                    f.name, getattr(self, f.name), unit=f.metadata["unit"], **f.metadata["bounds"]
                )
                object.__setattr__(self, f.name, value)

    def parameters(self) -> dict[str, float]:
        """Return all numbers that the equations of motion read, by name."""
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises
        ------
        UnknownNameError
            If a name is not a field.
        ParameterError
            If a value is not allowed.

        Examples
        --------
        >>> import railenv
        >>> railenv.HIGH_SPEED_COACH.replace(conicity=0.2).conicity
        0.2
        """
        checks.known("field", changes, [f.name for f in dataclasses.fields(self)])
        return dataclasses.replace(self, **changes)


@dataclass(frozen=True, kw_only=True)
class Vehicle(ParameterRecord):
    """Parameters of a bogie, its wheel-rail contact and its share of the vehicle body; SI units.

    Stiffnesses, dampings and creep coefficients are per side (per axle box, per wheel), as in Table 1
    of the paper; the nonlinear yaw damper is one per wheelset. ``railenv vehicles`` prints every field
    with its unit, and ``railenv vehicles NAME`` with symbol, meaning and source.

    Raises
    ------
    ParameterError
        If a value is not a finite number in its range; the message names field, value and range.
    """

    name: str = dataclasses.field(metadata={"meaning": "what to call the vehicle", "source": ""})
    provenance: str = dataclasses.field(
        metadata={"meaning": "where its numbers come from", "source": ""}
    )
    # masses and inertias
    wheelset_mass: float = _positive("m_w", "kg", "mass of one wheelset")
    wheelset_roll_inertia: float = _positive("I_wx", "kg m^2", "roll inertia of a wheelset")
    wheelset_pitch_inertia: float = _nonnegative(
        "I_wy",
        "kg m^2",
        "pitch inertia of a wheelset, about its axle (gyroscopic terms)",
        "eq 6; not in Table 1, from Zhai",
    )
    wheelset_yaw_inertia: float = _positive("I_wz", "kg m^2", "yaw inertia of a wheelset")
    frame_mass: float = _positive("m_b", "kg", "mass of the bogie frame")
    frame_roll_inertia: float = _positive("I_bx", "kg m^2", "roll inertia of the bogie frame")
    frame_yaw_inertia: float = _positive("I_bz", "kg m^2", "yaw inertia of the bogie frame")
    body_mass: float = _nonnegative("m_vb", "kg", "mass of the vehicle body, on two bogies")
    gravity: float = _positive("g", "m/s^2", "acceleration due to gravity")
    # geometry
    wheel_radius: float = _positive("r_0", "m", "nominal rolling radius")
    half_gauge: float = _positive("a", "m", "half the distance between the contact points")
    half_wheelbase: float = _positive("L", "m", "half the wheelbase (L_t1, L_t2, L_w in print)")
    frame_height: float = _nonnegative("h_G", "m", "height of the frame's centre above the axles")
    # wheel-rail contact
    conicity: float = _positive("lambda", "1", "conicity of the wheel treads", high=0.7)
    friction: float = _positive("mu", "1", "friction coefficient of wheel and rail", high=2.0)
    flange_clearance: float = _positive("delta", "m", "lateral clearance up to flange contact")
    lateral_creep: float = _positive("f_11", "N", "lateral creep coefficient")
    lateral_spin_creep: float = _nonnegative("f_12", "N m", "lateral/spin creep coefficient")
    spin_creep: float = _nonnegative("f_22", "N m^2", "spin creep coefficient")
    longitudinal_creep: float = _positive("f_33", "N", "longitudinal creep coefficient")
    vertical_rail_stiffness: float = _positive("K_rz", "N/m", "vertical stiffness under one wheel")
    lateral_rail_stiffness: float = _positive("K_ry", "N/m", "lateral stiffness behind the flange")
    # primary suspension
    primary_longitudinal_stiffness: float = _nonnegative("K_px", "N/m", "primary, per axle box")
    primary_lateral_stiffness: float = _nonnegative("K_py", "N/m", "primary, per axle box")
    primary_vertical_stiffness: float = _nonnegative("K_pz", "N/m", "primary, per axle box")
    primary_longitudinal_damping: float = _nonnegative("C_px", "N s/m", "primary, per axle box")
    primary_lateral_damping: float = _nonnegative("C_py", "N s/m", "primary, per axle box")
    primary_vertical_damping: float = _nonnegative("C_pz", "N s/m", "primary, per axle box")
    primary_arm: float = _positive(
        "b", "m", "lateral arm of primary springs and dampers (b_t1 to b_t4 in print)"
    )
    # nonlinear yaw damper between wheelset and frame: quartic in the speed, eq 7
    yaw_damper_c1: float = quantity("C_1", "N s/m", "yaw damper force (eq 7), linear term")
    yaw_damper_c2: float = quantity("C_2", "N s^2/m^2", "yaw damper force (eq 7), quadratic term")
    yaw_damper_c3: float = quantity("C_3", "N s^3/m^3", "yaw damper force (eq 7), cubic term")
    yaw_damper_c4: float = quantity("C_4", "N s^4/m^4", "yaw damper force (eq 7), quartic term")
    # secondary suspension, against a body at rest in the track frame
    secondary_longitudinal_stiffness: float = _nonnegative(
        "K_sx", "N/m", "secondary, per side", _BEYOND
    )
    secondary_lateral_stiffness: float = _nonnegative("K_sy", "N/m", "secondary, per side", _BEYOND)
    secondary_vertical_stiffness: float = _nonnegative("K_sz", "N/m", "secondary, per side", _BEYOND)
    secondary_longitudinal_damping: float = _nonnegative(
        "C_sx", "N s/m", "secondary, per side: the passive yaw damper", _BEYOND
    )
    secondary_lateral_damping: float = _nonnegative("C_sy", "N s/m", "secondary, per side", _BEYOND)
    secondary_vertical_damping: float = _nonnegative("C_sz", "N s/m", "secondary, per side", _BEYOND)
    secondary_arm: float = _positive(
        "b_s", "m", "lateral arm of the secondary springs and dampers", _BEYOND
    )
    # switches
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
        for label in ("name", "provenance"):
            if not isinstance(getattr(self, label), str):
                raise ParameterError(f"{label} is {getattr(self, label)!r}; it must be a string")
        if not isinstance(self.wheelbase_curving, bool):
            raise ParameterError(
                f"wheelbase_curving is {self.wheelbase_curving!r}; it must be true or false"
            )
        checks.choice("load_bookkeeping", self.load_bookkeeping, get_args(LoadBookkeeping))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        ``creep_factor``, which is no field, multiplies all four creep coefficients.

        Raises
        ------
        UnknownNameError
            If a name is neither a field nor ``creep_factor``.
        ParameterError
            If a value is not allowed.

        Examples
        --------
        >>> import railenv
        >>> railenv.HIGH_SPEED_COACH.replace(conicity=0.2).conicity
        0.2
        """
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

    @property
    def external_load(self) -> float:
        """Load (N) of one bogie: frame and half the vehicle body, the paper's W_ext."""
        return (self.body_mass / 2.0 + self.frame_mass) * self.gravity

    @property
    def klingel_wavelength(self) -> float:
        """Wavelength (m) of a free wheelset's kinematic oscillation, 2 pi sqrt(a r_0 / lambda)."""
        return 2.0 * math.pi * math.sqrt(self.half_gauge * self.wheel_radius / self.conicity)

    def parameters(self) -> dict[str, float]:
        """Return all numbers that the equations of motion read; switches become 0 or 1."""
        numbers = {n: getattr(self, n) for n in QUANTITIES}
        return {
            **numbers,
            "wheelbase_curving": float(self.wheelbase_curving),
            "printed_loads": float(self.load_bookkeeping == "printed"),
        }

    def to_toml(self, path: str | PathLike[str] | None = None) -> str:
        """Return the vehicle as TOML, with units and meanings as comments, and write it to ``path``.

        ``Vehicle.from_toml`` gives back an equal vehicle, to the last bit.
        """
        import tomlkit

        document = tomlkit.document()
        for f in dataclasses.fields(self):
            item = tomlkit.item(getattr(self, f.name))
            unit = f.metadata.get("unit")
            item.comment(f"{f.metadata['meaning']}" + (f" [{unit}]" if unit else ""))
            document.add(f.name, item)
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
        try:
            text = Path(path).read_text(encoding="utf-8")
            data = tomllib.loads(text)
        except (RecursionError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ParameterError(f"{path} is not a TOML file: {error}") from None
        names = [f.name for f in dataclasses.fields(cls)]
        checks.known(f"field in {path}", set(data) - {"base"}, names)
        if "base" in data:
            base = data.pop("base")
            if not isinstance(base, str):
                raise ParameterError(f"base in {path} is {base!r}; it must be a vehicle's name")
            return cls(**{**_values(preset(base)), **data})
        missing = [n for n in names if n not in data]
        if missing:
            raise ParameterError(
                f"{path} lacks {', '.join(missing)}; give them, or a `base` vehicle to take them from"
            )
        return cls(**data)


def _values(vehicle: Vehicle) -> dict[str, Any]:
    return {f.name: getattr(vehicle, f.name) for f in dataclasses.fields(vehicle)}


QUANTITIES = tuple(f.name for f in dataclasses.fields(Vehicle) if "bounds" in f.metadata)
"""Names of the fields of a Vehicle that hold a physical quantity."""

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
        "Dynamics (appendix); contact and geometry of Table 1"
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
)
"""A high-speed coach of the kind whose masses Table 1 has; its critical speed lies near the paper's."""

PRESETS = (TABLE_1, TABLE_1_PRINTED_LOADS, HIGH_SPEED_COACH)
"""The vehicles that the package ships."""


def preset(name: str) -> Vehicle:
    """Return a shipped vehicle by its name.

    Raises
    ------
    UnknownNameError
        If there is no such vehicle.
    """
    by_name = {v.name: v for v in PRESETS}
    checks.known("vehicle", [name], list(by_name))
    return by_name[name]


@dataclass(frozen=True)
class FieldDescription:
    """One row of a parameter table."""

    name: str
    symbol: str
    unit: str
    meaning: str
    source: str


def describe(record: type) -> list[FieldDescription]:
    """Describe the fields of a parameter record (a dataclass of quantities), in order."""
    return [
        FieldDescription(
            f.name,
            f.metadata.get("symbol", ""),
            f.metadata.get("unit", ""),
            f.metadata["meaning"],
            f.metadata["source"],
        )
        for f in dataclasses.fields(record)
    ]


@dataclass(frozen=True, kw_only=True)
class CooperriderParameters(ParameterRecord):
    """Parameters of the Cooperrider bogie, the benchmark of nonlinear railway dynamics; SI units.

    Raises
    ------
    ParameterError
        If a value is not a finite number in its range; the message names field, value and range.
    """

    wheelset_mass: float = _positive("m_w", "kg", "mass of one wheelset", "Cooperrider bogie")
    frame_mass: float = _positive("m_f", "kg", "mass of the bogie frame", "Cooperrider bogie")
    wheelset_yaw_inertia: float = _positive("I_w", "kg m^2", "wheelset, yaw", "Cooperrider bogie")
    frame_yaw_inertia: float = _positive("I_fz", "kg m^2", "frame, yaw", "Cooperrider bogie")
    frame_roll_inertia: float = _positive("I_fx", "kg m^2", "frame, roll", "Cooperrider bogie")
    k1: float = _nonnegative("k_1", "N/m", "primary lateral stiffness", "Cooperrider bogie")
    k2: float = _nonnegative("k_2", "N/m", "primary longitudinal stiffness", "Cooperrider bogie")
    k3: float = _nonnegative("k_3", "N/m", "primary vertical stiffness", "Cooperrider bogie")
    k4: float = _nonnegative("k_4", "N/m", "secondary lateral stiffness", "Cooperrider bogie")
    k5: float = _nonnegative("k_5", "N/m", "secondary vertical stiffness", "Cooperrider bogie")
    k6: float = _nonnegative("k_6", "N m/rad", "secondary yaw stiffness", "Cooperrider bogie")
    D1: float = _nonnegative("D_1", "N s/m", "secondary vertical damping", "Cooperrider bogie")
    D2: float = _nonnegative("D_2", "N s/m", "secondary lateral damping", "Cooperrider bogie")
    yaw_damping: float = _nonnegative("D_6", "N m s/rad", "yaw damper", _ADDED, default=0.0)
    half_gauge: float = _positive("a", "m", "half the track gauge", "Cooperrider bogie")
    half_wheelbase: float = _positive("b", "m", "half the wheelbase", "Cooperrider bogie")
    d1: float = _nonnegative("d_1", "m", "arm of the primary springs", "Cooperrider bogie")
    d2: float = _nonnegative("d_2", "m", "arm of the secondary springs", "Cooperrider bogie")
    h1: float = _nonnegative("h_1", "m", "frame above primary springs", "Cooperrider bogie")
    h2: float = _nonnegative("h_2", "m", "secondary springs above frame", "Cooperrider bogie")
    wheel_radius: float = _positive("r_0", "m", "nominal rolling radius", "Cooperrider bogie")
    conicity: float = _positive("lambda", "1", "wheel conicity", "Cooperrider bogie", high=0.7)
    flange_clearance: float = _positive("delta", "m", "dead band of flange", "Cooperrider bogie")
    flange_stiffness: float = _nonnegative("k_0", "N/m", "flange spring", "Cooperrider bogie")
    adhesion_force: float = _positive("mu N", "N", "adhesion limit, one wheel", "Cooperrider bogie")
    creep_ratio_lateral: float = _positive("Psi", "1", "Vermeulen-Johnson", "Cooperrider bogie")
    creep_ratio_longitudinal: float = _positive("Phi", "1", "Vermeulen-Johnson", "Cooperrider bogie")
    creep_coefficient: float = _positive("G pi a b", "N", "creep coefficient", "Cooperrider bogie")


COOPERRIDER = CooperriderParameters(
    wheelset_mass=1022.0,
    frame_mass=2918.0,
    wheelset_yaw_inertia=678.0,
    frame_yaw_inertia=6780.0,
    frame_roll_inertia=6780.0,
    k1=1.823e6,
    k2=3.646e6,
    k3=3.646e6,
    k4=0.1823e6,
    k5=0.3333e6,
    k6=2.710e6,
    D1=20.0e3,
    D2=29.2e3,
    half_gauge=0.716,
    half_wheelbase=1.074,
    d1=0.620,
    d2=0.680,
    h1=0.0762,
    h2=0.6584,
    wheel_radius=0.4572,
    conicity=0.05,
    flange_clearance=9.1e-3,
    flange_stiffness=14.60e6,
    adhesion_force=10e3,
    creep_ratio_lateral=0.54219,
    creep_ratio_longitudinal=0.60252,
    creep_coefficient=6.563e6,
)
"""The Cooperrider bogie with the numbers of the literature."""
