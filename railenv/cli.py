"""The command line: ``railenv --help``."""

from __future__ import annotations

import importlib.util
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

import railenv
from railenv import cli_train
from railenv import vehicles as vehicle_records
from railenv.errors import ParameterError, RailenvError

if TYPE_CHECKING:
    from railenv.models import Model

app = typer.Typer(
    help="Hunting of railway bogies on curved track: models, stability and simulation.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
out = Console()
err = Console(stderr=True)

_NARROW: Any = {"box": box.SIMPLE, "padding": (0, 1, 0, 0), "pad_edge": False}
"""Tables that fit a terminal of 80 columns."""

ModelName = Literal["bogie", "dual-wheelset", "cooperrider"]

VehicleOption = Annotated[
    str,
    typer.Option(
        "--vehicle",
        "-v",
        help="A shipped vehicle (TABLE_1, TABLE_1_PRINTED_LOADS, HIGH_SPEED_COACH) or a TOML file.",
    ),
]
ModelOption = Annotated[
    ModelName,
    typer.Option(
        "--model",
        "-m",
        help="Bogie of 12, dual wheelset of 8 or Cooperrider bogie of 7 degrees of freedom.",
    ),
]
RadiusOption = Annotated[
    float,
    typer.Option(
        "--radius", "-r", help="Curve radius in m; inf is tangent track, negative is the other hand."
    ),
]
CantOption = Annotated[
    float,
    typer.Option("--cant", "-c", help="Cant angle in rad; positive raises the left, outer rail."),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", help="Change a parameter, as conicity=0.2; may be repeated."),
]
YawRateGainOption = Annotated[
    float | None,
    typer.Option(help="Damp the yaw rate by actuators: moment against it, N m per rad/s."),
]
ControllerOption = Annotated[
    str | None, typer.Option("--controller", help="Close the loop: a shipped controller, or a file.")
]
WashoutOption = Annotated[
    float | None,
    typer.Option(help="Corner frequency (Hz) below which it does not; none if left out."),
]
DelayOption = Annotated[
    float | None, typer.Option(help="Transport delay of the commands, s; 0.01 if left out.")
]
PeriodOption = Annotated[float | None, typer.Option(help="Control period, s; 0.005 if left out.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")]


def _picture(path: Path | None) -> Path | None:
    """Check before anything is computed that a picture can be written."""
    return _checked_path(path, (".png", ".svg", ".pdf"))


def _animation(path: Path | None) -> Path | None:
    return _checked_path(path, (".gif",))


def _checked_path(path: Path | None, suffixes: tuple[str, ...]) -> Path | None:
    if path is not None:
        if path.suffix.lower() not in suffixes:
            raise ParameterError(f"{str(path)!r} must end in {' or '.join(suffixes)}")
        if not path.parent.is_dir():
            raise ParameterError(f"folder {str(path.parent)!r} of {path.name} does not exist")
    return path


PlotOption = Annotated[
    Path | None,
    typer.Option("--plot", help="Draw into this file (.png, .svg or .pdf).", callback=_picture),
]


def main() -> None:
    """Run the command line; errors of the package print as one line, with exit status 1."""
    try:
        app()
    except (RailenvError, OSError) as error:
        said = escape(" ".join(str(error).split()))  # one line, also of what other libraries say
        err.print(f"[red]error:[/] {said}", highlight=False, soft_wrap=True)
        raise SystemExit(1) from None


@app.callback(invoke_without_command=True)
def _start(
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    if version:
        out.print(railenv.__version__, highlight=False)
        raise typer.Exit
    for name in ("design", "agents"):
        problem = foreign_package(name)
        if problem:
            err.print(f"[yellow]warning:[/] {problem}", highlight=False, soft_wrap=True)


def foreign_package(name: str) -> str | None:
    """Say what is wrong if Python finds another package under one of this distribution's names."""
    spec = importlib.util.find_spec(name)
    home = Path(railenv.__file__).resolve().parent.parent
    if spec is None or spec.origin is None:
        return f"the package {name!r} of railenv is not installed; reinstall railenv"
    found = Path(spec.origin).resolve().parent
    if found.parent == home:
        return None
    return (
        f"Python finds {name!r} in {found}, which does not belong to railenv; another distribution or "
        f"folder of that name hides railenv's. Use an environment of its own for railenv"
    )


def _vehicle(name: str) -> railenv.Vehicle:
    if name.endswith(".toml"):
        return railenv.Vehicle.from_toml(name)
    return vehicle_records.preset(name)


def _model(model: ModelName, vehicle: str, changes: list[str] | None) -> Model:
    built: Model
    if model == "cooperrider":
        built = railenv.CooperriderBogie()
    else:
        kind = railenv.Bogie if model == "bogie" else railenv.DualWheelset
        built = kind(_vehicle(vehicle))
    return built.replace(**_assignments(changes, "--set")) if changes else built


def _assignments(texts: list[str] | None, option: str) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for text in texts or []:
        name, equals, value = text.partition("=")
        if not equals:
            raise ParameterError(f"{option} is {text!r}; it must be name=value")
        values[name.strip()] = _value(value.strip())
    return values


def _value(text: str) -> float | bool | str:
    if text in ("true", "false"):
        return text == "true"
    try:
        return float(text)
    except ValueError:
        return text


def _print_json(data: object) -> None:
    print(json.dumps(data, indent=2, allow_nan=False))


def _report(found: Any, plot: Path | None, as_json: bool) -> None:
    """Print what a command found, as text or as JSON, and draw it."""
    if as_json:
        _print_json(found.summary)
    else:
        for part in found.shown:
            out.print(part, highlight=False)
    if plot:
        _save(found.draw(), plot, as_json)


def _save(drawn: Any, path: Path, as_json: bool) -> None:
    drawn.figure.savefig(path)
    _say_written(path, as_json)


def _say_written(path: Path, as_json: bool) -> None:
    """Say that a file was written; not on standard output where that is JSON."""
    (err if as_json else out).print(f"wrote {escape(str(path))}", highlight=False, soft_wrap=True)


@app.command()
def vehicles(
    name: Annotated[
        str | None, typer.Argument(help="A shipped vehicle or a TOML file; all vehicles when left out.")
    ] = None,
    toml: Annotated[
        bool, typer.Option("--toml", help="Print the vehicle as a TOML file to start your own from.")
    ] = False,
    markdown: Annotated[
        bool, typer.Option("--markdown", help="Print a table of all vehicles for a document.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Print the parameters of vehicles, with symbol, unit, meaning and source."""
    forms = {"--toml": toml, "--markdown": markdown, "--json": as_json}
    if sum(forms.values()) > 1:
        given = " and ".join(form for form, is_given in forms.items() if is_given)
        raise ParameterError(f"{given} exclude each other; give one of them")
    shown = [_vehicle(name)] if name else list(railenv.PRESETS)
    if toml:
        if name is None:
            raise ParameterError("--toml needs the name of one vehicle")
        print(shown[0].to_toml(), end="")
        return
    rows = vehicle_records.describe(railenv.Vehicle)
    if markdown:
        print(_markdown(shown, rows))
        return
    if as_json:
        _print_json([{row.name: getattr(v, row.name) for row in rows} for v in shown])
        return
    out.print(_comparison(shown, rows) if name is None else _description(shown[0], rows))
    for v in shown:
        out.print(f"{v.name}: {v.provenance}", highlight=False)


def _comparison(shown: list[railenv.Vehicle], rows: list[vehicle_records.FieldDescription]) -> Table:
    table = Table(title="Vehicles; name one to see meanings and sources", **_NARROW)
    for title in ("field", "unit"):
        table.add_column(title, no_wrap=True)
    for v in shown:
        table.add_column(v.name.replace("_", "_\n"), justify="right", no_wrap=True)
    for row in _numeric(rows):
        table.add_row(row.name, row.unit, *(_written(getattr(v, row.name)) for v in shown))
    return table


def _description(vehicle: railenv.Vehicle, rows: list[vehicle_records.FieldDescription]) -> Table:
    table = Table(title=vehicle.name, **_NARROW)
    for title in ("field", "value", "unit"):
        table.add_column(title, no_wrap=True)
    table.add_column("meaning (symbol; source)")
    for row in _numeric(rows):
        meaning = f"{row.meaning} ({'; '.join(filter(None, (row.symbol, row.source)))})"
        table.add_row(row.name, _written(getattr(vehicle, row.name)), row.unit, meaning)
    return table


def _markdown(shown: list[railenv.Vehicle], rows: list[vehicle_records.FieldDescription]) -> str:
    names = [v.name for v in shown]
    lines = [
        "# Vehicles",
        "",
        "Generated by `railenv vehicles --markdown` from the metadata of `railenv.Vehicle`; SI units.",
        "",
        *(f"- `{v.name}`: {v.provenance}." for v in shown),
        "",
        f"| field | symbol | unit | {' | '.join(names)} | meaning | source |",
        f"|---|---|---|{'---:|' * len(names)}---|---|",
    ]
    for row in _numeric(rows):
        values = " | ".join(_written(getattr(v, row.name)) for v in shown)
        lines.append(
            f"| `{row.name}` | {row.symbol} | {row.unit} | {values} | {row.meaning} | {row.source} |"
        )
    return "\n".join(lines)


def _numeric(
    rows: list[vehicle_records.FieldDescription],
) -> list[vehicle_records.FieldDescription]:
    return [row for row in rows if row.name not in ("name", "provenance")]


def _written(value: object) -> str:
    if not isinstance(value, float):
        return str(value).lower()
    return f"{value:g}".replace("e+0", "e")


@app.command("critical-speed")
def critical_speed(
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    radius: RadiusOption = math.inf,
    cant: CantOption = 0.0,
    lowest: Annotated[float, typer.Option(help="Lowest speed searched, m/s.")] = 3.0,
    highest: Annotated[float, typer.Option(help="Highest speed searched, m/s.")] = 400.0,
    changes: SetOption = None,
    plot: PlotOption = None,
    animate: Annotated[
        Path | None,
        typer.Option(help="Animate the critical mode into this file (.gif).", callback=_animation),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the speed at which steady running ends: by hunting, divergence or loss of equilibrium."""
    import design

    built = _model(model, vehicle, changes)
    found = design.critical_speed(built, radius=radius, cant=cant, speed_range=(lowest, highest))
    if as_json:
        _print_json({"model": built.name, **found.summary()})
    else:
        out.print(f"{built.name}: {found}", highlight=False)
    if plot:
        _save(found.plot(), plot, as_json)
    if animate:
        if found.mode_shape is None:
            raise ParameterError(f"--animate needs a critical mode, but {built.name} is {found}")
        found.mode_shape.animate().save(animate, writer="pillow")
        _say_written(animate, as_json)


@app.command()
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
        typer.Option(help="Draw damping ratio and frequency into this file.", callback=_picture),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the eigenvalues over speed or over a parameter, sorted into modes."""
    from railenv import cli_design as command

    loop = command.loop(
        _model(model, vehicle, None),
        _assignments(changes, "--set"),
        command.Choice(controller, yaw_rate_gain, washout, delay, period),
    )
    if parameter is None:
        command.only_with_parameter({"--from": first, "--to": last, "--speed": speed})
        locus, found = command.speed_locus(loop, (lowest, highest), points, radius, cant)
    else:
        locus, found = command.parameter_locus(
            loop, parameter, (first, last), points, speed, radius, cant
        )
    _report(found, plot, as_json)
    if damping_plot:
        _save(locus.plot_damping(), damping_plot, as_json)


@app.command()
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
        _model(model, vehicle, None),
        _assignments(changes, "--set"),
        command.Choice(controller, yaw_rate_gain, washout, delay, period),
    )
    found = command.margins(loop, speed, radius, cant)
    _report(found, plot, as_json)


@app.command()
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

    built = _model(model, vehicle, changes)
    show = not as_json and err.is_terminal
    if chart is not None:
        found = command.hunting_map(built, chart, radius, cant, show)
    else:
        found = command.branch(built, radius, cant, (lowest, highest), points, state, simulated, show)
    _report(found, plot, as_json)


@app.command("map")
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
        _model(model, vehicle, None),
        _assignments(changes, "--set"),
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
    _report(found, plot, as_json)


@app.command()
def simulate(
    speed: Annotated[float, typer.Option("--speed", "-s", help="Forward speed, m/s.")],
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    radius: RadiusOption = math.inf,
    cant: CantOption = 0.0,
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

    built = _model(model, vehicle, changes)
    names = show or [built.state_names[0]]
    railenv.checks.known("state in --show", names, built.state_names)
    response = railenv.simulate(
        built,
        speed=speed,
        radius=radius,
        cant=cant,
        duration=duration,
        perturbation=_assignments(perturb, "--perturb"),
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
        _print_json({"model": built.name, "speed": speed, "duration": duration, "states": summary})
    else:
        shown = Table(title=f"{built.name} at {speed:g} m/s for {duration:g} s, SI units")
        for title in ("state", "final", "amplitude, first half", "amplitude, second half"):
            shown.add_column(title, justify="right")
        for name, values in summary.items():
            shown.add_row(name, *(f"{value:.6g}" for value in values.values()))
        out.print(shown)
    if plot:
        from design.plots import plot_response

        _save(plot_response(response, names), plot, as_json)


@app.command()
def evaluate(
    controllers: Annotated[
        list[str] | None,
        typer.Argument(help="Shipped controllers or files; all shipped ones when left out."),
    ] = None,
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    changes: SetOption = None,
    quick: Annotated[bool, typer.Option("--quick", help="Tangent track and one curve only.")] = False,
    store: Annotated[
        Path | None, typer.Option(help="JSON file to keep evaluations in, and to go on from.")
    ] = None,
    leaderboard: Annotated[bool, typer.Option("--leaderboard", help="Print a Markdown table.")] = False,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Measure how fast a vehicle runs with each controller: linear, nonlinear, robust, on curves."""
    import agents
    from railenv import cli_evaluate

    names = controllers or agents.shipped_names()
    built = _model(model, vehicle, changes)
    quiet = as_json or leaderboard
    done = cli_evaluate.evaluate(names, built, quick=quick, store=store, show_progress=not quiet)
    if as_json:
        _print_json([evaluation.summary() for evaluation in done])
    elif leaderboard:
        from agents.leaderboard import markdown

        print(markdown(done), end="")
    else:
        out.print(cli_evaluate.table(done))
    if plot:
        from agents.plots import plot_comparison

        _save(plot_comparison(done), plot, as_json)


@app.command()
def tune(
    kind: Annotated[str, typer.Argument(help="passive, yaw-rate, lqg, output-feedback, lqr, ...")],
    file: Annotated[Path, typer.Option("--out", help="File to write the controller to (npz).")],
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    changes: SetOption = None,
) -> None:
    """Design and tune a controller for a vehicle, as the shipped ones were for the coach."""
    from railenv import cli_evaluate

    cli_evaluate.tune(kind, _model(model, vehicle, changes), file, out)


@app.command()
def reproduce(
    directory: Annotated[Path, typer.Option("--out", help="Directory to write to.")] = Path("results"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Coarse bifurcation diagrams and limit cycles; two minutes.")
    ] = False,
    first_page: Annotated[
        bool,
        typer.Option("--first-page", help="Only the claims that take seconds, and critical speeds."),
    ] = False,
    jobs: Annotated[
        int | None, typer.Option("--jobs", "-j", min=1, help="Processes; as many as processors.")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Forget what was computed before; otherwise it is kept.")
    ] = False,
) -> None:
    """Compute every result of the paper again and write them, beside its claims, to report.html."""
    from design.reproduction import Interrupted
    from railenv import cli_reproduce as command

    try:
        command.run(directory, out, err, quick=quick, first=first_page, fresh=fresh, jobs=jobs)
    except Interrupted as stopped:
        err.print(str(stopped), highlight=False, soft_wrap=True)
        raise typer.Exit(130) from None


app.command()(cli_train.train)


if __name__ == "__main__":
    main()
