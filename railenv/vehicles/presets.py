"""The vehicles that the package ships; those on measured profiles are built on import."""

from __future__ import annotations

from railenv.contact.pair import ProfilePair
from railenv.contact.patch import ContactPatch
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


def _creep(load: float, wheel_radius: float) -> dict[str, float]:
    """Return Kalker's creep coefficients under a wheel load (N): a cone on a rail head of 300 mm."""
    patch = ContactPatch.of_wheel(load, wheel_radius, 0.3, friction=0.4)
    return patch.creep_coefficients._asdict()


MANCHESTER_1 = HIGH_SPEED_COACH_S1002.replace(
    name="MANCHESTER_1",
    provenance=(
        "passenger coach of the Manchester benchmarks (Iwnicki, The Manchester benchmarks for rail "
        "vehicle simulation, 1998), as public models have it; new S1002 wheels on UIC 60 rails at "
        "1:40; creep coefficients by Hertz and Kalker for the wheel load at rest, 54.5 kN; rails as "
        "Table 1"
    ),
    wheelset_mass=1813.0,
    wheelset_roll_inertia=1120.0,
    wheelset_pitch_inertia=112.0,
    wheelset_yaw_inertia=1120.0,
    frame_mass=2615.0,
    frame_roll_inertia=1722.0,
    frame_pitch_inertia=1476.0,
    frame_yaw_inertia=3067.0,
    body_mass=32000.0,
    body_roll_inertia=56.8e3,
    body_pitch_inertia=1.97e6,
    body_yaw_inertia=1.97e6,
    half_wheelbase=1.28,
    half_pivot_distance=9.5,
    frame_height=0.14,  # heights of the benchmark are above the rails: 0.6, 0.8275, 1.8 and 0.65 m
    secondary_height=0.3675,
    body_height=1.34,
    friction=0.4,
    load_dependent_creep=True,
    primary_longitudinal_stiffness=31.391e6,
    primary_lateral_stiffness=3.884e6,
    primary_vertical_stiffness=1.22e6,
    primary_longitudinal_damping=15e3,
    primary_lateral_damping=2e3,
    primary_vertical_damping=4e3,
    primary_arm=1.0,
    secondary_longitudinal_stiffness=160e3,
    secondary_lateral_stiffness=160e3,
    secondary_vertical_stiffness=430e3,
    secondary_longitudinal_damping=0.0,
    secondary_lateral_damping=32e3,
    secondary_vertical_damping=20e3,
    secondary_arm=1.0,
    secondary_bending_stiffness=10.5e3,
    roll_bar_stiffness=940e3,
    lateral_stop_force=(
        (0.025, 0.030, 0.035, 0.040, 0.045, 0.050, 0.055, 0.060, 0.065),
        (0.0, 600.0, 1760.0, 3730.0, 6870.0, 11580.0, 17170.0, 29200.0, 230e3),
    ),
    lateral_stop_height=0.19,
    **_creep(54.5e3, 0.46),
)
"""Vehicle 1 of the Manchester benchmarks: a passenger coach without yaw dampers."""

CRH380A = MANCHESTER_1.replace(
    name="CRH380A",
    provenance=(
        "public model of the high-speed train CRH380A; primary: coil spring and arm bush together; "
        "new LMA wheels on CHN60 rails at 1:40, back to back 1353 mm; creep coefficients by Hertz and "
        "Kalker for the wheel load at rest, 65 kN; friction and rails as MANCHESTER_1"
    ),
    wheelset_mass=1901.8,
    wheelset_roll_inertia=685.0,
    wheelset_pitch_inertia=76.0,
    wheelset_yaw_inertia=685.0,
    frame_mass=2280.0,
    frame_roll_inertia=1847.0,
    frame_pitch_inertia=1249.0,
    frame_yaw_inertia=2280.0,
    body_mass=40840.0,
    body_roll_inertia=110.2e3,
    body_pitch_inertia=1.666e6,
    body_yaw_inertia=1.5722e6,
    wheel_radius=0.43,
    half_wheelbase=1.25,
    half_pivot_distance=8.75,
    frame_height=0.08,  # above the rails: frame 0.51, secondary springs 0.8 to 1.0, body 1.52 m
    secondary_height=0.47,
    body_height=1.09,
    primary_longitudinal_stiffness=0.98e6 + 13.72e6,
    primary_lateral_stiffness=0.98e6 + 5.52e6,
    primary_vertical_stiffness=1.176e6,
    primary_longitudinal_damping=0.0,
    primary_lateral_damping=0.0,
    primary_vertical_damping=0.0,
    primary_damper_force=((0.0, 0.1, 1.1), (0.0, 1960.0, 16660.0)),
    primary_damper_stiffness=4.9e6,
    secondary_longitudinal_stiffness=168.9e3,
    secondary_lateral_stiffness=168.9e3,
    secondary_vertical_stiffness=260e3,
    secondary_lateral_damping=0.0,
    secondary_vertical_damping=40e3,
    secondary_arm=1.23,
    secondary_bending_stiffness=None,
    secondary_yaw_damper_force=((0.0, 0.004, 0.104), (0.0, 9810.0, 14805.0)),
    secondary_yaw_damper_stiffness=8.82e6,
    secondary_yaw_damper_arm=1.35,
    secondary_yaw_damper_height=-0.015,
    lateral_damper_force=((0.0, 0.1, 1.1), (0.0, 5880.0, 30480.0)),
    lateral_damper_stiffness=17.15e6,
    lateral_damper_height=0.361,
    roll_bar_stiffness=1e6,
    traction_rod_stiffness=7.882e6,
    traction_rod_height=-0.041,
    lateral_stop_force=(
        (0.020, 0.026, 0.032, 0.038, 0.044, 0.048),
        (0.0, 2e3, 5e3, 11e3, 25.5e3, 49e3),
    ),
    lateral_stop_height=0.25,
    contact=ProfilePair(
        wheel="LMA", rail="CHN60", back_to_back=1.353, gauge_depth=0.016, nominal_radius=0.43
    ),
    half_gauge=0.7523,
    **_creep(65e3, 0.43),
)
"""A coach of the high-speed train CRH380A, with yaw dampers on rubber ends."""

PRESETS = (
    TABLE_1,
    TABLE_1_PRINTED_LOADS,
    HIGH_SPEED_COACH,
    HIGH_SPEED_COACH_HOLLOW,
    HIGH_SPEED_COACH_S1002,
    HIGH_SPEED_COACH_S1002_WORN,
    MANCHESTER_1,
    CRH380A,
)
"""The vehicles that the package ships."""
