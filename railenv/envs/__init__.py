"""Gymnasium environments of hunting vehicles; ``gymnasium.make`` and ``make_vec`` make them by name."""

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
