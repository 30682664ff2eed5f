"""How the shipped controllers are designed, tuned or learned."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from agents.controllers.controller import Controller
from agents.controllers.lqr import LQR
from agents.controllers.passive import Passive
from agents.controllers.scheduled import ScheduledController
from agents.controllers.shipped import shipped
from agents.learning.policy_search import search_policy
from agents.tuning.tuning import tune_lqg, tune_yaw_rate
from agents.tuning.tuning_gradient import tune_output_feedback
from design.linear.regulator import Weights
from railenv import Equipped

SCHEDULE = tuple(float(v) for v in range(20, 241, 20))
"""m/s, between which scheduled regulators are linear."""

SEED = 0
"""Of the search of the learned policy."""

Design = Callable[[Equipped], Controller]


def _learned(model: Equipped) -> Controller:
    """Search a policy on top of the shipped output feedback."""
    base = shipped("output-feedback")
    assert isinstance(base, ScheduledController)
    return search_policy(model, base, seed=SEED, progress=True).policy


DESIGNS: Mapping[str, Design] = {
    "passive": Passive.design,
    "yaw-rate": tune_yaw_rate,
    "lqg": lambda model: tune_lqg(model, speeds=(130.0,)),
    "lqg-scheduled": lambda model: tune_lqg(model, speeds=SCHEDULE),
    "output-feedback": lambda model: tune_output_feedback(model).controller,
    "lqr": lambda model: LQR.design(model, speed=160.0),
    "learned": _learned,
    "lqr-scheduled": lambda model: LQR.design(model, speeds=SCHEDULE, weights=Weights()),
}
"""How each is designed, tuned or learned; the learned one has the shipped output feedback below it."""
