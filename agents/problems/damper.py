"""Passive yaw dampers, which active control has to beat."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from railenv import Vehicle, checks

BLOW_OFF = 9.8e3
"""Force at which a damper's valves open, as for CRH380A, N."""

ARM = 1.3
"""Lateral arm of the dampers, as of the actuators beside them, m."""

_BEYOND = 0.02  # of the rate, above the force at which the valves open
_LAST = 10.0  # times the speed at which they open: the last point


@dataclass(frozen=True)
class YawDamper:
    """A passive yaw damper on rubber ends, one on either side.

    Attributes
    ----------
    rate : float
        Damping rate up to the force at which its valves open, N s/m.
    stiffness : float
        Stiffness of its ends together, N/m.
    """

    rate: float
    stiffness: float

    def __post_init__(self) -> None:
        for name, unit in (("rate", "N s/m"), ("stiffness", "N/m")):
            checks.number(
                f"{name} of a yaw damper", getattr(self, name), low=0.0, open_low=True, unit=unit
            )

    def on(self, vehicle: Vehicle) -> Vehicle:
        """Return a vehicle with this damper between each frame and the body above it."""
        opens = BLOW_OFF / self.rate
        most = BLOW_OFF * (1.0 + _BEYOND * (_LAST - 1.0))
        force = ((0.0, opens, _LAST * opens), (0.0, BLOW_OFF, most))
        return vehicle.replace(
            secondary_yaw_damper_force=force,
            secondary_yaw_damper_stiffness=self.stiffness,
            secondary_yaw_damper_arm=ARM,
            secondary_yaw_damper_height=vehicle.frame_height,
        )

    def __str__(self) -> str:
        return f"{self.rate / 1e3:.0f} kN s/m on {self.stiffness / 1e6:.2f} MN/m"


@dataclass(frozen=True)
class PrimaryDamper:
    """The paper's yaw damper between wheelset and frame with its linear term alone (eq 7).

    Attributes
    ----------
    rate : float
        N s/m.
    """

    rate: float

    def __post_init__(self) -> None:
        checks.number("rate of a damper", self.rate, low=0.0, open_low=True, unit="N s/m")

    def on(self, vehicle: Vehicle) -> Vehicle:
        """Return a vehicle with this damper at each wheelset."""
        none: Mapping[str, Any] = dict.fromkeys(f"yaw_damper_c{k}" for k in (2, 3, 4))
        return vehicle.replace(yaw_damper_c1=self.rate, **dict.fromkeys(none, 0.0))

    def __str__(self) -> str:
        return f"{self.rate / 1e3:.1f} kN s/m"


def without_dampers(vehicle: Vehicle) -> Vehicle:
    """Return a vehicle without its yaw dampers, those of the wheelsets and those above the frames."""
    parts = ("force", "stiffness", "arm", "height")
    return vehicle.replace(
        **{f"yaw_damper_c{k}": 0.0 for k in (1, 2, 3, 4)},
        **{f"secondary_yaw_damper_{part}": None for part in parts},
        secondary_longitudinal_damping=0.0,
    )
