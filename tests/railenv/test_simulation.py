"""Simulation in time against linear theory, other integrators and the plant's own equilibrium."""

import math

import control
import numpy as np
import pytest

import design
import railenv
from railenv.errors import ParameterError, SimulationError, UnknownNameError

COACH = railenv.Bogie(railenv.HIGH_SPEED_COACH)
ALL_BODIES = {"y_w1": 1e-5, "y_w2": 1e-5, "y_b": 1e-5}


def amplitude(response, start, stop):
    inside = (response.time >= start) & (response.time < stop)
    return np.ptp(response.outputs[0, inside]) / 2.0


@pytest.mark.parametrize(
    ("model", "critical", "radius", "cant"),
    [
        (COACH, 116.474, math.inf, 0.0),
        (railenv.DualWheelset(railenv.TABLE_1), 34.177, math.inf, 0.0),
        (railenv.CooperriderBogie(), 68.644, math.inf, 0.0),
        (COACH, 90.134, 6250.0, 0.0873),
    ],
    ids=["coach", "table_1_dual_wheelset", "cooperrider", "coach_at_6250_m"],
)
def test_disturbance_decays_below_and_grows_above_the_critical_speed(model, critical, radius, cant):
    kick = {n: 1e-6 for n in model.state_names if n in ALL_BODIES}
    for factor, grows in ((0.98, False), (1.02, True)):
        response = railenv.simulate(
            model, speed=factor * critical, radius=radius, cant=cant, perturbation=kick, duration=12.0
        )
        ratio = amplitude(response, 9.0, 12.0) / amplitude(response, 6.0, 9.0)
        assert (ratio > 1.0) == grows


def test_growth_and_frequency_of_hunting_are_those_of_the_critical_eigenvalue():
    speed = 118.0
    poles = design.linearize(COACH, speed=speed).poles()
    hunting = poles[np.argmax(poles.real)]
    response = railenv.simulate(COACH, speed=speed, perturbation={"y_w1": 1e-8}, duration=20.0)
    first, second = amplitude(response, 6.0, 10.0), amplitude(response, 14.0, 18.0)
    assert math.log(second / first) / 8.0 == pytest.approx(hunting.real, rel=0.02)
    y = response.outputs[0, response.time > 5.0]
    t = response.time[response.time > 5.0]
    crossings = t[1:][(y[:-1] < 0) & (y[1:] >= 0)]
    period = np.diff(crossings).mean()
    assert 1.0 / period == pytest.approx(abs(hunting.imag) / (2 * math.pi), rel=1e-3)


def test_response_is_python_controls_with_names_and_conditions():
    response = railenv.simulate(COACH, speed=50.0, radius=2000.0, cant=0.05, duration=0.1)
    assert isinstance(response, control.TimeResponseData)
    assert tuple(response.output_labels) == COACH.state_names
    assert response.input_labels == [*COACH.input_names, "speed", "curvature", "cant"]
    np.testing.assert_allclose(response.inputs[-3:, -1], [50.0, 1 / 2000.0, 0.05])
    assert response.time[-1] == pytest.approx(0.1)


def test_equilibrium_stays_where_it_is():
    response = railenv.simulate(COACH, speed=60.0, radius=2500.0, cant=0.0873, duration=5.0)
    drift = np.abs(response.outputs - response.outputs[:, [0]])
    assert drift.max() < 1e-11


@pytest.mark.parametrize("method", ["DOP853", "Radau", "LSODA"])
def test_runge_kutta_in_the_kernel_agrees_with_scipy(method):
    common = {"speed": 100.0, "perturbation": {"y_w1": 4e-3, "psi_w2": 1e-3}, "duration": 2.0}
    other = railenv.simulate(COACH, method=method, **common)
    for step, tolerance in ((None, 1e-7), (1e-4, 1e-9)):
        own = railenv.simulate(COACH, step=step, **common)
        np.testing.assert_allclose(own.outputs[:12], other.outputs[:12], rtol=0.0, atol=tolerance)


def test_varying_speed_track_and_inputs_agree_with_scipy():
    track = railenv.Track.into_curve(
        radius=4000.0, cant=0.08, straight=50.0, transition=120.0, curve=60.0
    )
    common = {
        "speed": lambda t: 45.0 + 5.0 * t,
        "track": track,
        "inputs": {"M_b": lambda t: 2e3 * np.sin(6.0 * t), "align_w1": 1e-4},
        "duration": 7.0,
    }
    own = railenv.simulate(COACH, **common)
    other = railenv.simulate(COACH, method="LSODA", **common)
    np.testing.assert_allclose(own.outputs[:12], other.outputs[:12], atol=2e-6)
    speed, curvature = (own.inputs[own.input_labels.index(n)] for n in ("speed", "curvature"))
    assert speed[-1] == pytest.approx(80.0)
    assert curvature.max() == pytest.approx(1 / 4000.0, rel=1e-3)
    assert curvature[-1] == 0.0  # back on the straight
    assert own.inputs[COACH.input_names.index("M_b")].max() == pytest.approx(2e3, rel=1e-3)


def test_train_settles_into_the_curves_own_equilibrium_behind_a_transition():
    track = railenv.Track.into_curve(radius=6250.0, cant=0.0873, straight=50.0, transition=250.0)
    response = railenv.simulate(COACH, speed=80.0, track=track, duration=15.0)
    settled = railenv.find_equilibrium(COACH, speed=80.0, radius=6250.0, cant=0.0873).state
    np.testing.assert_allclose(response.outputs[:12, -1], settled[:12], atol=1e-8)


def test_long_run_in_chunks_equals_one_without(monkeypatch):
    common = {"speed": lambda t: 60.0 + t, "perturbation": {"y_w1": 1e-3}, "duration": 1.0}
    whole = railenv.simulate(COACH, **common)
    monkeypatch.setattr(railenv.simulation, "_CHUNK", 37)
    pieces = railenv.simulate(COACH, **common)
    np.testing.assert_allclose(pieces.outputs, whole.outputs, atol=1e-13)


def test_perturbation_is_added_to_the_equilibrium_by_name():
    at_rest = railenv.find_equilibrium(COACH, speed=50.0).state
    response = railenv.simulate(COACH, speed=50.0, perturbation={"psi_b": 1e-3}, duration=0.01)
    expected = at_rest.copy()
    expected[COACH.state_names.index("psi_b")] += 1e-3
    np.testing.assert_allclose(response.outputs[:, 0], expected, atol=1e-15)


def test_initial_state_replaces_the_equilibrium():
    start = railenv.find_equilibrium(COACH, speed=30.0, radius=250.0, cant=0.0873).state
    response = railenv.simulate(COACH, speed=50.0, initial_state=start, duration=0.01)
    np.testing.assert_array_equal(response.outputs[:, 0], start)


@pytest.mark.parametrize("method", ["RK4", "RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA"])
def test_divergence_to_infinity_is_an_error_that_keeps_what_was_computed(method):
    model = railenv.Model("explosive", ["q"], [], _explosive, {})
    arguments = {"initial_state": [1.0], "duration": 2.0, "step": 1e-4, "method": method}
    with pytest.raises(SimulationError, match=r"no longer finite after [01]\.?\d* s") as caught:
        railenv.simulate(model, speed=10.0, **arguments)
    kept = caught.value.response
    assert 0.9 < kept.time[-1] < 1.1  # q = 1/(1 - t)
    tolerance = 1e-6 if method == "RK4" else 1e-4
    assert kept.outputs[0, np.searchsorted(kept.time, 0.5)] == pytest.approx(2.0, rel=tolerance)


METHODS = ["RK4", "RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA"]


@pytest.mark.parametrize("method", METHODS)
def test_callers_whose_numpy_raises_get_the_same(method):
    arguments = {"duration": 0.2, "method": method, "perturbation": {"y_w1": 1e-3}}
    expected = railenv.simulate(COACH, speed=100.0, **arguments).states
    with np.errstate(all="raise"):
        found = railenv.simulate(COACH, speed=100.0, **arguments).states
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("method", METHODS)
def test_callers_whose_numpy_raises_are_told_of_divergence_in_the_same_way(method):
    model = railenv.Model("explosive", ["q"], [], _explosive, {})
    arguments = {"initial_state": [1.0], "duration": 2.0, "step": 1e-4, "method": method}
    with np.errstate(all="raise"), pytest.raises(SimulationError, match="no longer finite"):
        railenv.simulate(model, speed=10.0, **arguments)


def test_functions_of_time_keep_the_callers_treatment_of_floating_point_errors():
    def force(times):
        return 1.0 / (0.1 - np.minimum(times, 0.1))

    arguments = {"duration": 0.2, "method": "RK45", "inputs": {"M_b": force}}
    with np.errstate(all="raise"), pytest.raises(FloatingPointError):
        railenv.simulate(COACH, speed=100.0, **arguments)


@pytest.mark.parametrize("method", ["RK4", "RK45", "Radau", "LSODA"])
def test_initial_state_with_infinite_forces_is_refused(method):
    with pytest.raises(ParameterError, match="forces of bogie are not finite there"):
        railenv.simulate(COACH, speed=99.0, initial_state=[1e200] * 24, duration=0.1, method=method)


@pytest.mark.parametrize("speed", [0.0, -3.0, math.nan, lambda t: 10.0 - 20.0 * t])
def test_speed_that_is_not_positive_is_refused(speed):
    with pytest.raises(ParameterError, match="speed"):
        railenv.simulate(COACH, speed=speed, duration=1.0)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"perturbation": {"y_w9": 1.0}}, UnknownNameError, "y_w9.*did you mean"),
        ({"inputs": {"M_c": 1.0}}, UnknownNameError, "M_c"),
        ({"inputs": {"M_b": math.nan}}, ParameterError, "M_b is nan"),
        ({"inputs": {"M_b": lambda t: np.nan * t}}, ParameterError, "M_b at 0 s is nan"),
        ({"speed": object}, ParameterError, "speed is <class 'object'>, which is not a number"),
        ({"inputs": {"M_b": float}}, ParameterError, "M_b is <class 'float'>, which is not a number"),
        ({"duration": 0.0}, ParameterError, "duration is 0 s"),
        ({"step": -1e-3}, ParameterError, "step is -0.001 s"),
        ({"method": "Euler"}, ParameterError, "method is 'Euler'"),
        ({"initial_state": [0.0, 1.0]}, ParameterError, "initial_state has shape"),
        ({"track": railenv.Track.circular(500.0), "radius": 500.0}, ParameterError, "not both"),
    ],
)
def test_bad_arguments_name_quantity_and_value(arguments, error, message):
    with pytest.raises(error, match=message):
        railenv.simulate(COACH, **{"speed": 50.0, "duration": 1.0, **arguments})


@pytest.mark.parametrize("method", ["RK4", "RK45", "DOP853", "Radau", "BDF", "LSODA"])
def test_modes_too_fast_to_follow_are_told(method):
    with pytest.raises(ParameterError, match=r"the step that the fastest mode asks for is .* at least"):
        railenv.simulate(COACH, speed=1e-90, duration=0.01, method=method)  # creepage over speed


def _explosive(x, u, speed, curvature, cant, p):
    return [x[0] * x[0]]
