"""Parameters of the Cooperrider bogie, the benchmark of nonlinear railway dynamics."""

from __future__ import annotations

from dataclasses import dataclass

from railenv.vehicles.records import ParameterRecord, nonnegative, positive

_ADDED = "an addition to the benchmark, which has none"


@dataclass(frozen=True, kw_only=True)
class CooperriderParameters(ParameterRecord):
    """Parameters of the Cooperrider bogie, the benchmark of nonlinear railway dynamics; SI units.

    Raises
    ------
    ParameterError
        If a value is not a finite number in its range; the message names field, value and range.
    """

    wheelset_mass: float = positive("m_w", "kg", "mass of one wheelset", "Cooperrider bogie")
    frame_mass: float = positive("m_f", "kg", "mass of the bogie frame", "Cooperrider bogie")
    wheelset_yaw_inertia: float = positive("I_w", "kg m^2", "wheelset, yaw", "Cooperrider bogie")
    frame_yaw_inertia: float = positive("I_fz", "kg m^2", "frame, yaw", "Cooperrider bogie")
    frame_roll_inertia: float = positive("I_fx", "kg m^2", "frame, roll", "Cooperrider bogie")
    k1: float = nonnegative("k_1", "N/m", "primary lateral stiffness", "Cooperrider bogie")
    k2: float = nonnegative("k_2", "N/m", "primary longitudinal stiffness", "Cooperrider bogie")
    k3: float = nonnegative("k_3", "N/m", "primary vertical stiffness", "Cooperrider bogie")
    k4: float = nonnegative("k_4", "N/m", "secondary lateral stiffness", "Cooperrider bogie")
    k5: float = nonnegative("k_5", "N/m", "secondary vertical stiffness", "Cooperrider bogie")
    k6: float = nonnegative("k_6", "N m/rad", "secondary yaw stiffness", "Cooperrider bogie")
    D1: float = nonnegative("D_1", "N s/m", "secondary vertical damping", "Cooperrider bogie")
    D2: float = nonnegative("D_2", "N s/m", "secondary lateral damping", "Cooperrider bogie")
    yaw_damping: float = nonnegative("D_6", "N m s/rad", "yaw damper", _ADDED, default=0.0)
    half_gauge: float = positive("a", "m", "half the track gauge", "Cooperrider bogie")
    half_wheelbase: float = positive("b", "m", "half the wheelbase", "Cooperrider bogie")
    d1: float = nonnegative("d_1", "m", "arm of the primary springs", "Cooperrider bogie")
    d2: float = nonnegative("d_2", "m", "arm of the secondary springs", "Cooperrider bogie")
    h1: float = nonnegative("h_1", "m", "frame above primary springs", "Cooperrider bogie")
    h2: float = nonnegative("h_2", "m", "secondary springs above frame", "Cooperrider bogie")
    wheel_radius: float = positive("r_0", "m", "nominal rolling radius", "Cooperrider bogie")
    conicity: float = positive("lambda", "1", "wheel conicity", "Cooperrider bogie", high=0.7)
    flange_clearance: float = positive("delta", "m", "dead band of flange", "Cooperrider bogie")
    flange_stiffness: float = nonnegative("k_0", "N/m", "flange spring", "Cooperrider bogie")
    adhesion_force: float = positive("mu N", "N", "adhesion limit, one wheel", "Cooperrider bogie")
    creep_ratio_lateral: float = positive("Psi", "1", "Vermeulen-Johnson", "Cooperrider bogie")
    creep_ratio_longitudinal: float = positive("Phi", "1", "Vermeulen-Johnson", "Cooperrider bogie")
    creep_coefficient: float = positive("G pi a b", "N", "creep coefficient", "Cooperrider bogie")


COOPERRIDER = CooperriderParameters(
    wheelset_mass=1022.0,
    frame_mass=2918.0,
    wheelset_yaw_inertia=678.0,
    frame_yaw_inertia=6780.0,
    frame_roll_inertia=6780.0,
    k1=1.823e6,
    k2=3.646e6,
    k3=3.646e6,
    k4=0.1823e6,
    k5=0.3333e6,
    k6=2.710e6,
    D1=20.0e3,
    D2=29.2e3,
    half_gauge=0.716,
    half_wheelbase=1.074,
    d1=0.620,
    d2=0.680,
    h1=0.0762,
    h2=0.6584,
    wheel_radius=0.4572,
    conicity=0.05,
    flange_clearance=9.1e-3,
    flange_stiffness=14.60e6,
    adhesion_force=10e3,
    creep_ratio_lateral=0.54219,
    creep_ratio_longitudinal=0.60252,
    creep_coefficient=6.563e6,
)
"""The Cooperrider bogie with the numbers of the literature."""
