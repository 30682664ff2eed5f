"""The models of vehicles: any assembly, and the package's own.

A :class:`railenv.Model` made from equations of your own is used in the same way everywhere.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple, Self

from numpy.typing import ArrayLike

from railenv import checks
from railenv.contact.laws import ContactLaw
from railenv.equations import cooperrider
from railenv.equations.contact import Wheel, wheel
from railenv.equations.coordinates import Running, irregularity_names, rails
from railenv.errors import ParameterError, shown
from railenv.fields import Points
from railenv.kernels import store
from railenv.model import Model, check_names
from railenv.tables import Table
from railenv.vehicles import (
    COOPERRIDER,
    QUANTITIES,
    TABLE_1,
    CooperriderParameters,
    Vehicle,
    files,
    templates,
)
from railenv.vehicles.assembly import AssembledEquations, Assembly
from railenv.vehicles.declared import DeclaredEquations, MovingBody
from railenv.vehicles.elements import Element, Wheelset
from railenv.vehicles.further import BODY, GROUPS, NEEDS_BODY, OVERTURNING, PRIMARY_DAMPER, numbers_of
from railenv.vehicles.guided import KINEMATIC_AMPLITUDE, Guided
from railenv.vehicles.vehicle import SWITCHES

__all__ = ["Assembled", "Bogie", "Coach", "CooperriderBogie", "DualWheelset", "Model"]

_MILLIMETRE = 1e-3
_INERTIAS = {
    "y": "mass",
    "z": "mass",
    "phi": "roll_inertia",
    "theta": "pitch_inertia",
    "psi": "yaw_inertia",
}


class Assembled(Model):
    """A vehicle assembled from bodies and force elements.

    Parameters
    ----------
    assembly : Assembly

    Raises
    ------
    ParameterError
        If it is not an Assembly, or one of its names is unusable.

    Examples
    --------
    >>> import railenv
    >>> assembly = railenv.Bogie(railenv.HIGH_SPEED_COACH).assembly
    >>> railenv.Assembled(assembly).n_states
    24
    """

    def __init__(self, assembly: Assembly) -> None:
        if not isinstance(assembly, Assembly):
            raise ParameterError(f"assembly is {shown(assembly)}; it must be a railenv.Assembly")
        names = (assembly.state_names, assembly.input_names)
        check_names(*names, [*assembly.values, *assembly.tables])
        self._given = assembly
        self._set_assembled(assembly.name, assembly, assembly.values, assembly.tables)

    def _set_assembled(
        self,
        name: str,
        structure: Assembly,
        parameters: Mapping[str, float],
        tables: Mapping[str, Table],
    ) -> None:
        states = structure.state_names
        self._set(
            name,
            states,
            structure.input_names,
            AssembledEquations(structure),
            parameters,
            structure.scales,
            [-_MILLIMETRE * (name.startswith("z_")) for name in states],  # wheels loaded
            tables,
        )

    @property
    def assembly(self) -> Assembly:
        """The vehicle's parts, with its numbers."""
        return self._given

    @property
    def structure(self) -> str:
        """The structure without the numbers: models of one structure share their kernels."""
        return f"assembly {self.equations.assembly.structure}"

    @property
    def _source(self) -> str:
        return store.source_of(store.Recipe(self.structure, self._write))

    @property
    def body_states(self) -> dict[str, dict[str, str]]:
        """State of each coordinate and rate (``y``, ``dpsi``) of each body that moves."""
        return {
            name: {f"{d}{c}": f"{d}{c}_{name}" for d in ("", "d") for c in own}
            for name, own in self.equations.assembly.coordinates.items()
            if own
        }

    @property
    def body_inertias(self) -> dict[str, dict[str, float]]:
        """Mass (kg) or moment of inertia (kg m^2) of each coordinate of each body that moves."""
        vehicle = self.equations.assembly.with_numbers(self._values)
        return {
            name: {c: float(getattr(vehicle.body(name), _INERTIAS[c])) for c in own}
            for name, own in self.equations.assembly.coordinates.items()
            if own
        }

    @property
    def lateral_states(self) -> tuple[str, ...]:
        """States that are lateral displacements of bodies."""
        return tuple(f"y_{name}" for name in self.body_names)

    @property
    def axle_load(self) -> float:
        """Load (N) of one wheelset on the rails at rest, the same for all."""
        vehicle = self.equations.assembly.with_numbers(self._values)
        mass = sum(body.vertical_load_mass for body in vehicle.bodies if hasattr(body, "mass"))
        return float(vehicle.gravity * mass / max(1, len(vehicle.wheelsets)))

    @property
    def gravity(self) -> float:
        """Acceleration due to gravity, m/s^2."""
        return float(self.equations.assembly.with_numbers(self._values).gravity)

    @property
    def sites(self) -> dict[str, float]:
        """Place (m) along the vehicle of each body whose track may differ from that at the origin."""
        vehicle = self.equations.assembly.with_numbers(self._values)
        return {body.name: float(body.x) for body in vehicle.bodies}

    @property
    def guided(self) -> tuple[Guided, ...]:
        """The wheelsets."""
        found = []
        assembly = self.equations.assembly
        for w in assembly.with_numbers(self._values).wheelsets:
            laws = self._contact_laws(w.name)
            found.append(
                Guided(
                    name=w.name,
                    x=float(w.x),
                    clearance=_clearance(laws, float(w.flange_clearance)),
                    half_gauge=float(w.half_gauge),
                    wheel_radius=float(w.wheel_radius),
                    conicity=laws[0].linear(KINEMATIC_AMPLITUDE).conicity,
                    y=f"y_{w.name}",
                    psi=f"psi_{w.name}",
                    dy=f"dy_{w.name}",
                    rails=irregularity_names([w.name]),
                    z=f"z_{w.name}",
                    phi=f"phi_{w.name}",
                    laws=laws,
                    friction=float(w.friction),
                )
            )
        return tuple(found)

    def _contact_laws(self, wheelset: str) -> tuple[ContactLaw, ContactLaw]:
        """Return the contact laws of a wheelset's left and right wheel, with their numbers."""
        return self._given.contact_laws(wheelset)

    def contact_law(self, wheelset: str) -> ContactLaw:
        """Return the contact law of a wheelset's left wheel, with its numbers."""
        return self._given.contact_law(wheelset)

    @property
    def _values(self) -> dict[str, Any]:
        return {**self.parameters, **self.tables}

    def replace(self, **changes: Any) -> Self:
        """Return the same vehicle with some of its parameters changed; kernels are shared."""
        return type(self)(self.assembly.replace(**changes))

    def wheels(
        self,
        x: ArrayLike,
        u: ArrayLike | None = None,
        *,
        speed: float,
        curvature: float = 0.0,
        cant: float = 0.0,
    ) -> list[tuple[Wheel, Wheel]]:
        """Return loads and linear creep forces of the left and right wheel of each wheelset.

        Parameters are those of ``rhs``.
        """
        self.check_conditions(speed, curvature, cant)
        state = checks.vector("x", x, self.state_names).tolist()
        inputs = checks.vector("u", u, self.input_names).tolist()
        run = Running(speed, curvature, cant)
        motions = self.equations.motions(state)
        wheelsets = self.equations.assembly.with_numbers(self._values).wheelsets
        under = rails(inputs[self.n_inputs - 3 * len(wheelsets) :])
        return [
            (wheel(+1, motions[w.name], rail, run, w), wheel(-1, motions[w.name], rail, run, w))
            for w, rail in zip(wheelsets, under, strict=True)
        ]


class _VehicleModel(Assembled):
    """One of the package's own assemblies, whose parameters are those of a Vehicle."""

    _name: str  # of the model
    _template: str
    _body = False  # whether the vehicle's body moves

    def __init__(self, vehicle: Vehicle) -> None:
        if not isinstance(vehicle, Vehicle):
            raise ParameterError(f"vehicle is {vehicle!r}; it must be a railenv.Vehicle")
        self.vehicle = vehicle
        self._check()
        contact: Any = vehicle.contact
        structure = _structure(self._template, self._groups, contact.named(), _creep_options(vehicle))
        tables = {
            f"{w.name}_{field}": contact.table(field)
            for w in structure.assembly.wheelsets
            for field in contact.table_fields()
        }
        for part, field in structure.characteristics.items():
            tables[f"{part.name}_force"] = _characteristic(part, getattr(vehicle, field))
        names = structure.assembly.tables  # in the order in which kernels read them
        self._set_assembled(
            self._name,
            structure.assembly,
            vehicle.parameters_of(self._groups),
            {name: tables[name] for name in names},
        )

    def _check(self) -> None:
        """Raise ParameterError if the parts of the vehicle do not fit the model."""

    @property
    def _groups(self) -> frozenset[str]:
        """Parts of the model beyond the paper's bogie."""
        groups = self.vehicle.groups
        return groups if self._body else groups - {BODY, *NEEDS_BODY}

    @property
    def vehicle_name(self) -> str:
        """Name of the vehicle."""
        return self.vehicle.name

    @property
    def assembly(self) -> Assembly:
        """The vehicle's parts, with its numbers."""
        vehicle: Any = self.vehicle
        found = _assembly(
            self._template, self._groups, vehicle.contact.named(), _creep_options(vehicle), vehicle
        )
        own = {"name": vehicle.name, "provenance": vehicle.provenance}
        return dataclasses.replace(found, parameters=vehicle.parameters_of(self._groups), **own)

    @property
    def gravity(self) -> float:
        """Acceleration due to gravity, m/s^2."""
        return self.vehicle.gravity

    @property
    def axle_load(self) -> float:
        """Load (N) of one wheelset: its own weight and half of the bogie's load."""
        v = self.vehicle
        return v.wheelset_mass * v.gravity + v.external_load / 2.0

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Names of the vehicle's quantities and those of its contact law, and ``creep_factor``."""
        contact: Any = self.vehicle.contact
        further = numbers_of(self._groups)
        return (*QUANTITIES, *further, *contact.number_fields(), "creep_factor")

    def contact_law(self, wheelset: str) -> ContactLaw:
        """Return the contact law of a wheelset's left wheel, with its numbers."""
        return self._contact_laws(wheelset)[0]

    def _contact_laws(self, wheelset: str) -> tuple[ContactLaw, ContactLaw]:
        law: Any = self.vehicle.contact
        return law, law

    def replace(self, **changes: Any) -> Self:
        """Return the same model with some fields of its vehicle changed."""
        return type(self)(self.vehicle.replace(**changes))


def _clearance(laws: tuple[ContactLaw, ContactLaw], given: float) -> float:
    """Return the clearance (m) up to the first flange; the given one if no profile has a flange."""
    ways = [law.flange_clearance for law in laws]
    known = [way for way in ways if way is not None and math.isfinite(way)]
    return min(known, default=given)


_LOAD = "(wheelset_mass + (frame_mass + body_mass / 2) / 2) * gravity / 2"
"""Load of one wheel at rest."""


def _creep_options(vehicle: Vehicle) -> tuple[tuple[str, str], ...]:
    """Return the creep options of a vehicle's wheelsets."""
    options: dict[str, str] = {"saturation": vehicle.saturation, "saturation_of": vehicle.saturation_of}
    if vehicle.saturation == "polach":
        options |= {"polach_adhesion": "polach_adhesion", "polach_slip": "polach_slip"}
    if vehicle.load_dependent_creep:
        options["creep_load"] = _LOAD
    return tuple(options.items())


class _Structure(NamedTuple):
    """One of the package's own assemblies, with arbitrary numbers.

    ``characteristics`` gives the field of a vehicle with the points of an element's characteristic.
    """

    assembly: Assembly
    characteristics: dict[Element, str]


@cache
def _structure(
    template: str, groups: frozenset[str], law: ContactLaw, creep: tuple[tuple[str, str], ...]
) -> _Structure:
    """Return the parts of vehicles with the same structure."""
    assembly = _assembly(template, groups, law, creep, None)
    fields = templates.characteristics(templates.data_of(template, groups))
    return _Structure(assembly, {e: fields[e.name] for e in assembly.elements if e.name in fields})


@cache
def _characteristic(part: Element, points: Points) -> Table:
    """Return an element's characteristic with other points, in the form that kernels read."""
    given: Any = {"force": points}
    return dataclasses.replace(part, **given).table("force")


_SOME_POINTS: Points = ((0.0, 1.0), (0.0, 1.0))


def _assembly(
    template: str,
    groups: frozenset[str],
    law: ContactLaw,
    creep: tuple[tuple[str, str], ...],
    vehicle: Vehicle | None,
) -> Assembly:
    """Return one of the package's own assemblies with a contact law and a vehicle's characteristics.

    Numbers (and characteristics without a vehicle) are arbitrary.
    """
    data = templates.data_of(template, groups)
    points = {
        field: getattr(vehicle, field) if vehicle else _SOME_POINTS
        for field in templates.characteristics(data).values()
    }
    fields = files.fields_of(templates.with_points(data, points), template)
    given: dict[str, Any] = {**dict(creep), "contact": law, "conicity": None}
    fields["bodies"] = [
        dataclasses.replace(body, **given) if isinstance(body, Wheelset) else body
        for body in fields["bodies"]
    ]
    usual = TABLE_1.parameters()
    numbers = {field: law.example[field] for field in law.number_fields()}
    # in the order of Vehicle.parameters, so that a vehicle and its assembly share their kernels
    parameters = {
        **{name: usual[name] for name in QUANTITIES},
        **dict.fromkeys(numbers_of(groups), 1.0),
        **numbers,
        **{name: usual[name] for name in SWITCHES},
    }
    return Assembly(**fields, parameters=parameters)


class Bogie(_VehicleModel):
    """The two-axle bogie of 12 degrees of freedom (eq 6 of the paper).

    States are y, z, phi, psi of the leading wheelset ``w1``, the trailing wheelset ``w2`` and the
    frame ``b``, then their rates. Inputs are the yaw moments ``M_w1``, ``M_w2`` (primary actuators,
    wheelset against frame) and ``M_b`` (secondary, frame against body) in N m, and the track
    irregularity under each wheelset: ``align`` (lateral, m), ``vert`` (vertical, m), ``cross``
    (cross-level, rad).

    The body above is at rest. Parts of a vehicle between frame and body act against it, except the
    lateral stops, which a frame alone does not reach, and the traction rod, which it does not move.

    Parameters
    ----------
    vehicle : Vehicle
        For instance ``railenv.HIGH_SPEED_COACH``.
    """

    _name = _template = "bogie"

    @property
    def _groups(self) -> frozenset[str]:
        """Parts of the model beyond the paper's bogie."""
        return super()._groups | ({OVERTURNING} if self.vehicle.overturning else set())


class DualWheelset(_VehicleModel):
    """Two wheelsets suspended from a frame at rest, 8 degrees of freedom (eq 6 of the paper).

    States and inputs are those of :class:`Bogie` without the frame's. The two wheelsets are uncoupled,
    so every eigenvalue is double.

    Parameters
    ----------
    vehicle : Vehicle
        For instance ``railenv.TABLE_1``.
    """

    _name = _template = "dual_wheelset"

    def _check(self) -> None:
        if self.vehicle.overturning:
            raise ParameterError(
                f"overturning of {self.vehicle.name} is true; the frame of a dual wheelset stands "
                "still, so nothing can roll under the body's load"
            )

    @property
    def _groups(self) -> frozenset[str]:
        """Parts of the model beyond the paper's wheelsets: those between wheelsets and frame."""
        return super()._groups & {PRIMARY_DAMPER}


class Coach(_VehicleModel):
    """A whole vehicle: a body on two bogies, four wheelsets; 31 degrees of freedom.

    States are y, z, phi, psi of the wheelsets ``w1`` to ``w4`` from the front, then y, z, phi, theta,
    psi of the frames ``b1`` and ``b2`` and of the ``body``, then their rates, then the states of
    dampers on rubber ends. Inputs are, for each bogie, the yaw moments ``M_w1`` and ``M_w2`` (wheelset
    against frame) and ``M_b1`` (frame against body) in N m, then the track irregularity under each
    wheelset.

    Parameters
    ----------
    vehicle : Vehicle
        With the fields of a body, for instance ``railenv.HIGH_SPEED_COACH``.

    Raises
    ------
    ParameterError
        If the vehicle has no body, or the load bookkeeping as printed.
    """

    _name = "coach"
    _template = "bogie"
    _body = True

    def _check(self) -> None:
        vehicle = self.vehicle
        if BODY not in vehicle.groups:
            raise ParameterError(
                f"{vehicle.name} has no body; a whole vehicle needs {', '.join(GROUPS[BODY])}"
            )
        if vehicle.load_bookkeeping != "once":
            raise ParameterError(
                f"load_bookkeeping of {vehicle.name} is {vehicle.load_bookkeeping!r}; a body that "
                "moves carries its own weight, so it must be 'once'"
            )


_COOPERRIDER_BODIES = (
    *(
        MovingBody(
            name=w,
            y=f"y_{w}",
            psi=f"psi_{w}",
            yaw_moment=f"M_{w}",
            reacts_on="b",
            x=x,
            flange_clearance="flange_clearance",
            half_gauge="half_gauge",
            wheel_radius="wheel_radius",
            conicity="conicity",
        )
        for w, x in (("w1", "half_wheelbase"), ("w2", "-half_wheelbase"))
    ),
    MovingBody(name="b", y="y_b", psi="psi_b", phi="phi_b", yaw_moment="M_b"),
)


class CooperriderBogie(Model):
    """The Cooperrider bogie of 7 degrees of freedom, on tangent track only.

    Parameters
    ----------
    record : CooperriderParameters, optional
        The bogie of the literature when left out.
    """

    def __init__(self, record: CooperriderParameters = COOPERRIDER) -> None:
        if not isinstance(record, CooperriderParameters):
            raise ParameterError(f"record is {record!r}; it must be CooperriderParameters")
        self.record = record
        names = (cooperrider.STATES, cooperrider.INPUTS)
        equations = DeclaredEquations(cooperrider.cooperrider_bogie, *names, _COOPERRIDER_BODIES)
        self._set("cooperrider", *names, equations, record.parameters(), _MILLIMETRE, 0.0)

    @property
    def structure(self) -> str:
        """The structure of the model, without its numbers."""
        return "cooperrider"

    @property
    def _source(self) -> str:
        return store.source_of(store.Recipe(self.structure, self._write))

    def replace(self, **changes: float) -> Self:
        """Return the same model with some of its parameters changed."""
        return type(self)(self.record.replace(**changes))

    def check_conditions(self, speed: float, curvature: float, cant: float) -> None:
        """Raise ParameterError for a speed that is not positive, or for track that is not tangent."""
        super().check_conditions(speed, curvature, cant)
        if curvature != 0.0 or cant != 0.0:
            raise ParameterError(
                f"curvature is {curvature:g} 1/m and cant {cant:g} rad; the Cooperrider bogie is "
                "defined on tangent track only, where both are 0"
            )
