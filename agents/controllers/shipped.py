"""Controllers that the package ships, for ``HIGH_SPEED_COACH_HOLLOW`` with its secondary actuator.

``railenv tune KIND --out FILE`` designs and tunes one again, ``make controllers`` all of them.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from agents.controllers.learned import LearnedPolicy
from agents.controllers.load import load
from agents.controllers.scheduled import ScheduledController
from railenv import HIGH_SPEED_COACH_HOLLOW, Bogie, Equipped, checks

NAMES = (
    "passive",
    "yaw-rate",
    "lqg",
    "lqg-scheduled",
    "output-feedback",
    "lqr",
    "learned",
    "lqr-scheduled",
)
"""In the order in which they are shown; :mod:`agents.learning.designs` says how each is designed."""


def coach() -> Equipped:
    """Return the vehicle that the shipped controllers are for."""
    return Equipped(Bogie(HIGH_SPEED_COACH_HOLLOW), "secondary")


def shipped_names() -> list[str]:
    """Return names of the controllers that are shipped."""
    present = {Path(f.name).stem for f in _folder().iterdir() if f.name.endswith(".npz")}
    return [*(n for n in NAMES if n in present), *sorted(present - set(NAMES))]


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
    return resources.files("agents.controllers") / "data"
