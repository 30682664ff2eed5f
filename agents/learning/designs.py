"""Designs of the shipped controllers: classical, tuned or learned."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from agents.controllers.adaptive import AdaptiveLQG
from agents.controllers.controller import Controller
from agents.controllers.lqg import LQG
from agents.controllers.lqr import LQR
from agents.controllers.memory import MemorySettings
from agents.controllers.output_feedback import Filters
from agents.controllers.passive import Passive
from agents.controllers.scheduled import ScheduledController
from agents.controllers.service import CONICITIES, vehicles_of_service
from agents.controllers.shipped import FIRST, shipped
from agents.learning.exercises import Exercises
from agents.learning.policy_search import search_policy
from agents.learning.train_through import train_through
from agents.tuning.tuning import tune_h_infinity, tune_lqg, tune_yaw_rate
from agents.tuning.tuning_gradient import Goal, tune_output_feedback
from design.linear.regulator import Disturbances, Weights
from railenv import Equipped

SCHEDULE = tuple(float(v) for v in range(20, 241, 20))
"""Speeds (m/s) between which scheduled regulators are linear."""

COACH_SCHEDULE = tuple(float(v) for v in range(20, 201, 30))
"""The same (m/s) for the coach."""

COARSE = tuple(float(v) for v in range(20, 181, 40))
"""Speeds (m/s) between which H-infinity controllers are linear."""

SEED = 0
"""Seed of the learned controllers."""

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
    "h-infinity": lambda model: tune_h_infinity(model, speeds=COARSE),
    "output-feedback": lambda model: tune_output_feedback(model).controller,
    "lqr": lambda model: LQR.design(model, speed=160.0),
    "learned": _learned,
    "learned-by-gradient": lambda model: train_through(model, seed=SEED, progress=True).policy,
    "lqr-scheduled": lambda model: LQR.design(model, speeds=SCHEDULE, weights=Weights()),
}
"""Function that designs, tunes or learns each controller.

``learned`` has the shipped output feedback as its base, ``learned-by-gradient`` starts from random
weights.
"""

_FAST = Filters(low_pass=(1.0, 5.0, 15.0))
"""For modes up to 20 Hz, which actuators at the wheelsets can damp."""


def _at_wheelsets(model: Equipped) -> Controller:
    return tune_output_feedback(
        model,
        filters=_FAST,
        nodes=(20.0, 60.0, 100.0, 140.0, 180.0, 220.0),
        start=120.0,
        step=20.0,
        highest=220.0,
        iterations=300,
    ).controller


def _two_wheelsets(model: Equipped) -> Controller:
    return tune_output_feedback(
        model,
        filters=_FAST,
        goal=Goal(speeds=(10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 70.0)),
        nodes=(10.0, 40.0, 80.0, 120.0, 160.0, 200.0),
        start=30.0,
        step=10.0,
        highest=200.0,
        iterations=300,
    ).controller


def _all_three(model: Equipped) -> Controller:
    """Tune on from the gains of actuators at the wheelsets alone."""
    wheelsets = shipped("output-feedback", "bogie-primary-v1")
    assert isinstance(wheelsets, ScheduledController)
    alone = np.array(wheelsets.about["gains"])
    nodes, _, terms = alone.shape
    begin = np.concatenate([alone, np.zeros((nodes, 1, terms))], axis=1)
    return tune_output_feedback(
        model,
        filters=_FAST,
        nodes=wheelsets.law.speeds.tolist(),
        begin=begin,
        start=200.0,
        step=10.0,
        highest=260.0,
        iterations=150,
    ).controller


ROUGHER = Disturbances(alignment=5e-4)
"""Disturbances with a rougher line than the default, so that filters trust the readings more."""


def _nominal_coach(model: Equipped) -> Controller:
    """Design an LQG for nearly new wheels, for which it must damp the body."""
    conicity = 0.1
    law = LQG.design(model.replace(conicity=conicity), speeds=COACH_SCHEDULE, disturbances=ROUGHER)
    law.about["conicity"] = conicity
    return law


def _adaptive(model: Equipped, conicities: Sequence[float], speeds: Sequence[float]) -> Controller:
    """Design a bank over conicity and creep coefficients."""
    return AdaptiveLQG.design(
        model,
        speeds=speeds,
        vehicles=vehicles_of_service(model, conicities, (0.6, 1.4)),
        disturbances=ROUGHER,
    )


def _adaptive_bogie(model: Equipped) -> Controller:
    return _adaptive(model, (0.05, 0.15, 0.4), [float(v) for v in range(20, 181, 20)])


def _adaptive_coach(model: Equipped) -> Controller:
    return _adaptive(model, CONICITIES, COACH_SCHEDULE)


def _learned_coach(model: Equipped) -> Controller:
    """Train a policy that the shipped bank tells the vehicle."""
    bank = shipped("adaptive-lqg", "coach-v1")
    assert isinstance(bank, AdaptiveLQG)
    return train_through(
        model,
        exercises=Exercises(levels=3, stops=8, speeds=(15.0, 140.0), rough=4),
        memory=MemorySettings(corners=(0.2, 1.0, 5.0, 20.0)),
        identifier=bank,
        evaluations=501,
        seed=SEED,
        progress=True,
    ).policy


def _adaptive_train(model: Equipped) -> Controller:
    """Design a bank over wear and creep coefficients."""
    return AdaptiveLQG.design(
        model,
        speeds=[float(v) for v in range(20, 321, 50)],
        vehicles=vehicles_of_service(model, creep_factors=(0.6, 1.4)),
        disturbances=ROUGHER,
    )


PROBLEM_DESIGNS: Mapping[str, Mapping[str, Design]] = {
    FIRST: {**DESIGNS, "adaptive-lqg": _adaptive_bogie},
    "bogie-primary-v1": {"output-feedback": _at_wheelsets},
    "bogie-both-v1": {"output-feedback": _all_three},
    "coach-v1": {
        "lqg": _nominal_coach,
        "adaptive-lqg": _adaptive_coach,
        "learned-adaptive": _learned_coach,
    },
    "crh380a-v1": {"adaptive-lqg": _adaptive_train},
    "dual-wheelset-v1": {"output-feedback": _two_wheelsets},
}
"""Designs of controllers for each problem; those that take long are also shipped."""
