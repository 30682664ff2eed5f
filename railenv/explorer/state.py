"""Everything that the page shows, as one frozen record; results follow from it alone."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, Self, get_args

import agents
from agents.problems.damper import PrimaryDamper, YawDamper, without_dampers
from design.loop.feedback import Feedback
from railenv import (
    HIGH_SPEED_COACH_HOLLOW,
    Assembled,
    Assembly,
    Bogie,
    Coach,
    DualWheelset,
    Model,
    ProfileFamily,
    ProfilePair,
    Vehicle,
    checks,
    worn,
)
from railenv.contact.laws import ContactLaw
from railenv.errors import ParameterError

Kind = Literal["bogie", "dual-wheelset", "coach"]
KINDS: tuple[Kind, ...] = get_args(Kind)

Damper = Literal["own", "none"] | YawDamper | PrimaryDamper
"""The vehicle's own yaw dampers, none, or another one in their place."""

COMMON = ("friction", "creep_factor")
"""Numbers of the contact that every vehicle has; the others are those of its contact law."""

SHORTEST, LONGEST = 0.5, 60.0
"""Limits (s) of the duration of a motion."""

LARGEST_OFFSET = 0.02
"""m."""

_MODELS = {"bogie": Bogie, "dual-wheelset": DualWheelset, "coach": Coach}
_PROBLEMS: Mapping[Kind, str] = {
    "bogie": "bogie-secondary-v1",
    "dual-wheelset": "dual-wheelset-v1",
    "coach": "coach-v1",
}


@dataclass(frozen=True)
class Wearing:
    """A pair of profiles whose wheel wears by the rule of :func:`railenv.worn`.

    Attributes
    ----------
    new : ProfilePair
    depth, spread : float
        Wear of the tread at wear 1, and standard deviation of the lateral shift that wears it, m.
    """

    new: ProfilePair
    depth: float = 1e-3
    spread: float = 3e-3

    def law(self) -> ProfileFamily:
        """Return the profiles from new to worn, at wear 0."""
        return _family(self)


@cache
def _family(wearing: Wearing) -> ProfileFamily:
    new = wearing.new
    return ProfileFamily(new, worn(new, depth=wearing.depth, spread=wearing.spread), 0.0)


@dataclass(frozen=True)
class YawRate:
    """Feedback of the yaw rate with a chosen gain, N m per rad/s."""

    gain: float


Contact = ContactLaw | Wearing | None
"""None is the vehicle's own."""

Control = str | YawRate | None
"""Name of a shipped controller, feedback of the yaw rate, or none."""


@dataclass(frozen=True)
class State:
    """The state of the page.

    Attributes
    ----------
    vehicle : Vehicle or Assembly
        As shipped, or as dropped; the fields below change it.
    kind : {"bogie", "dual-wheelset", "coach"}
        The part of a Vehicle; an Assembly is its own model.
    contact : ContactLaw, Wearing or None
    damper : {"own", "none"}, YawDamper or PrimaryDamper
    numbers : tuple of (str, float)
        Friction, creep factor and numbers of the contact law that differ from the vehicle's own.
    radius, cant : float
        m (``math.inf`` is tangent track), rad.
    speed : float
        m/s.
    speed_range : (float, float)
        Range over which eigenvalues are shown, m/s.
    offset : float
        Lateral displacement of all bodies at the start of the motion, m.
    duration : float
        Duration of the motion, s.
    controller : str, YawRate or None

    Raises
    ------
    ParameterError
        If a running condition is not allowed.
    """

    vehicle: Vehicle | Assembly = HIGH_SPEED_COACH_HOLLOW
    kind: Kind = "bogie"
    contact: Contact = None
    damper: Damper = "own"
    numbers: tuple[tuple[str, float], ...] = ()
    radius: float = math.inf
    cant: float = 0.0
    speed: float = 100.0
    speed_range: tuple[float, float] = (5.0, 200.0)
    offset: float = 2e-3
    duration: float = 5.0
    controller: Control = None

    def __post_init__(self) -> None:
        checks.choice("kind", self.kind, KINDS)
        checks.curvature(self.radius)
        low, high = checks.speeds(self.speed_range)
        shift: Any = {"low": -LARGEST_OFFSET, "high": LARGEST_OFFSET}
        kept = {
            "radius": float(self.radius),
            "cant": checks.cant(self.cant),
            "speed_range": (low, high),
            "speed": checks.number("speed", self.speed, low=low, high=high, unit="m/s"),
            "offset": checks.number("offset", self.offset, **shift, unit="m"),
            "duration": checks.number("duration", self.duration, low=SHORTEST, high=LONGEST, unit="s"),
            "numbers": tuple((name, checks.number(name, value)) for name, value in self.numbers),
        }
        for name, value in kept.items():  # a browser gives whole numbers where it can
            object.__setattr__(self, name, value)

    # ------------------------------------------------------------------------- changes

    def with_vehicle(self, vehicle: Vehicle | Assembly, kind: Kind | None = None) -> Self:
        """Return the same running conditions with another, unchanged vehicle."""
        return dataclasses.replace(
            self,
            vehicle=vehicle,
            kind=kind or self.kind,
            contact=None,
            damper="own",
            numbers=(),
        )

    def with_contact(self, contact: Contact) -> Self:
        """Return the state with another contact; numbers of the previous one are dropped."""
        kept = tuple((name, value) for name, value in self.numbers if name in COMMON)
        return dataclasses.replace(self, contact=contact, numbers=kept)

    def with_number(self, name: str, value: float) -> Self:
        """Return the state with another friction, creep factor or number of the contact law."""
        numbers = {**dict(self.numbers), name: value}
        return dataclasses.replace(self, numbers=tuple(sorted(numbers.items())))

    def with_speed_range(self, low: float, high: float) -> Self:
        """Return the state with another range of speeds; the present speed moves into it."""
        low, high = checks.speeds((low, high))
        speed = min(max(self.speed, low), high)
        return dataclasses.replace(self, speed_range=(low, high), speed=speed)

    # ------------------------------------------------------------------------- what follows

    @property
    def law(self) -> ContactLaw | None:
        """The contact law with its numbers; None if the parts of an assembly have their own."""
        shown = self.vehicle_shown
        return shown.contact if isinstance(shown, Vehicle) else None

    @property
    def vehicle_shown(self) -> Vehicle | Assembly:
        """The vehicle with all changes.

        Raises
        ------
        ParameterError
            If it is impossible.
        """
        vehicle, numbers = self.vehicle, dict(self.numbers)
        if isinstance(vehicle, Assembly):
            for name, value in (("contact", self.contact), ("damper", self.damper)):
                if value not in (None, "own"):
                    raise ParameterError(
                        f"{vehicle.name} is made of parts, which have their own {name}; change it there"
                    )
            return Assembled(vehicle).replace(**numbers).assembly if numbers else vehicle
        if self.contact is not None:
            vehicle = vehicle.replace(**contact_fields(self.contact))
        if self.damper != "own":
            vehicle = without_dampers(vehicle)
            if not isinstance(self.damper, str):
                vehicle = self.damper.on(vehicle)
        return vehicle.replace(**numbers) if numbers else vehicle

    def plant(self) -> Assembled:
        """Return the model of the vehicle, without actuators."""
        shown = self.vehicle_shown
        return Assembled(shown) if isinstance(shown, Assembly) else _MODELS[self.kind](shown)

    def model(self) -> Model:
        """Return the model, with actuators and sensors if a controller is chosen."""
        plant = self.plant()
        return plant if self.controller is None else agents.equipped(plant)

    def feedback(self) -> agents.Controller | None:
        """Return the controller."""
        if self.controller is None:
            return None
        if isinstance(self.controller, YawRate):
            return agents.YawRateFeedback.design(self.model(), gain=self.controller.gain)
        return agents.shipped(self.controller, self.problem)

    @property
    def problem(self) -> str:
        """The problem whose shipped controllers fit this kind of vehicle."""
        return _PROBLEMS[self.kind]

    def to_python(self, *, diagram: bool = False) -> str:
        """Return a script that computes the results shown, optionally with the bifurcation diagram."""
        from railenv.explorer.script import script

        return script(self, diagram=diagram)

    def to_toml(self) -> str:
        """Return the vehicle as a file for every command, with running conditions as comments."""
        from railenv.explorer.script import conditions

        head = "".join(f"# {line}\n" for line in conditions(self))
        return f"{head}\n{self.vehicle_shown.to_toml()}"


def contact_fields(contact: ContactLaw | Wearing) -> dict[str, ContactLaw | float]:
    """Return the fields of a vehicle that a contact law sets: profiles have their own distance."""
    law = contact.law() if isinstance(contact, Wearing) else contact
    pair = law.new if isinstance(law, ProfileFamily) else law
    if not isinstance(pair, ProfilePair):
        return {"contact": law}
    return {
        "contact": law,
        "half_gauge": pair.half_contact_distance,
        "wheel_radius": pair.nominal_radius,
    }


@cache
def controller_names(kind: Kind) -> tuple[str, ...]:
    """Return the shipped controllers for a kind of vehicle whose closed loop has eigenvalues."""
    problem = _PROBLEMS[kind]
    names = agents.shipped_names(problem)
    return tuple(n for n in names if isinstance(agents.shipped(n, problem), Feedback))
