"""The report's section on controllers."""

import dataclasses
import json
import math

import pytest

import agents
import railenv
from agents.evaluation.evaluation import Plan
from agents.evaluation.leaderboard import markdown, push
from agents.reproduction import HopfPush
from design.reproduction import QUICK, reproduce
from railenv.errors import ParameterError
from tests.pages import DOCS

TINY = dataclasses.replace(
    Plan.quick(), speed_range=(20.0, 150.0), curves=((math.inf, 0.0),), ride_duration=2.0, delays=()
)
SETTINGS = dataclasses.replace(QUICK, diagram_speeds=4, diagram_duration=2.0, branch_points=25)
DAMPER = "damper-1"


@pytest.fixture(scope="module")
def controllers():
    coach = railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW)
    damper = agents.YawRateFeedback.design(coach, gain=5e4)
    return {"passive": agents.Passive.design(coach), DAMPER: damper}


@pytest.fixture(scope="module")
def written(controllers, tmp_path_factory):
    section = HopfPush(SETTINGS, TINY, controllers)
    directory = tmp_path_factory.mktemp("report")
    return section, reproduce([section], directory), directory


@pytest.fixture(scope="module")
def stored():
    """The section with evaluations of the stored leaderboard."""
    evaluations = agents.load_evaluations(DOCS / "leaderboard.json")
    section = HopfPush(SETTINGS, evaluations[0].plan)
    data = {f"hopf-push-evaluation-{e.controller}": e.summary() for e in evaluations}
    return section, data


def test_section_shows_what_the_evaluation_finds(written):
    section, report, directory = written
    passive, damped = sorted(section.evaluations(report.data), key=lambda e: e.controller == DAMPER)
    assert passive.linear == pytest.approx(114.2856, rel=1e-4)
    limit_cycles = report.data["branch-tangent-bogie-HIGH_SPEED_COACH_HOLLOW"]["branch"]
    assert passive.nonlinear == pytest.approx(limit_cycles.nonlinear_critical_speed, rel=0.01)
    assert damped.linear > passive.linear + 1.0
    columns = json.loads((directory / "data" / "hopf_push.json").read_text())
    assert columns["controller"] == [e.controller for e in section.evaluations(report.data)]
    assert columns["nonlinear_m_per_s"] == [e.nonlinear for e in section.evaluations(report.data)]
    growth = json.loads((directory / "data" / "growth_rates.json").read_text())
    rates = [
        rate
        for name, v, rate in zip(*growth.values(), strict=True)
        if name == "passive" and abs(v - passive.linear) < 1.0
    ]
    assert all(abs(rate) < 0.1 for rate in rates)
    text = report.path.read_text()
    assert f"{damped.linear - passive.linear:+.1f}" in text
    assert f"<td>{DAMPER}</td>" in text


def test_diagrams_of_loops_have_the_limit_cycles_without_control(written):
    section, report, _ = written
    figures = {d.name: d for d in section.draw(report.data)}
    passive = figures["closed_loop_passive"].figure.axes[0]
    dashed = [line for line in passive.lines if line.get_linestyle() == "--"]
    assert dashed
    other = next(d for name, d in figures.items() if name.startswith("closed_loop") and DAMPER in name)
    assert not [line for line in other.figure.axes[0].lines if line.get_linestyle() == "--"]
    for figure in figures.values():
        ax = figure.figure.axes[0]
        assert ax.get_xlabel().endswith("(m/s)")


def test_pieces_depend_on_the_controller_itself(controllers):
    names = ("passive", DAMPER)
    first, again = (HopfPush(SETTINGS, TINY, controllers) for _ in range(2))
    other = HopfPush(SETTINGS, TINY, dict(zip(names, reversed(controllers.values()), strict=True)))
    keys = [[piece.key for piece in section.pieces()] for section in (first, again, other)]
    assert keys[0] == keys[1]
    changed = [a != b for a, b in zip(keys[0], keys[2], strict=True)]
    assert changed == [True] * 6 + [False]  # the last piece is the vehicle without control


def test_the_passive_vehicle_must_be_there(controllers):
    with pytest.raises(ParameterError, match="'passive' must be among them"):
        HopfPush(SETTINGS, TINY, {"damper": controllers[DAMPER]})


@pytest.mark.parametrize("name", ["a/b", "", "<b>"])
def test_names_that_no_file_can_have_are_refused(controllers, name):
    with pytest.raises(ParameterError, match=r"it must consist of letters"):
        HopfPush(SETTINGS, TINY, {**controllers, name: controllers[DAMPER]})


def test_all_shipped_controllers_are_shown_in_the_order_of_the_leaderboard(stored):
    section, data = stored
    found = section.evaluations(data)
    assert {e.controller for e in found} == set(agents.shipped_names())
    rows = [line.split(" | ")[0] for line in markdown(found).splitlines()[2:]]
    assert rows == [f"| {e.controller}" for e in found]
    text = section.text(data)
    for evaluation in found:
        assert f"<td>{evaluation.controller}</td>" in text


def test_controllers_whose_highest_speed_reads_the_same_are_all_named(stored):
    section, data = stored
    found = section.evaluations(data)
    best = max((e for e in found if e.observation == "sensors"), key=lambda e: e.robust or 0.0)
    alike = {"hopf-push-evaluation-yaw-rate": dict(data["hopf-push-evaluation-yaw-rate"])}
    alike["hopf-push-evaluation-yaw-rate"]["robust"] = best.robust + 1e-4
    text = section.text(data | alike).replace("\xa0", " ")
    names = [e.controller for e in section.evaluations(data | alike)][:2]
    assert set(names) == {best.controller, "yaw-rate"}
    assert f"robust {best.robust:.1f} m/s ({', '.join(names)})" in text


def test_pushes_are_written_as_what_they_are():
    assert push(150.04, 100.0, 400.0) == "+50.0"
    assert push(90.0, 100.0, 400.0) == "-10.0"
    assert push(400.0, 100.0, 400.0) == "> +300"
    assert push(None, 100.0, 400.0) == "failed"
