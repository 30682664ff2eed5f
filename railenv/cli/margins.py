"""``railenv margins``: stability margins under a controller."""

from __future__ import annotations

import math
from typing import Annotated

import typer
from rich.table import Table

from railenv.cli import loops
from railenv.cli.common import Found, report
from railenv.cli.options import (
    ControlOptions,
    CurveOptions,
    JsonOption,
    PlotOption,
    SetOption,
    VehicleOptions,
    with_groups,
)
from railenv.errors import ParameterError


@with_groups
def margins(
    *,
    speed: Annotated[float, typer.Option("--speed", "-s", help="Forward speed, m/s.")],
    control: ControlOptions,
    plant: VehicleOptions,
    curve: CurveOptions,
    changes: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute gain, phase, disk and delay margins of a vehicle under a controller."""
    loop = loops.loop(plant, changes, control)
    report(_margins(loop, speed, curve.radius, curve.cant), plot, as_json)


def _margins(loop: loops.Loop, speed: float, radius: float, cant: float) -> Found:
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
