"""``railenv modes``: the modes of a vehicle at one speed, with their names."""

from __future__ import annotations

from typing import Annotated

import typer
from rich import box
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


@with_groups
def modes(
    *,
    plant: VehicleOptions,
    curve: CurveOptions,
    speed: Annotated[float, typer.Option("--speed", "-s", help="Speed, m/s.")],
    highest: Annotated[
        float | None, typer.Option(help="Frequency up to which modes are listed, Hz.")
    ] = None,
    control: ControlOptions,
    changes: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the oscillating modes at one speed: name, frequency, damping and shares of the energy."""
    import design

    loop = loops.loop(plant, changes, control)
    found = design.modes(
        loop.model,
        speed=speed,
        radius=curve.radius,
        cant=curve.cant,
        highest=highest,
        controller=loop.controller,
    )
    title = f"{found.model_name}, {found.condition}: shares of {found.measure}"
    table = Table(title=title, box=box.SIMPLE)
    table.add_column("mode", no_wrap=True)
    for title in ("Hz", "damping ratio", *found.parts):
        table.add_column(title, justify="right")
    rows = found.rows()
    for row in rows:
        shares = [f"{row[part]:.2f}" for part in found.parts]
        table.add_row(row["mode"], f"{row['frequency']:.3f}", f"{row['damping']:+.3f}", *shares)
    summary = {"model": found.model_name, "speed": speed, "shares_of": found.measure, "modes": rows}
    report(Found(summary, [table], found.plot), plot, as_json)
