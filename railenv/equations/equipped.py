"""A vehicle with its actuators and sensors: their states join the plant's own equations.

States are the plant's, then moment and rate of each actuator, then the filtered readings of each
sensor. Inputs are the commanded moments, then the plant's own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from railenv.equations import bogie, dual_wheelset
from railenv.equations.actuator import (
    ActuatorState,
    actuator_rates,
    applied_moment,
    parallel_damper_moment,
)
from railenv.equations.contact import flange_spring, rail_forces
from railenv.equations.coordinates import Motion, Running, bodies, rails
from railenv.equations.functions import Scalar
from railenv.equations.sensors import SensorState, sensor_rates, specific_force

PlantEquations = Callable[..., list[Scalar]]


@dataclass(frozen=True)
class Equipment:
    """Which moments of a plant are actuated and which of its bodies carry sensors.

    Attributes
    ----------
    plant : callable
        The plant's equations of motion.
    states, inputs : tuple of str
        Names of the plant's.
    body_names : tuple of str
    actuated : tuple of str
        Bodies whose yaw moment ``M_<body>`` an actuator applies; the damper beside it acts on the same
        body against the frame (wheelsets) or the vehicle body (frame).
    sensed : tuple of str
        Bodies with an accelerometer and a yaw gyro.
    """

    plant: PlantEquations
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    body_names: tuple[str, ...]
    actuated: tuple[str, ...]
    sensed: tuple[str, ...]

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of all states."""
        actuators = [name for body in self.actuated for name in (f"T_{body}", f"dT_{body}")]
        sensors = [name for body in self.sensed for name in (f"accel_{body}", f"gyro_{body}")]
        return (*self.states, *actuators, *sensors)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of all inputs."""
        return (*(f"command_{body}" for body in self.actuated), *self.inputs)

    @property
    def signal_names(self) -> tuple[str, ...]:
        """Names of the signals of :meth:`signals`."""
        forces = [
            f"{force}_{side}_w{i}" for i in (1, 2) for side in ("left", "right") for force in "YQ"
        ]
        return (*(f"force_{body}" for body in self.sensed), *forces)

    def equations(
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
        accelerations = dict(zip(self.states, rates, strict=True))
        extra: list[Scalar] = []
        for actuator, command in zip(actuators, u, strict=False):
            extra += actuator_rates(actuator, command, p)
        for body, sensor in zip(self.sensed, sensors, strict=True):
            extra += sensor_rates(sensor, accelerations[f"dy_{body}"], motions[body], run, p)
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
        accelerations = dict(zip(self.states, self._plant_rates(x, u, run, p), strict=True))
        found = [
            specific_force(accelerations[f"dy_{body}"], motions[body], run, p) for body in self.sensed
        ]
        for body, rail in zip(("w1", "w2"), rails(u[-6:]), strict=True):
            w = motions[body]
            for f in rail_forces(w, rail, run, p):
                flange = flange_spring(f.side, w.y - rail.align, p)
                found += [flange - f.side * f.force_y, f.force_z]
        return found

    def _split(
        self, x: Sequence[Scalar]
    ) -> tuple[dict[str, Motion], list[ActuatorState], list[SensorState]]:
        n = len(self.states)
        motions = dict(zip(self.body_names, bodies(x[:n]), strict=True))
        pairs = [tuple(x[i : i + 2]) for i in range(n, len(x), 2)]
        count = len(self.actuated)
        return (
            motions,
            [ActuatorState(*pair) for pair in pairs[:count]],
            [SensorState(*pair) for pair in pairs[count:]],
        )

    def _plant_rates(
        self, x: Sequence[Scalar], u: Sequence[Scalar], run: Running, p: Scalar
    ) -> list[Scalar]:
        """Return derivatives of the plant's states under the moments that the actuators apply."""
        motions, actuators, _ = self._split(x)
        inputs = list(u[len(self.actuated) :])
        for body, state in zip(self.actuated, actuators, strict=True):
            frame_yaw_rate = motions["b"].dpsi if body != "b" and "b" in motions else 0.0
            damper = parallel_damper_moment(motions[body].dpsi - frame_yaw_rate, p)
            k = self.inputs.index(f"M_{body}")
            inputs[k] = inputs[k] + applied_moment(state, p) + damper
        return self.plant(x[: len(self.states)], inputs, *run, p)


def _bogie(actuated: tuple[str, ...]) -> Equipment:
    return Equipment(bogie.bogie, bogie.STATES, bogie.INPUTS, ("w1", "w2", "b"), actuated, ("b",))


def _dual_wheelset(actuated: tuple[str, ...]) -> Equipment:
    plant = dual_wheelset
    wheelsets = ("w1", "w2")
    return Equipment(plant.dual_wheelset, plant.STATES, plant.INPUTS, wheelsets, actuated, wheelsets)


EQUIPMENT = {
    ("bogie", "none"): _bogie(()),
    ("bogie", "secondary"): _bogie(("b",)),
    ("bogie", "primary"): _bogie(("w1", "w2")),
    ("dual_wheelset", "none"): _dual_wheelset(()),
    ("dual_wheelset", "primary"): _dual_wheelset(("w1", "w2")),
}
"""Plants with their equipment, by name of the plant and place of the actuators."""
