"""Controllers of hunting vehicles and their evaluation, and the adapter for Stable-Baselines3.

>>> import agents, railenv
>>> controller = agents.LQR.design(railenv.Bogie(railenv.HIGH_SPEED_COACH), speed=160.0)

``agents.train`` trains policies, and ``agents.learning.sb3`` adapts the vector environments for
Stable-Baselines3 (extra ``rl``). Other distributions also use the name ``agents``;
``__distribution__`` identifies this one.
"""

from agents.controllers.adaptive import AdaptiveLQG
from agents.controllers.adaptive_policy import AdaptivePolicy
from agents.controllers.controller import Controller, equipped
from agents.controllers.h_infinity import HInfinity
from agents.controllers.learned import LearnedPolicy
from agents.controllers.load import load
from agents.controllers.lqg import LQG
from agents.controllers.lqr import LQR
from agents.controllers.output_feedback import Filters, OutputFeedback
from agents.controllers.passive import Passive
from agents.controllers.scheduled import Law, ScheduledController
from agents.controllers.shipped import shipped, shipped_names
from agents.controllers.yaw_rate import YawRateFeedback
from agents.evaluation.equivalent import EquivalentDamper, equivalent_damper
from agents.evaluation.evaluating import evaluate
from agents.evaluation.evaluation import Evaluation, Plan, load_evaluations, save_evaluations
from agents.evaluation.growth import growth_rates, simulated_critical_speed
from agents.evaluation.nonlinear import Place, disturbed_critical_speed, ramp_down
from agents.evaluation.rollout import Case, Motion, Rollout
from agents.learning.exercises import Exercises
from agents.learning.lessons import Lessons
from agents.learning.policy_search import Searched, search_policy
from agents.learning.policy_start import Aim, Target
from agents.learning.train_through import Descent, train_through
from agents.learning.training import Training, resume, train
from agents.tuning.tuning import tune_h_infinity, tune_lqg, tune_yaw_rate
from agents.tuning.tuning_gradient import Goal, tune_output_feedback

__distribution__ = "railenv"

__all__ = [
    "LQG",
    "LQR",
    "AdaptiveLQG",
    "AdaptivePolicy",
    "Aim",
    "Case",
    "Controller",
    "Descent",
    "EquivalentDamper",
    "Evaluation",
    "Exercises",
    "Filters",
    "Goal",
    "HInfinity",
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
    "equivalent_damper",
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
    "train_through",
    "tune_h_infinity",
    "tune_lqg",
    "tune_output_feedback",
    "tune_yaw_rate",
]
