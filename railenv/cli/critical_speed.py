"""``railenv critical-speed``: the speed at which steady running ends."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from railenv.cli import loops
from railenv.cli.common import out, print_json, save, say_written
from railenv.cli.options import (
    ControlOptions,
    CurveOptions,
    JsonOption,
    PlotOption,
    SetOption,
    VehicleOptions,
    animation,
    with_groups,
)
from railenv.errors import ParameterError


@with_groups
def critical_speed(
    *,
    plant: VehicleOptions,
    curve: CurveOptions,
    lowest: Annotated[float, typer.Option(help="Lowest speed searched, m/s.")] = 3.0,
    highest: Annotated[float, typer.Option(help="Highest speed searched, m/s.")] = 400.0,
    longest_step: Annotated[
        float | None,
        typer.Option(
            help="Longest step between sampled speeds, of their logarithm; 0.15 if not given, or 0.06 "
            "with a controller."
        ),
    ] = None,
    control: ControlOptions,
    changes: SetOption = None,
    plot: PlotOption = None,
    animate: Annotated[
        Path | None,
        typer.Option(help="Animate the critical mode into this file (.gif).", callback=animation),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the speed at which steady running ends: by hunting, divergence or loss of equilibrium."""
    import design

    loop = loops.loop(plant, changes, control)
    found = design.critical_speed(
        loop.model,
        radius=curve.radius,
        cant=curve.cant,
        speed_range=(lowest, highest),
        controller=loop.controller,
        longest_step=longest_step,
    )
    if as_json:
        print_json({"model": found.model_name, **found.summary()})
    else:
        out.print(f"{found.model_name}: {found}", markup=False, highlight=False)
    if plot:
        save(found.plot(), plot, as_json)
    if animate:
        if found.mode_shape is None:
            raise ParameterError(f"--animate needs a critical mode, but {found.model_name} is {found}")
        found.mode_shape.animate().save(animate, writer="pillow")
        say_written(animate, as_json)
