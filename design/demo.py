"""The demonstration: what the package is for, in under a minute, on paper and on the terminal."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from rich import box
from rich.console import Console
from rich.progress import Progress, TaskID
from rich.table import Table

import railenv
from design.critical_speed import CriticalSpeed, critical_speed
from design.locus import speed_locus
from design.plots import SERIES, STABLE, UNSTABLE, loss_handles, plot_response, style
from design.sweep import CurveSweep, curve_sweep

CANT = 0.0873
"""rad, the paper's cant: 131 mm over a base of 1.5 m."""

RADII = np.geomspace(250.0, 10_000.0, 25)
"""m, the range of the paper's Fig 5."""

_VEHICLES = (railenv.TABLE_1, railenv.HIGH_SPEED_COACH)
_MODELS: tuple[type[railenv.Bogie] | type[railenv.DualWheelset], ...] = (
    railenv.Bogie,
    railenv.DualWheelset,
)
_TABLE_RADII = (10_000.0, 6250.0, 1000.0, 250.0)
_TITLE = "Speed at which steady running ends, m/s"
_HEADINGS = ("radius of curve", "tangent", *(f"{r:g} m" for r in _TABLE_RADII))
_CAPTION = (
    f"cant {CANT} rad on curves; f: the equilibrium on the tread ends in a fold, "
    "w: it ends where a wheel lifts, otherwise by hunting"
)
_STEPS = 2 * len(_VEHICLES) * len(_MODELS) + 3


@dataclass(frozen=True)
class Case:
    """One model of one vehicle, its critical speed on tangent track and its sweep over curves."""

    model: railenv.Bogie | railenv.DualWheelset
    tangent: CriticalSpeed
    sweep: CurveSweep


def run(directory: Path, console: Console) -> list[Path]:
    """Write the demonstration's figures and data into a directory; returns the files written."""
    directory.mkdir(parents=True, exist_ok=True)
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("critical speeds", total=_STEPS)
        cases = _cases(progress, task)
        coach = cases[1]
        files = [*_sweep_files(directory, cases)]
        progress.update(task, advance=1, description="speed locus")
        files += _locus_files(directory, coach)
        progress.update(task, advance=1, description="time histories")
        files += _history_files(directory, coach)
        progress.update(task, advance=1)
    rows = _rows(cases)
    console.print(_table(rows))
    return [*files, _markdown(directory / "critical_speeds.md", rows)]


def _cases(progress: Progress, task: TaskID) -> list[Case]:
    cases = []
    for model_type in _MODELS:
        for vehicle in _VEHICLES:
            model = model_type(vehicle)
            label = f"{model_type.__name__} of {vehicle.name}"
            progress.update(task, description=f"{label}: compiling (once) and tangent track")
            tangent = critical_speed(model)
            progress.update(task, advance=1, description=f"{label}: curves")
            sweep = curve_sweep(model, RADII, cant=CANT)
            progress.update(task, advance=1)
            cases.append(Case(model, tangent, sweep))
    return cases


def _rows(cases: Sequence[Case]) -> list[list[str]]:
    rows = []
    for case in cases:
        found = [
            case.tangent,
            *(critical_speed(case.model, radius=r, cant=CANT) for r in _TABLE_RADII),
        ]
        rows.append([f"{case.model.vehicle.name} {case.model.name}", *map(_brief, found)])
    return rows


def _table(rows: Sequence[Sequence[str]]) -> Table:
    table = Table(title=_TITLE, box=box.SIMPLE, padding=(0, 1), pad_edge=False)
    for i, heading in enumerate(_HEADINGS):
        table.add_column(heading, justify="right" if i else "left", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    table.caption = _CAPTION
    return table


def _markdown(path: Path, rows: Sequence[Sequence[str]]) -> Path:
    lines = [
        f"| {' | '.join(_HEADINGS)} |",
        f"|---|{'---:|' * (len(_HEADINGS) - 1)}",
        *(f"| {' | '.join(row)} |" for row in rows),
        "",
        f"{_TITLE}; {_CAPTION}.",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _brief(found: CriticalSpeed) -> str:
    if found.speed is None:
        return f"> {found.speed_range[1]:g}" if found.loss == "none" else found.loss
    mark = {"fold": " f", "end": " w"}.get(found.loss, "")
    return f"{found.speed:.1f}{mark}"


def _sweep_files(directory: Path, cases: Sequence[Case]) -> list[Path]:
    with style():
        figure, axes = plt.subplots(1, 2, figsize=(11.0, 4.6))
        for ax, model_type, title in zip(axes, _MODELS, ("bogie", "dual wheelset"), strict=True):
            chosen = [case for case in cases if type(case.model) is model_type]
            for case, color in zip(chosen, SERIES, strict=False):
                case.sweep.plot(ax, case.model.vehicle.name, color)
            deficient = np.sqrt(RADII * 9.81 * (CANT + 0.150 / 1.5))
            ax.plot(RADII, deficient, ":", color="#333333", lw=1.2, label="cant deficiency 150 mm")
            ax.set_title(f"{title}, cant {CANT} rad")
            ax.set_ylim(0.0, 430.0 if model_type is railenv.DualWheelset else 150.0)
            ax.get_legend().remove()
        losses = {str(r.loss) for case in cases for r in case.sweep.results}
        curves = axes[0].get_legend_handles_labels()[0]
        figure.legend(handles=[*curves, *loss_handles(losses)], loc="outside lower center", ncols=4)
        rows = [
            (
                case.model.name,
                case.model.vehicle.name,
                radius,
                r.speed,
                r.frequency,
                r.loss,
            )
            for case in cases
            for radius, r in zip(case.sweep.radius, case.sweep.results, strict=True)
        ]
        header = ("model", "vehicle", "radius_m", "critical_speed_m_per_s", "frequency_hz", "loss")
        return [
            _figure(figure, directory / "critical_speed_over_radius.png"),
            _csv(directory / "critical_speed_over_radius.csv", header, rows),
            _json(directory / "critical_speed_tangent.json", cases),
        ]


def _locus_files(directory: Path, case: Case) -> list[Path]:
    locus = speed_locus(case.model, np.linspace(5.0, 200.0, 118))
    drawn = locus.plot()
    modes = range(locus.loci.shape[1])
    header = ("speed_m_per_s", *(f"{part}_{k}" for k in modes for part in ("re", "im")))
    rows = [
        (v, *(part for value in values for part in (value.real, value.imag)))
        for v, values in zip(locus.speeds, locus.loci, strict=True)
    ]
    return [
        _figure(drawn.figure, directory / "speed_locus.png"),
        _csv(directory / "speed_locus.csv", header, rows),
    ]


def _history_files(directory: Path, case: Case) -> list[Path]:
    assert case.tangent.speed is not None
    with style():
        figure, axes = plt.subplots(2, 1, figsize=(8.0, 5.2), sharex=True)
        columns: list[Any] = []
        for ax, factor, color in zip(axes, (0.98, 1.02), (STABLE, UNSTABLE), strict=True):
            speed = factor * case.tangent.speed
            response = railenv.simulate(
                case.model,
                speed=speed,
                perturbation={"y_w1": 5e-4, "y_w2": 5e-4, "y_b": 5e-4},
                duration=20.0,
            )
            plot_response(response, ["y_w1"], ax, color=color)
            ax.set_title(f"{case.model.vehicle.name}, {speed:.1f} m/s ({factor:.0%} of critical)")
            columns += [response.time] * (not columns) + [response.outputs[0]]
        axes[0].set_xlabel("")
    header = ("time_s", "y_w1_below_m", "y_w1_above_m")
    return [
        _figure(figure, directory / "time_histories.png"),
        _csv(directory / "time_histories.csv", header, np.column_stack(columns).tolist()),
    ]


def _figure(figure: Any, path: Path) -> Path:
    figure.savefig(path)
    plt.close(figure)
    return path


def _csv(path: Path, header: Sequence[str], rows: Sequence[Sequence[Any]]) -> Path:
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        writer.writerows(rows)
    return path


def _json(path: Path, cases: Sequence[Case]) -> Path:
    data = [
        {"model": c.model.name, "vehicle": c.model.vehicle.name, **c.tangent.summary()} for c in cases
    ]
    path.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
    return path
