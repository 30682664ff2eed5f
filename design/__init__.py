"""Control design and stability analysis of any model of :mod:`railenv`, on python-control.

>>> import design, railenv
>>> model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
>>> print(design.critical_speed(model))
hunting from 116.1213 m/s at 3.0553 Hz
"""

from design.critical_speed import CriticalSpeed, critical_speed
from design.equilibrium import equilibrium
from design.linearization import linearize
from design.locus import SpeedLocus, speed_locus
from design.sweep import CurveSweep, curve_sweep

__all__ = [
    "CriticalSpeed",
    "CurveSweep",
    "SpeedLocus",
    "critical_speed",
    "curve_sweep",
    "equilibrium",
    "linearize",
    "speed_locus",
]
