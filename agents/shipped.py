"""Controllers that the package ships for ``HIGH_SPEED_COACH`` with its default secondary actuator.

``railenv tune KIND --out FILE`` designs and tunes one again, ``make controllers`` all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path

from agents.controller import Controller
from agents.learned import LearnedPolicy
from agents.load import load
from agents.lqr import LQR
from agents.passive import Passive
from agents.policy_search import search_policy
from agents.scheduled import ScheduledController
from agents.tuning import tune_lqg, tune_yaw_rate
from agents.tuning_gradient import tune_output_feedback
from design.regulator import Weights
from railenv import HIGH_SPEED_COACH, Bogie, Equipped, checks

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


def coach() -> Equipped:
    """Return the vehicle that the shipped controllers are for."""
    return Equipped(Bogie(HIGH_SPEED_COACH), "secondary")


def shipped_names() -> list[str]:
    """Return names of the controllers that are shipped."""
    present = {Path(f.name).stem for f in _folder().iterdir() if f.name.endswith(".npz")}
    return [*(n for n in DESIGNS if n in present), *sorted(present - set(DESIGNS))]


def shipped(name: str) -> ScheduledController | LearnedPolicy:
    """Return a shipped controller.

    Raises
    ------
    UnknownNameError
        If there is none of that name.
    """
    checks.known("shipped controller", [name], shipped_names())
    with resources.as_file(_folder() / f"{name}.npz") as path:
        return load(path)


def _folder() -> resources.abc.Traversable:
    return resources.files("agents") / "data"
