"""Hunting dynamics of railway bogies: full nonlinear models on curved track, simulation, equilibria.

>>> import railenv
>>> model = railenv.Bogie(railenv.HIGH_SPEED_COACH)

Analysis and control design are in :mod:`design`. Compiling (Numba) and python-control load on first
use, not on import.
"""

from railenv.equilibrium import Equilibrium, find_equilibrium
from railenv.equipment import Actuator, Equipped, LateralActuator, Sensors, YawActuator
from railenv.errors import (
    CompilationError,
    EquationError,
    EquilibriumError,
    MissingPackageError,
    ParameterError,
    RailenvError,
    SimulationError,
    UnknownNameError,
)
from railenv.models import Assembled, Bogie, CooperriderBogie, DualWheelset, Model
from railenv.simulation import simulate
from railenv.track import Track
from railenv.vehicles import (
    COOPERRIDER,
    HIGH_SPEED_COACH,
    PRESETS,
    TABLE_1,
    TABLE_1_PRINTED_LOADS,
    CooperriderParameters,
    Vehicle,
)
from railenv.vehicles.assembly import Assembly
from railenv.vehicles.declared import MovingBody

__version__ = "0.1.0"

__all__ = [
    "COOPERRIDER",
    "HIGH_SPEED_COACH",
    "PRESETS",
    "TABLE_1",
    "TABLE_1_PRINTED_LOADS",
    "Actuator",
    "Assembled",
    "Assembly",
    "Bogie",
    "CompilationError",
    "CooperriderBogie",
    "CooperriderParameters",
    "DualWheelset",
    "EquationError",
    "Equilibrium",
    "EquilibriumError",
    "Equipped",
    "LateralActuator",
    "MissingPackageError",
    "Model",
    "MovingBody",
    "ParameterError",
    "RailenvError",
    "Sensors",
    "SimulationError",
    "Track",
    "UnknownNameError",
    "Vehicle",
    "YawActuator",
    "find_equilibrium",
    "simulate",
]


def _register() -> None:
    """Register the environments with Gymnasium; they load on first use."""
    from gymnasium.envs.registration import register

    for name in ("Bogie", "DualWheelset"):
        register(
            f"railenv/{name}-v0",
            entry_point=f"railenv.envs.environment:{name}Env",
            vector_entry_point=f"railenv.envs.vector:{name}VectorEnv",
        )


_register()
