"""Reading a controller of any kind from its file."""

from __future__ import annotations

from os import PathLike

from agents.controllers.adaptive import AdaptiveLQG
from agents.controllers.adaptive_policy import AdaptivePolicy
from agents.controllers.files import ControllerFile, read, restored
from agents.controllers.learned import LearnedPolicy
from agents.controllers.linear_kinds import LINEAR
from agents.controllers.scheduled import ScheduledController

Loaded = ScheduledController | LearnedPolicy | AdaptiveLQG | AdaptivePolicy
"""Controllers that files hold."""

_KINDS: tuple[type[Loaded], ...] = tuple(
    sorted((*LINEAR, LearnedPolicy, AdaptiveLQG, AdaptivePolicy), key=lambda kind: kind.__name__)
)


def load(path: str | PathLike[str]) -> Loaded:
    """Read a controller from the file that its ``save`` wrote; nothing in it is executed.

    Raises
    ------
    ParameterError
        If it is not such a file, is damaged, or holds an unknown kind of controller.
    FileNotFoundError
        If it does not exist.
    """
    return controller_of(read(path), str(path))


def controller_of(content: ControllerFile, where: str) -> Loaded:
    """Return the controller that a file's content describes; ``where`` names it in errors."""
    return restored(content, _KINDS, where)
