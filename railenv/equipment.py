"""Models that carry actuators and sensors."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks, mounting
from railenv.equations.coordinates import Running
from railenv.equations.equipped import Equipment, Mount
from railenv.equations.sensors import inertial_yaw_rate, specific_force
from railenv.errors import ParameterError, shown
from railenv.kernels import store
from railenv.model import Model
from railenv.mounting import PLACES, Place
from railenv.vehicles.actuators import Actuator, LateralActuator, Sensors, YawActuator
from railenv.vehicles.guided import Guided
from railenv.vehicles.records import ParameterRecord

__all__ = ["PLACES", "Actuator", "Equipped", "LateralActuator", "Place", "Sensors", "YawActuator"]

_COMPLEX_STEP = 1e-30


class Equipped(Model):
    """A model with actuators and sensors, whose states are added to the plant's.

    States are the plant's, then the moment of each actuator and its rate (``T_b, dT_b``; force
    ``F_..., dF_...`` for a lateral one), then the filtered readings of each sensor (``accel_b,
    gyro_b``). Inputs are the commands (``command_b``, N m or N), then the plant's own. The transport
    delay is not part of the equations.

    Parameters
    ----------
    plant : Model
        Any assembly, such as a Bogie, or your own equations with ``bodies``.
    place : {"secondary", "primary", "both", "lateral", "none"}, optional
        The usual actuators. Yaw actuators between frames and the body above them, between wheelsets and
        frames, or both; "lateral": lateral actuators between frames and the body above them, at the
        springs between them. When left out, the actuators that the vehicle's assembly declares,
        or else "secondary", or "primary" if no frame moves.
    actuator : Actuator, optional
        Numbers of those actuators; ``Actuator.secondary()``, ``primary()`` or ``lateral()`` when left
        out.
    sensors : Sensors, optional
        Sensors; when left out, those of the assembly, or ``Sensors.standard()``.
    actuators : sequence of YawActuator and LateralActuator, optional
        In place of ``place``: any number, between any two bodies. All must have the same delay.
    sensed : sequence of str, optional
        Bodies that carry sensors; when left out those of the assembly, or the frames and the bodies
        that they carry, or the wheelsets if no frame moves.

    Raises
    ------
    ParameterError
        If the plant cannot carry actuators at that place.
    UnknownNameError
        If there is no such body.

    Examples
    --------
    >>> import railenv
    >>> coach = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    >>> railenv.Equipped(coach, "both").command_names
    ('command_w1', 'command_w2', 'command_b')
    """

    def __init__(
        self,
        plant: Model,
        place: Place | None = None,
        actuator: Actuator | None = None,
        sensors: Sensors | None = None,
        *,
        actuators: Sequence[YawActuator] | None = None,
        sensed: Sequence[str] | None = None,
    ) -> None:
        given: Any = plant
        if not isinstance(given, Model) or isinstance(given, Equipped):
            raise ParameterError(f"plant is {plant!r}; it must be a railenv.Model without equipment")
        if not plant.body_names:
            raise ParameterError(
                f"{plant.name} does not say which of its states are whose motion; give its `bodies` "
                "(railenv.MovingBody)"
            )
        self.plant = plant
        declared = mounting.assembly_of(plant)
        if declared is not None:
            sensors = declared.sensors if sensors is None else sensors
            sensed = declared.sensed if sensed is None else sensed
            if declared.actuators and place is None and actuator is None and actuators is None:
                actuators = declared.actuators
        self.sensors = Sensors.standard() if sensors is None else sensors
        if not isinstance(self.sensors, Sensors):
            raise ParameterError(f"sensors is {self.sensors!r}; it must be a railenv.Sensors")
        self.place: str
        if actuators is None:
            self.place = mounting.first_place(plant) if place is None else place
            mounted = _usual(plant, self.place, actuator)
        elif place is not None or actuator is not None:
            raise ParameterError(
                "actuators are given, and place or actuator as well; give either them or these"
            )
        else:
            self.place = "custom"
            mounted = _mounted(plant, actuators)
        self._equip(*mounted, mounting.sensed_bodies(plant, sensed))

    def _equip(
        self,
        mounts: Sequence[Mount],
        groups: Mapping[str, Actuator],
        extra: Mapping[str, float],
        sensed: tuple[str, ...],
    ) -> None:
        plant = self.plant
        self.groups = dict(groups)
        self._places = dict(extra)
        delays = {a.delay for a in self.groups.values()}
        if len(delays) > 1:
            listed = ", ".join(f"{d:g}" for d in sorted(delays))
            raise ParameterError(f"delays of the actuators are {listed} s; they must be the same")
        lateral = mounting.lateral_rates(plant, sensed)
        wheelsets = mounting.wheelsets_with_forces(plant)
        self.equipment = Equipment(
            plant.equations,
            plant.state_names,
            plant.input_names,
            wheelsets,
            tuple(mounts),
            sensed,
            lateral,
        )
        own = {
            group + name: value
            for group, a in self.groups.items()
            for name, value in a.parameters().items()
        }
        taken = {*plant.parameters, *plant.tables} & {*own, *extra, *self.sensors.parameters()}
        if taken:
            raise ParameterError(
                f"{plant.name} has parameters {', '.join(sorted(taken))}, which its equipment needs; "
                "rename them"
            )
        count = len(self.equipment.state_names) - plant.n_states
        self._set(
            f"{plant.name}_{self.place}",
            self.equipment.state_names,
            self.equipment.input_names,
            self.equipment,
            {**plant.parameters, **own, **extra, **self.sensors.parameters()},
            [*plant.scale, *self._scales()],
            [*plant.guess, *[0.0] * count],
            plant.tables,
        )
        self._attributes = SimpleNamespace(**self.parameters, **self.tables)

    @property
    def structure(self) -> str:
        """The structure of the model, without its numbers."""
        e = self.equipment
        mounts = [(m.name, m.between, m.acts, m.group) for m in e.mounts]
        return f"{self.plant.structure} equipped {mounts} {e.sensed} {list(self.parameters)}"

    @property
    def _source(self) -> str:
        return store.source_of(store.Recipe(self.structure, self._write))

    @property
    def _signals(self) -> Any:
        return self.equipment.signals

    @property
    def _constants(self) -> dict[str, Any]:
        """Return the constants of the environments' control steps (``kernels/environment``)."""
        e, x, u = self.equipment, self.state_names.index, self.input_names.index
        return {
            "N_ACTUATORS": len(e.mounts),
            "N_SENSED": len(e.sensed),
            "N_FORCES": len(e.wheelsets),
            "FELT": tuple(map(e.sensed.index, self.felt)),
            "WATCHED": tuple(map(e.sensed.index, self.watched)),
            "GUIDED": tuple(
                (*map(x, (g.y, g.psi, g.dy)), *(x(n) if n else -1 for n in (g.z, g.phi)))
                for g in self.guided
            ),
            "RAILS": tuple(tuple(map(u, g.rails)) or (-1, -1, -1) for g in self.guided),
        }

    def _scales(self) -> list[float]:
        """Return typical magnitudes of the actuators' and sensors' states."""
        found = []
        for mount in self.equipment.mounts:
            a = self.groups[mount.group]
            found += [1e-2 * a.limit, 1e-2 * a.limit * 2.0 * math.pi * a.bandwidth]
        return [*found, *[0.1, 1e-2] * len(self.equipment.sensed)]

    # ---------------------------------------------------------------- what there is

    @property
    def actuator(self) -> Actuator:
        """The actuators' numbers, if all share them.

        Raises
        ------
        ParameterError
            If there are several kinds; see :attr:`groups`.
        """
        kinds = list(self.groups.values())
        if len(kinds) != 1:
            raise ParameterError(
                f"{self.name} has {len(kinds)} kinds of actuators; `groups` has each by its prefix"
            )
        return kinds[0]

    @property
    def delay(self) -> float:
        """Transport delay (s) of all commands."""
        return next((a.delay for a in self.groups.values()), 0.0)

    @property
    def limits(self) -> NDArray[np.float64]:
        """Largest moment (N m) or force (N) of each actuator."""
        return np.array([self.groups[m.group].limit for m in self.equipment.mounts])

    @property
    def sensed(self) -> tuple[str, ...]:
        """Bodies that carry sensors."""
        return self.equipment.sensed

    @property
    def felt(self) -> tuple[str, ...]:
        """Sensed bodies whose acceleration counts for ride: those above the frames, or else all."""
        above = mounting.carried(self.plant)
        return tuple(name for name in self.sensed if name in above) or self.sensed

    @property
    def watched(self) -> tuple[str, ...]:
        """Sensed bodies whose acceleration shows instability: the frames, or else the first one."""
        frames = mounting.frames(self.plant)
        return tuple(name for name in self.sensed if name in frames) or self.sensed[:1]

    @property
    def body_states(self) -> dict[str, dict[str, str]]:
        """State of each coordinate and rate (``y``, ``dpsi``) of each body that moves."""
        return self.plant.body_states

    @property
    def body_places(self) -> dict[str, float]:
        """Place (m) along the vehicle of each body that moves."""
        return self.plant.body_places

    @property
    def sites(self) -> dict[str, float]:
        """Place (m) along the vehicle of each body whose track may differ from that at the origin."""
        return self.plant.sites

    @property
    def body_heights(self) -> dict[str, float]:
        """Height (m) of the centre of each body that moves; 0 if the equations do not give it."""
        return self.plant.body_heights

    @property
    def body_inertias(self) -> dict[str, dict[str, float]]:
        """Mass (kg) or moment of inertia (kg m^2) of each coordinate of each body that moves."""
        return self.plant.body_inertias

    @property
    def guided(self) -> tuple[Guided, ...]:
        """The wheelsets."""
        return self.plant.guided

    @property
    def vehicle_name(self) -> str:
        """Name of the vehicle."""
        return self.plant.vehicle_name

    @property
    def gravity(self) -> float:
        """Acceleration due to gravity, m/s^2."""
        return self.plant.gravity

    @property
    def lateral_states(self) -> tuple[str, ...]:
        """States that are lateral displacements of bodies."""
        return self.plant.lateral_states

    @property
    def axle_load(self) -> float:
        """Load (N) of one wheelset on the rails at rest."""
        return self.plant.axle_load

    def replace(self, **changes: Any) -> Self:
        """Return the same model with some numbers of its plant, actuators or sensors changed.

        Numbers of the actuators have their fields' names, after the group's prefix if there are
        several kinds (``primary_limit``); ``delay`` is that of all.

        Raises
        ------
        UnknownNameError
            If a name belongs to none of them.
        """
        fields = getattr(self.plant, "vehicle", None)
        further = [f.name for f in dataclasses.fields(fields)] if fields is not None else []
        checks.known("parameter", changes, [*dict.fromkeys([*further, *self.variable_names])])
        model, rest = copy.copy(self), dict(changes)
        groups = {}
        for group, a in self.groups.items():
            own = {f: rest.pop(group + f) for f in _own_names(a) if group + f in rest}
            groups[group] = a.replace(**own, delay=changes.get("delay", a.delay))
        rest.pop("delay", None)
        places = {n: checks.number(n, rest.pop(n), unit="m") for n in self._places if n in rest}
        of_sensors = {f: rest.pop(f) for f in _names(self.sensors) if f in rest}
        model.sensors = self.sensors.replace(**of_sensors)
        model.plant = self.plant.replace(**rest) if rest else self.plant
        places = {**model._unmoved(self), **places}
        model._equip(self.equipment.mounts, groups, places, self.equipment.sensed)
        return model

    def _unmoved(self, before: Equipped) -> dict[str, float]:
        """Return the places of lateral actuators; those at their usual place follow the vehicle."""
        if self.place != "lateral":
            return before._places
        old, new = (mounting.usual(m.plant, m.place).places for m in (before, self))
        return {n: new[n] if value == old[n] else value for n, value in before._places.items()}

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Names that :meth:`replace` accepts: quantities of plant, actuators and sensors."""
        own = (group + f for group, a in self.groups.items() for f in _own_names(a))
        delay = ("delay",) if self.groups else ()
        return (*self.plant.variable_names, *own, *delay, *self._places, *_names(self.sensors))

    @property
    def command_names(self) -> tuple[str, ...]:
        """Inputs that a controller commands."""
        return self.input_names[: len(self.equipment.actuated)]

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """States that the sensors read."""
        return self.state_names[self.n_states - 2 * len(self.equipment.sensed) :]

    def check_conditions(self, speed: float, curvature: float, cant: float) -> None:
        """Raise ParameterError unless the plant runs at this speed (m/s), curvature (1/m), cant."""
        self.plant.check_conditions(speed, curvature, cant)

    @property
    def signal_names(self) -> tuple[str, ...]:
        """Names of the signals of :meth:`signals`."""
        return self.equipment.signal_names

    def signals(
        self,
        x: ArrayLike,
        u: ArrayLike | None = None,
        *,
        speed: float,
        curvature: float = 0.0,
        cant: float = 0.0,
    ) -> NDArray[np.float64]:
        """Return the specific force (m/s^2) of each sensed body, then Y and Q (N) of each wheel.

        Parameters are those of :meth:`railenv.Model.rhs`; the order is that of ``signal_names``.
        """
        evaluator = self._evaluator_at(x, u, speed, curvature, cant)
        return self._finite(evaluator.signals(), x)

    def signal_jacobian(
        self,
        x: ArrayLike,
        u: ArrayLike | None = None,
        *,
        speed: float,
        curvature: float = 0.0,
        cant: float = 0.0,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return exact derivatives of :meth:`signals` (same parameters) by states and inputs.

        They are computed by complex steps through the equations, which takes milliseconds.

        Returns
        -------
        C : ndarray, shape (n_signals, n_states)
        D : ndarray, shape (n_signals, n_inputs)
        """
        self.check_conditions(speed, curvature, cant)
        state = checks.vector("x", x, self.state_names)
        inputs = checks.vector("u", u, self.input_names)
        point = np.concatenate([state, inputs]).astype(complex)
        columns = []
        for k in range(len(point)):
            step = point.copy()
            step[k] += 1j * _COMPLEX_STEP
            arguments = step[: self.n_states].tolist(), step[self.n_states :].tolist()
            values = self.equipment.signals(*arguments, speed, curvature, cant, self._attributes)
            columns.append(np.imag(np.asarray(values, dtype=complex)) / _COMPLEX_STEP)
        full = np.stack(columns, axis=1)
        return full[:, : self.n_states], full[:, self.n_states :]

    def steady_state(
        self, plant_state: NDArray[np.float64], *, speed: float, curvature: float, cant: float
    ) -> NDArray[np.float64]:
        """Return the model's equilibrium: a plant's equilibrium with settled sensors.

        Parameters
        ----------
        plant_state : ndarray
            Equilibrium of the plant.
        speed, curvature, cant : float
            Running conditions (m/s, 1/m, rad).
        """
        state = np.concatenate([plant_state, np.zeros(self.n_states - self.plant.n_states)])
        names = self.state_names
        run = Running(speed, curvature, cant)
        motions = self.plant.equations.motions(plant_state.tolist())
        for body in self.equipment.sensed:
            force = specific_force(0.0, motions[body], run, self.gravity)
            state[names.index(f"accel_{body}")] = force
            state[names.index(f"gyro_{body}")] = inertial_yaw_rate(motions[body], run)
        return state


def _names(record: ParameterRecord) -> list[str]:
    return [f.name for f in dataclasses.fields(record)]


def _own_names(actuator: Actuator) -> list[str]:
    """Return the numbers in which kinds of actuators may differ: all but the common delay."""
    return [name for name in _names(actuator) if name != "delay"]


_Mounted = tuple[Sequence[Mount], dict[str, Actuator], dict[str, float]]
"""Mounts of actuators, their kinds by prefix, and places of lateral ones."""


def _usual(plant: Model, place: str, actuator: Actuator | None) -> _Mounted:
    """Return the actuators of one of the usual places."""
    if actuator is not None and not isinstance(actuator, Actuator):
        raise ParameterError(f"actuator is {actuator!r}; it must be a railenv.Actuator")
    chosen = mounting.usual(plant, place)
    groups = {g: actuator or getattr(Actuator, kind)() for g, kind in chosen.groups.items()}
    return chosen.mounts, groups, chosen.places


def _mounted(plant: Model, actuators: Sequence[YawActuator]) -> _Mounted:
    """Return actuators given one by one."""
    given: list[Any] = list(actuators)
    wrong = [a for a in given if not isinstance(a, YawActuator)]
    if wrong:
        raise ParameterError(
            f"actuators has {shown(wrong[0])}; it may have railenv.YawActuator and LateralActuator"
        )
    names = [a.name for a in given]
    if len(set(names)) < len(names):
        raise ParameterError(f"actuators are named {', '.join(names)}; names must differ")
    alike = len({a.actuator for a in given}) == 1
    mounts: list[Mount] = []
    groups: dict[str, Actuator] = {}
    places: dict[str, float] = {}
    for a in given:
        group = "" if alike else f"{a.name}_"
        groups[group] = a.actuator
        mounts.append(Mount(a.name, a.between, a.acts, group))
        mounting.check(plant, a.between, a.acts, a.name)
        if isinstance(a, LateralActuator):
            places |= {f"{a.name}_x": a.x, f"{a.name}_z": a.z}
    return mounts, groups, places
