"""The evaluation: nonlinear critical speeds, its table and its files, and the shipped results."""

import dataclasses
import json
import math
import re

import numpy as np
import pytest

import agents
import design
import railenv
from agents.evaluation.evaluation import Plan, written
from agents.evaluation.leaderboard import markdown
from agents.evaluation.nonlinear import amplitudes
from railenv.errors import ParameterError, UnknownNameError
from tests.pages import DOCS, script

STORED = DOCS / "leaderboard.json"
SERVICE = {"conicity": (0.05, 0.4), "creep_factor": (0.6, 1.4)}

TINY = dataclasses.replace(
    Plan.quick(), curves=((math.inf, 0.0),), ride_duration=2.0, delays=(), noises=(1.0, 3.0)
)


@pytest.fixture(scope="module")
def coach():
    return agents.equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))


@pytest.fixture(scope="module")
def passive(coach):
    return agents.evaluate(agents.Passive.design(coach), coach, name="passive", plan=TINY)


def test_passive_evaluation_gives_the_known_critical_speeds(passive, coach):
    assert passive.linear == pytest.approx(114.2856, rel=1e-4)
    fold = design.cycle_branch(coach.plant).nonlinear_critical_speed
    assert fold == pytest.approx(91.587, rel=1e-3)
    assert passive.curves[0].established
    assert passive.curves[0].ramp == pytest.approx(fold, rel=0.01)
    # an offset need not lead to hunting as soon as there is a limit cycle
    assert fold * 0.995 < passive.curves[0].disturbed < passive.linear
    assert passive.nonlinear == min(passive.curves[0].ramp, passive.curves[0].disturbed)
    assert passive.robust == pytest.approx(63.96, rel=1e-3)
    assert passive.worst == {"conicity": pytest.approx(0.4), "creep_factor": pytest.approx(1.4)}
    assert passive.noises == {"1": 0.0, "3": 0.0}


def test_an_offset_dies_out_below_the_fold_and_stays_above_the_hopf_point(coach):
    left = amplitudes(coach, None, agents.Place(), [85.0, 119.0])
    assert left[0] < 1e-3
    assert left[1] > 8e-3


def test_an_offset_that_dies_out_slowly_dies_out(coach):
    speed = 97.85  # just below where the offset leads to hunting: it first stays near an unstable cycle
    after = [amplitudes(coach, None, agents.Place(), [speed], duration=d)[0] for d in (2.0, 6.0, 20.0)]
    assert after[0] > 1e-3
    assert after[1] > 1e-4
    assert after[2] < 1e-9
    assert agents.disturbed_critical_speed(coach, None, speed_range=(60.0, speed)) == speed


def test_the_nonlinear_critical_speed_is_never_above_the_linear_one(passive):
    one = passive.curves[0]
    fast = dataclasses.replace(one, linear=100.0, disturbed=120.0, ramp=110.0)
    assert fast.nonlinear == 100.0
    assert dataclasses.replace(fast, established=False, ramp=None, linear=130.0).nonlinear == 120.0
    assert dataclasses.replace(fast, ramp=None).nonlinear is None
    assert dataclasses.replace(fast, linear=None).nonlinear is None


def test_without_established_hunting_only_the_disturbance_counts(coach):
    lqr = agents.LQR.design(coach, speed=160.0)
    plan = dataclasses.replace(TINY, speed_range=(20.0, 150.0), noises=())
    found = agents.evaluate(lqr, coach, plan=plan)
    assert not found.curves[0].established
    assert found.curves[0].ramp is None
    assert found.nonlinear == found.curves[0].disturbed == 150.0
    assert found.curves[0].loss == "none"
    assert "linear > 150" in str(found)


def test_a_controller_that_destabilises_low_speed_has_failed(coach):
    bad = agents.YawRateFeedback.design(coach, gain=2e6)
    found = agents.evaluate(bad, coach, plan=dataclasses.replace(TINY, noises=()))
    assert found.linear is None
    assert found.robust is None
    assert found.nonlinear is None
    assert "linear failed" in str(found)


def test_a_controller_without_linearisation_is_measured(coach):
    class Idle(agents.Controller):
        def reset(self, count=None):
            self.count = count

        def act(self, observation):
            return np.zeros((*observation.shape[:-1], 1))

    found = agents.evaluate(Idle(), coach, plan=dataclasses.replace(TINY, noises=()))
    assert found.linear == pytest.approx(114.2856, rel=5e-3)
    assert found.robust is None


def test_curves_mark_where_cant_deficiency_passes_its_limit(coach):
    plan = dataclasses.replace(TINY, curves=((6250.0, 0.0873),), noises=())
    found = agents.evaluate(agents.Passive.design(coach), coach, plan=plan)
    curve = found.curves[0]
    assert curve.linear == pytest.approx(98.5591, rel=1e-4)
    limit = curve.deficiency_limit
    assert limit**2 / 6250.0 / 9.81 - 0.0873 == pytest.approx(0.150 / 1.5)
    assert curve.name == "R = 6250 m"


def test_evaluations_survive_their_file(passive, tmp_path):
    path = tmp_path / "evaluations.json"
    agents.save_evaluations([passive, passive], path)
    again = agents.load_evaluations(path)
    assert again == [passive, passive]
    json.loads(path.read_text())
    for content in ("", "[1]", '[{"schema": "other"}]', path.read_text()[:-40]):
        path.write_text(content)
        with pytest.raises(ParameterError, match=r"not a file of evaluations|not an evaluation"):
            agents.load_evaluations(path)


def test_leaderboard_is_a_table_with_a_row_for_each(passive):
    text = markdown([passive])
    lines = text.splitlines()
    assert lines[0].startswith("| controller | reads | linear | nonlinear | robust (conicity ")
    assert "| passive | sensors | 114.3 |" in lines[2]
    assert len({line.count("|") for line in lines}) == 1


def test_speeds_are_written_as_what_they_are():
    assert written(None, 400.0) == "failed"
    assert written(400.0, 400.0) == "> 400"
    assert written(123.456, 400.0) == "123.5"


def test_plots_say_what_they_show(passive, coach, tmp_path):
    from agents.evaluation.diagram import closed_loop_diagram
    from agents.evaluation.evaluation_plots import plot_comparison
    from agents.evaluation.growth import linear_growth_rates
    from agents.evaluation.growth_plots import plot_growth
    from agents.evaluation.rollout_plots import plot_histories

    damper = agents.YawRateFeedback.design(coach, gain=1e5)
    both, speeds = {"passive": None, "damper": damper}, [60.0, 100.0, 140.0]
    rates = {name: linear_growth_rates(coach, each, speeds) for name, each in both.items()}
    drawn = {
        "bars": passive.plot(),
        "comparison": plot_comparison([passive]),
        "curve": plot_comparison([passive], len(passive.curves) - 1),
        "histories": plot_histories(
            {"passive": None, "damper": damper}, coach, speed=120.0, duration=1.0
        ),
        "diagram": closed_loop_diagram(damper, coach, [80.0, 150.0]).plot(),
        "growth": plot_growth(rates, speeds),
    }
    for name, plot in drawn.items():
        figure = plot.figure
        figure.savefig(tmp_path / f"{name}.png")
        for ax in figure.axes:
            assert re.search(
                r" \(.+\)$", ax.get_xlabel() if name in ("comparison", "curve") else ax.get_ylabel()
            )


@pytest.mark.parametrize("name", ["passive", "yaw-rate", "lqr", "lqg", "output-feedback"])
def test_shipped_controllers_are_there_and_for_the_coach(coach, name):
    controller = agents.shipped(name)
    found = design.critical_speed(coach, controller=controller, speed_range=(20.0, 400.0))
    assert found.loss in ("hunting", "none", "divergence")
    if name != "passive":
        assert found.loss == "none" or found.speed > 130.0


@pytest.mark.parametrize("name", [n for n in agents.shipped_names() if n != "passive"])
def test_linear_critical_speeds_of_shipped_controllers_are_the_environments(coach, name):
    controller = agents.shipped(name)
    looked_at = 0
    for conicity in (0.05, 0.4):
        model = coach.replace(conicity=conicity)
        found = design.critical_speed(model, controller=controller, speed_range=(20.0, 400.0))
        if found.loss == "hunting":
            simulated = agents.simulated_critical_speed(
                coach,
                controller,
                found.speed,
                vehicle={"conicity": conicity},
                width=0.02,
                duration=24.0,  # a mode that a disturbance hardly excites takes long to be alone
            )
            assert simulated == pytest.approx(found.speed, rel=5e-3)
            looked_at += 1
    assert looked_at


def test_the_best_shipped_controller_from_sensors_meets_its_claims(coach):
    best = agents.shipped("output-feedback")
    robust = design.robust_critical_speed(coach, best, SERVICE, samples=8)
    assert robust.speed >= 1.9 * 63.97
    assert agents.disturbed_critical_speed(coach, best, speed_range=(20.0, 250.0)) >= 1.6 * 91.59
    stored = {e.controller: e for e in agents.load_evaluations(STORED)}
    assert robust.speed == pytest.approx(stored["output-feedback"].robust, rel=1e-3)


def test_robust_speed_needs_a_number_of_the_contact_or_the_creep_only(coach):
    """Of what the plan varies, a vehicle on one pair of profiles has the creep factor."""
    fixed = agents.equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002))
    family = railenv.ProfileFamily(
        railenv.ProfilePair(), railenv.ProfilePair(wheel="S1002_WORN"), wear=0.5
    )
    wearing = railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002.replace(contact=family))
    assert set(Plan().robust_over(coach)) == {"conicity", "creep_factor"}
    assert set(Plan().robust_over(fixed)) == {"creep_factor"}
    assert set(Plan().robust_over(wearing)) == {"wear", "creep_factor"}


def test_page_on_learning_tells_what_was_measured():
    make_learned = script("make_learned")
    page = make_learned.PAGE.read_text()
    assert make_learned.page(page) == page
    rows = json.loads(make_learned.DATA.read_text())
    stored = {e.controller: e for e in agents.load_evaluations(STORED)}
    for name in ("learned", "learned-by-gradient", *make_learned.CLASSICAL):
        assert rows[name]["robust"] == pytest.approx(stored[name].robust, rel=1e-3)


def test_unknown_shipped_controllers_are_named():
    with pytest.raises(UnknownNameError, match=r"'magic'.*output-feedback"):
        agents.shipped("magic")


def test_leaderboards_of_the_pages_are_the_stored_evaluations():
    make_leaderboard = script("make_leaderboard")
    for page in make_leaderboard.PAGES:
        assert make_leaderboard.written(page, make_leaderboard.table()) == page.read_text()
    stored = {e.controller: e for e in agents.load_evaluations(STORED)}
    assert set(stored) == set(agents.shipped_names())
    for name, evaluation in stored.items():
        assert dict(evaluation.about) == json.loads(json.dumps(agents.shipped(name).about))


@pytest.mark.slow
@pytest.mark.parametrize("name", agents.shipped_names())
def test_stored_evaluations_are_what_the_evaluation_gives(coach, name):
    stored = {e.controller: e for e in agents.load_evaluations(STORED)}[name]
    again = agents.evaluate(agents.shipped(name), coach, name=name)
    for kept, found in zip(stored.curves, again.curves, strict=True):
        for reading in ("linear", "nonlinear"):
            assert getattr(found, reading) == pytest.approx(getattr(kept, reading), rel=1e-3)
    assert again.robust == pytest.approx(stored.robust, rel=1e-3)


def test_file_whose_worst_vehicle_has_an_unknown_number_or_range_is_refused(tmp_path):
    row = json.loads((DOCS / "leaderboard.json").read_text(encoding="utf-8"))[0]
    for name, changed in (
        ("worst", {"creep_factkr": 1.4}),
        ("plan", {**row["plan"], "creep_factor": [0.6, 1.0, 1.4]}),
    ):
        (tmp_path / "damaged.json").write_text(json.dumps([{**row, name: changed}]), encoding="utf-8")
        with pytest.raises(ParameterError, match="creep_fact"):
            agents.load_evaluations(tmp_path / "damaged.json")
