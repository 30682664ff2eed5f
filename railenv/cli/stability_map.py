"""``railenv map``: stability over two parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer
from rich import box
from rich.table import Table

from railenv.cli import loops
from railenv.cli.common import Found, err, report
from railenv.cli.options import (
    ControllerOption,
    ControlOptions,
    CurveOptions,
    JsonOption,
    PlotOption,
    SetOption,
    VehicleOptions,
    with_groups,
)
from railenv.errors import ParameterError
from railenv.models import Model

_ROWS, _COLUMNS = 16, 6  # of the table that is shown


@with_groups
def stability_map(
    *,
    x: Annotated[
        str,
        typer.Option(
            "--x", help="First parameter, such as radius:500:20000:40:log or radius:500,1000,inf."
        ),
    ],
    y: Annotated[str, typer.Option("--y", help="Second parameter, such as conicity:0.05:0.4:40.")],
    plant: VehicleOptions,
    quantity: Annotated[
        Literal["critical-speed", "damping", "growth"], typer.Option(help="What to map.")
    ] = "critical-speed",
    speed: Annotated[
        float | None, typer.Option("--speed", "-s", help="Speed for damping and growth, m/s.")
    ] = None,
    curve: CurveOptions,
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
    loop = loops.loop(plant, changes, ControlOptions(controller))
    found = _mapped(
        loop.model,
        loop.controller,
        (x, y),
        quantity=quantity,
        speed=speed,
        radius=curve.radius,
        cant=curve.cant,
        store=store,
        n_jobs=jobs,
        progress=not as_json and err.is_terminal,
    )
    report(found, plot, as_json)


def _mapped(
    model: Model,
    controller: Any | None,
    texts: tuple[str, str],
    *,
    quantity: str,
    speed: float | None,
    radius: float,
    cant: float,
    store: Path | None,
    n_jobs: int,
    progress: bool,
) -> Found:
    """Map a quantity over two parameters given as texts."""
    import design

    (x, first), (y, second) = (
        _axis(text, option) for text, option in zip(texts, ("--x", "--y"), strict=True)
    )
    if x == y:
        raise ParameterError(f"--x and --y are both {x}; a map needs two parameters")
    chosen: Any = quantity.replace("-", "_")
    found = design.stability_map(
        model,
        {x: first, y: second},
        quantity=chosen,
        speed=speed,
        radius=radius,
        cant=cant,
        controller=controller,
        store=store,
        n_jobs=n_jobs,
        progress=progress,
    )
    shown: list[Any] = [str(found), _table(found)]
    missing = int((found.notes != "").sum())
    if missing:
        shown.append(f"{missing} cells without a result, such as: {found.notes[found.notes != ''][0]}")
    if found.ended:
        shown.append(found.ended)
    return Found(found.summary(), shown, found.plot)


def _axis(text: str, option: str) -> tuple[str, Any]:
    """Return name and values of a text such as radius:500:20000:40:log or radius:500,1000,inf."""
    name, colon, rest = text.partition(":")
    parts = rest.split(":")
    try:
        if "," in rest:
            return name.strip(), np.array([float(part) for part in rest.split(",")])
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
        logarithmic = len(parts) == 4 and parts[3] == "log"
        if not colon or count < 2 or not (len(parts) == 3 or logarithmic):
            raise ValueError
        if logarithmic and not (low > 0.0 and high > 0.0):
            raise ParameterError(f"{option} is {text!r}; a logarithmic axis needs limits above 0")
    except ParameterError:
        raise
    except (IndexError, ValueError):
        raise ParameterError(
            f"{option} is {text!r}; it must be name:low:high:count, with :log for logarithmic spacing, "
            "or name:value,value,..., and have two values or more"
        ) from None
    space = np.geomspace if logarithmic else np.linspace
    return name.strip(), space(low, high, count)


def _table(found: Any) -> Table:
    """Return some rows and columns of the map."""
    first, second = found.axes
    table = Table(title=f"{found.quantity.replace('_', ' ')}; across: {first.name}", box=box.SIMPLE)
    columns = _spread(first.values.size, _COLUMNS)
    table.add_column(second.name, justify="right")
    for i in columns:
        table.add_column(f"{first.values[i]:.4g}", justify="right")
    for j in _spread(second.values.size, _ROWS)[::-1]:
        cells = (found.value[i, j] for i in columns)
        table.add_row(f"{second.values[j]:.4g}", *("" if np.isnan(v) else f"{v:.4g}" for v in cells))
    return table


def _spread(size: int, most: int) -> list[int]:
    return sorted(set(np.linspace(0, size - 1, min(size, most)).astype(int).tolist()))
