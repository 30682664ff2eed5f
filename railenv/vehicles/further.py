"""Parts of a vehicle beyond the paper's bogie: a body on its bogies, and further suspension parts.

Each group of fields is one part, which exists if the fields are given. Heights are above the axles.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass

from railenv.errors import ParameterError
from railenv.fields import Points, as_points
from railenv.vehicles.records import ParameterRecord, optional, optional_table

_BEYOND = "beyond the paper"

BODY = "body"
"""Group of fields that a whole vehicle needs beside its bogies."""

PRIMARY_DAMPER = "primary damper"
"""Group of the vertical dampers between wheelsets and frame."""

NEEDS_BODY = ("lateral stop", "traction rod")
"""Groups without effect under a body at rest.

Under a body whose load acts on the frame, the frame moves by some millimetres, less than the clearance
of a stop; and a frame that does not pitch does not stretch a rod in the middle.
"""

OVERTURNING = "overturning"
"""Group of a bogie whose body's lateral force acts at the body's height."""


@dataclass(frozen=True, kw_only=True)
class FurtherParts(ParameterRecord):
    """Fields of the parts that a vehicle may lack, by groups; see :class:`railenv.Vehicle`."""

    # the body on its two bogies
    body_roll_inertia: float | None = optional(
        "I_cx", "kg m^2", "roll inertia of the vehicle body", _BEYOND, BODY, low=0.0, open_low=True
    )
    body_pitch_inertia: float | None = optional(
        "I_cy", "kg m^2", "pitch inertia of the vehicle body", _BEYOND, BODY, low=0.0, open_low=True
    )
    body_yaw_inertia: float | None = optional(
        "I_cz", "kg m^2", "yaw inertia of the vehicle body", _BEYOND, BODY, low=0.0, open_low=True
    )
    body_height: float | None = optional(
        "h_c", "m", "height of the body's centre above the axles", _BEYOND, BODY, low=0.0
    )
    half_pivot_distance: float | None = optional(
        "l_c", "m", "half the distance of the bogie pivots", _BEYOND, BODY, low=0.0, open_low=True
    )
    frame_pitch_inertia: float | None = optional(
        "I_by", "kg m^2", "pitch inertia of the bogie frame", _BEYOND, BODY, low=0.0, open_low=True
    )
    # primary
    primary_damper_force: Points | None = optional_table(
        "F_pd",
        "m/s",
        "N",
        "vertical damper on a rubber end, per axle box: force over speed",
        _BEYOND,
        PRIMARY_DAMPER,
    )
    primary_damper_stiffness: float | None = optional(
        "K_pd",
        "N/m",
        "stiffness of that damper's rubber ends",
        _BEYOND,
        PRIMARY_DAMPER,
        low=0.0,
        open_low=True,
    )
    # secondary
    secondary_height: float | None = optional(
        "h_s",
        "m",
        "height of the secondary springs above the axles; that of the frame's centre when left out",
        _BEYOND,
        "secondary height",
        low=0.0,
    )
    secondary_bending_stiffness: float | None = optional(
        "K_sb",
        "N m/rad",
        "stiffness of a secondary spring against roll and pitch of its ends, per side",
        _BEYOND,
        "secondary bending",
        low=0.0,
    )
    secondary_yaw_damper_force: Points | None = optional_table(
        "F_sx",
        "m/s",
        "N",
        "yaw damper on rubber ends between frame and body, per side: force over speed",
        _BEYOND,
        "secondary yaw damper",
    )
    secondary_yaw_damper_stiffness: float | None = optional(
        "K_sxd",
        "N/m",
        "stiffness of a yaw damper's rubber ends together",
        _BEYOND,
        "secondary yaw damper",
        low=0.0,
        open_low=True,
    )
    secondary_yaw_damper_arm: float | None = optional(
        "b_sxd",
        "m",
        "lateral arm of the yaw dampers",
        _BEYOND,
        "secondary yaw damper",
        low=0.0,
        open_low=True,
    )
    secondary_yaw_damper_height: float | None = optional(
        "h_sxd", "m", "height of the yaw dampers above the axles", _BEYOND, "secondary yaw damper"
    )
    lateral_damper_force: Points | None = optional_table(
        "F_sy",
        "m/s",
        "N",
        "lateral damper on rubber ends between frame and body, per side: force over speed",
        _BEYOND,
        "lateral damper",
    )
    lateral_damper_stiffness: float | None = optional(
        "K_syd",
        "N/m",
        "stiffness of a lateral damper's rubber ends together",
        _BEYOND,
        "lateral damper",
        low=0.0,
        open_low=True,
    )
    lateral_damper_height: float | None = optional(
        "h_syd", "m", "height of the lateral dampers above the axles", _BEYOND, "lateral damper"
    )
    lateral_stop_force: Points | None = optional_table(
        "F_stop",
        "m",
        "N",
        "lateral stop of a bogie: force over displacement, the clearance first",
        _BEYOND,
        "lateral stop",
    )
    lateral_stop_height: float | None = optional(
        "h_stop", "m", "height of the lateral stop above the axles", _BEYOND, "lateral stop"
    )
    roll_bar_stiffness: float | None = optional(
        "K_phi",
        "N m/rad",
        "stiffness of a bogie's anti-roll bar",
        _BEYOND,
        "roll bar",
        low=0.0,
        open_low=True,
    )
    traction_rod_stiffness: float | None = optional(
        "K_t",
        "N/m",
        "longitudinal stiffness of a bogie's traction rod",
        _BEYOND,
        "traction rod",
        low=0.0,
        open_low=True,
    )
    traction_rod_height: float | None = optional(
        "h_t", "m", "height of the traction rod above the axles", _BEYOND, "traction rod"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for group, names in GROUPS.items():
            missing = [n for n in names if getattr(self, n) is None]
            if missing and len(missing) < len(names):
                raise ParameterError(
                    f"the {group} lacks {', '.join(missing)}; give all of {', '.join(names)} or none"
                )
        for f in dataclasses.fields(self):
            if "table" in f.metadata and getattr(self, f.name) is not None:
                object.__setattr__(self, f.name, as_points(f.name, getattr(self, f.name)))

    @property
    def groups(self) -> frozenset[str]:
        """Names of the parts that the vehicle has beyond the paper's bogie."""
        return frozenset(g for g, names in GROUPS.items() if getattr(self, names[0]) is not None)


def _groups() -> dict[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    for f in dataclasses.fields(FurtherParts):
        group = f.metadata["group"]
        found[group] = (*found.get(group, ()), f.name)
    return found


GROUPS = _groups()
"""Fields of each part that a vehicle may lack."""


def numbers_of(groups: Iterable[str]) -> list[str]:
    """Return the fields of some groups that hold a number, in the order of the record."""
    wanted = set(groups)
    return [
        f.name
        for f in dataclasses.fields(FurtherParts)
        if "bounds" in f.metadata
        and (f.metadata["group"] in wanted or (f.name == "body_height" and OVERTURNING in wanted))
    ]
