"""Controllers of hunting vehicles and their evaluation, and the adapter for Stable-Baselines3.

>>> import agents, railenv
>>> controller = agents.LQR.design(railenv.Bogie(railenv.HIGH_SPEED_COACH), speed=160.0)

``agents.train`` trains policies, and ``agents.sb3`` gives the vector environments to Stable-Baselines3
(extra ``rl``). The name ``agents`` is used by other distributions too; ``__distribution__`` tells this
one.
"""

from agents.controller import Controller, equipped
from agents.evaluation import Evaluation, Plan, evaluate, load_evaluations, save_evaluations
from agents.growth import growth_rates, simulated_critical_speed
from agents.learned import LearnedPolicy
from agents.lessons import Lessons
from agents.load import load
from agents.lqg import LQG
from agents.lqr import LQR
from agents.nonlinear import Place, disturbed_critical_speed, ramp_down
from agents.output_feedback import Filters, OutputFeedback
from agents.passive import Passive
from agents.policy_search import Searched, search_policy
from agents.policy_start import Aim, Target
from agents.rollout import Case, Motion, Rollout
from agents.scheduled import Law, ScheduledController
from agents.shipped import shipped, shipped_names
from agents.training import Training, resume, train
from agents.tuning import tune_lqg, tune_yaw_rate
from agents.tuning_gradient import Goal, tune_output_feedback
from agents.yaw_rate import YawRateFeedback

__distribution__ = "railenv"

__all__ = [
    "LQG",
    "LQR",
    "Aim",
    "Case",
    "Controller",
    "Evaluation",
    "Filters",
    "Goal",
    "Law",
    "LearnedPolicy",
    "Lessons",
    "Motion",
    "OutputFeedback",
    "Passive",
    "Place",
    "Plan",
    "Rollout",
    "ScheduledController",
    "Searched",
    "Target",
    "Training",
    "YawRateFeedback",
    "disturbed_critical_speed",
    "equipped",
    "evaluate",
    "growth_rates",
    "load",
    "load_evaluations",
    "ramp_down",
    "resume",
    "save_evaluations",
    "search_policy",
    "shipped",
    "shipped_names",
    "simulated_critical_speed",
    "train",
    "tune_lqg",
    "tune_output_feedback",
    "tune_yaw_rate",
]
