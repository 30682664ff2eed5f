"""``railenv locus``: eigenvalues over speed or a parameter."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

from railenv.cli import loops
from railenv.cli.common import Found, report, save
from railenv.cli.options import (
    ControlOptions,
    CurveOptions,
    JsonOption,
    PlotOption,
    SetOption,
    VehicleOptions,
    picture,
    with_groups,
)
from railenv.errors import ParameterError

if TYPE_CHECKING:
    import design

_ROWS = 20


@with_groups
def locus(
    *,
    plant: VehicleOptions,
    curve: CurveOptions,
    lowest: Annotated[float, typer.Option(help="Lowest speed, m/s.")] = 5.0,
    highest: Annotated[float, typer.Option(help="Highest speed, m/s.")] = 200.0,
    points: Annotated[int, typer.Option(min=2, help="Number of speeds or values.")] = 100,
    parameter: Annotated[
        str | None,
        typer.Option(
            help="Vary this instead of the speed, such as conicity; gain varies the controller's."
        ),
    ] = None,
    first: Annotated[
        float | None, typer.Option("--from", help="Lowest value of the parameter.")
    ] = None,
    last: Annotated[float | None, typer.Option("--to", help="Highest value of the parameter.")] = None,
    speed: Annotated[
        float | None, typer.Option("--speed", "-s", help="Speed for --parameter, m/s.")
    ] = None,
    control: ControlOptions,
    changes: SetOption = None,
    plot: PlotOption = None,
    damping_plot: Annotated[
        Path | None,
        typer.Option(callback=picture, help="Draw damping ratio and frequency into this file."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the eigenvalues over speed or over a parameter, sorted into modes."""
    loop = loops.loop(plant, changes, control)
    if parameter is None:
        only_with_parameter({"--from": first, "--to": last, "--speed": speed})
        locus, found = speed_locus(loop, (lowest, highest), points, curve.radius, curve.cant)
    else:
        locus, found = parameter_locus(
            loop, parameter, (first, last), points, speed, curve.radius, curve.cant
        )
    report(found, plot, as_json)
    if damping_plot:
        save(locus.plot_damping(), damping_plot, as_json)


def only_with_parameter(options: dict[str, float | None]) -> None:
    """Raise ParameterError if an option of parameter loci is given for a speed locus."""
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise ParameterError(
            f"{', '.join(given)} needs --parameter; a locus over speed runs from --lowest to --highest"
        )


def speed_locus(
    loop: loops.Loop, speeds: tuple[float, float], points: int, radius: float, cant: float
) -> tuple[design.SpeedLocus, Found]:
    """Compute the eigenvalues over speed."""
    import design

    grid = np.linspace(*speeds, points)
    found = design.speed_locus(loop.model, grid, radius=radius, cant=cant, controller=loop.controller)
    summary = {"speed": found.speeds.tolist(), "critical_speed": found.critical.summary()}
    return found, _found(found, summary, str(found.critical))


def parameter_locus(
    loop: loops.Loop,
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
