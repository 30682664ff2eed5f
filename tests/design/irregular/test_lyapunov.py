"""Lyapunov exponents of systems for which they are known, and of vehicles' limit cycles."""

import math
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest

import design
import railenv
from railenv.errors import ParameterError, SimulationError
from tests.design.cycles import exact
from tests.design.irregular.known import (
    LINEAR,
    LORENZ,
    LORENZ_START,
    RELAY,
    ROSSLER,
    ROSSLER_START,
)


@pytest.fixture(scope="module")
def lorenz():
    return design.lyapunov_exponents(
        LORENZ, speed=1.0, duration=2000.0, perturbation=LORENZ_START, step=0.003
    )


def test_exponents_of_the_lorenz_system(lorenz):
    # J. C. Sprott, Chaos and Time-Series Analysis (2003): 0.9056, 0, -14.5723; dimension 2.062
    assert lorenz.largest == pytest.approx(0.9056, abs=0.01)
    assert lorenz.exponents[1] == pytest.approx(0.0, abs=lorenz.bound[1])
    assert lorenz.exponents[2] == pytest.approx(-14.5723, abs=0.01)
    assert abs(lorenz.largest - 0.9056) < 3.0 * lorenz.error[0]
    assert lorenz.kaplan_yorke == pytest.approx(2.062, abs=0.002)
    assert lorenz.kind == "chaotic"
    assert lorenz.own_error < 1e-6


def test_exponents_of_the_lorenz_system_sum_up_to_its_divergence(lorenz):
    assert lorenz.exponents.sum() == pytest.approx(-(10.0 + 1.0 + 8.0 / 3.0), abs=1e-6)


def test_exponents_of_the_rossler_system():
    found = design.lyapunov_exponents(
        ROSSLER, speed=1.0, duration=6000.0, settle=200.0, perturbation=ROSSLER_START, step=0.03
    )
    # Sprott: 0.0714, 0, -5.3943; dimension 2.0132
    assert found.largest == pytest.approx(0.0714, abs=3.0 * found.error[0])
    assert found.error[0] < 0.003
    assert found.exponents[2] == pytest.approx(-5.3943, abs=0.02)
    assert found.kaplan_yorke == pytest.approx(2.0132, abs=0.002)
    assert found.frequency == pytest.approx(0.171, rel=0.02)


def test_exponents_of_a_linear_system_are_the_real_parts_of_its_eigenvalues():
    found = design.lyapunov_exponents(LINEAR, speed=1.0, duration=50.0)
    np.testing.assert_allclose(found.exponents, [-0.3, -0.3, -1.1], rtol=1e-5)
    assert found.kind == "equilibrium"
    assert found.kaplan_yorke == 0.0


def test_exponents_of_van_der_pols_cycle_are_zero_and_that_of_its_multiplier():
    model = exact.planar(f_y=1.0, g_x=-1.0, g_my=1.0, g_xxy=-1.0)
    cycle = design.simulated_cycle(model, speed=exact.MU + 1.0, perturbation={"x": 1.0}, duration=60.0)
    found = design.lyapunov_exponents(
        model, speed=exact.MU + 1.0, perturbation={"x": 1.0}, duration=2000.0
    )
    floquet = math.log(abs(cycle.multipliers[0])) / cycle.period
    assert found.exponents[0] == pytest.approx(0.0, abs=1e-3)
    assert found.exponents[1] == pytest.approx(floquet, abs=2e-3)
    assert found.kind == "periodic"
    assert found.kaplan_yorke == 1.0
    assert found.frequency == pytest.approx(cycle.frequency, rel=4e-3)


def test_two_uncoupled_oscillators_move_on_a_torus():
    model = exact.company(sigma=0.5, slope=0.0, nu=math.sqrt(5.0))
    found = design.lyapunov_exponents(
        model, speed=exact.MU + 1.0, perturbation={"a": 1.0, "c": 0.5}, duration=2000.0, count=4
    )
    np.testing.assert_allclose(found.exponents[:2], 0.0, atol=2e-3)
    assert found.exponents[2] < -0.5
    # the first of them is the normal form of a Hopf point: twice its rate of growth
    assert found.exponents[3] == pytest.approx(-2.0, abs=0.01)
    assert found.kind == "torus"
    assert found.kaplan_yorke == 2.0


def test_one_exponent_does_not_tell_a_cycle_from_a_torus():
    model = exact.hopf_normal_form(l1=-1.0)
    found = design.lyapunov_exponents(model, speed=exact.MU + 1.0, duration=100.0, count=1)
    assert found.kind == "not decided"


def test_a_motion_that_still_grows_is_not_decided():
    model = exact.hopf_normal_form(l1=-1.0)
    found = design.lyapunov_exponents(
        model, speed=exact.MU + 0.05, perturbation={"x": 1e-4}, duration=60.0, settle=0.0
    )
    assert not found.steady
    assert found.kind == "not decided"


def test_nothing_that_moves_is_an_equilibrium_though_an_exponent_is_positive():
    model = exact.hopf_normal_form(l1=-1.0)
    found = design.lyapunov_exponents(
        model, speed=exact.MU + 0.05, perturbation={}, duration=20.0, settle=0.0
    )
    assert found.kind == "equilibrium"
    assert found.largest == pytest.approx(0.05, rel=1e-4)


def test_derivatives_that_miss_a_jump_are_told_by_the_motions_own_direction():
    # the force jumps where the velocity changes sign: derivatives see a damped oscillator only
    found = design.lyapunov_exponents(RELAY, speed=1.0, duration=500.0, settle=300.0, step=0.01)
    assert found.exponents[0] == pytest.approx(-0.05, abs=1e-3)  # wrong: a cycle has a zero
    assert found.own_error > 0.04
    assert found.kind == "not decided"


@pytest.mark.parametrize(("vehicle", "speed"), [("coach", 105.0), ("cooperrider", 80.0)])
def test_exponents_of_a_hunting_vehicle_are_those_of_its_floquet_multipliers(request, vehicle, speed):
    model = request.getfixturevalue(vehicle)
    away = {"y_w1": 8e-3, "y_w2": 8e-3}
    cycle = design.simulated_cycle(model, speed=speed, perturbation=away, steps_per_period=1600)
    floquet = np.log(np.abs(cycle.multipliers[:2])) / cycle.period
    found = design.lyapunov_exponents(
        model, speed=speed, initial_state=cycle.states[0], duration=40.0, settle=20.0
    )
    assert found.kind == "periodic"
    assert found.exponents[0] == pytest.approx(0.0, abs=found.bound[0])
    np.testing.assert_allclose(found.exponents[1:], floquet, atol=0.05)
    assert found.swing[0] == pytest.approx(cycle.amplitude["y_w1"], rel=1e-3)


def test_chaos_of_the_coach_on_a_curve_has_the_exponent_of_its_return_map(coach):
    place = {"speed": 122.0, "radius": 6250.0, "cant": 0.0873}
    section = design.poincare_section(
        coach, **place, perturbation={"y_w1": 8e-3, "y_w2": 8e-3}, duration=120.0
    )
    before, after = section.return_map()
    order = np.argsort(before)
    near = (order[max(0, i - 5) : i + 6] for i in range(len(order)))
    slopes = [np.polyfit(before[k], after[k], 1)[0] for k in near]
    of_map = np.log(np.abs(slopes)).mean() / np.diff(section.time).mean()
    found = design.lyapunov_exponents(
        coach, **place, initial_state=section.end, duration=60.0, settle=5.0
    )
    assert found.kind == "chaotic"
    assert found.largest == pytest.approx(of_map, abs=3.0 * found.error[0])
    assert 0.7 < of_map < 1.1
    assert found.exponents[1] == pytest.approx(0.0, abs=0.1)
    assert 2.1 < found.kaplan_yorke < 2.3


@pytest.mark.slow
def test_chaos_of_the_coach_parts_neighbours_that_another_method_integrates(coach):
    place = {"speed": 122.0, "radius": 6250.0, "cant": 0.0873}
    away = {"y_w1": 8e-3, "y_w2": 8e-3}
    found = design.lyapunov_exponents(coach, **place, perturbation=away, duration=200.0)
    accurate = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-13, "output_step": 0.02}
    rng, start, rates = np.random.default_rng(1), found.end, []
    for _ in range(6):
        beside = start + 1e-7 * coach.scale * rng.standard_normal(coach.n_states)
        one, other = (
            railenv.simulate(coach, **place, initial_state=x, duration=12.0, **accurate).states
            for x in (start, beside)
        )
        apart = np.log(np.linalg.norm((other - one) / coach.scale[:, None], axis=0))
        time = np.linspace(0.0, 12.0, len(apart))
        rates.append(np.polyfit(time[time > 1.0], apart[time > 1.0], 1)[0])
        start = one[:, -1]
    assert np.mean(rates) == pytest.approx(found.largest, abs=0.25)


def test_a_coach_below_its_critical_speed_is_an_equilibrium_with_the_damping_of_its_modes(coach):
    rest = railenv.find_equilibrium(coach, speed=80.0).state
    least = np.linalg.eigvals(coach.jacobian(rest, speed=80.0)[0]).real.max()
    found = design.lyapunov_exponents(coach, speed=80.0, duration=40.0, settle=20.0, count=1)
    assert found.kind == "equilibrium"
    assert found.largest == pytest.approx(least, abs=0.03)


def test_an_interrupted_run_keeps_what_it_has(monkeypatch):
    module = sys.modules["design.irregular.lyapunov"]
    go, calls = module._Tangent.go, []

    def interrupted(self, duration):
        calls.append(duration)
        if len(calls) > 13:
            raise KeyboardInterrupt
        return go(self, duration)

    monkeypatch.setattr(module._Tangent, "go", interrupted)
    found = design.lyapunov_exponents(LORENZ, speed=1.0, duration=240.0, perturbation=LORENZ_START)
    assert found.duration == pytest.approx(120.0, rel=0.05)
    assert found.ended == "interrupted after 12 of 24 parts of the duration"
    calls.clear()
    monkeypatch.setattr(module, "_FEWEST", 20)
    with pytest.raises(KeyboardInterrupt):
        design.lyapunov_exponents(LORENZ, speed=1.0, duration=240.0, perturbation=LORENZ_START)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"count": 0}, "count is 0"),
        ({"duration": 0.0}, "duration is 0"),
        ({"settle": -1.0}, "settle is -1"),
        ({"step": 0.0}, "step is 0"),
        ({"perturbation": {"w": 1.0}}, "state in perturbation"),
        ({"inputs": [1.0]}, "inputs has shape"),
    ],
)
def test_bad_arguments_are_told(arguments, message):
    with pytest.raises((ParameterError, LookupError), match=message):
        design.lyapunov_exponents(LORENZ, **{"speed": 1.0, **arguments})


def test_a_motion_that_diverges_is_an_error():
    with pytest.raises(SimulationError, match="diverges"):
        design.lyapunov_exponents(
            exact.hopf_normal_form(l1=1.0), speed=exact.MU, perturbation={"x": 2.0}
        )


def test_text_summary_and_picture(lorenz):
    assert str(lorenz).startswith("chaotic; exponents 0.9")
    assert lorenz.summary()["kaplan_yorke"] == lorenz.kaplan_yorke
    axes = np.ravel(lorenz.plot().axes)[0]
    assert len(axes.lines) == 4
    plt.close("all")
