"""What ``railenv locus`` and ``railenv margins`` compute and show."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from railenv import checks
from railenv.cli_bifurcation import Found
from railenv.equipment import Equipped
from railenv.errors import ParameterError
from railenv.models import Bogie, DualWheelset, Model

if TYPE_CHECKING:
    import design
    from design.loop.feedback import Feedback

_ROWS = 20


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

    The bogie gets actuators between frame and body, the dual wheelset between wheelsets and frame.
    """
    if choice.name is None and choice.gain is None:
        for name in ("washout", "delay", "period"):
            if getattr(choice, name) is not None:
                raise ParameterError(
                    f"--{name} needs a controller; give --controller or --yaw-rate-gain too"
                )
        return Loop(model.replace(**changes) if changes else model, None)
    if not isinstance(model, (Bogie, DualWheelset)):
        raise ParameterError(f"a controller needs a bogie or a dual wheelset, not {model.name}")
    equipped = Equipped(model, "secondary" if isinstance(model, Bogie) else "primary")
    if choice.delay is not None:
        changes = {"delay": choice.delay, **changes}
    equipped = equipped.replace(**changes)
    return Loop(equipped, _controller(equipped, choice))


def _controller(model: Equipped, choice: Choice) -> Feedback:
    from agents.controllers.yaw_rate import YawRateFeedback
    from design.linear.linearization import CONTROL_PERIOD
    from design.loop.feedback import Feedback
    from railenv.cli_evaluate import controllers

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


def only_with_parameter(options: dict[str, float | None]) -> None:
    """Raise ParameterError if an option of parameter loci is given for a speed locus."""
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise ParameterError(
            f"{', '.join(given)} needs --parameter; a locus over speed runs from --lowest to --highest"
        )


def speed_locus(
    loop: Loop, speeds: tuple[float, float], points: int, radius: float, cant: float
) -> tuple[design.SpeedLocus, Found]:
    """Compute the eigenvalues over speed."""
    import design

    grid = np.linspace(*speeds, points)
    found = design.speed_locus(loop.model, grid, radius=radius, cant=cant, controller=loop.controller)
    summary = {"speed": found.speeds.tolist(), "critical_speed": found.critical.summary()}
    return found, _found(found, summary, str(found.critical))


def parameter_locus(
    loop: Loop,
    parameter: str,
    limits: tuple[float | None, float | None],
    points: int,
    speed: float | None,
    radius: float,
    cant: float,
) -> tuple[design.ParameterLocus, Found]:
    """Compute the eigenvalues over a parameter at one speed."""
    import design

    first, last = limits
    if first is None or last is None or speed is None:
        raise ParameterError("--parameter needs --from, --to and --speed")
    found = design.parameter_locus(
        loop.model,
        parameter,
        np.linspace(first, last, points),
        speed=speed,
        radius=radius,
        cant=cant,
        controller=loop.controller,
    )
    summary = {
        "parameter": parameter,
        "unit": found.unit,
        "speed": speed,
        "values": found.values.tolist(),
    }
    said = "; ".join(str(point) for point in found.critical_points) or "stability does not change"
    return found, _found(found, summary, f"at {speed:g} m/s {said}")


def _found(locus: design.VehicleLocus, summary: dict[str, Any], said: str) -> Found:
    k = locus.least_damped
    data = {
        "model": locus.sysname,
        **summary,
        "real": locus.loci.real.tolist(),
        "imag": locus.loci.imag.tolist(),
        "least_damped": k,
        "critical_points": [
            {"value": c.value, "stability": c.stability, "frequency": c.frequency}
            for c in locus.critical_points
        ],
        "ended": locus.ended,
    }
    unit = f" ({locus.unit})" if locus.unit not in ("", "1") else ""
    table = Table(title=f"{locus.sysname}: least damped mode; {said}")
    titles = (f"{locus.parameter}{unit}", "growth rate (1/s)", "frequency (Hz)", "damping ratio")
    for title in titles:
        table.add_column(title, justify="right")
    for i in range(0, len(locus.values), max(1, len(locus.values) // _ROWS)):
        table.add_row(
            f"{locus.values[i]:.2f}" if locus.parameter == "speed" else f"{locus.values[i]:.5g}",
            f"{locus.growth[i, k]:+.4f}",
            f"{locus.frequency[i, k]:.4f}",
            f"{locus.damping[i, k]:+.5f}",
        )
    return Found(data, [table], locus.plot)


def margins(loop: Loop, speed: float, radius: float, cant: float) -> Found:
    """Compute the margins of a closed loop."""
    import design

    if loop.controller is None:
        raise ParameterError("margins need a controller; give --controller or --yaw-rate-gain")

    found = design.margins(loop.model, loop.controller, speed=speed, radius=radius, cant=cant)
    table = Table(title=found.closed_loop.model_name)
    for title in ("command", "gain", "phase (°)", "disk", "disk gain", "disk phase (°)"):
        table.add_column(title, justify="right")
    for c in found.channels:
        table.add_row(
            c.channel,
            f"{c.gain_reduction:.4g} to {c.gain_margin:.4g}",
            f"{math.degrees(c.phase_margin):.2f}",
            f"{c.disk_margin:.4f}",
            f"{c.disk_gain_margin:.4g}",
            f"{math.degrees(c.disk_phase_margin):.2f}",
        )
    lines = str(found).splitlines()
    said = [line for line in lines if not line.startswith(tuple(c.channel for c in found.channels))]
    return Found(found.summary(), [*said, *([table] if found.channels else [])], found.plot)
