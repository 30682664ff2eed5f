"""Assemblies: vehicles composed of bodies, wheelsets and force elements."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Self

from railenv import checks
from railenv.contact.laws import ContactLaw
from railenv.equations import motion
from railenv.equations.coordinates import (
    GROUND,
    Motion,
    Running,
    Site,
    Wrench,
    at_site,
    irregularity_names,
    motions,
    site_names,
    state_names,
)
from railenv.equations.functions import Scalar
from railenv.errors import ParameterError, UnknownNameError, shown
from railenv.fields import Number, Numbered
from railenv.tables import Table
from railenv.vehicles import files
from railenv.vehicles.actuators import Sensors, YawActuator
from railenv.vehicles.elements import (
    BODIES,
    ELEMENTS,
    GRAVITY,
    Body,
    Clamped,
    Element,
    Part,
    Wheelset,
)
from railenv.vehicles.expressions import evaluate

Values = Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Assembly:
    """A vehicle of bodies and force elements, from which its equations of motion are assembled.

    Every number of a part becomes a parameter of the model, named after part and field
    (``frame_mass``), unless it is a text: a text reads ``parameters`` by name, and may compute
    (``"-half_wheelbase"``). Vehicles of the same parts share their kernels, whatever the numbers.

    Parameters
    ----------
    name : str
    bodies : sequence of Wheelset, Body and Clamped
        In the states wheelsets come first, then bodies.
    elements : sequence of Element
        Their own states and inputs are in the order of :data:`railenv.vehicles.elements.ELEMENTS`.
    parameters : mapping of str to float, optional
        Numbers that several fields share, by name.
    gravity : float or str
        Acceleration due to gravity, m/s^2.
    wheelbase_curving : float or str
        1 if bodies at different places see the track turn between them on a curve, 0 if they do not
        (as in the paper).
    shifting_loads : bool
        True if vertical forces act at the displaced places of bodies: a body that moves aside or leans
        then bears more on that side. False if they act at the places of rest (as in the paper).
    provenance : str
        Where the numbers come from.
    actuators : sequence of YawActuator and LateralActuator, optional
        Actuators of the vehicle, the default of :class:`railenv.Equipped`.
    sensors : Sensors, optional
    sensed : sequence of str, optional
        Bodies that carry the sensors.

    Raises
    ------
    ParameterError
        If a number is not allowed, names repeat, an element is not attached to a body, or nothing
        holds a body to the ground.
    UnknownNameError
        If a text reads a parameter that does not exist.

    Examples
    --------
    >>> import railenv
    >>> coach = railenv.Bogie(railenv.HIGH_SPEED_COACH).assembly
    >>> [body.name for body in coach.bodies]
    ['w1', 'w2', 'b']
    """

    name: str
    bodies: tuple[Clamped, ...]
    elements: tuple[Element, ...] = ()
    parameters: Mapping[str, float] = dataclasses.field(default_factory=dict)
    gravity: Number = GRAVITY
    wheelbase_curving: Number = 1.0
    shifting_loads: bool = False
    provenance: str = ""
    actuators: tuple[YawActuator, ...] = ()
    sensors: Sensors | None = None
    sensed: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        for field, kinds in (("bodies", BODIES), ("elements", ELEMENTS)):
            parts = tuple(getattr(self, field))
            wrong = [p for p in parts if type(p) not in kinds]
            if wrong:
                names = ", ".join(kind.__name__ for kind in kinds)
                raise ParameterError(f"{field} has {shown(wrong[0])}; it may have {names}")
            order: Any = kinds
            object.__setattr__(self, field, tuple(sorted(parts, key=lambda p: order.index(type(p)))))
        given = checks.mapping("parameters", self.parameters)
        numbers = {name: checks.number(name, value) for name, value in given.items()}
        object.__setattr__(self, "parameters", numbers)
        if not isinstance(self.shifting_loads, bool):
            raise ParameterError(
                f"shifting_loads is {shown(self.shifting_loads)}; it must be true or false"
            )
        self._check_structure()
        self._check_equipment()
        self.check(self.values)

    # -------------------------------------------------------------------------- files

    @classmethod
    def described(cls, data: Mapping[str, Any], source: str, **own: Any) -> Self:
        """Return the assembly that the content of a file describes; ``own`` replaces plain fields.

        Raises
        ------
        ParameterError
            If a part lacks something or has a value that is not allowed; the message names the part.
        UnknownNameError
            If there is a name that a file cannot have.
        """
        return cls(**{**files.fields_of(data, source), **own})

    @classmethod
    def from_toml(cls, path: str | PathLike[str]) -> Self:
        """Read a vehicle from a TOML file of parts; nothing in the file is ever executed.

        If the file gives no name, the vehicle has the name of the file.

        Raises
        ------
        ParameterError
            If the file is not TOML, a part lacks something, or a value is not allowed.
        UnknownNameError
            If there is a name that a file cannot have.
        """
        data = files.read(path)
        if not files.describes_assembly(data):
            raise ParameterError(
                f"{path} has no parts such as [[wheelset]] or [[spring]]; a file of a bogie's numbers "
                "is read by railenv.Vehicle.from_toml"
            )
        return cls.described(data, str(path))

    def to_toml(
        self, path: str | PathLike[str] | None = None, *, units: Mapping[str, str] | None = None
    ) -> str:
        """Return the vehicle as TOML, with units and meanings as comments, and write it to ``path``.

        ``Assembly.from_toml`` gives back an equal vehicle, to the last bit.

        Parameters
        ----------
        path : path, optional
        units : mapping of str to str, optional
            Comments on :attr:`parameters`, by name.
        """
        text = files.text_of(self, units)
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text

    # ------------------------------------------------------------------------- checks

    def _check_structure(self) -> None:
        """Check names, attachments, and that something holds every body."""
        if not any(isinstance(body, Body) for body in self.bodies):
            raise ParameterError(f"{self.name} has no bodies that move; a vehicle needs at least one")
        names = [part.name for part in self.parts]
        for name in names:
            if names.count(name) > 1 or name == GROUND:
                raise ParameterError(
                    f"{name} cannot name a part of {self.name}: names must differ, and none may be "
                    f"{GROUND!r}, which is the track"
                )
        bodies = [body.name for body in self.bodies]
        for e in self.elements:
            for end in e.between:
                if end not in (*bodies, GROUND):
                    raise UnknownNameError(
                        f"body to which {e.name} is attached", str(end), [*bodies, GROUND]
                    )
            if e.between[0] == e.between[1]:
                raise ParameterError(f"{e.name} is attached to {e.between[0]} twice")
        loose = self._loose()
        if loose:
            raise ParameterError(
                f"nothing holds {', '.join(loose)} of {self.name} to the ground: no chain of force "
                "elements leads to a wheelset or to the ground"
            )

    def _check_equipment(self) -> None:
        """Check that actuators and sensors are on bodies that move."""
        moving = [body.name for body in self.bodies if isinstance(body, Body)]
        object.__setattr__(self, "actuators", tuple(self.actuators))
        for actuator in self.actuators:
            given: Any = actuator
            if not isinstance(given, YawActuator):
                raise ParameterError(
                    f"actuators has {shown(given)}; it may have railenv.YawActuator and LateralActuator"
                )
            checks.known(f"body of actuator {actuator.name}", actuator.between, [*moving, GROUND])
        if not isinstance(self.sensors, (Sensors, type(None))):
            raise ParameterError(f"sensors is {shown(self.sensors)}; it must be a railenv.Sensors")
        if self.sensed is not None:
            bodies: Any = self.sensed
            if isinstance(bodies, str) or not isinstance(bodies, Sequence):
                raise ParameterError(
                    f"bodies that carry sensors are {shown(bodies)}; they must be a list of names"
                )
            checks.known("body that carries sensors", bodies, moving)
            object.__setattr__(self, "sensed", tuple(bodies))

    def _loose(self) -> list[str]:
        """Return the bodies from which no chain of elements leads to the rails or the ground."""
        held = {GROUND, *(b.name for b in self.bodies if type(b) is not Body)}
        links = [set(e.between) for e in self.elements if not e.n_inputs]
        while more := {end for link in links if link & held for end in link} - held:
            held |= more
        return [body.name for body in self.bodies if body.name not in held]

    def check(self, values: Values) -> None:
        """Raise ParameterError unless all fields have allowed numbers with ``values``."""
        known = {**dict.fromkeys(self._table_names), **values}
        for part in self.parts:
            for role, (_, numbered) in part.groups().items():
                texts = self._expressions[part.name, role]
                plain = {f: evaluate(t, known, f"{f} of {part.name}") for f, t in texts.items()}
                for field in numbered.number_fields():
                    if field in plain:
                        numbered.checked(field, plain[field])
                if isinstance(numbered, ContactLaw):
                    numbered.with_numbers(plain)
        gravity, switch = (evaluate(self._own[f], known, f) for f in ("gravity", "wheelbase_curving"))
        checks.number("gravity", gravity, low=0.0, open_low=True, unit="m/s^2")
        if switch not in (0.0, 1.0):
            raise ParameterError(f"wheelbase_curving is {shown(switch)}; it must be 0 or 1")

    # -------------------------------------------------------------- names and numbers

    @property
    def parts(self) -> tuple[Part, ...]:
        """Bodies, then elements."""
        return (*self.bodies, *self.elements)

    @cached_property
    def wheelsets(self) -> tuple[Wheelset, ...]:
        """The bodies that run on the rails."""
        return tuple(body for body in self.bodies if isinstance(body, Wheelset))

    @cached_property
    def coordinates(self) -> dict[str, tuple[str, ...]]:
        """Coordinates of each body, by its name."""
        return {body.name: body.coordinates for body in self.bodies}

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Coordinates, their rates, then the elements' own states."""
        own = (name for e in self.elements for name in e.own_states)
        return (*state_names(self.coordinates), *own)

    @cached_property
    def input_names(self) -> tuple[str, ...]:
        """Moments and forces that the elements apply, then the irregularity under each wheelset."""
        driven = (e.name for e in self.elements if e.n_inputs)
        return (*driven, *irregularity_names([w.name for w in self.wheelsets]))

    @cached_property
    def site_names(self) -> tuple[str, ...]:
        """Names of the differences of the track at each body's place from that at the origin."""
        return site_names([body.name for body in self.bodies])

    @cached_property
    def scales(self) -> list[float]:
        """Typical magnitude of each state."""
        n = 2 * sum(map(len, self.coordinates.values()))
        return [1e-3] * n + [e.magnitudes for e in self.elements for _ in e.own_states]

    @cached_property
    def _own(self) -> dict[str, str]:
        """Expressions of the assembly's own fields."""
        given = {"gravity": self.gravity, "wheelbase_curving": self.wheelbase_curving}
        return {field: value if isinstance(value, str) else field for field, value in given.items()}

    @cached_property
    def _expressions(self) -> dict[tuple[str, str], dict[str, str]]:
        """Expression of every given field, by part and by the group of the part with the field."""
        return {
            (part.name, role): numbered.given(prefix)
            for part in self.parts
            for role, (prefix, numbered) in part.groups().items()
        }

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameters of the model: those given, then the numbers of the parts."""
        values = dict(self.parameters)
        own = [(field, getattr(self, field)) for field in self._own]
        for part in self.parts:
            for prefix, numbered in part.groups().values():
                own += numbered.numbers(prefix).items()
        for name, value in own:
            if value is None or isinstance(value, str):
                continue
            if name in values:
                raise ParameterError(
                    f"{name} is a parameter and the number of a field of {self.name} at once; give the "
                    f"field as the text {name!r}, or rename the parameter"
                )
            values[name] = checks.number(name, value)
        return values

    @property
    def _table_names(self) -> list[str]:
        return [
            prefix + field
            for part in self.parts
            for prefix, numbered in part.groups().values()
            for field in numbered.table_fields()
            if numbered.has_table(field)
        ]

    @cached_property
    def tables(self) -> dict[str, Table]:
        """All characteristics, by their names in the equations."""
        return {
            prefix + field: numbered.table(field)
            for part in self.parts
            for prefix, numbered in part.groups().values()
            for field in numbered.table_fields()
            if numbered.has_table(field)
        }

    def replace(self, **changes: float) -> Self:
        """Return the same vehicle with some of its :attr:`values` changed.

        Raises
        ------
        UnknownNameError
            If a name is not one of them.
        ParameterError
            If a number is not allowed.
        """
        checks.known("parameter", changes, list(self.values))
        fields: dict[str, Any] = {n: v for n, v in changes.items() if n in self._own}
        shared = {n: v for n, v in changes.items() if n in self.parameters}
        for group in ("bodies", "elements"):
            fields[group] = tuple(part.with_changes(changes) for part in getattr(self, group))
        fields["parameters"] = {**self.parameters, **shared}
        return dataclasses.replace(self, **fields)

    # ---------------------------------------------------------------------- equations

    @cached_property
    def structure(self) -> str:
        """Hash of everything but the numbers: vehicles of the same structure share kernels."""
        parts = [
            [role, numbered.kind, part.name, numbered.settings(), self._expressions[part.name, role]]
            for part in self.parts
            for role, (_, numbered) in part.groups().items()
        ]
        plain = [self._own, self.shifting_loads]
        text = json.dumps([parts, plain, list(self.values), self._table_names])
        return hashlib.sha256(text.encode()).hexdigest()

    def with_numbers(self, values: Values) -> SimpleNamespace:
        """Return the vehicle with numbers (or symbols) in all fields, for the equations."""
        bodies = [self._numbered(body, values) for body in self.bodies]
        by_name = {body.name: body for body in bodies}
        wheelsets = [by_name[w.name] for w in self.wheelsets]
        gravity = evaluate(self._own["gravity"], values)
        return SimpleNamespace(
            bodies=bodies,
            wheelsets=wheelsets,
            elements=[self._numbered(e, values) for e in self.elements],
            body=by_name.get,
            coordinates=self.coordinates,
            gravity=gravity,
            wheelbase_curving=evaluate(self._own["wheelbase_curving"], values),
            shifting_loads=self.shifting_loads,
            sites={b.name: self._site(b.name, values) for b in self.bodies},
            rail_level=wheelsets[0].z - wheelsets[0].wheel_radius if wheelsets else 0,
        )

    def _site(self, body: str, values: Values) -> Site:
        """Return the track at a body's place; by default it is that of the origin."""
        return Site(*(values.get(name, 0) for name in site_names([body])))

    def _numbered(self, part: Part, values: Values) -> SimpleNamespace:
        found = self._fields(part, "", part, values)
        found.name = part.name
        if isinstance(part, Clamped):
            for field in ("lateral_load_mass", "vertical_load_mass"):
                if isinstance(part, Body) and getattr(part, field) is None:
                    setattr(found, field, found.mass)
            if isinstance(part, Body) and part.load_height is None:
                found.load_height = None
            if isinstance(part, Wheelset):
                self._add_contact(found, part, values)
            return found
        assert isinstance(part, Element)
        if part.x is None:
            found.x = None
        found.between, found.pair, found.law = part.between, part.pair, part.law
        found.axis = getattr(part, "axis", None)
        found.n_states, found.n_inputs = part.n_states, part.n_inputs
        return found

    def _fields(self, part: Part, role: str, numbered: Numbered, values: Values) -> SimpleNamespace:
        found = SimpleNamespace(**dict.fromkeys(numbered.number_fields(), 0))
        vars(found).update(dict.fromkeys(numbered.table_fields()))
        for field, text in self._expressions[part.name, role].items():
            setattr(found, field, evaluate(text, values))
        return found

    def _add_contact(self, found: SimpleNamespace, part: Wheelset, values: Values) -> None:
        """Add to the numbers of a wheelset its contact laws and its fields that are not numbers."""
        for role, (_, numbered) in part.groups().items():
            if isinstance(numbered, ContactLaw):
                setattr(found, role, self._fields(part, role, numbered, values))
                getattr(found, role).law = numbered.law
        found.right = getattr(found, "right", found.left)
        found.saturation, found.saturation_of = part.saturation, part.saturation_of
        if part.creep_load is None:
            found.creep_load = None

    def contact_law(self, wheelset: str) -> ContactLaw:
        """Return the contact law of a wheelset's left wheel, with numbers for all its texts."""
        return self.contact_laws(wheelset)[0]

    def contact_laws(self, wheelset: str) -> tuple[ContactLaw, ContactLaw]:
        """Return the contact laws of the left and right wheel, with numbers for all their texts."""
        part = next(w for w in self.wheelsets if w.name == wheelset)
        found = []
        for role, (_, law) in part.groups().items():
            if isinstance(law, ContactLaw):
                texts = self._expressions[wheelset, role]
                numbers = {f: evaluate(texts[f], self.values) for f in law.number_fields()}
                found.append(law.with_numbers(numbers))
        return found[0], found[-1]

    def place(self, body: str, values: Values | None = None) -> float:
        """Return the place (m) of a body along the vehicle."""
        text = self._expressions[body, ""].get("x")
        return 0.0 if text is None else float(evaluate(text, values or self.values))


@dataclass(frozen=True)
class AssembledEquations:
    """Equations of motion of an assembly, for models and their equipment.

    Attributes
    ----------
    assembly : Assembly
        Structure of the assembly; the numbers come with every call.
    """

    assembly: Assembly

    def __call__(
        self,
        x: Sequence[Scalar],
        u: Sequence[Scalar],
        speed: Scalar,
        curvature: Scalar,
        cant: Scalar,
        p: Scalar,
    ) -> list[Scalar]:
        """Return time derivatives of the states; ``p`` has parameters and tables as attributes."""
        return self.driven(x, u, Running(speed, curvature, cant), p, {})

    def driven(
        self,
        x: Sequence[Scalar],
        u: Sequence[Scalar],
        run: Running,
        p: Scalar,
        wrenches: Mapping[str, Sequence[Wrench]],
    ) -> list[Scalar]:
        """Return time derivatives of the states, with further wrenches on the bodies."""
        return motion.rates(self.assembly.with_numbers(vars(p)), x, u, run, wrenches)

    def motions(self, x: Sequence[Scalar]) -> dict[str, Motion]:
        """Return the motions of the bodies."""
        return motions(x, self.assembly.coordinates)

    @property
    def site_names(self) -> tuple[str, ...]:
        """Result of :func:`railenv.equations.coordinates.site_names` for the bodies."""
        return self.assembly.site_names

    def here(self, body: str, run: Running, p: Scalar) -> Running:
        """Return the running conditions at a body's own place."""
        return at_site(run, self.assembly._site(body, vars(p)))

    def gravity(self, p: Scalar) -> Scalar:
        """Return the acceleration due to gravity."""
        return evaluate(self.assembly._own["gravity"], vars(p))

    def places(self, p: Scalar) -> dict[str, tuple[Scalar, Scalar]]:
        """Return the place along the vehicle and the height of every body."""
        return {b.name: (b.x, b.z) for b in self.assembly.with_numbers(vars(p)).bodies}

    def guiding_forces(
        self, x: Sequence[Scalar], u: Sequence[Scalar], run: Running, p: Scalar
    ) -> list[Scalar]:
        """Return Y and Q (N) of the left and right wheel of each wheelset."""
        return motion.guiding_forces(self.assembly.with_numbers(vars(p)), x, u, run)
