"""Hunting dynamics of railway bogies: full nonlinear models on curved track, simulation, equilibria.

>>> import railenv
>>> model = railenv.Bogie(railenv.HIGH_SPEED_COACH)

Analysis and control design are in :mod:`design`. Each name loads its module on first use; compiling
(Numba) and python-control load when something is computed.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from railenv.assessment import Assessment, assess
    from railenv.contact.conicity import equivalent_conicity
    from railenv.contact.family import ProfileFamily
    from railenv.contact.laws import ArcProfile, Cone, HollowTread, LinearProfile
    from railenv.contact.pair import ProfilePair
    from railenv.contact.profiles import Profile
    from railenv.contact.wear import worn
    from railenv.equilibrium import Equilibrium, find_equilibrium
    from railenv.equipment import Equipped
    from railenv.errors import (
        CompilationError,
        EquationError,
        EquilibriumError,
        MissingPackageError,
        ParameterError,
        RailenvError,
        SimulationError,
        UnknownKeywordError,
        UnknownNameError,
    )
    from railenv.models import Assembled, Bogie, Coach, CooperriderBogie, DualWheelset, Model
    from railenv.simulation import simulate
    from railenv.track import Track
    from railenv.vehicles import (
        COOPERRIDER,
        HIGH_SPEED_COACH,
        HIGH_SPEED_COACH_HOLLOW,
        TABLE_1,
        TABLE_1_PRINTED_LOADS,
        CooperriderParameters,
        Vehicle,
    )
    from railenv.vehicles.actuators import Actuator, LateralActuator, Sensors, YawActuator
    from railenv.vehicles.assembly import Assembly
    from railenv.vehicles.declared import MovingBody
    from railenv.vehicles.presets import (
        CRH380A,
        HIGH_SPEED_COACH_S1002,
        HIGH_SPEED_COACH_S1002_WORN,
        MANCHESTER_1,
        PRESETS,
    )

__version__ = "0.2.0"

_MODULES = {
    "assessment": ("Assessment", "assess"),
    "contact.conicity": ("equivalent_conicity",),
    "contact.laws": ("ArcProfile", "Cone", "HollowTread", "LinearProfile"),
    "contact.pair": ("ProfilePair",),
    "contact.family": ("ProfileFamily",),
    "contact.profiles": ("Profile",),
    "contact.wear": ("worn",),
    "equilibrium": ("Equilibrium", "find_equilibrium"),
    "equipment": ("Equipped",),
    "errors": (
        "CompilationError",
        "EquationError",
        "EquilibriumError",
        "MissingPackageError",
        "ParameterError",
        "RailenvError",
        "SimulationError",
        "UnknownKeywordError",
        "UnknownNameError",
    ),
    "models": ("Assembled", "Bogie", "Coach", "CooperriderBogie", "DualWheelset", "Model"),
    "simulation": ("simulate",),
    "track": ("Track",),
    "vehicles": (
        "COOPERRIDER",
        "HIGH_SPEED_COACH",
        "HIGH_SPEED_COACH_HOLLOW",
        "TABLE_1",
        "TABLE_1_PRINTED_LOADS",
        "CooperriderParameters",
        "Vehicle",
    ),
    "vehicles.actuators": ("Actuator", "LateralActuator", "Sensors", "YawActuator"),
    "vehicles.assembly": ("Assembly",),
    "vehicles.declared": ("MovingBody",),
    "vehicles.presets": (
        "CRH380A",
        "HIGH_SPEED_COACH_S1002",
        "HIGH_SPEED_COACH_S1002_WORN",
        "MANCHESTER_1",
        "PRESETS",
    ),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}

__all__ = [
    "COOPERRIDER",
    "CRH380A",
    "HIGH_SPEED_COACH",
    "HIGH_SPEED_COACH_HOLLOW",
    "HIGH_SPEED_COACH_S1002",
    "HIGH_SPEED_COACH_S1002_WORN",
    "MANCHESTER_1",
    "PRESETS",
    "TABLE_1",
    "TABLE_1_PRINTED_LOADS",
    "Actuator",
    "ArcProfile",
    "Assembled",
    "Assembly",
    "Assessment",
    "Bogie",
    "Coach",
    "CompilationError",
    "Cone",
    "CooperriderBogie",
    "CooperriderParameters",
    "DualWheelset",
    "EquationError",
    "Equilibrium",
    "EquilibriumError",
    "Equipped",
    "HollowTread",
    "LateralActuator",
    "LinearProfile",
    "MissingPackageError",
    "Model",
    "MovingBody",
    "ParameterError",
    "Profile",
    "ProfileFamily",
    "ProfilePair",
    "RailenvError",
    "Sensors",
    "SimulationError",
    "Track",
    "UnknownKeywordError",
    "UnknownNameError",
    "Vehicle",
    "YawActuator",
    "assess",
    "equivalent_conicity",
    "find_equilibrium",
    "simulate",
    "worn",
]


if not TYPE_CHECKING:  # type checkers read the imports above

    def __getattr__(name):
        """Load an exported name, or a module of the package, when it is asked for."""
        if name in _HOME:
            value = getattr(_import_module(f"railenv.{_HOME[name]}"), name)
            globals()[name] = value  # found at once the next time
            return value
        if name in (*_MODULES, "batch", "checks", "contact", "envs", "irregularity", "tables"):
            return _import_module(f"railenv.{name}")
        raise AttributeError(f"module 'railenv' has no attribute {name!r}")

    def __dir__():
        return sorted({*globals(), *__all__})


def _register() -> None:
    """Register the environments with Gymnasium; they load on first use."""
    from gymnasium.envs.registration import register

    for name, before in (("Bogie", "bogie_v0"), ("DualWheelset", "dual_wheelset_v0")):
        gone = f"railenv.envs.gone:{before}"
        register(f"railenv/{name}-v0", entry_point=gone, vector_entry_point=gone)
    for task in _import_module("railenv.tasks").TASKS:
        register(
            task.id,
            entry_point=f"railenv.envs.environment:{task.environment}Env",
            vector_entry_point=f"railenv.envs.vector:{task.environment}VectorEnv",
            reward_threshold=task.reward_threshold,
            kwargs=dict(task.keywords),
        )


_register()
