"""Control design and stability analysis of any model of :mod:`railenv`, on python-control.

>>> import design, railenv
>>> model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
>>> print(design.critical_speed(model))
hunting from 116.1213 m/s at 3.0553 Hz
"""

from design.critical_points import CriticalPoint
from design.critical_speed import CriticalSpeed, critical_speed
from design.cycle_plots import phase_portrait
from design.cycles import Cycle, CycleBranch, CycleError, SpecialPoint, cycle_branch
from design.diagram import SimulatedDiagram, simulated_diagram
from design.equilibrium import equilibrium
from design.feedback import Feedback, LinearFeedback, ScaledFeedback, StaticFeedback
from design.gain_locus import GainLocus, gain_locus
from design.hopf import HopfPoint, hopf_point
from design.hunting_map import HuntingMap, hunting_map
from design.linearization import discretize, linearize
from design.locus import Locus, SpeedLocus, VehicleLocus, speed_locus
from design.margins import ChannelMargins, Margins, margins
from design.mode_shape import ModeShape
from design.parameter_locus import ParameterLocus, parameter_locus
from design.polach import DisturbanceTest, SpeedRamp, disturbance_test, speed_ramp
from design.reduction import balanced, minimal, transfer_function
from design.regulator import (
    Disturbances,
    Observer,
    Regulator,
    Weights,
    kalman,
    lateral_model,
    lqr,
)
from design.robust import RobustCriticalSpeed, robust_critical_speed
from design.sampled import ClosedLoop, closed_loop, open_loop
from design.simulated_cycle import simulated_cycle
from design.spectrum import Spectrum, spectrum
from design.stability_map import StabilityMap, stability_map
from design.study import Study, run_study
from design.sweep import CurveSweep, curve_sweep

__all__ = [
    "ChannelMargins",
    "ClosedLoop",
    "CriticalPoint",
    "CriticalSpeed",
    "CurveSweep",
    "Cycle",
    "CycleBranch",
    "CycleError",
    "DisturbanceTest",
    "Disturbances",
    "Feedback",
    "GainLocus",
    "HopfPoint",
    "HuntingMap",
    "LinearFeedback",
    "Locus",
    "Margins",
    "ModeShape",
    "Observer",
    "ParameterLocus",
    "Regulator",
    "RobustCriticalSpeed",
    "ScaledFeedback",
    "SimulatedDiagram",
    "SpecialPoint",
    "Spectrum",
    "SpeedLocus",
    "SpeedRamp",
    "StabilityMap",
    "StaticFeedback",
    "Study",
    "VehicleLocus",
    "Weights",
    "balanced",
    "closed_loop",
    "critical_speed",
    "curve_sweep",
    "cycle_branch",
    "discretize",
    "disturbance_test",
    "equilibrium",
    "gain_locus",
    "hopf_point",
    "hunting_map",
    "kalman",
    "lateral_model",
    "linearize",
    "lqr",
    "margins",
    "minimal",
    "open_loop",
    "parameter_locus",
    "phase_portrait",
    "robust_critical_speed",
    "run_study",
    "simulated_cycle",
    "simulated_diagram",
    "spectrum",
    "speed_locus",
    "speed_ramp",
    "stability_map",
    "transfer_function",
]
