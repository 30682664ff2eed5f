"""A vehicle under a controller, as described by options of several commands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from railenv import checks
from railenv.cli.common import assignments, model_of
from railenv.cli.controllers import controllers
from railenv.cli.options import ControlOptions, VehicleOptions
from railenv.equipment import Equipped
from railenv.errors import ParameterError
from railenv.models import Model

if TYPE_CHECKING:
    from design.loop.feedback import Feedback


@dataclass(frozen=True)
class Loop:
    """A model with its controller, or alone."""

    model: Model
    controller: Feedback | None


def loop(plant: VehicleOptions, changes: list[str] | None, control: ControlOptions) -> Loop:
    """Return a model with changed parameters and, if one is chosen, actuators and controller."""
    model, values = model_of(plant, None), assignments(changes, "--set")
    if control.controller is None and control.yaw_rate_gain is None:
        for name in ("washout", "delay", "period"):
            if getattr(control, name) is not None:
                raise ParameterError(
                    f"--{name} needs a controller; give --controller or --yaw-rate-gain too"
                )
        return Loop(model.replace(**values) if values else model, None)
    from agents.controllers.controller import equipped

    if control.delay is not None:
        values = {"delay": control.delay, **values}
    carrier = equipped(model).replace(**values)
    return Loop(carrier, _controller(carrier, control))


def _controller(model: Equipped, control: ControlOptions) -> Feedback:
    from agents.controllers.yaw_rate import YawRateFeedback
    from design.linear.linearization import CONTROL_PERIOD
    from design.loop.feedback import Feedback

    if control.controller is not None:
        for name in ("yaw_rate_gain", "washout", "period"):
            if getattr(control, name) is not None:
                option = name.replace("_", "-")
                raise ParameterError(
                    f"--{option} cannot be combined with --controller, which has its own"
                )
        (controller,) = controllers([control.controller]).values()
        if not isinstance(controller, Feedback):
            raise ParameterError(f"controller {control.controller!r} has no linearisation")
        return controller
    period = CONTROL_PERIOD if control.period is None else control.period
    period = checks.number("--period", period, low=0.0, open_low=True, unit="s")
    gain = checks.number("--yaw-rate-gain", control.yaw_rate_gain, unit="N m s/rad")
    washout = checks.number("--washout", control.washout or 0.0, low=0.0, unit="Hz")
    return YawRateFeedback.design(model, gain=gain, washout=washout, period=period)
