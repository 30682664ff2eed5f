"""``railenv critical-speed``, ``locus``, ``margins``, ``bifurcation`` and ``map``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import typer

from railenv.cli_common import assignments, err, model_of, out, print_json, report, save, say_written
from railenv.cli_options import (
    CantOption,
    ControllerOption,
    DelayOption,
    JsonOption,
    ModelOption,
    PeriodOption,
    PlotOption,
    RadiusOption,
    SetOption,
    VehicleOption,
    WashoutOption,
    YawRateGainOption,
    animation,
    picture,
)
from railenv.errors import ParameterError


def critical_speed(
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    radius: RadiusOption = math.inf,
    cant: CantOption = 0.0,
    lowest: Annotated[float, typer.Option(help="Lowest speed searched, m/s.")] = 3.0,
    highest: Annotated[float, typer.Option(help="Highest speed searched, m/s.")] = 400.0,
    controller: ControllerOption = None,
    yaw_rate_gain: YawRateGainOption = None,
    washout: WashoutOption = None,
    delay: DelayOption = None,
    period: PeriodOption = None,
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
    from railenv import cli_design as command

    loop = command.loop(
        model_of(model, vehicle, None),
        assignments(changes, "--set"),
        command.Choice(controller, yaw_rate_gain, washout, delay, period),
    )
    found = design.critical_speed(
        loop.model,
        radius=radius,
        cant=cant,
        speed_range=(lowest, highest),
        controller=loop.controller,
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


def locus(
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    radius: RadiusOption = math.inf,
    cant: CantOption = 0.0,
    lowest: Annotated[float, typer.Option(help="Lowest speed, m/s.")] = 5.0,
    highest: Annotated[float, typer.Option(help="Highest speed, m/s.")] = 200.0,
    points: Annotated[int, typer.Option(min=2, help="Number of speeds or values.")] = 100,
    parameter: Annotated[
        str | None,
        typer.Option(help="Vary this instead of the speed, as conicity; gain, of the controller."),
    ] = None,
    first: Annotated[float | None, typer.Option("--from", help="Lowest value of it.")] = None,
    last: Annotated[float | None, typer.Option("--to", help="Highest value of it.")] = None,
    speed: Annotated[float | None, typer.Option("--speed", "-s", help="Speed for it, m/s.")] = None,
    controller: ControllerOption = None,
    yaw_rate_gain: YawRateGainOption = None,
    washout: WashoutOption = None,
    delay: DelayOption = None,
    period: PeriodOption = None,
    changes: SetOption = None,
    plot: PlotOption = None,
    damping_plot: Annotated[
        Path | None,
        typer.Option(callback=picture, help="Draw damping ratio and frequency into this file."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the eigenvalues over speed or over a parameter, sorted into modes."""
    from railenv import cli_design as command

    loop = command.loop(
        model_of(model, vehicle, None),
        assignments(changes, "--set"),
        command.Choice(controller, yaw_rate_gain, washout, delay, period),
    )
    if parameter is None:
        command.only_with_parameter({"--from": first, "--to": last, "--speed": speed})
        locus, found = command.speed_locus(loop, (lowest, highest), points, radius, cant)
    else:
        locus, found = command.parameter_locus(
            loop, parameter, (first, last), points, speed, radius, cant
        )
    report(found, plot, as_json)
    if damping_plot:
        save(locus.plot_damping(), damping_plot, as_json)


def margins(
    speed: Annotated[float, typer.Option("--speed", "-s", help="Forward speed, m/s.")],
    controller: ControllerOption = None,
    yaw_rate_gain: YawRateGainOption = None,
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    radius: RadiusOption = math.inf,
    cant: CantOption = 0.0,
    washout: WashoutOption = None,
    delay: DelayOption = None,
    period: PeriodOption = None,
    changes: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute gain, phase, disk and delay margins of a vehicle under a controller."""
    from railenv import cli_design as command

    loop = command.loop(
        model_of(model, vehicle, None),
        assignments(changes, "--set"),
        command.Choice(controller, yaw_rate_gain, washout, delay, period),
    )
    found = command.margins(loop, speed, radius, cant)
    report(found, plot, as_json)


def bifurcation(
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    radius: RadiusOption = math.inf,
    cant: CantOption = 0.0,
    lowest: Annotated[
        float | None, typer.Option(help="Lowest speed, m/s; 3, or near the fold to simulate.")
    ] = None,
    highest: Annotated[
        float | None, typer.Option(help="Highest speed, m/s; 1.2 times the Hopf point's if left out.")
    ] = None,
    points: Annotated[int, typer.Option(min=2, help="Most points of the branch.")] = 150,
    chart: Annotated[
        str | None,
        typer.Option("--map", help="Hopf points and folds over a parameter, as conicity=0.03:0.1:8."),
    ] = None,
    simulated: Annotated[
        int,
        typer.Option(min=0, help="Simulate too, at so many speeds, from a small and a large start."),
    ] = 0,
    state: Annotated[str | None, typer.Option(help="State to report and draw; the first.")] = None,
    changes: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Follow the limit cycles from the Hopf point through their fold; or map where hunting occurs."""
    from railenv import cli_bifurcation as command

    built = model_of(model, vehicle, changes)
    show = not as_json and err.is_terminal
    if chart is not None:
        found = command.hunting_map(built, chart, radius, cant, show)
    else:
        found = command.branch(built, radius, cant, (lowest, highest), points, state, simulated, show)
    report(found, plot, as_json)


def stability_map(
    x: Annotated[
        str,
        typer.Option("--x", help="First parameter, as radius:500:20000:40:log or radius:500,1000,inf."),
    ],
    y: Annotated[str, typer.Option("--y", help="Second parameter, as conicity:0.05:0.4:40.")],
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    quantity: Annotated[
        Literal["critical-speed", "damping", "growth"], typer.Option(help="What to map.")
    ] = "critical-speed",
    speed: Annotated[
        float | None, typer.Option("--speed", "-s", help="Speed for damping and growth, m/s.")
    ] = None,
    radius: RadiusOption = math.inf,
    cant: CantOption = 0.0,
    store: Annotated[
        Path | None, typer.Option(help="Keep finished cells in this file; a rerun continues it.")
    ] = None,
    controller: ControllerOption = None,
    jobs: Annotated[int, typer.Option(help="Processes; -1 is one for each processor.")] = -1,
    changes: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Map critical speed, damping or growth rate over two parameters, in parallel."""
    from railenv import cli_design
    from railenv import cli_map as command

    loop = cli_design.loop(
        model_of(model, vehicle, None),
        assignments(changes, "--set"),
        cli_design.Choice(controller),
    )
    found = command.stability_map(
        loop.model,
        loop.controller,
        (x, y),
        quantity=quantity,
        speed=speed,
        radius=radius,
        cant=cant,
        store=store,
        n_jobs=jobs,
        progress=not as_json and err.is_terminal,
    )
    report(found, plot, as_json)
