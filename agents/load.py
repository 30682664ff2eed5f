"""Reading a controller of any kind from its file."""

from __future__ import annotations

from os import PathLike

from agents.files import read
from agents.lqg import LQG
from agents.lqr import LQR
from agents.output_feedback import OutputFeedback
from agents.passive import Passive
from agents.scheduled import ScheduledController
from agents.yaw_rate import YawRateFeedback
from railenv import checks
from railenv.errors import ParameterError

_SCHEDULED: tuple[type[ScheduledController], ...] = (
    LQG,
    LQR,
    OutputFeedback,
    Passive,
    ScheduledController,
    YawRateFeedback,
)


def load(path: str | PathLike[str]) -> ScheduledController:
    """Read a controller from the file that its ``save`` wrote; nothing in it is executed.

    Raises
    ------
    ParameterError
        If it is no such file, is damaged, or holds a kind of controller that is not known.
    FileNotFoundError
        If there is none.
    """
    content = read(path)
    kinds = {kind.__name__: kind for kind in _SCHEDULED}
    checks.known(f"kind of controller in {path}", [content.kind], list(kinds))
    try:
        return kinds[content.kind].from_file(content)
    except (KeyError, TypeError, AttributeError) as error:
        raise ParameterError(f"{path} is damaged: {error!r} in its header") from None
