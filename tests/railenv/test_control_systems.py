"""Models as systems of python-control."""

import copy
import pickle
import sys
from concurrent.futures import ThreadPoolExecutor

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import railenv
from railenv.errors import ParameterError
from tests.railenv.own_models import (
    PENDULUM,
)


def test_control_system_has_the_models_dynamics_and_names(any_model, operations):
    tangent_only = any_model.name == "cooperrider"
    radius, cant = (np.inf, 0.0) if tangent_only else (-1200.0, -0.08)
    system = any_model.to_nlsys(speed=40.0, radius=radius, cant=cant)
    assert isinstance(system, control.NonlinearIOSystem)
    assert tuple(system.state_labels) == any_model.state_names
    assert tuple(system.output_labels) == any_model.state_names
    assert tuple(system.input_labels) == any_model.input_names
    for o in operations(any_model, 8, seed=7):
        expected = any_model.rhs(o.x, o.u, speed=40.0, curvature=1.0 / radius, cant=cant)
        assert_array_equal(system.dynamics(0.0, o.x, o.u), expected)
        assert_array_equal(system.output(0.0, o.x, o.u), o.x)


def test_control_simulates_what_the_package_simulates(cooperrider):
    start = np.zeros(14)
    start[:4] = 1e-3, 0.0, -5e-4, 1e-4
    times = np.linspace(0.0, 0.3, 61)
    system = cooperrider.to_nlsys(speed=60.0)
    inputs = np.vstack([np.full_like(times, 500.0), np.zeros((2, len(times)))])
    theirs = control.input_output_response(
        system, times, inputs, start, solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-12}
    )
    ours = railenv.simulate(
        cooperrider,
        speed=60.0,
        initial_state=start,
        inputs={"M_w1": 500.0},
        duration=0.3,
        step=1e-4,
    )
    assert_allclose(ours.time, times, atol=1e-12)
    scale = np.abs(theirs.states).max(axis=1, keepdims=True)
    assert (np.abs(ours.states - theirs.states) <= 1e-6 * scale).all()


def test_control_linearises_to_the_analytic_jacobian(coach):
    x = railenv.find_equilibrium(coach, speed=80.0).state
    linear_system = coach.to_nlsys(speed=80.0).linearize(x, np.zeros(coach.n_inputs), eps=1e-8)
    A, B = coach.jacobian(x, speed=80.0)
    for numerical, exact in ((linear_system.A, A), (linear_system.B, B)):
        # one-sided differences, of columns of very different sizes
        assert (np.abs(numerical - exact) <= 1e-4 * np.abs(exact).max(axis=0)).all()


def test_control_system_survives_pickling(coach, operations):
    system = coach.to_nlsys(speed=130.0, radius=3000.0, cant=0.05)
    (o,) = operations(coach, 1, seed=3)
    expected = system.dynamics(0.0, o.x, o.u)  # once called, it holds what cannot be pickled
    for other in (pickle.loads(pickle.dumps(system)), copy.deepcopy(system)):
        assert other.state_labels == system.state_labels
        assert_array_equal(other.dynamics(0.0, o.x, o.u), expected)


def test_control_system_called_by_several_threads_gives_what_one_gives(coach, operations):
    system = coach.to_nlsys(speed=130.0)
    points = operations(coach, 20, seed=4)
    expected = [system.dynamics(0.0, o.x, o.u) for o in points]
    switching = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as executor:
            wrong = sum(executor.map(lambda _: _differing(system, points, expected), range(4)))
    finally:
        sys.setswitchinterval(switching)
    assert wrong == 0


def _differing(system, points, expected, rounds=150):
    wrong = 0
    for _ in range(rounds):
        for o, value in zip(points, expected, strict=True):
            wrong += not np.array_equal(system.dynamics(0.0, o.x, o.u), value)
    return wrong


def test_control_system_of_an_own_model():
    system = PENDULUM.to_nlsys(speed=9.0)
    assert system.name == "pendulum"
    assert_allclose(system.dynamics(0.0, [0.1, 0.2], [0.3]), PENDULUM.rhs([0.1, 0.2], [0.3], speed=9.0))


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ({"speed": 0.0}, "speed is 0 m/s"),
        ({"speed": 30.0, "radius": 0.0}, "radius is 0 m; its magnitude must be at least 1 m"),
        ({"speed": 30.0, "radius": np.nan}, "radius is nan"),
        ({"speed": 30.0, "cant": 2.0}, "cant is 2 rad"),
    ],
)
def test_control_system_refuses_impossible_conditions(bogie, where, message):
    with pytest.raises(ParameterError, match=message):
        bogie.to_nlsys(**where)
