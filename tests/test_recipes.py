"""The recipes for control design: their page, and the physics in their results."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import agents
import design
import railenv
from examples import (
    damper_sizing,
    delay_sensitivity,
    gain_scheduling,
    lqg_and_conicity,
    lqr_at_one_speed,
    yaw_rate_feedback,
)
from tests.pages import DOCS, script

make_recipes = script("make_recipes")


@pytest.fixture(scope="module", params=make_recipes.RECIPES)
def name(request):
    return request.param


@pytest.fixture(scope="module")
def results():
    found = {}

    def result(name):
        if name not in found:
            found[name] = make_recipes.run(name, fast=True)
        return found[name]

    return result


def test_table_of_the_page_is_the_recipes(name, results):
    text = (DOCS / "recipes.md").read_text(encoding="utf-8")
    assert f"<!-- made: {name} -->\n\n{results(name).markdown()}\n\n<!-- end -->" in text


def test_recipe_draws_itself_and_the_page_shows_it(name, results):
    figure = results(name).plot()
    assert all(ax.get_xlabel() or ax.get_ylabel() for ax in figure.axes)
    plt.close(figure)
    picture = f"pictures/recipe-{name.replace('_', '-')}.png"
    assert f"]({picture})" in (DOCS / "recipes.md").read_text(encoding="utf-8")
    assert (DOCS / picture).exists()


def test_page_has_every_recipe(results):
    text = (DOCS / "recipes.md").read_text(encoding="utf-8")
    assert make_recipes.page(text, {name: results(name) for name in make_recipes.RECIPES}) == text


# ------------------------------------------------------------------------ passive damper


def test_a_stronger_yaw_damper_moves_the_critical_speed_up_for_both_bogies(results):
    for sizing in results("damper_sizing").sizings:
        assert (np.diff(sizing.speeds) > 1.0).all(), sizing.name
        assert sizing.speeds[-1] > 1.3 * sizing.speeds[0]


def test_damper_sized_on_the_linear_loop_gives_the_speed_that_was_asked_for(results):
    for sizing in results("damper_sizing").sizings:
        assert sizing.reached == pytest.approx(sizing.target, abs=1e-3)


@pytest.mark.parametrize("case", damper_sizing.CASES, ids=lambda case: case[0])
def test_a_damper_is_a_gain_of_the_root_locus(case):
    _, model, speed = case
    locus = damper_sizing.root_locus(model, speed, [0.0, 200.0])  # kN m s/rad
    poles = design.linearize(damper_sizing.damped(model, 200e3), speed=speed).poles()
    assert np.sort_complex(locus.loci[-1]) == pytest.approx(np.sort_complex(poles), rel=1e-6)


def test_damper_in_parallel_with_the_actuator_does_what_one_in_the_suspension_does():
    rate = 150e3
    base = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    parallel = railenv.Equipped(base)
    arm = parallel.actuator.arm
    parallel = parallel.replace(parallel_damping=rate / (2.0 * arm**2))
    speeds = [design.critical_speed(m).speed for m in (damper_sizing.damped(base, rate), parallel)]
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-6)


# ------------------------------------------------------------------------ yaw-rate feedback


def test_margins_end_where_the_root_locus_loses_stability(results):
    found = results("yaw_rate_feedback")
    low, high = found.windows[yaw_rate_feedback.SPEED]
    for gain, margins in found.margins.items():
        assert margins.stable == (low < gain < high)
        if margins.stable:
            assert gain * margins["command_b"].gain_reduction == pytest.approx(low, rel=1e-5)
            assert gain * margins["command_b"].gain_margin == pytest.approx(high, rel=1e-5)


def test_critical_speed_of_a_gain_is_where_the_gain_is_the_smallest_stable_one(results):
    speed = results("yaw_rate_feedback").speeds[200e3]
    assert yaw_rate_feedback.window(speed)[0] == pytest.approx(200e3, rel=1e-4)


def test_feedback_raises_the_critical_speed_until_the_gain_is_too_high_at_low_speed(results):
    speeds = results("yaw_rate_feedback").speeds
    assert 116.2 < speeds[100e3] < speeds[150e3] < speeds[200e3] < speeds[300e3]
    assert speeds[400e3] == 0.0


# ------------------------------------------------------------------------ LQR


def test_cost_of_the_linear_loop_is_what_the_riccati_solution_promises(results):
    for promised, linear, _ in results("lqr_at_one_speed").costs.values():
        assert linear == pytest.approx(promised, rel=1e-6)


def test_cost_of_the_nonlinear_vehicle_is_near_it_for_small_states(results):
    costs = results("lqr_at_one_speed").costs
    errors = [abs(nonlinear / promised - 1.0) for promised, _, nonlinear in costs.values()]
    assert max(errors) < 0.02
    assert errors[0] < 1e-3
    assert errors[0] < errors[-1]


def test_regulated_vehicle_comes_to_rest_where_the_free_one_hunts(results):
    found = results("lqr_at_one_speed")
    assert np.abs(found.runs[3e-3].states[-200:]).max(axis=0)[0] < 1e-6
    free = agents.Rollout(
        lqr_at_one_speed.VEHICLE, None, [agents.Case(lqr_at_one_speed.SPEED, offset=3e-3)]
    ).run(2.0)
    assert np.abs(free["y_w1"][-100:]).max() > 8e-3


# ------------------------------------------------------------------------ gain scheduling


def test_schedule_of_python_control_is_that_of_the_agent(results):
    found = results("gain_scheduling")
    assert found.difference < 1e-12
    loops = [
        design.closed_loop(gain_scheduling.VEHICLE, controller, speed=170.0).multipliers
        for controller in (found.feedback, found.controller)
    ]
    assert np.abs(loops[0][:8]) == pytest.approx(np.abs(loops[1][:8]), rel=1e-6)


def test_no_gain_costs_less_than_the_optimum_and_the_schedule_costs_little_more(results):
    found = results("gain_scheduling").comparisons
    for speed, c in found.items():
        assert c.scheduled >= c.least * (1.0 - 1e-6)
        assert c.fixed >= c.least * (1.0 - 1e-6)
        assert c.scheduled < 1.01 * c.least
        if speed in (*gain_scheduling.NODES, gain_scheduling.FIXED):
            own = c.fixed if speed == gain_scheduling.FIXED else c.scheduled
            assert own == pytest.approx(c.least, rel=1e-6)
    assert found[240.0].fixed > 1.1 * found[240.0].least


# ------------------------------------------------------------------------ LQG


def test_lqg_gains_at_its_own_conicity_and_fails_at_others(results):
    speeds = results("lqg_and_conicity").speeds
    free = speeds[None]
    for made_for in lqg_and_conicity.DESIGNS:
        assert speeds[made_for][made_for] > 1.5 * free[made_for]
    assert speeds[0.05][0.4] < 1.02 * free[0.4]
    assert speeds[0.2][0.05] < free[0.05]


def test_robust_critical_speed_is_no_better_than_any_conicity_of_the_range(results):
    found = results("lqg_and_conicity")
    low, high = lqg_and_conicity.BOX["conicity"]
    worst = {
        made_for: min(speed for conicity, speed in over.items() if low <= conicity <= high)
        for made_for, over in found.speeds.items()
    }
    assert found.robust.speed <= worst[0.05] + 0.01
    assert found.robust.speed < 1.1 * worst[None]


# ------------------------------------------------------------------------ delay


def test_delay_margin_is_where_the_loop_with_that_delay_becomes_unstable(results):
    found = results("delay_sensitivity")
    controllers = {
        "yaw-rate feedback": yaw_rate_feedback.damper(delay_sensitivity.GAIN),
        "LQR for 10 ms": delay_sensitivity.optimal(0.01),
    }
    assert set(controllers) == set(found.margins)
    for name, controller in controllers.items():
        stable = [
            design.closed_loop(
                delay_sensitivity.VEHICLE.replace(delay=found.longest(name) + step),
                controller,
                speed=delay_sensitivity.SPEED,
            ).stable
            for step in (-1e-4, 1e-4)
        ]
        assert stable == [True, False]


def test_regulator_relies_on_the_delay_that_it_was_designed_for(results):
    speeds = results("delay_sensitivity").speeds
    fixed, designed = speeds["LQR for 10 ms"], speeds["LQR for the delay"]
    assert fixed[0.01] == designed[0.01]
    assert fixed[0.05] < 116.0 < designed[0.05]


def test_map_has_no_stable_place_without_gain_or_with_much_delay(results):
    chart = results("delay_sensitivity").chart
    damping = chart.to_xarray()["damping"].transpose("delay", "gain")
    assert (damping.sel(gain=0.0) < 0.0).all()
    assert (damping.isel(delay=-1) < 0.0).all()
    assert (damping > 0.0).any()
