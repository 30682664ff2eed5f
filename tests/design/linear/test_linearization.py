"""Operating points and linear models."""

import control
import numpy as np
import pytest

import design
import railenv
from railenv.errors import UnknownNameError


def test_equilibrium_is_an_operating_point_without_motion():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    point = design.equilibrium(model, speed=80.0, radius=6250.0, cant=0.0873)
    assert isinstance(point, control.OperatingPoint)
    derivative = model.rhs(point.states, point.inputs, speed=80.0, curvature=1 / 6250.0, cant=0.0873)
    assert np.abs(derivative).max() < 1e-6
    assert point.result["y_w1"] == point.states[0]


def test_linear_model_carries_the_names_of_the_signals():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    system = design.linearize(model, speed=100.0)
    assert isinstance(system, control.StateSpace)
    assert tuple(system.state_labels) == model.state_names
    assert tuple(system.input_labels) == model.input_names
    assert tuple(system.output_labels) == model.state_names
    chosen = design.linearize(model, speed=100.0, outputs=["y_b", "dpsi_b"])
    assert chosen.output_labels == ["y_b", "dpsi_b"]
    np.testing.assert_array_equal(chosen.C, system.C[[8, 23]])


def test_linear_model_equals_python_controls_own_linearisation():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    state = design.equilibrium(model, speed=60.0, radius=2500.0, cant=0.0873).states
    own = design.linearize(model, speed=60.0, radius=2500.0, cant=0.0873)
    nonlinear = model.to_nlsys(speed=60.0, radius=2500.0, cant=0.0873)
    other = nonlinear.linearize(state, np.zeros(model.n_inputs), eps=1e-9)
    scale = np.abs(own.A).max(axis=1, keepdims=True)
    assert np.abs((own.A - other.A) / scale).max() < 1e-4  # theirs is a forward difference


def test_linear_model_predicts_a_small_motion_of_the_nonlinear_one():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    start = np.zeros(24)
    start[[0, 4]] = 1e-7
    system = design.linearize(model, speed=90.0)
    response = railenv.simulate(
        model, speed=90.0, perturbation={"y_w1": 1e-7, "y_w2": 1e-7}, duration=1.0
    )
    linear = control.initial_response(system, response.time, start)
    difference = response.outputs - response.outputs[:, [0]] + start[:, None] - linear.outputs
    assert np.abs(difference[:12]).max() < 2e-3 * 1e-7


def test_unknown_output_is_refused():
    with pytest.raises(UnknownNameError, match=r"'y_w3'.*allowed are y_w1"):
        design.linearize(railenv.Bogie(railenv.HIGH_SPEED_COACH), speed=100.0, outputs=["y_w3"])


def test_unknown_keywords_are_refused_by_every_public_function():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    calls = {
        design.critical_speed: (model,),
        design.curve_sweep: (model, [1000.0]),
        design.speed_locus: (model, [10.0, 20.0]),
        design.equilibrium: (model,),
        design.linearize: (model,),
        railenv.simulate: (model,),
        railenv.find_equilibrium: (model,),
    }
    for function, arguments in calls.items():
        with pytest.raises(TypeError, match="sped"):
            function(*arguments, sped=100.0)
