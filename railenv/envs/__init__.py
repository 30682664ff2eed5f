"""Gymnasium environments of hunting vehicles; make them with ``gymnasium.make`` or ``make_vec``."""

from railenv.envs.derailment import DERAILED
from railenv.envs.environment import BogieEnv, CoachEnv, DualWheelsetEnv
from railenv.envs.settings import RewardWeights, Settings
from railenv.envs.vector import BogieVectorEnv, CoachVectorEnv, DualWheelsetVectorEnv

__all__ = [
    "DERAILED",
    "BogieEnv",
    "BogieVectorEnv",
    "CoachEnv",
    "CoachVectorEnv",
    "DualWheelsetEnv",
    "DualWheelsetVectorEnv",
    "RewardWeights",
    "Settings",
]
