"""Actuators and sensors as records: their numbers, and places of actuators."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

from railenv import checks
from railenv.errors import ParameterError, shown
from railenv.vehicles.records import ParameterRecord, quantity

_SOURCE = "railway practice"


def _positive(symbol: str, unit: str, meaning: str, **bounds: float) -> Any:
    return quantity(symbol, unit, meaning, _SOURCE, low=0.0, open_low=True, **bounds)


@dataclass(frozen=True, kw_only=True)
class Actuator(ParameterRecord):
    """Actuated damper with a limit, a lag and a delay; as a yaw damper, two longitudinal actuators.

    Limits of a lateral actuator are in N instead of N m. ``Actuator.secondary()``,
    ``Actuator.primary()`` and ``Actuator.lateral()`` have realistic numbers; change them with
    ``replace``.

    Raises
    ------
    ParameterError
        If a value is out of range; the message names field, value and range.
    """

    limit: float = _positive("M_max", "N m", "largest moment; of a lateral actuator force, N")
    bandwidth: float = _positive("f_a", "Hz", "natural frequency of the second-order lag")
    damping: float = _positive("zeta_a", "1", "damping ratio of the lag", high=10.0)
    delay: float = quantity("T_d", "s", "transport delay", _SOURCE, low=0.0, high=1.0)
    rate_limit: float = quantity(
        "dM_max",
        "N m/s",
        "largest rate of moment or force; 1e300 is none",
        _SOURCE,
        low=0.0,
        open_low=True,
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
        return cls.secondary().replace(limit=5e3, arm=1.0)

    @classmethod
    def lateral(cls) -> Self:
        """Return two lateral actuators of 10 kN between bogie frame and vehicle body."""
        return cls.secondary().replace(limit=20e3, arm=1.0)

    def parameters(self) -> dict[str, float]:
        """Return the numbers for the equations of motion; the delay acts before them."""
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
    """Lateral accelerometer and yaw gyro on a body; :class:`railenv.Equipped` chooses the bodies.

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
        """Return sensors as used for bogie monitoring."""
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
        """Return the numbers for the equations of motion; noise and bias are added to the readings."""
        return {
            "accelerometer_bandwidth": self.accelerometer_bandwidth,
            "gyro_bandwidth": self.gyro_bandwidth,
        }


@dataclass(frozen=True, kw_only=True)
class YawActuator:
    """A yaw moment on the first body, with its reaction on the second (or the ground).

    Attributes
    ----------
    between : (str, str)
        Bodies, or a body and ``"ground"``.
    actuator : Actuator
    name : str
        Name of its states and its command; that of the first body when left out.
    """

    between: tuple[str, str]
    actuator: Actuator = dataclasses.field(default_factory=Actuator.secondary)
    name: str = ""

    acts: ClassVar[Literal["yaw", "lateral"]] = "yaw"

    def __post_init__(self) -> None:
        between: Any = self.between
        pair = tuple(between) if isinstance(between, (tuple, list)) else ()
        if len(pair) != 2 or pair[0] == pair[1] or not all(isinstance(b, str) for b in pair):
            raise ParameterError(f"between is {shown(between)}; it must be the names of two bodies")
        object.__setattr__(self, "between", pair)
        object.__setattr__(self, "name", self.name or pair[0])
        if not str(self.name).isidentifier():
            raise ParameterError(f"name of an actuator is {shown(self.name)}; it must be a word")
        if not isinstance(self.actuator, Actuator):
            raise ParameterError(f"actuator is {shown(self.actuator)}; it must be a railenv.Actuator")


@dataclass(frozen=True, kw_only=True)
class LateralActuator(YawActuator):
    """A lateral force on the first body, with its reaction on the second (or the ground).

    Attributes
    ----------
    between, actuator, name
        As in :class:`YawActuator`; the actuator's moments are forces (N), its arm is not used.
    x, z : float
        Place where it acts, in the coordinates of the vehicle, m.
    """

    x: float = 0.0
    z: float = 0.0

    acts = "lateral"

    def __post_init__(self) -> None:
        super().__post_init__()
        for place in ("x", "z"):
            value = checks.number(f"{place} of {self.name}", getattr(self, place), unit="m")
            object.__setattr__(self, place, value)
