"""The section that the report begins with."""

import io
import json
import math

import numpy as np
import pytest
from rich.console import Console

import agents
import design
import railenv
from agents.reproduction import Overview
from agents.reproduction.computations import CASE
from agents.reproduction.overview import survived
from agents.reproduction.words import PASSIVE
from design.reproduction import QUICK, reproduce
from railenv.cli.reproduce import show_overview
from tests.pages import DOCS


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    section = Overview(QUICK)
    directory = tmp_path_factory.mktemp("overview")
    return section, reproduce([section], directory), directory


def test_speeds_are_those_of_the_leaderboard(written):
    section, report, _ = written
    found = {each.name: each for each in section.controlled(report.data)}
    assert set(found) == set(agents.shipped_names())
    for evaluation in agents.load_evaluations(DOCS / "leaderboard.json"):
        reached = found[evaluation.controller].reached
        assert reached == pytest.approx(evaluation.linear, rel=1e-3)
        assert found[evaluation.controller].reads == evaluation.observation


def test_coach_alone_comes_first_then_the_best(written):
    section, report, directory = written
    names = [row[0] for row in section.rows(report.data)]
    assert names[0] == PASSIVE
    reached = [each.reached for each in section.controlled(report.data)[1:]]
    assert reached == sorted(reached, reverse=True)
    assert {p.stem for p in (directory / "figures").glob("*.svg")} == {
        "overview_branch",
        "overview_controllers",
    }
    columns = json.loads((directory / "data" / "overview.json").read_text())
    assert columns["controller"] == names


def test_sentences_have_the_numbers_of_the_branch(written):
    section, report, _ = written
    linear, persists, controlled = section.sentences(report.data)
    branch = section.branch(report.data)
    assert f"hunts from {branch.hopf.speed:.1f} m/s at {branch.hopf.frequency:.2f} Hz" in linear
    assert f"down to {branch.nonlinear_critical_speed:.1f} m/s" in persists
    assert "26 kN m" in controlled


def test_larger_disturbances_than_the_one_survived_grow(written):
    """Started from the unstable limit cycle, made smaller and larger, the motion dies out or hunts."""
    section, report, _ = written
    branch = section.branch(report.data)
    speed = 103.0
    size = survived(branch, speed)
    fresh = design.cycle_branch(CASE.model, parameter_range=(90.0, 115.0))
    cycle = min((c for c in fresh.cycles if not c.stable), key=lambda c: abs(c.speed - speed))
    assert survived(fresh, cycle.speed) == pytest.approx(cycle.amplitudes[0], rel=1e-6)
    assert size == pytest.approx(survived(fresh, speed), rel=0.05)
    rest = railenv.find_equilibrium(CASE.model, speed=cycle.speed).state
    for factor, grows in ((0.9, False), (1.1, True)):
        start = rest + factor * (cycle.states[0] - rest)
        motion = railenv.simulate(
            CASE.model, speed=cycle.speed, radius=math.inf, initial_state=start, duration=12.0
        )
        y = np.asarray(motion.outputs)[0]
        last = np.ptp(y[np.asarray(motion.time) > 10.0]) / 2.0
        assert (last > cycle.amplitudes[0]) == grows


def test_nothing_survives_where_no_cycle_is_unstable(written):
    section, report, _ = written
    with pytest.raises(ValueError, match="unstable limit cycle at 300 m/s"):
        survived(section.branch(report.data), 300.0)


def test_it_is_printed_within_80_columns(written):
    section, report, _ = written
    text = io.StringIO()
    show_overview(section, report.data, Console(width=80, file=text))
    lines = text.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    assert any(line.split()[:2] == ["passive", "sensors"] for line in lines)
