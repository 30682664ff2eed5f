"""Controllers of hunting vehicles and their evaluation, and the adapter for Stable-Baselines3.

>>> import agents, railenv
>>> controller = agents.LQR.design(railenv.Bogie(railenv.HIGH_SPEED_COACH), speed=160.0)

``agents.train`` trains policies, and ``agents.sb3`` gives the vector environments to Stable-Baselines3
(extra ``rl``). The name ``agents`` is used by other distributions too; ``__distribution__`` tells this
one.
"""

from agents.controller import Controller, equipped
from agents.growth import growth_rates, simulated_critical_speed
from agents.learned import LearnedPolicy
from agents.load import load
from agents.lqg import LQG
from agents.lqr import LQR
from agents.passive import Passive
from agents.rollout import Case, Motion, Rollout
from agents.scheduled import Law, ScheduledController
from agents.training import Training, resume, train
from agents.yaw_rate import YawRateFeedback

__distribution__ = "railenv"

__all__ = [
    "LQG",
    "LQR",
    "Case",
    "Controller",
    "Law",
    "LearnedPolicy",
    "Motion",
    "Passive",
    "Rollout",
    "ScheduledController",
    "Training",
    "YawRateFeedback",
    "equipped",
    "growth_rates",
    "load",
    "resume",
    "simulated_critical_speed",
    "train",
]
