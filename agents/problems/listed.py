"""The problems, each under a name with a version."""

from __future__ import annotations

from functools import cache

from agents.controllers.service import CONICITY, WEAR
from agents.problems.damper import PrimaryDamper, YawDamper
from agents.problems.problem import CONTACT, Problem
from railenv import CRH380A, HIGH_SPEED_COACH_HOLLOW, TABLE_1, ProfileFamily, Vehicle, checks, worn
from railenv.contact.pair import ProfilePair

WORN_DEPTH, WORN_SPREAD = 1e-3, 3e-3
"""Depth of the worn treads of CRH380A, and spread of the lateral shift that wore them, m."""


@cache
def train() -> Vehicle:
    """Return CRH380A on wheels between new LMA profiles and treads of which 1 mm is worn off."""
    new = CRH380A.contact
    assert isinstance(new, ProfilePair)
    old = worn(new, depth=WORN_DEPTH, spread=WORN_SPREAD)
    return CRH380A.replace(contact=ProfileFamily(new, old, 0.5))


_TREADS = {"conicity": CONICITY, **CONTACT}
_AXLES = ("b", "w1", "w2")
_BOGIE_DAMPER = YawDamper(1.33e5, 1e7)
_COACH_DAMPER = YawDamper(2.37e5, 1e7)
_TRAIN_DAMPER = YawDamper(8.98e5, 1e7)

PROBLEMS: tuple[Problem, ...] = (
    Problem(
        name="bogie-secondary-v1",
        asks="A bogie under a body at rest, with a yaw actuator between frame and body.",
        kind="bogie",
        vehicle=lambda: HIGH_SPEED_COACH_HOLLOW,
        place="secondary",
        sensed=("b",),
        ranges=_TREADS,
        damper=_BOGIE_DAMPER,
    ),
    Problem(
        name="bogie-primary-v1",
        asks="The same with an actuator at each wheelset instead, and sensors on the axle boxes, too.",
        kind="bogie",
        vehicle=lambda: HIGH_SPEED_COACH_HOLLOW,
        place="primary",
        sensed=_AXLES,
        ranges=_TREADS,
        damper=_BOGIE_DAMPER,
    ),
    Problem(
        name="bogie-both-v1",
        asks="The same with all three actuators.",
        kind="bogie",
        vehicle=lambda: HIGH_SPEED_COACH_HOLLOW,
        place="both",
        sensed=_AXLES,
        ranges=_TREADS,
        damper=_BOGIE_DAMPER,
    ),
    Problem(
        name="dual-wheelset-v1",
        asks="The paper's two wheelsets under a frame at rest, with a yaw actuator each.",
        kind="dual_wheelset",
        vehicle=lambda: TABLE_1,
        place="primary",
        sensed=("w1", "w2"),
        ranges=_TREADS,
        damper=PrimaryDamper(1e5),
        speed_range=(10.0, 200.0),
        ride_speeds=(15.0, 20.0),
    ),
    Problem(
        name="coach-v1",
        asks="A whole coach with a passive yaw damper and an actuator beside it on each bogie.",
        kind="coach",
        vehicle=lambda: HIGH_SPEED_COACH_HOLLOW,
        place="secondary",
        sensed=("b1", "b2", "body"),
        ranges=_TREADS,
        damper=_COACH_DAMPER,
        fitted=_COACH_DAMPER,
    ),
    Problem(
        name="crh380a-v1",
        asks="A train's coach on its own profiles, new to worn, with an actuator beside each damper.",
        kind="coach",
        vehicle=train,
        place="secondary",
        sensed=("b1", "b2", "body"),
        ranges={"wear": WEAR, **CONTACT},
        damper=_TRAIN_DAMPER,
        fitted=_TRAIN_DAMPER,
    ),
)
"""All problems."""


def problem(name: str) -> Problem:
    """Return a problem.

    Raises
    ------
    UnknownNameError
        If there is no problem of that name.
    """
    found = {p.name: p for p in PROBLEMS}
    checks.known("problem", [name], list(found))
    return found[name]
