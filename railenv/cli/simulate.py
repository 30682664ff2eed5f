"""``railenv simulate``: a motion in time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

import railenv
from railenv.cli.common import Found, assignments, model_of, report
from railenv.cli.options import (
    CurveOptions,
    JsonOption,
    PlotOption,
    SetOption,
    VehicleOptions,
    with_groups,
)

if TYPE_CHECKING:
    import control


@with_groups
def simulate(
    *,
    speed: Annotated[float, typer.Option("--speed", "-s", help="Forward speed, m/s.")],
    plant: VehicleOptions,
    curve: CurveOptions,
    duration: Annotated[float, typer.Option(help="Time simulated, s.")] = 10.0,
    perturb: Annotated[
        list[str] | None,
        typer.Option(help="Add to a state at the start, as y_w1=0.005 (SI units); may be repeated."),
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Time step, s; from the fastest mode when left out.")
    ] = None,
    show: Annotated[
        list[str] | None, typer.Option(help="A state to report and draw; may be repeated.")
    ] = None,
    changes: SetOption = None,
    csv: Annotated[Path | None, typer.Option(help="Write time and all states to this file.")] = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate a vehicle from its running equilibrium, perturbed, and report how the motion ends."""
    model = model_of(plant, changes)
    names = show or [model.state_names[0]]
    railenv.checks.known("state in --show", names, model.state_names)
    response = railenv.simulate(
        model,
        speed=speed,
        radius=curve.radius,
        cant=curve.cant,
        duration=duration,
        perturbation=assignments(perturb, "--perturb"),
        step=step,
    )
    if csv:
        _write(response, csv)
    report(_ending(response, names, speed, duration), plot, as_json)


def _write(response: control.TimeResponseData, path: Path) -> None:
    """Write time and all states as a table of numbers."""
    header = ",".join(["time", *response.state_labels])
    table = np.vstack([response.time, response.outputs]).T
    np.savetxt(path, table, delimiter=",", header=header, comments="")


def _ending(
    response: control.TimeResponseData, names: list[str], speed: float, duration: float
) -> Found:
    """Return how the motion of some states ends."""

    def draw() -> Any:
        from design.cycles.motion_plots import plot_response

        return plot_response(response, names)

    half = len(response.time) // 2
    rows = {name: response.outputs[response.state_labels.index(name)] for name in names}
    states = {
        name: {
            "final": float(y[-1]),
            "amplitude_first_half": float(np.ptp(y[: half + 1]) / 2.0),
            "amplitude_second_half": float(np.ptp(y[half:]) / 2.0),
        }
        for name, y in rows.items()
    }
    table = Table(title=f"{response.sysname} at {speed:g} m/s for {duration:g} s, SI units")
    for title in ("state", "final", "amplitude, first half", "amplitude, second half"):
        table.add_column(title, justify="right")
    for name, values in states.items():
        table.add_row(name, *(f"{value:.6g}" for value in values.values()))
    summary = {"model": response.sysname, "speed": speed, "duration": duration, "states": states}
    return Found(summary, [table], draw)
