"""The vehicles that the package ships; those on measured profiles are made when this is imported."""

from __future__ import annotations

from railenv.contact.pair import ProfilePair
from railenv.vehicles.vehicle import (
    HIGH_SPEED_COACH,
    HIGH_SPEED_COACH_HOLLOW,
    TABLE_1,
    TABLE_1_PRINTED_LOADS,
)

HIGH_SPEED_COACH_S1002 = HIGH_SPEED_COACH.replace(
    name="HIGH_SPEED_COACH_S1002",
    provenance=(
        "as HIGH_SPEED_COACH, on new S1002 wheels and UIC 60 rails at 1:40, gauge 1435 mm, back to "
        "back 1360 mm"
    ),
    contact=ProfilePair(),
    half_gauge=0.75,
    wheel_radius=0.46,
)
"""The coach on new S1002 wheels and UIC 60 rails at 1:40."""

HIGH_SPEED_COACH_S1002_WORN = HIGH_SPEED_COACH_S1002.replace(
    name="HIGH_SPEED_COACH_S1002_WORN",
    provenance=(
        "as HIGH_SPEED_COACH_S1002, with 0.5 mm of the tread worn off by the rule of railenv.worn "
        "(equivalent conicity 0.34 at 3 mm)"
    ),
    contact=ProfilePair(wheel="S1002_WORN"),
)
"""The coach on worn S1002 wheels."""

PRESETS = (
    TABLE_1,
    TABLE_1_PRINTED_LOADS,
    HIGH_SPEED_COACH,
    HIGH_SPEED_COACH_HOLLOW,
    HIGH_SPEED_COACH_S1002,
    HIGH_SPEED_COACH_S1002_WORN,
)
"""The vehicles that the package ships."""
