"""Limit cycles of the vehicles against simulation, their Hopf points, and curves."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

import design
import railenv
from design.cycles.periodic import PeriodicProblem
from design.cycles.points import position
from design.cycles.shooting import Shooting

CANT = 0.0873  # rad, the paper's


@pytest.fixture(scope="module")
def coach_branch(coach):
    return design.cycle_branch(coach, parameter_range=(30.0, 120.0))


@pytest.fixture(scope="module")
def cooperrider_branch(cooperrider):
    return design.cycle_branch(cooperrider, parameter_range=(30.0, 80.0))


@pytest.fixture(params=["coach", "cooperrider"])
def branch(request):
    return request.getfixturevalue(f"{request.param}_branch")


def test_coach_is_unstable_from_the_hopf_point_back_to_the_fold_and_stable_beyond(coach_branch):
    fold = coach_branch.nonlinear_critical_speed
    assert fold == pytest.approx(91.419, abs=0.01)
    turn = int(np.argmin(coach_branch.speed))
    assert (np.diff(coach_branch.speed[: turn + 1]) < 0.0).all()
    assert (np.diff(coach_branch.speed[turn:]) > 0.0).all()
    assert not coach_branch.stable[: turn - 1].any()
    assert coach_branch.stable[turn + 1 :].all()
    assert len(coach_branch) >= 60
    assert [s.kind for s in coach_branch.special] == ["fold"]
    amplitude = 1e3 * coach_branch.amplitude["y_w1"][turn:]
    assert amplitude.min() > 10.0
    assert amplitude.max() < 13.0


def test_cooperrider_branch_turns_back_at_a_fold_below_its_critical_speed(cooperrider_branch):
    assert cooperrider_branch.hopf.speed == pytest.approx(68.644, rel=1e-4)
    assert cooperrider_branch.nonlinear_critical_speed == pytest.approx(66.655, abs=0.01)


def test_a_tangent_leads_to_the_next_motion_whatever_phase_is_held_there(coach_branch):
    for cycle in coach_branch.cycles[2:60:8]:
        shooting = Shooting(coach_branch.setting, len(cycle.states) - 1)
        problem = PeriodicProblem(shooting, cycle.states, cycle.value)
        tangent = problem.in_phase(cycle.tangent, cycle.scale)
        assert np.linalg.norm(tangent) == pytest.approx(1.0)
        start, step = position(cycle), 1e-4
        found = problem.solve(start + step * tangent * cycle.scale, tangent, cycle.scale)
        way = (found.z - start) / cycle.scale / step
        assert np.linalg.norm(way - tangent) < 0.01


def test_a_guess_improved_without_derivatives_is_the_motion_that_newtons_method_finds(coach_branch):
    cycle = coach_branch.cycles[20]
    problem = PeriodicProblem(
        Shooting(coach_branch.setting, len(cycle.states) - 1), cycle.states, cycle.value
    )
    tangent = problem.in_phase(cycle.tangent, cycle.scale)
    guess = position(cycle) + 0.1 * tangent * cycle.scale
    plane = (tangent, cycle.scale)
    assert problem.improved(guess, *plane) is guess  # no derivatives to start from
    exact = problem.solve(guess, *plane)
    better = problem.improved(guess, *plane)
    assert np.abs((better - exact.z) / cycle.scale).max() < 1e-7
    far = guess + 1e3 * cycle.scale
    assert problem.improved(far, *plane) is far


@pytest.mark.slow
def test_whole_coach_hunts_down_to_the_last_fold_of_its_branch():
    coach = railenv.Coach(railenv.HIGH_SPEED_COACH)
    branch = design.cycle_branch(coach)
    assert branch.complete
    fold = branch.nonlinear_critical_speed
    assert fold < 0.75 * branch.hopf.speed
    k = coach.state_names.index("y_w1")
    for speed in (1.005 * fold, 75.0, 100.0):
        (cycle,) = branch.at(speed, stable=True)
        motion = railenv.simulate(
            coach, speed=cycle.speed, initial_state=cycle.states[0], duration=30.0
        )
        last = np.abs(motion.states[k, -motion.states.shape[1] // 10 :]).max()
        assert last == pytest.approx(cycle.amplitudes[k], rel=2e-3)
    start = branch.at(1.005 * fold, stable=True)[0].states[0]
    below = railenv.simulate(coach, speed=0.99 * fold, initial_state=start, duration=40.0)
    assert np.abs(below.states[k, -100:]).max() < 1e-5


def test_fold_does_not_depend_on_the_steps_of_the_period(cooperrider, cooperrider_branch):
    finer = design.cycle_branch(cooperrider, parameter_range=(60.0, 67.0), steps_per_period=800)
    assert finer.nonlinear_critical_speed == pytest.approx(
        cooperrider_branch.nonlinear_critical_speed, rel=1e-5
    )


def test_fold_agrees_with_a_slow_ramp_down(branch):
    fold = branch.nonlinear_critical_speed
    start = next(c for c in reversed(branch.at(1.008 * fold, stable=True)))
    ramp = design.speed_ramp(
        branch.setting.model, start=start.speed, stop=0.99 * fold, rate=0.004, cycle=start
    )
    assert ramp.critical_speed == pytest.approx(fold, rel=2e-3)
    assert ramp.critical_speed < fold  # a ramp lags


def test_a_very_slow_ramp_ends_where_an_independent_program_has_the_fold(coach_branch):
    """Between 91.40 and 91.50 m/s; the lag falls with the rate."""
    fold = coach_branch.nonlinear_critical_speed
    start = next(c for c in reversed(coach_branch.at(1.004 * fold, stable=True)))
    slow, slower = (
        design.speed_ramp(
            coach_branch.setting.model, start=start.speed, stop=0.997 * fold, rate=rate, cycle=start
        ).critical_speed
        for rate in (0.002, 0.0005)
    )
    assert 91.40 < slower < fold < 91.50
    assert fold - slower < 0.45 * (fold - slow)


def test_stable_cycles_agree_with_long_simulations(branch):
    stable = [c for c in branch.cycles if c.stable and c.speed > 1.003 * branch.folds[0].value]
    for cycle in [stable[i] for i in np.linspace(0, len(stable) - 1, 6).astype(int)]:
        response = railenv.simulate(
            branch.setting.model,
            speed=cycle.speed,
            initial_state=cycle.states[0],
            perturbation={"y_w1": 5e-4},
            duration=40.0,
        )
        for state in ("y_w1", "y_w2", "psi_w1", "y_b"):
            tail = response.outputs[response.output_labels.index(state), response.time > 35.0]
            assert np.ptp(tail) / 2.0 == pytest.approx(cycle.amplitude[state], rel=5e-3)
        found = design.spectrum(response, "y_w1", skip=10.0)
        assert found.main_frequency == pytest.approx(cycle.frequency, rel=2e-3)


def test_multipliers_agree_with_the_decay_of_a_perturbed_cycle(cooperrider, cooperrider_branch):
    cycle = cooperrider_branch.at(70.0, stable=True)[0]
    response = railenv.simulate(
        cooperrider,
        speed=cycle.speed,
        initial_state=cycle.states[0],
        perturbation={"y_w1": 1e-4, "y_b": -5e-5},
        duration=8 * cycle.period,
        step=cycle.period / 400,
        output_step=cycle.period,
    )
    # differences of successive periods leave out the shift in phase, which does not decay; what is
    # left obeys the recurrence of the leading pair, d'' = 2 Re(mu) d' - |mu|^2 d
    d = np.diff(response.outputs, axis=1) / cycle.scale[:14, None]
    measured = np.linalg.lstsq(d[:, 4:6], d[:, 6], rcond=None)[0]
    mu = cycle.multipliers[0]
    np.testing.assert_allclose(measured, [-(abs(mu) ** 2), 2.0 * mu.real], rtol=0.05)


def test_multipliers_agree_with_the_growth_of_a_perturbed_unstable_cycle(coach, coach_branch):
    cycle = coach_branch.at(105.0, stable=False)[0]
    response = railenv.simulate(
        coach,
        speed=cycle.speed,
        initial_state=cycle.states[0],
        perturbation={"y_w1": 1e-6},
        duration=12 * cycle.period,
        step=cycle.period / 400,
        output_step=cycle.period,
    )
    left = np.linalg.norm(np.diff(response.outputs, axis=1), axis=0)
    np.testing.assert_allclose(left[10] / left[9], cycle.multipliers[0].real, rtol=5e-3)


def test_the_trivial_multiplier_is_accurate_where_the_flange_is_not_touched(coach_branch):
    off = coach_branch.amplitude["y_w1"] < 8e-3
    assert coach_branch.trivial_error[off].max() < 1e-4  # creep has no second derivative at rest
    assert coach_branch.trivial_error.max() < 0.1


# ----------------------------------------------------------------------------- kinds of Hopf


def test_coach_has_a_normal_form_only_at_amplitudes_below_a_twentieth_of_a_millimetre(coach):
    hopf = design.critical_speed(coach).hopf
    assert hopf.lyapunov_coefficient > 0.0
    assert hopf.criticality == "subcritical"
    assert 1e-5 < hopf.amplitude_range < 5e-5
    assert "subcritical from 0.1 to 1 mm" in str(hopf)


def test_cooperrider_has_no_normal_form_and_is_subcritical(cooperrider):
    hopf = design.hopf_point(cooperrider)
    assert hopf.lyapunov_coefficient is None
    assert hopf.normal_form_criticality is None
    assert hopf.criticality == "subcritical"
    assert "no first Lyapunov coefficient" in str(hopf)


def test_dual_wheelset_is_supercritical_with_both_wheelsets_hunting_in_phase(dual):
    assert design.critical_speed(dual).criticality == "supercritical"
    branch = design.cycle_branch(dual, parameter_range=(30.0, 40.0), longest_step=0.2)
    np.testing.assert_allclose(branch.amplitude["y_w1"], branch.amplitude["y_w2"], rtol=1e-6)
    assert branch.nonlinear_critical_speed == pytest.approx(branch.hopf.speed, rel=1e-9)
    assert branch.stable.all()  # apart from the relative phase of the wheelsets, which is indifferent
    assert branch.multipliers.shape[1] == 14


@pytest.mark.slow
def test_bogie_of_table_1_is_neutral_and_folds_within_0_2_percent_of_its_hopf_point(bogie):
    assert design.critical_speed(bogie).criticality == "neutral"
    branch = design.cycle_branch(bogie, parameter_range=(10.0, 14.0), longest_step=0.2)
    assert branch.nonlinear_critical_speed == pytest.approx(branch.hopf.speed, rel=2e-3)
    assert branch.nonlinear_critical_speed < branch.hopf.speed
    assert branch.stable[-1]


def test_no_criticality_where_stability_is_not_lost_by_hunting(coach):
    assert design.critical_speed(coach, speed_range=(3.0, 50.0)).criticality is None
    with pytest.raises(design.CycleError, match="no Hopf point"):
        design.hopf_point(coach, speed_range=(3.0, 50.0))


# ----------------------------------------------------------------------------------- curves


@pytest.mark.parametrize("radius", [20_000.0, 10_000.0, 6250.0])
def test_branch_on_a_curve_starts_from_the_curves_own_equilibrium_coach(coach, radius):
    check_start(coach, radius)


@pytest.mark.parametrize("radius", [10_000.0, 2500.0, 1000.0])
def test_branch_on_a_curve_starts_from_the_curves_own_equilibrium_table_1(dual, radius):
    check_start(dual, radius)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [10_000.0, 2500.0, 1000.0])
def test_branch_on_a_curve_starts_from_the_curves_own_equilibrium_table_1_bogie(bogie, radius):
    check_start(bogie, radius)


def check_start(model, radius):
    branch = design.cycle_branch(model, radius=radius, cant=CANT, points=2)
    first = branch.cycles[0]
    resting = railenv.find_equilibrium(model, speed=first.speed, radius=radius, cant=CANT)
    middle = first.states[:-1].mean(axis=0)
    assert np.abs(middle - resting.state).max() < 5e-6
    assert abs(resting["y_w1"]) > 1e-4  # it is not the tangent one
    assert first.amplitude["y_w1"] == pytest.approx(1e-4, rel=0.3)
    assert first.curvature == pytest.approx(1.0 / radius)
    hopf = design.critical_speed(model, radius=radius, cant=CANT)
    assert first.speed == pytest.approx(hopf.speed, rel=2e-3)


def test_a_curve_and_its_mirror_image_have_the_same_limit_cycles(dual):
    left, right = (
        design.cycle_branch(dual, radius=s * 5000.0, cant=s * CANT, points=6) for s in (1.0, -1.0)
    )
    assert left.hopf.speed == pytest.approx(right.hopf.speed, rel=1e-8)
    np.testing.assert_allclose(left.speed, right.speed, rtol=1e-5)  # steps differ by half a period


# -------------------------------------------------------------------- parameters and maps


def test_a_branch_in_conicity_meets_the_branch_in_speed(cooperrider, cooperrider_branch):
    start = cooperrider_branch.at(70.0, stable=True)[0]
    along = design.cycle_branch(
        cooperrider, start=start, parameter="conicity", parameter_range=(0.045, 0.055), direction=1
    )
    assert along.value[-1] == pytest.approx(0.055)
    worn = design.simulated_cycle(
        cooperrider.replace(conicity=0.055),
        speed=start.speed,
        initial_state=along.cycles[-1].states[0],
        perturbation={"y_w1": 1e-4},
        duration=10.0,
    )
    assert worn.amplitude["y_w1"] == pytest.approx(along.amplitude["y_w1"][-1], rel=1e-4)
    assert worn.frequency == pytest.approx(along.frequency[-1], rel=1e-5)


def test_map_over_conicity_agrees_with_whole_branches(cooperrider):
    chart = design.hunting_map(cooperrider, "conicity", [0.05, 0.055, 0.06])
    for value, hopf, fold in zip(chart.value, chart.hopf_speed, chart.onset_speed, strict=True):
        branch = design.cycle_branch(cooperrider.replace(conicity=value), parameter_range=(50.0, 69.0))
        assert hopf == pytest.approx(branch.hopf.speed, rel=1e-8)
        assert fold == pytest.approx(branch.nonlinear_critical_speed, rel=1e-5)


# ------------------------------------------------------------------- simulation and plots


def test_simulated_diagram_shows_the_stable_motions_of_the_branch(cooperrider, cooperrider_branch):
    speeds = np.array([64.0, 68.0, 72.0])
    large = {"y_w1": 8e-3, "y_w2": 8e-3, "y_b": 8e-3}
    diagram = design.simulated_diagram(
        cooperrider, speeds, starts=[{"y_w1": 1e-4}, large], duration=60.0, window=1.0
    )
    small, big = diagram.amplitude["y_w1"][0].T
    assert (small[:2] < 1e-5).all()
    assert big[0] < 1e-5
    on = cooperrider_branch.stable
    curve = cooperrider_branch.speed[on], cooperrider_branch.amplitude["y_w1"][on]
    expected = np.interp([68.0, 72.0, 72.0], *curve)
    np.testing.assert_allclose([big[1], big[2], small[2]], expected, rtol=5e-3)
    assert diagram.steady.all()


def test_an_interrupted_diagram_keeps_its_radii(coach, monkeypatch):
    import sys

    module = sys.modules["design.cycles.diagram"]
    one = module._one_curve

    def interrupted(model, speeds, radius, *rest):
        if radius == 6250.0:
            raise KeyboardInterrupt
        return one(model, speeds, radius, *rest)

    monkeypatch.setattr(module, "_one_curve", interrupted)
    diagram = design.simulated_diagram(
        coach, [80.0], radii=[math.inf, 6250.0], cant=0.0, duration=0.5, window=0.2
    )
    assert diagram.radius.tolist() == [math.inf]
    assert diagram.ended == "interrupted after 1 of 2 radii"


def test_disturbance_test_finds_hunting_between_fold_and_hopf_point(coach, coach_branch):
    found = design.disturbance_test(coach, np.linspace(85.0, 116.0, 32))
    assert coach_branch.nonlinear_critical_speed < found.critical_speed < coach_branch.hopf.speed
    assert "goes on hunting" in str(found)
    below = design.disturbance_test(coach, [70.0, 80.0])
    assert below.critical_speed is None


def test_ramp_up_from_rest_begins_to_hunt_above_the_hopf_point(cooperrider):
    ramp = design.speed_ramp(cooperrider, start=68.0, stop=72.0, rate=0.1, perturbation={"y_w1": 1e-5})
    assert 68.644 < ramp.critical_speed < 72.0
    assert "begins" in str(ramp)


def test_spectrum_of_a_sine_is_exact():
    import control

    time = np.linspace(0.0, 40.0, 8001)
    wave = 3.0 * np.sin(2.0 * np.pi * 2.734 * time) + 1.0
    response = control.TimeResponseData(
        time, wave[None], wave[None], None, issiso=False, output_labels=["y"], state_labels=["y"]
    )
    found = design.spectrum(response)
    assert found.main_frequency == pytest.approx(2.734, abs=1e-3)
    assert found.rms == pytest.approx(3.0 / math.sqrt(2.0), rel=1e-3)
    assert np.trapezoid(found.density, found.frequency) == pytest.approx(found.rms**2, rel=1e-2)


def test_everything_can_be_drawn(cooperrider, cooperrider_branch, coach):
    branch = cooperrider_branch
    diagram = design.simulated_diagram(
        cooperrider, [66.0, 70.0], duration=1.0, window=0.5, radii=[math.inf]
    )
    response = railenv.simulate(cooperrider, speed=70.0, perturbation={"y_w1": 1e-3}, duration=4.0)
    chart = design.hunting_map(cooperrider, "conicity", [0.05, 0.052])
    ramp = design.speed_ramp(cooperrider, start=70.0, stop=69.0, rate=0.5, cycle=branch.cycles[-1])
    drawn = [
        branch.plot(),
        branch.plot("psi_w1"),
        branch.cycles[-1].plot(("y_w1", "psi_w1")),
        branch.hopf.hopf.plot(),
        diagram.plot(),
        diagram.plot(ax=np.ravel(branch.plot().axes)[0]),
        design.phase_portrait(response, ("y_w1", "y_w2"), skip=1.0),
        design.spectrum(response).plot(),
        chart.plot(),
        ramp.plot(),
        design.DisturbanceTest(diagram, "y_w1", 1e-3).plot(),
    ]
    for plot in drawn:
        axes = np.ravel(plot.axes)[0]
        assert axes.lines or axes.patches
    text = [t.get_text() for t in np.ravel(drawn[0].axes)[0].get_legend().get_texts()]
    assert "fold at 66.66 m/s" in text
    assert "Hopf point at 68.64 m/s" in text
    assert "flange clearance 9.1 mm" in text
    plt.close("all")


def test_summary_and_text_of_a_branch_tell_its_fold(coach_branch):
    at_fold = coach_branch.folds[0]
    assert at_fold.precision < 1e-6
    assert len(coach_branch.summary()["speed"]) == len(coach_branch)
    assert "from speed 91.419 m/s (fold" in str(coach_branch)
