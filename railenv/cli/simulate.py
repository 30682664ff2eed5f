"""``railenv simulate``: a motion in time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

import railenv
from railenv.cli.common import assignments, model_of, out, print_json, save
from railenv.cli.options import (
    CurveOptions,
    JsonOption,
    PlotOption,
    SetOption,
    VehicleOptions,
    with_groups,
)


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
    import numpy as np

    built = model_of(plant, changes)
    names = show or [built.state_names[0]]
    railenv.checks.known("state in --show", names, built.state_names)
    response = railenv.simulate(
        built,
        speed=speed,
        radius=curve.radius,
        cant=curve.cant,
        duration=duration,
        perturbation=assignments(perturb, "--perturb"),
        step=step,
    )
    rows = {name: response.outputs[built.state_names.index(name)] for name in names}
    half = len(response.time) // 2
    summary = {
        name: {
            "final": float(y[-1]),
            "amplitude_first_half": float(np.ptp(y[: half + 1]) / 2.0),
            "amplitude_second_half": float(np.ptp(y[half:]) / 2.0),
        }
        for name, y in rows.items()
    }
    if csv:
        header = ",".join(["time", *built.state_names])
        table = np.vstack([response.time, response.outputs]).T
        np.savetxt(csv, table, delimiter=",", header=header, comments="")
    if as_json:
        print_json({"model": built.name, "speed": speed, "duration": duration, "states": summary})
    else:
        shown = Table(title=f"{built.name} at {speed:g} m/s for {duration:g} s, SI units")
        for title in ("state", "final", "amplitude, first half", "amplitude, second half"):
            shown.add_column(title, justify="right")
        for name, values in summary.items():
            shown.add_row(name, *(f"{value:.6g}" for value in values.values()))
        out.print(shown)
    if plot:
        from design.cycles.motion_plots import plot_response

        save(plot_response(response, names), plot, as_json)
