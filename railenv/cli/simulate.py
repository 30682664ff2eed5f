"""``railenv simulate``: simulation of a motion in time."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import numpy as np
import typer
from rich.table import Table
from rich.text import Text

import railenv
from railenv.cli.common import Found, assignments, model_of, report
from railenv.cli.options import (
    CurveOptions,
    JsonOption,
    PlotOption,
    SetOption,
    TrackOptions,
    VehicleOptions,
    with_groups,
)
from railenv.errors import ParameterError
from railenv.irregularity import Level, Line

if TYPE_CHECKING:
    import control

    from railenv.assessment import Assessment


@with_groups
def simulate(
    *,
    speed: Annotated[float, typer.Option("--speed", "-s", help="Forward speed, m/s.")],
    plant: VehicleOptions,
    curve: CurveOptions,
    track: TrackOptions,
    duration: Annotated[float, typer.Option(help="Time simulated, s.")] = 10.0,
    perturb: Annotated[
        list[str] | None,
        typer.Option(
            help="Add to a state at the start, such as y_w1=0.005 (SI units); may be repeated."
        ),
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Time step, s; from the fastest mode when left out.")
    ] = None,
    show: Annotated[
        list[str] | None, typer.Option(help="A state to report and draw; may be repeated.")
    ] = None,
    changes: SetOption = None,
    assess: Annotated[
        bool,
        typer.Option(
            "--assess", help="Print forces, accelerations and ride beside the limits of EN 14363."
        ),
    ] = False,
    section: Annotated[
        tuple[float, float] | None,
        typer.Option(
            help="Start and end of the stretch that is assessed, m; the whole run if left out."
        ),
    ] = None,
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
        **_where(curve, track),
        irregularity=_irregularity(track),
        irregularity_factor=track.irregularity_factor,
        duration=duration,
        perturbation=assignments(perturb, "--perturb"),
        step=step,
    )
    if csv:
        _write(response, csv)
    found = _ending(response, names, speed, duration)
    if assess:
        found = _assessed(found, railenv.assess(model, response, section=section))
    report(found, plot, as_json)


def _where(curve: CurveOptions, track: TrackOptions) -> dict[str, Any]:
    """Return the curve, or the track with its transitions, as arguments of ``railenv.simulate``."""
    if track.transition is None:
        if track.straight is not None or track.curve_length is not None:
            raise ParameterError(
                "--straight and --curve need --transition, the length of the transition"
            )
        return {"radius": curve.radius, "cant": curve.cant}
    plan = railenv.Track.into_curve(
        radius=curve.radius,
        cant=curve.cant,
        straight=track.straight or 0.0,
        transition=track.transition,
        curve=track.curve_length,
    )
    return {"track": plan}


def _irregularity(track: TrackOptions) -> Any:
    """Return the level or the line that the options ask for."""
    given, unit = track.irregularity, track.irregularity_unit
    if given is None or given in get_args(Level):
        if unit is not None:
            raise ParameterError("--irregularity-unit is that of a file given as --irregularity")
        return given
    if not Path(given).is_file():
        levels = ", ".join(get_args(Level))
        raise ParameterError(
            f"--irregularity is {given!r}; it must be {levels} or a file, which this is not"
        )
    if unit is None:
        raise ParameterError(f"--irregularity is the file {given!r}; say --irregularity-unit m or mm")
    checked: Any = unit
    return Line.from_file(given, unit=checked)


def _assessed(found: Found, assessment: Assessment) -> Found:
    """Return the report of a motion and of its assessment."""
    summary = {
        "passed": assessment.passed,
        "section": assessment.section,
        "hunting_frequency": assessment.hunting_frequency,
        "notes": assessment.notes,
        "quantities": [
            {**dataclasses.asdict(q), "share": q.share, "passed": q.passed}
            for q in assessment.quantities
        ],
    }
    shown = [*found.shown, Text(assessment.table())]  # its wide lines stay whole
    return Found({**found.summary, "assessment": summary}, shown, assessment.plot)


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
