"""A plant with actuators and sensors: their states join the plant's own equations.

States are the plant's, then moment (or force) and rate of each actuator, then the filtered readings of
each sensor. Inputs are the commands, then the plant's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal

from railenv.equations.actuator import (
    ActuatorState,
    actuator_rates,
    applied_moment,
    parallel_damper_force,
    parallel_damper_moment,
)
from railenv.equations.coordinates import AT_REST, GROUND, Motion, Running, Wrench
from railenv.equations.elements import Arm, at_centre, opposite, point
from railenv.equations.functions import Scalar
from railenv.equations.sensors import (
    SensorState,
    inertial_yaw_rate,
    sensor_rates,
    specific_force,
)

ACTUATOR_NUMBERS = (
    "actuator_limit",
    "actuator_bandwidth",
    "actuator_damping",
    "actuator_rate_limit",
    "actuator_arm",
    "parallel_damping",
    "parallel_force_limit",
)
"""Attributes of ``p`` that an actuator reads, behind the prefix of its group."""


@dataclass(frozen=True)
class Mount:
    """Where an actuator acts: on the first body, with its reaction on the second.

    Attributes
    ----------
    name : str
        Of its states and its command.
    between : tuple of str
    acts : {"yaw", "lateral"}
        A moment about z, or a force along y at the place (``<name>_x``, ``<name>_z``) of ``p``.
    group : str
        Prefix of its numbers: actuators of a group share them.
    """

    name: str
    between: tuple[str, str]
    acts: Literal["yaw", "lateral"]
    group: str

    @property
    def state_names(self) -> tuple[str, str]:
        """Names of its states: what it develops, and the rate of that."""
        letter = "T" if self.acts == "yaw" else "F"
        return f"{letter}_{self.name}", f"d{letter}_{self.name}"


@dataclass(frozen=True)
class Equipment:
    """Which actuators a plant has, and which of its bodies carry sensors.

    Attributes
    ----------
    plant : AssembledEquations or DeclaredEquations
        The plant's equations of motion.
    states, inputs : tuple of str
        Names of the plant's.
    wheelsets : tuple of str
        Bodies whose wheels' forces are among the signals.
    mounts : tuple of Mount
    sensed : tuple of str
        Bodies with an accelerometer and a yaw gyro.
    lateral_rates : tuple of str
        The state that is the lateral velocity of each sensed body.
    """

    plant: Any
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    wheelsets: tuple[str, ...]
    mounts: tuple[Mount, ...]
    sensed: tuple[str, ...]
    lateral_rates: tuple[str, ...]

    @property
    def site_names(self) -> tuple[str, ...]:
        """Numbers of the track at the bodies' places."""
        names: tuple[str, ...] = self.plant.site_names
        return names

    @property
    def actuated(self) -> tuple[str, ...]:
        """Names of the actuators."""
        return tuple(mount.name for mount in self.mounts)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of all states."""
        actuators = [name for mount in self.mounts for name in mount.state_names]
        sensors = [name for body in self.sensed for name in (f"accel_{body}", f"gyro_{body}")]
        return (*self.states, *actuators, *sensors)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of all inputs."""
        return (*(f"command_{name}" for name in self.actuated), *self.inputs)

    @property
    def signal_names(self) -> tuple[str, ...]:
        """Names of the signals of :meth:`signals`."""
        forces = [
            f"{force}_{side}_{w}"
            for w in self.wheelsets
            for side in ("left", "right")
            for force in "YQ"
        ]
        return (*(f"force_{body}" for body in self.sensed), *forces)

    def __call__(
        self,
        x: Sequence[Scalar],
        u: Sequence[Scalar],
        speed: Scalar,
        curvature: Scalar,
        cant: Scalar,
        p: Scalar,
    ) -> list[Scalar]:
        """Time derivatives of all states."""
        run = Running(speed, curvature, cant)
        motions, actuators, sensors = self._split(x)
        rates = self._plant_rates(x, u, run, p)
        extra: list[Scalar] = []
        for mount, actuator, command in zip(self.mounts, actuators, u, strict=False):
            extra += actuator_rates(actuator, command, numbers(mount, p))
        forces = self._specific_forces(rates, motions, run, p)
        for body, force, sensor in zip(self.sensed, forces, sensors, strict=True):
            rate = inertial_yaw_rate(motions[body], self.plant.here(body, run, p))
            extra += sensor_rates(sensor, force, rate, p)
        return [*rates, *extra]

    def signals(
        self,
        x: Sequence[Scalar],
        u: Sequence[Scalar],
        speed: Scalar,
        curvature: Scalar,
        cant: Scalar,
        p: Scalar,
    ) -> list[Scalar]:
        """Unfiltered specific force of each sensed body, then Y and Q (N) of every wheel.

        Y is the guiding force, positive where the rail pushes the wheel towards the track's middle; Q
        the wheel load. Order: left and right wheel of the leading, then of the trailing wheelset.
        """
        run = Running(speed, curvature, cant)
        motions, _, _ = self._split(x)
        found = self._specific_forces(self._plant_rates(x, u, run, p), motions, run, p)
        plant_inputs = u[len(self.mounts) :]
        return [*found, *self.plant.guiding_forces(x[: len(self.states)], plant_inputs, run, p)]

    def _specific_forces(
        self, rates: Sequence[Scalar], motions: dict[str, Motion], run: Running, p: Scalar
    ) -> list[Scalar]:
        """Return what an ideal accelerometer on each sensed body reads (m/s^2)."""
        gravity = self.plant.gravity(p)
        places = (self.states.index(name) for name in self.lateral_rates)
        return [
            specific_force(rates[i], motions[body], self.plant.here(body, run, p), gravity)
            for body, i in zip(self.sensed, places, strict=True)
        ]

    def _split(
        self, x: Sequence[Scalar]
    ) -> tuple[dict[str, Motion], list[ActuatorState], list[SensorState]]:
        n, count = len(self.states), len(self.mounts)
        pairs = [tuple(x[i : i + 2]) for i in range(n, len(x), 2)]
        return (
            self.plant.motions(x[:n]),
            [ActuatorState(*pair) for pair in pairs[:count]],
            [SensorState(*pair) for pair in pairs[count:]],
        )

    def _plant_rates(
        self, x: Sequence[Scalar], u: Sequence[Scalar], run: Running, p: Scalar
    ) -> list[Scalar]:
        """Return derivatives of the plant's states under what the actuators apply."""
        motions, actuators, _ = self._split(x)
        wrenches: dict[str, list[Wrench]] = {}
        places = self.plant.places(p) if any(m.acts == "lateral" for m in self.mounts) else {}
        for mount, state in zip(self.mounts, actuators, strict=True):
            for body, wrench in _applied(mount, state, motions, places, p):
                wrenches.setdefault(body, []).append(wrench)
        n = len(self.states)
        rates: list[Scalar] = self.plant.driven(x[:n], u[len(self.mounts) :], run, p, wrenches)
        return rates


def numbers(mount: Mount, p: Scalar) -> SimpleNamespace:
    """Return the numbers of an actuator under the names that its equations read."""
    return SimpleNamespace(**{n: getattr(p, mount.group + n) for n in ACTUATOR_NUMBERS})


def _applied(
    mount: Mount,
    state: ActuatorState,
    motions: dict[str, Motion],
    places: dict[str, tuple[Scalar, Scalar]],
    p: Scalar,
) -> list[tuple[str, Wrench]]:
    """Wrenches about the centres of both bodies that an actuator and the damper beside it apply."""
    own = numbers(mount, p)
    first, second = mount.between
    a, b = (motions.get(body, AT_REST) for body in mount.between)
    if mount.acts == "yaw":
        moment = applied_moment(state, own) + parallel_damper_moment(a.dpsi - b.dpsi, own)
        pairs = [(first, Wrench(yaw=moment)), (second, Wrench(yaw=-moment))]
    else:
        x, z = getattr(p, f"{mount.name}_x"), getattr(p, f"{mount.name}_z")
        at = [places.get(body, (x, z)) for body in mount.between]  # the ground is where it acts
        arms = [Arm(x - place[0], 0, z - place[1]) for place in at]
        speeds = [point(arm, m)[1][1] for arm, m in zip(arms, (a, b), strict=True)]
        force = applied_moment(state, own) + parallel_damper_force(speeds[0] - speeds[1], own)
        on_first = Wrench(force_y=force)
        pairs = [
            (first, at_centre(arms[0], on_first)),
            (second, at_centre(arms[1], opposite(on_first))),
        ]
    return [(body, wrench) for body, wrench in pairs if body != GROUND]
