"""Linear models, closed loops and margins of vehicles of all kinds, with actuators of all kinds."""

import math

import numpy as np
import pytest

import design
import railenv
from design.linear.regulator import kalman, lateral_states, lqr
from railenv.errors import ParameterError, UnknownNameError
from tests.vehicles import EQUIPPED, sprung_wheelset

SPEED = {"both": 140.0, "own": 20.0, "lateral": 36.0}
"""m/s, at which a regulator is designed: most of the vehicles hunt there."""

every = pytest.mark.parametrize("name", list(EQUIPPED))


def regulated(name):
    """Return a model, a speed, and the gain of a regulator there from all states."""
    model, speed = EQUIPPED[name](), SPEED[name]
    found = lqr(model, speed=speed)
    labels = found.system.state_labels
    past = [label for label in labels if label not in model.state_names]
    columns = [*model.state_names, *past]
    gain = np.zeros((len(model.command_names), len(columns)))
    gain[:, [columns.index(label) for label in labels]] = found.gain
    return model, speed, gain


@every
def test_linear_model_has_every_command_and_sensor(name):
    model = EQUIPPED[name]()
    system = design.linearize(
        model, speed=SPEED[name], inputs=model.command_names, outputs=model.sensor_names
    )
    assert list(system.input_labels) == list(model.command_names)
    assert list(system.output_labels) == [f"{s}_{b}" for b in model.sensed for s in ("accel", "gyro")]
    # an actuator acts through its lag: its command moves its own state's rate, nothing else
    for k, mount in enumerate(model.equipment.mounts):
        moved = np.flatnonzero(system.B[:, k])
        assert [model.state_names[i] for i in moved] == [mount.state_names[1]]


@every
def test_regulator_keeps_stable_what_hunts(name):
    model, speed, gain = regulated(name)
    alone = np.linalg.eigvals(design.linearize(model, speed=speed).A).real.max()
    closed = design.closed_loop(model, gain, speed=speed)
    assert closed.stable
    assert closed.growth < alone
    lone = design.critical_speed(model, speed_range=(5.0, 250.0))
    both = design.critical_speed(model, controller=gain, speed_range=(0.8 * speed, 250.0))
    assert both.loss == "none" or both.speed > lone.speed


@every
def test_regulator_weighs_each_command_by_its_own_limit(name):
    model = EQUIPPED[name]()
    found = lqr(model, speed=SPEED[name])
    np.testing.assert_allclose(np.diag(found.command_weight), 1.0 / model.limits**2)
    # the gain minimises the cost: Riccati's equation holds in SI units
    A, B, P = found.system.A, found.system.B, found.cost
    K = np.linalg.solve(found.command_weight + B.T @ P @ B, B.T @ P @ A)
    scale = np.abs(K).max(axis=1, keepdims=True)
    assert (np.abs(K - found.gain) / scale).max() < 1e-5


@every
def test_margins_of_every_command(name):
    model, speed, gain = regulated(name)
    found = design.margins(model, gain, speed=speed, longest_delay=0.02)
    assert [channel.channel for channel in found.channels] == list(model.command_names)
    assert found.delay == model.delay
    for channel in found.channels:
        assert channel.gain_margin > 1.0 > channel.gain_reduction
        assert found.disk_margin <= channel.disk_margin * (1.0 + 1e-5)  # both are searched


@every
def test_observer_follows_the_sensors(name):
    model = EQUIPPED[name]()
    found = kalman(model, speed=SPEED[name])
    error = found.A @ (np.eye(len(found.A)) - found.M @ found.C)
    assert np.abs(np.linalg.eigvals(error)).max() < 1.0


@every
def test_loci_and_maps(name):
    model, speed, gain = regulated(name)
    locus = design.speed_locus(model, [speed, speed + 5.0], controller=gain)
    assert locus.loci.real.max() == pytest.approx(
        max(design.closed_loop(model, gain, speed=v).growth for v in (speed, speed + 5.0)), rel=1e-6
    )
    axes = {"speed": [speed, speed + 5.0], "delay": [model.delay, model.delay + 1e-3]}
    found = design.stability_map(model, axes, controller=gain, quantity="growth", n_jobs=1)
    np.testing.assert_allclose(found.growth[:, 0], locus.loci.real.max(axis=1), rtol=1e-6)
    assert found.axes[1].unit == "s"


def test_robust_critical_speed_over_a_parameter_of_ones_own():
    model, _, gain = regulated("own")
    found = design.robust_critical_speed(
        model, gain, {"conicity": (0.04, 0.06)}, samples=2, speed_range=(10.0, 60.0)
    )
    at_nominal = design.critical_speed(model, controller=gain, speed_range=(10.0, 60.0))
    assert found.speed <= (at_nominal.speed or 60.0)


def test_lateral_states_leave_out_heave_and_pitch_only():
    model = EQUIPPED["both"]()
    left_out = set(model.state_names) - set(lateral_states(model, sensors=True))
    assert {name.removeprefix("d")[0] for name in left_out} == {"z"}
    own = EQUIPPED["own"]()
    assert lateral_states(own, sensors=True) == list(own.state_names)


def test_one_delay_for_all_kinds_of_actuators():
    model = EQUIPPED["both"]()
    assert model.replace(delay=0.02).delay == 0.02
    with pytest.raises(UnknownNameError, match="primary_delay"):
        model.replace(primary_delay=0.02)


def test_a_regulator_needs_something_to_weigh():
    def mass(x, u, speed, curvature, cant, p):
        return [x[1], -p.k * x[0] + u[0]]

    body = railenv.MovingBody(name="b", y="y", lateral_force="F")
    plant = railenv.Model("mass", ["y", "dy"], ["F"], mass, {"k": 4.0}, bodies=[body])
    model = railenv.Equipped(plant, actuators=[railenv.LateralActuator(between=("b", "ground"))])
    with pytest.raises(ParameterError, match="no wheelsets"):
        lqr(model, speed=10.0)


def test_mode_shape_of_a_sprung_wheelset_is_drawn_in_plan():
    plant = sprung_wheelset()
    critical = design.critical_speed(plant)
    shape = critical.mode_shape
    assert shape.names == ("y", "psi")
    assert [body.name for body in shape.geometry.bodies] == ["w"]
    drawn = shape.plot(phases=(0.0,))
    centre = next(line for line in drawn.axes[0, 0].lines if line.get_marker() == "o")
    assert np.sign(centre.get_ydata()[0]) == np.sign(shape.at(0.0)[0])
    assert math.isclose(shape.geometry.half_gauge, 0.75)
