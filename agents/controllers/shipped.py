"""Controllers that the package ships, each for one of the problems of :mod:`agents.problems`.

``railenv tune KIND --problem NAME --out FILE`` designs and tunes one again, and ``make controllers``
all of them.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from agents.controllers.load import Loaded, load
from railenv import HIGH_SPEED_COACH_HOLLOW, Bogie, Equipped, checks

NAMES = (
    "passive",
    "yaw-rate",
    "lqg",
    "lqg-scheduled",
    "h-infinity",
    "output-feedback",
    "lqr",
    "learned",
    "learned-by-gradient",
    "lqr-scheduled",
)
"""Names in the order in which they are shown; :mod:`agents.learning.designs` designs each."""

FIRST = "bogie-secondary-v1"
"""The default problem."""


def coach() -> Equipped:
    """Return the vehicle of the controllers of the first problem."""
    return Equipped(Bogie(HIGH_SPEED_COACH_HOLLOW), "secondary")


def shipped_problems() -> list[str]:
    """Return the problems for which controllers are shipped."""
    found = sorted(f.name for f in _folder().iterdir() if f.is_dir())
    return [FIRST, *(name for name in found if name != FIRST)]


def shipped_names(problem: str = FIRST) -> list[str]:
    """Return the names of the controllers shipped for a problem."""
    if problem not in shipped_problems():
        return []
    files = (_folder() / problem).iterdir()
    present = {Path(f.name).stem for f in files if f.name.endswith(".npz")}
    return [*(n for n in NAMES if n in present), *sorted(present - set(NAMES))]


def shipped(name: str, problem: str = FIRST) -> Loaded:
    """Return a shipped controller.

    Parameters
    ----------
    name : str
    problem : str
        A problem of :mod:`agents.problems`.

    Raises
    ------
    UnknownNameError
        If there is no controller of that name.
    """
    checks.known("problem with shipped controllers", [problem], shipped_problems())
    checks.known("shipped controller", [name], shipped_names(problem))
    with resources.as_file(_folder() / problem / f"{name}.npz") as path:
        return load(path)


def _folder() -> resources.abc.Traversable:
    return resources.files("agents.controllers") / "data"
