"""All settings of an environment, in one record."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from railenv import checks
from railenv.contact.laws import ContactLaw
from railenv.envs import given
from railenv.envs.derailment import CONTACT_ANGLE, nadal_limits
from railenv.envs.observation import Observation
from railenv.equipment import PLACES, Actuator, Equipped, Place, Sensors
from railenv.errors import ParameterError, UnknownKeywordError, shown
from railenv.irregularity import SPACING, Level, Line
from railenv.irregularity import given as line_of
from railenv.model import Model
from railenv.models import Assembled, Bogie, Coach, DualWheelset
from railenv.vehicles import HIGH_SPEED_COACH_HOLLOW, TABLE_1, Vehicle
from railenv.vehicles.assembly import Assembly

TrackPlan = Literal["constant", "curve"]

Plant = Literal["bogie", "dual_wheelset", "coach"]

LOWEST_SPEED = 5.0
"""Lowest speed (m/s) of an episode, at which the window of Nadal's criterion still holds 2 m."""

RANDOMIZABLE = ("conicity", "friction", "creep_factor", "body_mass")
"""Numbers that ``randomize`` may vary of a vehicle on cones or hollow treads.

``creep_factor`` multiplies all four creep coefficients. Other contact laws have other numbers in the
place of ``conicity``, or none.
"""


@dataclass(frozen=True, kw_only=True)
class RewardWeights:
    """Weights of the reward's terms, each of which lies between 0 and 1; only their ratios count.

    Attributes
    ----------
    hunting : float
        Kinematic amplitude of hunting about the running equilibrium.
    excursion : float
        Lateral excursion of the wheelsets from it.
    ride : float
        Lateral acceleration of the sensed body above the frames, or else of the sensed bodies.
    effort : float
        Mean squared moment or force, as a share of the limit.
    command : float
        Mean squared command.
    change : float
        Mean change of the command since the step before, as a share of the whole range.
    """

    hunting: float = 0.35
    excursion: float = 0.25
    ride: float = 0.2
    effort: float = 0.05
    command: float = 0.05
    change: float = 0.1

    def __post_init__(self) -> None:
        for f in dataclasses.fields(self):
            checks.number(f"reward weight {f.name}", getattr(self, f.name), low=0.0)
        if not sum(dataclasses.astuple(self)) > 0.0:
            raise ParameterError("all reward weights are 0; at least one must be above 0")

    @property
    def shares(self) -> tuple[float, ...]:
        """Weights in the order of the terms, as shares of their sum."""
        weights = dataclasses.astuple(self)
        return tuple(weight / sum(weights) for weight in weights)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Keywords of the environments, checked.

    Attributes
    ----------
    plant : {"bogie", "dual_wheelset", "coach"}
        Set by the environment's id.
    vehicle : Vehicle, Assembly, str or mapping
        A vehicle, the name of a shipped one (``"HIGH_SPEED_COACH_S1002"``), or what a file of a vehicle
        holds (``{"base": "HIGH_SPEED_COACH", "friction": 0.4}``). An assembly is a vehicle of its own,
        not one of the environment's kind.
    contact : ContactLaw, mapping or str, optional
        Another contact law for the vehicle, short for ``vehicle.replace(contact=...)``; as a mapping,
        with its kind as ``law`` (``{"law": "cone", "conicity": 0.2}``), or its kind alone
        (``"profiles"``).
    model : Model, optional
        Instead of a vehicle: any model that describes its bodies, or a :class:`railenv.Equipped`
        with its own actuators and sensors.
    actuator : {"secondary", "primary", "both", "lateral", "none"}, optional
        Place of the yaw actuators, or lateral ones between frames and body. None, the default with an
        assembly or model, stands for its own actuators, as in :class:`railenv.Equipped`.
    actuator_model : Actuator, mapping or str, optional
        Their limits and lag; realistic ones for their place when left out. As a mapping, with ``base``
        for the fields left out (``{"base": "secondary", "delay": 0.02}``), or a name (``"secondary"``,
        ``"primary"``, ``"lateral"``).
    sensors : Sensors, mapping or str, optional
        Bandwidth, noise and bias; ``Sensors.standard()`` when left out. As a mapping, fields left out
        are standard; or a name (``"standard"``, ``"ideal"``).
    observation : {"state", "sensors"}
    context : bool
        Whether the observation also contains the drawn numbers of the vehicle: every number of
        ``randomize``, from -1 to 1 over its range.
    history : int
        Number of past observations stacked below the present one, oldest last.
    speed_range, cant_range : (float, float)
        Ranges from which an episode's speed (m/s) and cant (rad) are drawn.
    max_cant_deficiency : float
        Largest cant deficiency or excess (m over a base of 1.5 m), which bounds the curvature.
    min_radius : float
        Smallest curve radius drawn, m.
    tangent_share : float
        Share of the episodes on tangent track.
    track : {"constant", "curve"}
        The same curve for the whole episode, or tangent, clothoid, curve, clothoid, tangent.
    irregularity : {"low", "high"}, Line or mapping, optional
        Level of ERRI B176, or a :class:`railenv.irregularity.Line` or its fields; none when left out. A
        line that does not repeat begins again where it has faded out.
    irregularity_factor : (float, float)
        Range of the factor on it.
    randomize : mapping of str to (float, float)
        Ranges from which numbers of the vehicle are drawn: ``friction``, ``creep_factor`` (on all creep
        coefficients), ``body_mass`` (kg) and every number of its contact law, such as ``conicity`` of a
        cone or a hollow tread, ``contact_angle`` or ``wear``; with an assembly or a model any of its
        parameters.
    actuator_failure : float
        Share of the episodes in which one actuator, drawn at random, gets no more commands after some
        time, drawn from the first three quarters of the episode.
    nadal_limit : float or "contact angle"
        The Y/Q over 2 m above which a wheel counts as derailed. ``"contact angle"``: Nadal's limit for
        the flange of the vehicle's profiles and the friction of the episode.
    initial_offset : float
        Largest lateral displacement (m, either way) of all bodies at the start of an episode.
    duration : float
        Time after which the episode is truncated, s.
    control_period, time_step : float
        Time between actions (0.1 ms to 1 s) and step of the integration (1 µs to 1 s), s.
    weights : RewardWeights or mapping
        As a mapping, weights left out have their defaults (``{"ride": 0.5}``).
    critical_speed : float, optional
        Critical speed shown by the renderer, m/s.
    """

    plant: Plant
    vehicle: Vehicle | Assembly
    contact: ContactLaw | None = None
    model: Model | None = None
    actuator: Place | None
    actuator_model: Actuator | None = None
    sensors: Sensors | None = None
    observation: Observation = "state"
    context: bool = False
    history: int = 0
    speed_range: tuple[float, float]
    cant_range: tuple[float, float] = (0.0, 0.0873)
    max_cant_deficiency: float = 0.150
    min_radius: float = 250.0
    tangent_share: float = 0.25
    track: TrackPlan = "constant"
    irregularity: Level | Line | None = None
    irregularity_factor: tuple[float, float] = (1.0, 1.0)
    randomize: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    actuator_failure: float = 0.0
    nadal_limit: float | Literal["contact angle"] = 0.8
    initial_offset: float = 0.003
    duration: float = 10.0
    control_period: float = 0.005
    time_step: float = 0.001
    weights: RewardWeights = RewardWeights()
    critical_speed: float | None = None

    def __post_init__(self) -> None:
        self._resolve_records()
        self._resolve_vehicle()
        for name in ("actuator", "observation", "track"):
            value = getattr(self, name)
            if not isinstance(value, str) and not (name == "actuator" and value is None):
                raise ParameterError(f"{name} is {shown(value)}; it must be a name")
        for name, choices in (
            ("actuator", PLACES),
            ("observation", get_args(Observation)),
            ("track", get_args(TrackPlan)),
        ):
            if getattr(self, name) is not None:
                checks.known(name, [getattr(self, name)], choices)
        line_of(self.irregularity)
        self._check_model()
        self._range("speed_range", low=LOWEST_SPEED, high=checks.HIGHEST_SPEED, unit="m/s")
        self._range("cant_range", low=0.0, high=checks.CANT_LIMIT, unit="rad")
        self._range("irregularity_factor", low=0.0)
        if not isinstance(self.randomize, Mapping):
            raise ParameterError(f"randomize is {shown(self.randomize)}; it must map names to ranges")
        checks.known(self.told("name in randomize"), self.randomize, self.randomizable)
        self._check_ranges()
        self._check_nadal_limit()
        self._check_context()
        checks.number("actuator_failure", self.actuator_failure, low=0.0, high=1.0)
        if self.actuator_failure and not self.equipped.command_names:
            raise ParameterError(
                f"actuator_failure is {self.actuator_failure:g}, but {self.equipped.plant.name} has no "
                "actuators"
            )
        if self.critical_speed is not None:
            checks.speed(self.critical_speed, "critical_speed")
        for name, unit in (("max_cant_deficiency", "m"), ("min_radius", "m"), ("duration", "s")):
            checks.number(name, getattr(self, name), low=0.0, open_low=True, unit=unit)
        checks.number("control_period", self.control_period, low=1e-4, high=1.0, unit="s")
        checks.number("time_step", self.time_step, low=1e-6, high=1.0, unit="s")
        checks.number("tangent_share", self.tangent_share, low=0.0, high=1.0)
        checks.number("initial_offset", self.initial_offset, low=0.0, high=0.02, unit="m")
        checks.whole("history", self.history, low=0, high=_LONGEST_HISTORY)
        checks.number("duration", self.duration, high=_MOST_STEPS * self.control_period, unit="s")
        if self.steps < 1:
            raise ParameterError(
                f"duration is {self.duration:g} s; it must be at least one control period "
                f"({self.control_period:g} s)"
            )

    def _resolve_records(self) -> None:
        """Replace names and mappings with the records that they stand for."""

        def keep(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        keep("vehicle", given.vehicle(self.vehicle))
        keep("weights", given.record("weights", RewardWeights, self.weights))
        keep("irregularity", given.irregularity(self.irregularity))
        if self.actuator_model is not None:
            actuator = given.record("actuator_model", Actuator, self.actuator_model, given.ACTUATORS)
            keep("actuator_model", actuator)
        if self.sensors is not None:
            sensors = given.record("sensors", Sensors, self.sensors, given.SENSORS, "standard")
            keep("sensors", sensors)

    def _resolve_vehicle(self) -> None:
        """Check the model, and give the vehicle its contact law."""
        vehicle: Any = self.vehicle
        if not (self.model is None or isinstance(self.model, Model)):
            raise ParameterError(f"model is {shown(self.model)}; it must be a railenv.Model")
        if self.contact is not None:
            if self.model is not None or isinstance(vehicle, Assembly):
                raise ParameterError(
                    "contact is given with a model or an assembly; it belongs to a Vehicle, and "
                    "the wheelsets of an assembly have their own"
                )
            law = given.contact(self.contact)
            object.__setattr__(self, "contact", law)
            vehicle = vehicle.replace(contact=law)
        object.__setattr__(self, "vehicle", vehicle)

    def _check_ranges(self) -> None:
        """Raise if the vehicle does not allow every number that may be drawn."""
        plant = self.equipped.plant
        ends = {n: checks.interval(f"randomize[{n!r}]", self.randomize[n]) for n in self.randomize}
        object.__setattr__(self, "randomize", ends)
        for name, limits in ends.items():
            for end in limits:
                if name not in self._of_contact:
                    plant.replace(**{name: end})
        # numbers of a contact law bound each other
        together = [name for name in ends if name in self._of_contact]
        for corner in itertools.product(*(ends[name] for name in together)):
            plant.replace(**dict(zip(together, corner, strict=True)))

    def _check_nadal_limit(self) -> None:
        """Raise unless Nadal's limit is a number or can be taken from the flanges."""
        if not isinstance(self.nadal_limit, str):
            number = checks.number("nadal_limit", self.nadal_limit, low=0.0, open_low=True)
            object.__setattr__(self, "nadal_limit", number)
            return
        checks.choice("nadal_limit", self.nadal_limit, [CONTACT_ANGLE])
        for wheelset in self.equipped.guided:
            nadal_limits(self.nadal_limit, wheelset)

    def _check_context(self) -> None:
        """Raise if the observation is to contain drawn numbers of the vehicle and none are drawn."""
        if not isinstance(self.context, bool):
            raise ParameterError(f"context is {shown(self.context)}; it must be True or False")
        if self.context and not any(low < high for low, high in self.randomize.values()):
            raise ParameterError(
                "context is True, but nothing is drawn of the vehicle (randomize is "
                f"{dict(self.randomize)})"
            )

    def _check_model(self) -> None:
        """Raise if vehicle, actuators and sensors are incompatible, or there is no wheelset."""
        if isinstance(self.model, Equipped) and (self.actuator_model or self.sensors):
            raise ParameterError(
                "model is a railenv.Equipped, and actuator_model or sensors are given; it has its own"
            )
        if not self.equipped.guided:
            raise ParameterError(
                f"{self.equipped.plant.name} has no wheelsets; say which of its bodies are "
                "(flange_clearance and contact of a railenv.MovingBody)"
            )

    def _range(self, name: str, low: float, high: float = float("inf"), unit: str = "") -> None:
        object.__setattr__(
            self, name, checks.interval(name, getattr(self, name), low=low, high=high, unit=unit)
        )

    @cached_property
    def line(self) -> Line:
        """The line of irregularities, as a repeating one; a straight one if there are none."""
        found = line_of(self.irregularity)
        return _STRAIGHT if found is None else found.faded()

    @property
    def steps(self) -> int:
        """Control steps of an episode."""
        return round(self.duration / self.control_period)

    @cached_property
    def equipped(self) -> Equipped:
        """The vehicle with its equipment.

        Raises
        ------
        ParameterError
            If vehicle, actuators and sensors are incompatible.
        """
        if isinstance(self.model, Equipped):
            return self.model
        if self.model is not None:
            plant = self.model
        elif isinstance(self.vehicle, Assembly):
            plant = Assembled(self.vehicle)
        else:
            plant = _MODELS[self.plant](self.vehicle)
        return Equipped(plant, self.actuator, self.actuator_model, self.sensors)

    @property
    def _law(self) -> ContactLaw | None:
        """The contact law of a vehicle of the environment's kind."""
        plant = self.equipped.plant
        return plant.vehicle.contact if isinstance(plant, (Bogie, DualWheelset, Coach)) else None

    @cached_property
    def _of_contact(self) -> tuple[str, ...]:
        """Numbers of that law."""
        return tuple(self._law.number_fields()) if self._law is not None else ()

    @cached_property
    def _own(self) -> tuple[str, ...]:
        """Numbers of a vehicle of the environment's kind that may vary."""
        own = [name for name in RANDOMIZABLE if name != "conicity" or name in self._of_contact]
        return tuple(dict.fromkeys([*own, *self._of_contact]))

    @property
    def randomizable(self) -> tuple[str, ...]:
        """Numbers that ``randomize`` may vary."""
        return self.equipped.plant.variable_names if self._law is None else self._own

    @property
    def variable(self) -> tuple[str, ...]:
        """Numbers of the vehicle in which episodes may differ, or which options may pin."""
        return tuple(self.randomize) if self._law is None else self._own

    def told(self, kind: str) -> str:
        """Return the kind of an unknown name, with the contact law on which the names depend."""
        return kind if self._law is None else f"{kind} (the vehicle's contact is {self._law.called})"


_STRAIGHT = Line(np.zeros(2), np.zeros(2), np.zeros(2), SPACING)
_LONGEST_HISTORY = 10_000
_MOST_STEPS = 10**9

_MODELS: Mapping[Plant, type[Bogie | DualWheelset | Coach]] = {
    "bogie": Bogie,
    "dual_wheelset": DualWheelset,
    "coach": Coach,
}

_DEFAULTS: Mapping[str, Mapping[str, Any]] = {
    "bogie": {
        "vehicle": HIGH_SPEED_COACH_HOLLOW,
        "actuator": "secondary",
        "speed_range": (20.0, 160.0),
    },
    "dual_wheelset": {
        "vehicle": TABLE_1,
        "actuator": "primary",
        "speed_range": (20.0, 60.0),
    },
    "coach": {
        "vehicle": HIGH_SPEED_COACH_HOLLOW,
        "actuator": "secondary",
        "speed_range": (20.0, 150.0),
    },
}


def settings(plant: Plant, keywords: Mapping[str, Any]) -> Settings:
    """Return the settings of an environment: the defaults of its id, changed by keywords.

    Raises
    ------
    UnknownKeywordError
        If a keyword is not a setting.
    ParameterError
        If a value is not allowed.
    """
    names = [f.name for f in dataclasses.fields(Settings) if f.name != "plant"]
    unknown = [name for name in keywords if name not in names]
    if unknown:
        raise UnknownKeywordError.of("the environment", unknown, names)
    changes = dict(keywords)
    if "vehicle" in changes:
        changes["vehicle"] = given.vehicle(changes["vehicle"])
    own = isinstance(changes.get("vehicle"), Assembly) or changes.get("model") is not None
    defaults = {**_DEFAULTS[plant], **({"actuator": None} if own else {})}
    return Settings(plant=plant, **{**defaults, **changes})
