"""Actuators and sensors of a vehicle, and the model of a vehicle that carries them."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.equations.coordinates import Running, bodies
from railenv.equations.equipped import EQUIPMENT
from railenv.equations.sensors import inertial_yaw_rate, specific_force
from railenv.errors import ParameterError, shown
from railenv.kernels import loader
from railenv.models import Bogie, DualWheelset, Model
from railenv.vehicles import ParameterRecord, quantity

Place = Literal["none", "secondary", "primary"]
PLACES = ("none", "secondary", "primary")

_SOURCE = "railway practice"
_COMPLEX_STEP = 1e-30


def _positive(symbol: str, unit: str, meaning: str, **bounds: float) -> Any:
    return quantity(symbol, unit, meaning, _SOURCE, low=0.0, open_low=True, **bounds)


@dataclass(frozen=True, kw_only=True)
class Actuator(ParameterRecord):
    """Actuated yaw damper: two longitudinal actuators with a force limit, a lag and a delay.

    ``Actuator.secondary()`` and ``Actuator.primary()`` have realistic numbers; change them with
    ``replace``.

    Raises
    ------
    ParameterError
        If a value is out of range; the message names field, value and range.
    """

    limit: float = _positive("M_max", "N m", "largest moment")
    bandwidth: float = _positive("f_a", "Hz", "natural frequency of the second-order lag")
    damping: float = _positive("zeta_a", "1", "damping ratio of the lag", high=10.0)
    delay: float = quantity("T_d", "s", "transport delay", _SOURCE, low=0.0, high=1.0)
    rate_limit: float = quantity(
        "dM_max", "N m/s", "largest rate of moment; 1e300 is none", _SOURCE, low=0.0, open_low=True
    )
    arm: float = _positive("b_a", "m", "lateral arm of the dampers in parallel")
    parallel_damping: float = quantity(
        "C_p", "N s/m", "passive damper in parallel, each of two", _SOURCE, low=0.0
    )
    parallel_force_limit: float = _positive("F_p", "N", "force at which that damper goes flat")

    @classmethod
    def secondary(cls) -> Self:
        """Return two actuators of 10 kN at +-1.3 m between bogie frame and vehicle body."""
        return cls(
            limit=26e3,
            bandwidth=20.0,
            damping=0.7,
            delay=0.010,
            rate_limit=1e300,
            arm=1.3,
            parallel_damping=0.0,
            parallel_force_limit=9.8e3,
        )

    @classmethod
    def primary(cls) -> Self:
        """Return actuators of 5 kN m at each wheelset, between it and the bogie frame (an estimate)."""
        return cls(
            limit=5e3,
            bandwidth=20.0,
            damping=0.7,
            delay=0.010,
            rate_limit=1e300,
            arm=1.0,
            parallel_damping=0.0,
            parallel_force_limit=9.8e3,
        )

    def parameters(self) -> dict[str, float]:
        """Return what the equations of motion read; the delay lies before them."""
        return {
            "actuator_limit": self.limit,
            "actuator_bandwidth": self.bandwidth,
            "actuator_damping": self.damping,
            "actuator_rate_limit": self.rate_limit,
            "actuator_arm": self.arm,
            "parallel_damping": self.parallel_damping,
            "parallel_force_limit": self.parallel_force_limit,
        }


@dataclass(frozen=True, kw_only=True)
class Sensors(ParameterRecord):
    """Lateral accelerometer and yaw gyro on the bogie frame (of a dual wheelset: on both axles).

    Raises
    ------
    ParameterError
        If a value is out of range; the message names field, value and range.
    """

    accelerometer_bandwidth: float = _positive("f_acc", "Hz", "first-order filter", high=1e4)
    gyro_bandwidth: float = _positive("f_gyro", "Hz", "first-order filter", high=1e4)
    accelerometer_noise: float = quantity(
        "s_acc", "m/s^2", "standard deviation of the noise in a sample", _SOURCE, low=0.0
    )
    gyro_noise: float = quantity(
        "s_gyro", "rad/s", "standard deviation of the noise in a sample", _SOURCE, low=0.0
    )
    accelerometer_bias: float = quantity(
        "b_acc", "m/s^2", "standard deviation of the bias, drawn per episode", _SOURCE, low=0.0
    )
    gyro_bias: float = quantity(
        "b_gyro", "rad/s", "standard deviation of the bias, drawn per episode", _SOURCE, low=0.0
    )

    @classmethod
    def standard(cls) -> Self:
        """Return sensors as carried for bogie monitoring."""
        return cls(
            accelerometer_bandwidth=50.0,
            gyro_bandwidth=50.0,
            accelerometer_noise=0.05,
            gyro_noise=1e-3,
            accelerometer_bias=0.05,
            gyro_bias=1e-4,
        )

    @classmethod
    def ideal(cls) -> Self:
        """Return sensors without noise and bias, and fast."""
        return cls(
            accelerometer_bandwidth=1e3,
            gyro_bandwidth=1e3,
            accelerometer_noise=0.0,
            gyro_noise=0.0,
            accelerometer_bias=0.0,
            gyro_bias=0.0,
        )

    def parameters(self) -> dict[str, float]:
        """Return what the equations of motion read; noise and bias are added to the readings."""
        return {
            "accelerometer_bandwidth": self.accelerometer_bandwidth,
            "gyro_bandwidth": self.gyro_bandwidth,
        }


class Equipped(Model):
    """A bogie or dual wheelset with actuators and sensors, whose states join the plant's own.

    States are the plant's, then moment and rate of each actuator (``T_b, dT_b``), then the filtered
    readings of each sensor (``accel_b, gyro_b``). Inputs are the commanded moments (``command_b``,
    N m), then the plant's own. The transport delay is not part of the equations.

    Parameters
    ----------
    plant : Bogie or DualWheelset
    place : {"none", "secondary", "primary"}
        Where the actuators are: between frame and body (bogie only), or between wheelsets and frame.
    actuator : Actuator, optional
        ``Actuator.secondary()`` or ``Actuator.primary()`` when left out.
    sensors : Sensors, optional
        ``Sensors.standard()`` when left out.

    Raises
    ------
    ParameterError
        If the plant cannot carry actuators at that place.
    """

    _shipped = True

    def __init__(
        self,
        plant: Bogie | DualWheelset,
        place: Place = "secondary",
        actuator: Actuator | None = None,
        sensors: Sensors | None = None,
    ) -> None:
        if not isinstance(plant, (Bogie, DualWheelset)):
            raise ParameterError(f"plant is {plant!r}; it must be a Bogie or a DualWheelset")
        chosen: Any = place
        if not isinstance(chosen, str) or (plant.name, chosen) not in EQUIPMENT:
            allowed = [repr(p) for p in PLACES if (plant.name, p) in EQUIPMENT]
            raise ParameterError(
                f"place is {shown(place)}; actuators of a {plant.name} are at {', '.join(allowed)}"
            )
        default = Actuator.primary() if place == "primary" else Actuator.secondary()
        self.plant = plant
        self.place = place
        self.actuator = default if actuator is None else actuator
        self.sensors = Sensors.standard() if sensors is None else sensors
        self.equipment = EQUIPMENT[plant.name, place]
        for name, value, kind in (
            ("actuator", self.actuator, Actuator),
            ("sensors", self.sensors, Sensors),
        ):
            if not isinstance(value, kind):
                raise ParameterError(f"{name} is {value!r}; it must be a railenv.{kind.__name__}")
        extra = len(self.equipment.state_names) - plant.n_states
        self._assemble(
            f"{plant.name}_{place}",
            self.equipment.state_names,
            self.equipment.input_names,
            self.equipment.equations,
            {**plant.parameters, **self.actuator.parameters(), **self.sensors.parameters()},
            [*plant.scale, *self._scales()],
            [*plant.guess, *[0.0] * extra],
            loader.shipped_source(f"{plant.name}_{place}"),
        )
        self._attributes = SimpleNamespace(**self.parameters)

    def _scales(self) -> list[float]:
        """Return typical magnitudes of the actuators' and sensors' states."""
        omega = 2.0 * math.pi * self.actuator.bandwidth
        actuators = [1e-2 * self.actuator.limit, 1e-2 * self.actuator.limit * omega]
        return actuators * len(self.equipment.actuated) + [0.1, 1e-2] * len(self.equipment.sensed)

    def replace(self, **changes: Any) -> Self:
        """Return the same model with some fields of its vehicle, actuator or sensors changed.

        Raises
        ------
        UnknownNameError
            If a name is a field of none of them.
        """
        fields = [f.name for f in dataclasses.fields(self.plant.vehicle)]
        checks.known("parameter", changes, [*dict.fromkeys([*fields, *self.variable_names])])
        of_actuator = {f.name for f in dataclasses.fields(self.actuator)} & set(changes)
        of_sensors = {f.name for f in dataclasses.fields(self.sensors)} & set(changes)
        rest = {n: v for n, v in changes.items() if n not in of_actuator | of_sensors}
        return type(self)(
            self.plant.replace(**rest) if rest else self.plant,
            self.place,
            self.actuator.replace(**{n: changes[n] for n in of_actuator}),
            self.sensors.replace(**{n: changes[n] for n in of_sensors}),
        )

    @property
    def variable_names(self) -> tuple[str, ...]:
        """What :meth:`replace` changes: quantities of the vehicle, the actuator and the sensors."""
        extra = (f.name for r in (self.actuator, self.sensors) for f in dataclasses.fields(r))
        return (*self.plant.variable_names, *extra)

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
        """Specific force (m/s^2) of each sensed body, then guiding force and load (N) of each wheel.

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
        """Exact derivatives of :meth:`signals` (same parameters) with respect to states and inputs.

        By complex steps through the equations, which takes milliseconds.

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
        """Return the equilibrium that a plant's equilibrium has with its sensors settled.

        Parameters
        ----------
        plant_state : ndarray
            Equilibrium of the plant.
        speed, curvature, cant : float
            Running conditions (m/s, 1/m, rad).
        """
        state = np.concatenate([plant_state, np.zeros(self.n_states - self.plant.n_states)])
        names = self.state_names
        run, p = Running(speed, curvature, cant), self._attributes
        motions = dict(zip(self.equipment.body_names, bodies(plant_state.tolist()), strict=True))
        for body in self.equipment.sensed:
            force = specific_force(0.0, motions[body], run, p)
            state[names.index(f"accel_{body}")] = force
            state[names.index(f"gyro_{body}")] = inertial_yaw_rate(motions[body], run)
        return state
