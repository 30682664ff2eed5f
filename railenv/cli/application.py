"""The command line: ``railenv --help``."""

from __future__ import annotations

import importlib.util
import warnings
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

import railenv
from railenv.cli import (
    bifurcation,
    contact,
    critical_speed,
    evaluate,
    explore,
    locus,
    margins,
    modes,
    reproduce,
    simulate,
    stability_map,
    train,
    train_through,
    tune,
    vehicles,
    warm,
)
from railenv.cli.common import err, out
from railenv.errors import RailenvError
from railenv.terminals import replace_what_cannot_be_shown

app = typer.Typer(
    help="Hunting of railway bogies on curved track: models, stability and simulation.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

app.command()(vehicles.vehicles)
app.command("critical-speed")(critical_speed.critical_speed)
app.command()(locus.locus)
app.command()(modes.modes)
app.command()(margins.margins)
app.command()(bifurcation.bifurcation)
app.command("map")(stability_map.stability_map)
app.command()(simulate.simulate)
app.command()(evaluate.evaluate)
app.command()(tune.tune)
app.command()(reproduce.reproduce)
app.command()(train.train)
app.command("train-through")(train_through.train_through)
app.command()(contact.contact)
app.command()(explore.explore)
app.command()(warm.warm)


def main() -> None:
    """Run the command line; errors of the package print as one line, with exit status 1."""
    replace_what_cannot_be_shown()
    # joblib replaces worker processes that compiling has made large, and loses nothing
    warnings.filterwarnings("ignore", "A worker stopped while some jobs were given", UserWarning)
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
            err.print(f"[yellow]warning:[/] {escape(problem)}", highlight=False, soft_wrap=True)


def foreign_package(name: str) -> str | None:
    """Describe the problem if Python finds another package under a name of this distribution."""
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
