"""Control design and stability analysis of any model of :mod:`railenv`, on python-control.

>>> import design, railenv
>>> model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
>>> print(design.critical_speed(model))
hunting from 116.4739 m/s at 3.1135 Hz
"""

from design.curves.curve import BifurcationCurve, CurveError, CurvePoint, CurveSpecialPoint
from design.curves.follow import bifurcation_curve
from design.cycles.bifurcation import BifurcationDiagram, bifurcation_diagram
from design.cycles.branch import cycle_branch
from design.cycles.cycle import Cycle, CycleBranch, CycleError, SpecialPoint
from design.cycles.diagram import SimulatedDiagram, simulated_diagram
from design.cycles.hopf import hopf_point
from design.cycles.hunting_map import HuntingMap, hunting_map
from design.cycles.motion_plots import phase_portrait
from design.cycles.onset import HuntingOnset
from design.cycles.polach import DisturbanceTest, SpeedRamp, disturbance_test, speed_ramp
from design.cycles.simulated_cycle import simulated_cycle
from design.cycles.spectrum import Spectrum, spectrum
from design.irregular.lyapunov import LyapunovExponents, lyapunov_exponents
from design.irregular.section import PoincareSection, SectionSurface, poincare_section
from design.irregular.section_diagram import SectionDiagram, SectionPoint, section_diagram
from design.linear.equilibrium import equilibrium
from design.linear.h_infinity import (
    HInfinitySynthesis,
    UncertainModel,
    h_infinity,
    uncertain_model,
)
from design.linear.linearization import discretize, linearize
from design.linear.reduction import balanced, minimal, transfer_function
from design.linear.regulator import (
    Disturbances,
    Observer,
    Regulator,
    Weights,
    kalman,
    lateral_model,
    lqr,
)
from design.loop.feedback import Feedback, LinearFeedback, ScaledFeedback, StaticFeedback
from design.loop.margins import ChannelMargins, Margins, margins
from design.loop.sampled import ClosedLoop, closed_loop, open_loop
from design.stability.critical_points import CriticalPoint
from design.stability.critical_speed import critical_speed, hopf_points
from design.stability.gain_locus import GainLocus, gain_locus
from design.stability.locus import Locus, SpeedLocus, VehicleLocus, speed_locus
from design.stability.loss import CriticalSpeed, HopfPoint
from design.stability.mode_shape import ModeShape
from design.stability.mode_table import ModeTable, modes
from design.stability.parameter_locus import ParameterLocus, parameter_locus
from design.stability.participation import Participation
from design.stability.recoverable import Recoverable, recoverable_amplitudes
from design.stability.robust import RobustCriticalSpeed, robust_critical_speed
from design.stability.sweep import CurveSweep, curve_sweep
from design.studies.stability_map import StabilityMap, stability_map
from design.studies.study import Study, run_study

__all__ = [
    "BifurcationCurve",
    "BifurcationDiagram",
    "ChannelMargins",
    "ClosedLoop",
    "CriticalPoint",
    "CriticalSpeed",
    "CurveError",
    "CurvePoint",
    "CurveSpecialPoint",
    "CurveSweep",
    "Cycle",
    "CycleBranch",
    "CycleError",
    "DisturbanceTest",
    "Disturbances",
    "Feedback",
    "GainLocus",
    "HInfinitySynthesis",
    "HopfPoint",
    "HuntingMap",
    "HuntingOnset",
    "LinearFeedback",
    "Locus",
    "LyapunovExponents",
    "Margins",
    "ModeShape",
    "ModeTable",
    "Observer",
    "ParameterLocus",
    "Participation",
    "PoincareSection",
    "Recoverable",
    "Regulator",
    "RobustCriticalSpeed",
    "ScaledFeedback",
    "SectionDiagram",
    "SectionPoint",
    "SectionSurface",
    "SimulatedDiagram",
    "SpecialPoint",
    "Spectrum",
    "SpeedLocus",
    "SpeedRamp",
    "StabilityMap",
    "StaticFeedback",
    "Study",
    "UncertainModel",
    "VehicleLocus",
    "Weights",
    "balanced",
    "bifurcation_curve",
    "bifurcation_diagram",
    "closed_loop",
    "critical_speed",
    "curve_sweep",
    "cycle_branch",
    "discretize",
    "disturbance_test",
    "equilibrium",
    "gain_locus",
    "h_infinity",
    "hopf_point",
    "hopf_points",
    "hunting_map",
    "kalman",
    "lateral_model",
    "linearize",
    "lqr",
    "lyapunov_exponents",
    "margins",
    "minimal",
    "modes",
    "open_loop",
    "parameter_locus",
    "phase_portrait",
    "poincare_section",
    "recoverable_amplitudes",
    "robust_critical_speed",
    "run_study",
    "section_diagram",
    "simulated_cycle",
    "simulated_diagram",
    "spectrum",
    "speed_locus",
    "speed_ramp",
    "stability_map",
    "transfer_function",
    "uncertain_model",
]
