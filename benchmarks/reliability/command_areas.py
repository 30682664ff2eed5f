"""Fuzzed: the command line. It ends with status 0 and finite numbers, or with 1 or 2 and a message."""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import matplotlib as mpl
import matplotlib.pyplot as plt
from hypothesis import strategies as st
from rich.console import Console

import railenv
from benchmarks.reliability.fuzz import Area
from benchmarks.reliability.values import rarely
from railenv.cli import application
from railenv.errors import RailenvError

_FOLDER = Path(tempfile.mkdtemp(prefix="railenv-fuzz-"))

FAILED, WRONG_USE = 1, 2
"""Exit statuses: an error of the package, a wrong use of options."""


class CommandFailedError(RailenvError):
    """A command said what is wrong, in one line, and ended with status 1."""


class WrongUseError(RailenvError):
    """A command said how its options are used, and ended with status 2."""


@contextlib.contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def call(arguments: list[str]) -> tuple[int, str, str]:
    """Run the command line in this process; returns exit status, output and errors."""
    out, err = io.StringIO(), io.StringIO()
    status: Any = 0
    with (
        mock.patch.object(sys, "argv", ["railenv", *arguments]),
        mock.patch.object(application, "out", Console(file=out, width=100)),
        mock.patch.object(application, "err", Console(file=err, width=100)),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        _inside(_FOLDER),
    ):
        try:
            application.main()
        except SystemExit as end:
            status = end.code
    plt.close("all")
    return int(status or 0), out.getvalue(), err.getvalue()


def _command(arguments: list[str]) -> None:
    status, out, err = call(arguments)
    assert "Traceback" not in out + err
    assert status in (0, FAILED, WRONG_USE), status
    if status == 0:
        assert out.strip()
        if "--json" in arguments and not {"--help", "-h", "--version"} & set(arguments):
            json.loads(out, parse_constant=_refuse)
        return
    assert (err + out).strip(), "it failed and said nothing"
    if status == FAILED:
        lines = err.strip().splitlines()
        assert lines[-1].startswith("error: "), lines
        assert not any(line.startswith("error: ") for line in lines[:-1])
        raise CommandFailedError(lines[-1])
    raise WrongUseError((err + out).splitlines()[-1])


def _refuse(name: str) -> None:
    raise AssertionError(f"{name} in the output")


# ------------------------------------------------------------------------------- arguments

_ODD = st.sampled_from(
    [
        "",
        "nan",
        "inf",
        "-inf",
        "0",
        "-1",
        "1e300",
        "1e-300",
        "abc",
        "1,5",
        "--",
        "é\n",
        "[red]",
        "[/]",
        "3 4",
        "1e999",
    ]
)


def _number(low: float, high: float) -> st.SearchStrategy[str]:
    return rarely(st.floats(low, high).map(repr), _ODD)


_ASSIGNED = rarely(
    st.tuples(
        rarely(st.sampled_from(["conicity", "friction", "body_mass", "creep_factor"]), _ODD),
        _number(0.02, 0.5),
    ).map("=".join),
    _ODD,
)
_VEHICLES = rarely(
    st.sampled_from(["TABLE_1", "HIGH_SPEED_COACH", "mine.toml"]),
    st.sampled_from(["TABLE_2", "absent.toml", "broken.toml", "", "."]),
)
_COMMON: dict[str, st.SearchStrategy[str] | None] = {
    "--vehicle": _VEHICLES,
    "--radius": _number(300.0, 1e4),
    "--cant": _number(0.0, 0.1),
    "--set": _ASSIGNED,
    "--json": None,
    "--modle": _ODD,
}
_MODEL = {"--model": rarely(st.sampled_from(["bogie", "dual-wheelset", "cooperrider"]), _ODD)}
_CONTROLLER = {
    "--controller": rarely(st.sampled_from(["yaw-rate", "output-feedback"]), _ODD),
    "--yaw-rate-gain": _number(0.0, 1e6),
    "--washout": _number(0.1, 3.0),
    "--delay": _number(0.0, 0.03),
    "--period": _number(0.002, 0.02),
}
_PLOT = {"--plot": st.sampled_from(["picture.svg", "picture.xyz", "no/such/folder.png", ""])}
_AXIS = st.sampled_from(
    [
        "conicity:0.05:0.2:2",
        "friction:0.2,0.3",
        "cant:0:0.1:2",
        "speed:20:40:2",
        "radius:500,inf",
        "radius:500:900:2:log",
    ]
)
_COMMANDS: dict[str, dict[str, st.SearchStrategy[str] | None]] = {
    "vehicles": {"--toml": None, "--markdown": None, "--json": None, "": _VEHICLES},
    "critical-speed": {
        **_COMMON,
        **_MODEL,
        **_PLOT,
        "--lowest": _number(3.0, 20.0),
        "--highest": _number(20.0, 200.0),
    },
    "locus": {
        **_COMMON,
        **_MODEL,
        **_CONTROLLER,
        **_PLOT,
        "--lowest": _number(5.0, 20.0),
        "--highest": _number(30.0, 90.0),
        "--points": rarely(st.integers(2, 4).map(str), _ODD),
        "--parameter": rarely(st.sampled_from(["conicity", "gain", "delay"]), _ODD),
        "--from": _number(0.02, 0.1),
        "--to": _number(0.1, 0.5),
        "--speed": _number(10.0, 90.0),
    },
    "margins": {**_COMMON, **_CONTROLLER, "--speed": _number(20.0, 120.0)},
    "simulate": {
        **_COMMON,
        **_MODEL,
        **_PLOT,
        "--speed": _number(5.0, 150.0),
        "--duration": _number(0.01, 0.1),
        "--perturb": rarely(st.just("y_w1=0.001"), _ASSIGNED),
        "--step": _number(1e-4, 2e-3),
        "--show": rarely(st.just("y_w1"), _ODD),
        "--csv": st.sampled_from(["out.csv", "no/such/out.csv", "."]),
        "--irregularity": rarely(st.sampled_from(["low", "high"]), _ODD),
        "--irregularity-unit": rarely(st.sampled_from(["m", "mm"]), _ODD),
        "--irregularity-factor": _number(0.0, 2.0),
        "--straight": _number(0.0, 50.0),
        "--transition": _number(10.0, 100.0),
        "--curve": _number(10.0, 100.0),
    },
    "map": {
        **_COMMON,
        "--x": rarely(_AXIS, _ODD),
        "--y": rarely(_AXIS, st.text(":,.0123abc", max_size=12)),
        "--quantity": rarely(st.sampled_from(["damping", "growth"]), _ODD),
        "--speed": _number(20.0, 60.0),
        "--store": st.sampled_from(["store.jsonl", "no/such/store.jsonl", "."]),
    },
    "bifurcation": {
        **_COMMON,
        "--state": _ODD,
        "--points": _ODD,
        "--map": rarely(
            st.sampled_from(["conicity:1:2:3", "conicity=a:b:c", "conicity=0.1:0.2:0"]), _ODD
        ),
        "--simulated": st.sampled_from(["-1", "x"]),
    },
    "train": {
        "": rarely(st.sampled_from(["ppo", "sac", "td3"]), _ODD),
        "--set": rarely(
            st.sampled_from(["env_kwargs.duration=2", "seed=3", "n_envs=0", "x.y=1"]), _ODD
        ),
        "--config": st.sampled_from(["mine.toml", "absent.yml", "."]),
        "--steps": _number(1.0, 9.0),
        "--seed": rarely(st.integers(-1, 9).map(str), _ODD),
        "--base": st.sampled_from(["absent.npz", "mine.toml"]),
    },
    "evaluate": {"": st.sampled_from(["absent", "mine.toml", "."]), "--quick": None, **_MODEL},
    "tune": {"": _ODD, "--out": st.just("x.npz"), **_MODEL},
    "reproduce": {"--jobs": st.sampled_from(["0", "-1", "x"]), "--out": st.just("mine.toml")},
    "": {"--version": None, "--nonsense": None, "nonsense": None},
}
_ALWAYS = {
    "margins": ["--speed", "60", "--yaw-rate-gain", "1e5"],
    "map": ["--x", "conicity:0.05:0.2:2", "--y", "friction:0.2,0.3", "--jobs", "1"],
    "simulate": ["--speed", "60"],
    "bifurcation": ["--points", "1"],  # one of many is wrong: the right ones take long
    "train": ["ppo", "--show"],
    "evaluate": ["absent"],
    "tune": ["nothing", "--out", "x.npz"],
    "reproduce": ["--jobs", "0"],
}


@st.composite
def _arguments(draw: Any) -> list[str]:
    """Draw a command with some of its options, mostly right ones."""
    (_FOLDER / "mine.toml").write_text(railenv.TABLE_1.to_toml(), encoding="utf-8")
    (_FOLDER / "broken.toml").write_text("conicity = [", encoding="utf-8")
    (_FOLDER / "store.jsonl").unlink(missing_ok=True)
    command = draw(st.sampled_from([*_COMMANDS, "critical-speed", "locus", "simulate"]))
    options = _COMMANDS[command]
    arguments = [command] if command else []
    if draw(st.integers(0, 9)):
        arguments += _ALWAYS.get(command, [])
    for name in draw(st.lists(st.sampled_from(list(options)), max_size=4)):
        value = options[name]
        text = [] if value is None else [draw(value)]
        arguments += [*([name] if name else []), *text]
    if draw(st.integers(0, 19)) == 19:
        arguments.append(draw(st.sampled_from(["--help", "-h", "--json", "surplus"])))
    if command == "train" and "--show" not in arguments:
        arguments.append("--show")
    if command in ("evaluate", "tune", "reproduce", "bifurcation"):  # never what takes minutes
        arguments += ["--set", "nonsense=1"] if command != "reproduce" else ["--jobs", "0"]
    return arguments


mpl.use("Agg")

AREAS = (Area("command line", _arguments(), _command, 2500, quick=40),)
