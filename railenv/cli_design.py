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
    import control

    import design

_ROWS = 20


@dataclass(frozen=True)
class YawDamper:
    """What the command line says of a controller: a moment against the yaw rate that a gyro reads.

    Attributes
    ----------
    gain : float or None
        N m per rad/s; None for no controller.
    washout : float or None
        Time constant of the high-pass filter, s; None for no filter.
    delay : float or None
        Transport delay of the commands, s; None for the actuator's own.
    period : float or None
        Control period, s; None for the usual one.
    """

    gain: float | None
    washout: float | None
    delay: float | None
    period: float | None


@dataclass(frozen=True)
class Loop:
    """A model with its controller, or alone."""

    model: Model
    controller: control.StateSpace | None


def loop(model: Model, changes: dict[str, Any], damper: YawDamper) -> Loop:
    """Return a model with changed parameters and, if there is a gain, actuators and controller.

    The bogie gets actuators between frame and body, the dual wheelset between wheelsets and frame.
    """
    if damper.gain is None:
        for name in ("washout", "delay", "period"):
            if getattr(damper, name) is not None:
                raise ParameterError(f"--{name} needs a controller; give --yaw-rate-gain too")
        return Loop(model.replace(**changes) if changes else model, None)
    if not isinstance(model, (Bogie, DualWheelset)):
        raise ParameterError(f"--yaw-rate-gain needs a bogie or a dual wheelset, not {model.name}")
    equipped = Equipped(model, "secondary" if isinstance(model, Bogie) else "primary")
    if damper.delay is not None:
        changes = {"delay": damper.delay, **changes}
    equipped = equipped.replace(**changes)
    return Loop(equipped, _controller(equipped, damper))


def _controller(model: Equipped, damper: YawDamper) -> control.StateSpace:
    """Return the controller: each actuator acts against the gyro of its own body."""
    import control

    from design.feedback import CONTROL_PERIOD

    period = CONTROL_PERIOD if damper.period is None else damper.period
    period = checks.number("--period", period, low=0.0, open_low=True, unit="s")
    gain = checks.number("--yaw-rate-gain", damper.gain, unit="N m s/rad")
    if damper.washout is None:
        one = control.ss([], [], [], [[-gain]], period)
    else:
        time = checks.number("--washout", damper.washout, low=0.0, open_low=True, unit="s")
        high_pass = control.ss([[-1.0 / time]], [[1.0 / time]], [[gain]], [[-gain]])
        one = control.sample_system(high_pass, period, method="tustin")
    commands = model.command_names
    gyros = [f"gyro_{name.removeprefix('command_')}" for name in commands]
    return control.ss(control.append(*[one] * len(commands)), inputs=gyros, outputs=list(commands))


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
