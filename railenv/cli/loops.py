"""A vehicle under a controller, as options of several commands say it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from railenv import checks
from railenv.cli.common import equipped
from railenv.cli.controllers import controllers
from railenv.equipment import Equipped
from railenv.errors import ParameterError
from railenv.models import CooperriderBogie, Model

if TYPE_CHECKING:
    from design.loop.feedback import Feedback


@dataclass(frozen=True)
class Choice:
    """What the command line says of a controller.

    Attributes
    ----------
    name : str or None
        A shipped controller or a file.
    gain : float or None
        Instead of it, N m per rad/s of a yaw rate that is damped.
    washout : float or None
        Corner frequency of the high-pass filter of that, Hz; None for no filter.
    delay : float or None
        Transport delay of the commands, s; None for the actuator's own.
    period : float or None
        Control period, s; None for the usual one.
    """

    name: str | None = None
    gain: float | None = None
    washout: float | None = None
    delay: float | None = None
    period: float | None = None


@dataclass(frozen=True)
class Loop:
    """A model with its controller, or alone."""

    model: Model
    controller: Feedback | None


def loop(model: Model, changes: dict[str, Any], choice: Choice) -> Loop:
    """Return a model with changed parameters and, if one is chosen, actuators and controller.

    Actuators are between frame and body, or where no frame moves between wheelsets and frame.
    """
    if choice.name is None and choice.gain is None:
        for name in ("washout", "delay", "period"):
            if getattr(choice, name) is not None:
                raise ParameterError(
                    f"--{name} needs a controller; give --controller or --yaw-rate-gain too"
                )
        return Loop(model.replace(**changes) if changes else model, None)
    if isinstance(model, CooperriderBogie):  # it knows neither curves nor cant, which they read
        raise ParameterError(
            f"a controller needs a bogie, a dual wheelset or a file of parts, not {model.name}"
        )
    if choice.delay is not None:
        changes = {"delay": choice.delay, **changes}
    actuated = equipped(model).replace(**changes)
    return Loop(actuated, _controller(actuated, choice))


def _controller(model: Equipped, choice: Choice) -> Feedback:
    from agents.controllers.yaw_rate import YawRateFeedback
    from design.linear.linearization import CONTROL_PERIOD
    from design.loop.feedback import Feedback

    if choice.name is not None:
        for name in ("gain", "washout", "period"):
            if getattr(choice, name) is not None:
                option = "yaw-rate-gain" if name == "gain" else name
                raise ParameterError(f"--{option} does not go with --controller, which has its own")
        (controller,) = controllers([choice.name]).values()
        if not isinstance(controller, Feedback):
            raise ParameterError(f"controller {choice.name!r} has no linearisation")
        return controller
    period = CONTROL_PERIOD if choice.period is None else choice.period
    period = checks.number("--period", period, low=0.0, open_low=True, unit="s")
    gain = checks.number("--yaw-rate-gain", choice.gain, unit="N m s/rad")
    washout = checks.number("--washout", choice.washout or 0.0, low=0.0, unit="Hz")
    return YawRateFeedback.design(model, gain=gain, washout=washout, period=period)
