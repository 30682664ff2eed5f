"""``railenv bifurcation``: branches of limit cycles, curves over two parameters, maps of hunting."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
import typer
from rich import box
from rich.table import Table

from railenv import checks
from railenv.cli.common import Found, err, model_of, report
from railenv.cli.options import (
    CurveOptions,
    JsonOption,
    PlotOption,
    SetOption,
    VehicleOptions,
    with_groups,
)
from railenv.errors import ParameterError
from railenv.models import Model

_ROWS = 20
_PASSAGES = 11  # values of a parameter at which curves are listed
_RANGE = 0.3, 2.0  # times the Hopf point's speed: where curves are followed
_BELOW = 0.97  # times the lowest speed of the branch: where simulations start


@with_groups
def bifurcation(
    *,
    plant: VehicleOptions,
    curve: CurveOptions,
    lowest: Annotated[
        float | None, typer.Option(help="Lowest speed, m/s; 3, or near the fold to simulate.")
    ] = None,
    highest: Annotated[
        float | None, typer.Option(help="Highest speed, m/s; 1.2 times the Hopf point's if left out.")
    ] = None,
    points: Annotated[int, typer.Option(min=2, help="Largest number of points of the branch.")] = 150,
    every: Annotated[
        bool,
        typer.Option(
            "--all", help="Every branch: of all Hopf points, those that leave others, isolated ones."
        ),
    ] = False,
    chart: Annotated[
        str | None,
        typer.Option(
            "--map",
            help="Linear and nonlinear critical speeds over a parameter, such as conicity=0.03:0.1:8.",
        ),
    ] = None,
    curve_over: Annotated[
        str | None,
        typer.Option(
            "--curve",
            help="Curves of Hopf points and folds over a parameter, such as conicity=0.03:0.2.",
        ),
    ] = None,
    simulated: Annotated[
        int,
        typer.Option(min=0, help="Simulate too, at this many speeds, from a small and a large start."),
    ] = 0,
    state: Annotated[
        str | None, typer.Option(help="State to report and draw; by default the first.")
    ] = None,
    changes: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Follow limit cycles from the Hopf point through their fold, or all branches; or map hunting."""
    built = model_of(plant, changes)
    show = not as_json and err.is_terminal
    if every and (chart is not None or curve_over is not None or simulated):
        raise ParameterError("--all cannot be combined with --map, --curve or --simulated")
    if curve_over is not None and (chart is not None or simulated):
        raise ParameterError("--curve cannot be combined with --map or --simulated")
    if every:
        found = diagram(built, curve.radius, curve.cant, (lowest, highest), points, state, show)
    elif curve_over is not None:
        found = curves(built, curve_over, curve.radius, curve.cant, (lowest, highest), show)
    elif chart is not None:
        found = hunting_map(built, chart, curve.radius, curve.cant, show)
    else:
        found = branch(
            built, curve.radius, curve.cant, (lowest, highest), points, state, simulated, show
        )
    report(found, plot, as_json)


def branch(
    model: Model,
    radius: float,
    cant: float,
    speeds: tuple[float | None, float | None],
    points: int,
    state: str | None,
    simulated: int,
    progress: bool,
) -> Found:
    """Follow the branch from the Hopf point; on request, simulate at some speeds as well."""
    import design
    from design.cycles.branch import ABOVE_HOPF
    from design.stability.critical_speed import SPEED_RANGE

    name = model.state_names[0] if state is None else state
    checks.known("state in --state", [name], model.state_names)
    hopf = design.critical_speed(model, radius=radius, cant=cant)
    low = SPEED_RANGE[0] if speeds[0] is None else speeds[0]
    high = ABOVE_HOPF * (hopf.speed or SPEED_RANGE[1]) if speeds[1] is None else speeds[1]
    found = design.cycle_branch(
        model, start=hopf, parameter_range=(low, high), points=points, progress=progress
    )
    summary = {**found.summary(), "hopf": hopf.summary()}
    shown: list[Any] = [f"{model.name}: {hopf}", *(str(s) for s in found.special)]
    shown += [_cycles(found, name), f"ended: {found.ended}"]
    diagram: Any = None
    if simulated:
        start = _BELOW * float(found.speed.min()) if speeds[0] is None else low
        grid = np.linspace(start, high, simulated)
        diagram = design.simulated_diagram(model, grid, radii=[radius], cant=cant, progress=progress)
        amplitude = diagram.amplitude[name][0]
        summary["simulated"] = {"speed": grid.tolist(), name: _plain(amplitude)}
        shown.append(_simulated(grid, amplitude, name))

    def draw() -> Any:
        drawn = found.plot(name)
        if diagram is None:
            return drawn
        return diagram.plot(name, ax=np.ravel(drawn.axes)[0])

    return Found(summary, shown, draw)


def diagram(
    model: Model,
    radius: float,
    cant: float,
    speeds: tuple[float | None, float | None],
    points: int,
    state: str | None,
    progress: bool,
) -> Found:
    """Find all branches over a range of speed."""
    import design
    from design.cycles.branch import ABOVE_HOPF
    from design.stability.critical_speed import SPEED_RANGE

    low = SPEED_RANGE[0] if speeds[0] is None else speeds[0]
    high = speeds[1]
    if high is None:
        hopf = design.critical_speed(model, radius=radius, cant=cant)
        high = ABOVE_HOPF * (hopf.speed or SPEED_RANGE[1])
    found = design.bifurcation_diagram(
        model,
        radius=radius,
        cant=cant,
        speed_range=(low, high),
        points=points,
        progress=progress,
    )
    return Found(found.summary(), str(found).splitlines(), lambda: found.plot(state))


def curves(
    model: Model,
    text: str,
    radius: float,
    cant: float,
    speeds: tuple[float | None, float | None],
    progress: bool,
) -> Found:
    """Follow Hopf points, and folds of limit cycles, over a parameter given as name=low:high."""
    import design

    name, limits = _interval(text)
    hopf = design.critical_speed(model, radius=radius, cant=cant)
    speed = hopf.speed or 0.0
    low, high = (
        given if given is not None else part * speed for given, part in zip(speeds, _RANGE, strict=True)
    )
    plane = {name: limits, "speed": (low, high)}
    found = [design.bifurcation_curve(model, hopf, plane, progress=progress)]
    branch = design.cycle_branch(model, start=hopf, parameter_range=(low, high), progress=progress)
    if branch.folds:
        lowest = min(branch.folds, key=lambda fold: fold.value)
        found.append(design.bifurcation_curve(model, lowest, plane, progress=progress))
    table = Table(title=f"{model.name}: speeds in m/s", box=box.SIMPLE)
    for title in (name, *(c.kind for c in found)):
        table.add_column(title, justify="right")
    for value in np.linspace(*limits, _PASSAGES):
        passages = [", ".join(f"{v:.3f}" for v in sorted(c.at(name, value))) or "none" for c in found]
        table.add_row(f"{value:.5g}", *passages)
    shown: list[Any] = [f"{model.name}: {hopf}", table]
    for c in found:
        shown += [f"{c.kind}: {s}" for s in c.special]
        shown.append(f"{c.kind} ended: {'; '.join(dict.fromkeys(c.ended))}")

    def draw() -> Any:
        drawn = found[0].plot()
        for c in found[1:]:
            drawn = c.plot(ax=np.ravel(drawn.axes)[0])
        return drawn

    return Found({"curves": [c.summary() for c in found]}, shown, draw)


def _interval(text: str) -> tuple[str, tuple[float, float]]:
    name, equals, limits = text.partition("=")
    try:
        low, high = (float(part) for part in limits.split(":"))
    except ValueError:
        equals = ""
    if not equals:
        raise ParameterError(f"--curve is {text!r}; it must be name=low:high, as conicity=0.03:0.2")
    return name.strip(), (low, high)


def hunting_map(model: Model, text: str, radius: float, cant: float, progress: bool) -> Found:
    """Find both critical speeds over a parameter given as name=low:high:count."""
    import design

    name, values = _grid(text)
    found = design.hunting_map(model, name, values, radius=radius, cant=cant, progress=progress)
    table = Table(title=f"{model.name}: speeds in m/s", box=box.SIMPLE)
    for title in (name, "never hunts below", "resting on", "must hunt above (Hopf)", ""):
        table.add_column(title, justify="right")
    rows = zip(found.value, found.onset_speed, found.onsets, found.hopf_speed, found.notes, strict=True)
    for value, speed, onset, hopf, note in rows:
        rests_on = "" if onset is None else onset.rests_on
        table.add_row(f"{value:.5g}", _speed(speed), rests_on, _speed(hopf), note)
    return Found(found.summary(), [table, *([found.ended] if found.ended else [])], found.plot)


def _grid(text: str) -> tuple[str, Any]:
    name, equals, limits = text.partition("=")
    parts = limits.split(":")
    try:
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (IndexError, ValueError):
        count = 0
    if not equals or len(parts) != 3 or count < 1:
        raise ParameterError(
            f"--map is {text!r}; it must be name=low:high:count, as radius=3000:9000:7"
        )
    return name.strip(), np.linspace(low, high, count)


def _cycles(found: Any, name: str) -> Table:
    unit = 1e3 if name.startswith(("y_", "z_", "phi_", "psi_")) else 1.0
    table = Table(title=str(found), box=box.SIMPLE)
    for title in ("speed (m/s)", "amplitude" + (" (mm, mrad)" if unit > 1 else ""), "frequency (Hz)"):
        table.add_column(title, justify="right")
    table.add_column("largest multiplier", justify="right")
    table.add_column("")
    amplitude = unit * found.amplitude[name]
    for i in np.unique(np.linspace(0, len(found) - 1, min(_ROWS, len(found))).astype(int)):
        cycle = found.cycles[i]
        table.add_row(
            f"{cycle.speed:.3f}",
            f"{amplitude[i]:.4f}",
            f"{cycle.frequency:.4f}",
            f"{abs(cycle.multipliers[0]):.4f}" if cycle.multipliers.size else "",
            "stable" if cycle.stable else "unstable",
        )
    return table


def _simulated(speeds: Any, amplitude: Any, name: str) -> Table:
    table = Table(title=f"simulated amplitude of {name} after 20 s, SI units", box=box.SIMPLE)
    for title in ("speed (m/s)", "small start", "large start"):
        table.add_column(title, justify="right")
    for speed, (small, large) in zip(speeds, amplitude, strict=True):
        table.add_row(f"{speed:.3f}", f"{small:.4g}", f"{large:.4g}")
    return table


def _plain(values: Any) -> list[list[float | None]]:
    return [[None if math.isnan(v) else float(v) for v in row] for row in values]


def _speed(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.3f}"
