"""Linear models for design: signals, exact sampling with delay, reductions."""

import control
import numpy as np
import pytest

import design
import railenv
from railenv.errors import ParameterError, UnknownNameError


@pytest.fixture(scope="module")
def equipped():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))


def response(system, omega):
    s = 1j * omega if system.isctime() else np.exp(1j * omega * system.dt)
    resolvent = np.linalg.solve(s * np.eye(system.nstates) - system.A, system.B.astype(complex))
    return system.C @ resolvent + system.D


def test_signals_of_an_equipped_vehicle_are_outputs_with_exact_derivatives(equipped):
    outputs = ["accel_b", "force_b", "Y_left_w1", "Q_right_w2"]
    system = design.linearize(equipped, speed=70.0, radius=6000.0, cant=0.05, outputs=outputs)
    at = {"speed": 70.0, "curvature": 1 / 6000.0, "cant": 0.05}
    x = design.equilibrium(equipped, speed=70.0, radius=6000.0, cant=0.05).states
    rng = np.random.default_rng(1)
    dx = 1e-7 * equipped.scale * rng.normal(size=equipped.n_states)
    du = 1e-9 * rng.normal(size=equipped.n_inputs)
    up, down = (equipped.signals(x + s * dx, s * du, **at) for s in (1.0, -1.0))
    change = dict(zip(equipped.signal_names, (up - down) / 2.0, strict=True))
    predicted = dict(zip(outputs, system.C @ dx + system.D @ du, strict=True))
    for name in outputs[1:]:
        assert predicted[name] == pytest.approx(change[name], rel=1e-5)
    assert predicted["accel_b"] == dx[equipped.state_names.index("accel_b")]


def test_inputs_and_outputs_are_chosen_by_name(equipped):
    system = design.linearize(equipped, speed=90.0, inputs=["command_b", "align_w2"])
    full = design.linearize(equipped, speed=90.0)
    assert system.input_labels == ["command_b", "align_w2"]
    np.testing.assert_array_equal(system.B, full.B[:, [0, full.input_labels.index("align_w2")]])
    with pytest.raises(UnknownNameError, match="'command_w1'"):
        design.linearize(equipped, speed=90.0, inputs=["command_w1"])
    with pytest.raises(UnknownNameError, match="'Y_left_w3'"):
        design.linearize(equipped, speed=90.0, outputs=["Y_left_w3"])


def test_sampling_without_delay_is_python_controls_zero_order_hold(equipped):
    system = design.linearize(equipped, speed=90.0, inputs=["command_b", "align_w1"])
    own, theirs = design.discretize(system, 0.005), control.c2d(system, 0.005, "zoh")
    for matrix in "ABCD":
        ours, reference = getattr(own, matrix), getattr(theirs, matrix)
        assert np.abs(ours - reference).max() <= 1e-9 * np.abs(reference).max()
    assert own.state_labels == system.state_labels
    assert own.dt == 0.005


@pytest.mark.parametrize("delay", [0.005, 0.0075, 0.01, 0.0123])
def test_sampling_with_delay_is_a_fine_simulation_of_held_and_delayed_commands(equipped, delay):
    T = 0.005
    system = design.linearize(equipped, speed=90.0, inputs=["command_b", "align_w1"])
    sampled = design.discretize(system, T, delay=delay, delayed=["command_b"])
    rng = np.random.default_rng(0)
    commands = 1e4 * rng.normal(size=12)
    rails = 1e-3 * rng.normal(size=12)

    fine = 1e-5  # s, a divisor of the period and of all delays but for 1e-16
    steps = round(10 * T / fine)
    x, z = np.zeros(system.nstates), np.zeros(sampled.nstates)
    for i in range(steps):
        middle = (i + 0.5) * fine
        k = int(np.floor((middle - delay) / T))
        drive = system.B @ [commands[k] if k >= 0 else 0.0, rails[int(middle / T)]]
        k1 = system.A @ x + drive
        k2 = system.A @ (x + fine / 2 * k1) + drive
        k3 = system.A @ (x + fine / 2 * k2) + drive
        k4 = system.A @ (x + fine * k3) + drive
        x = x + fine / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    for k in range(10):
        z = sampled.A @ z + sampled.B @ [commands[k], rails[k]]
    scale = np.abs(x).max()
    assert np.abs(z[: system.nstates] - x).max() < 1e-6 * scale
    past = [label for label in sampled.state_labels if "[-" in label]
    assert past[0] == "command_b[-1]"
    assert z[sampled.state_labels.index("command_b[-1]")] == commands[9]


def test_sampling_refuses_what_it_cannot_do(equipped):
    system = design.linearize(equipped, speed=90.0, outputs=["Y_left_w1"])
    with pytest.raises(ParameterError, match="acts on an output directly"):
        design.discretize(system, 0.005, delay=0.01)
    with pytest.raises(ParameterError, match="period is 0 s"):
        design.discretize(system, 0.0)
    with pytest.raises(ParameterError, match="must be in continuous time"):
        design.discretize(design.discretize(system, 0.005), 0.005)
    with pytest.raises(UnknownNameError, match="delayed input"):
        design.discretize(system, 0.005, delay=0.01, delayed=["command_x"])


def test_double_modes_and_what_inputs_cannot_reach_leave_a_minimal_realisation():
    dual = railenv.DualWheelset(railenv.TABLE_1)
    system = design.linearize(dual, speed=30.0, inputs=["M_w1"], outputs=["y_w1", "y_w2"])
    small = design.minimal(system)
    assert small.nstates == 6  # lateral motion of one wheelset
    assert small.input_labels == ["M_w1"]
    assert small.output_labels == ["y_w1", "y_w2"]
    bogie = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    lateral = design.linearize(bogie, speed=100.0, inputs=["M_b"], outputs=["y_b", "psi_b"])
    assert design.minimal(lateral).nstates == 18  # y, phi, psi of three bodies; no vertical motion
    for full in (system, lateral):
        for reduced in (design.minimal(full), design.transfer_function(full)):
            for omega in (0.1, 5.0, 30.0, 200.0):
                there = response(full, omega)
                here = reduced(1j * omega).reshape(there.shape)
                assert np.abs(here - there).max() < 1e-6 * np.abs(there).max()


def test_a_tolerance_that_loses_the_response_is_refused(equipped):
    system = design.linearize(
        equipped, speed=100.0, inputs=["command_b"], outputs=["accel_b", "gyro_b"]
    )
    with pytest.raises(ParameterError, match=r"tolerance is 0.01.*frequency response"):
        design.minimal(system, tolerance=0.01)


def test_balanced_reduction_converges_and_keeps_unstable_modes(equipped):
    for speed in (100.0, 130.0):
        system = design.linearize(
            equipped, speed=speed, inputs=["command_b"], outputs=["accel_b", "gyro_b"]
        )
        omegas = np.geomspace(1.0, 500.0, 40)
        size = max(np.abs(response(system, w)).max() for w in omegas)
        errors = []
        for order in (6, 10, 16):
            reduced = design.balanced(system, order)
            assert reduced.nstates == order
            assert reduced.output_labels == ["accel_b", "gyro_b"]
            errors.append(max(np.abs(response(reduced, w) - response(system, w)).max() for w in omegas))
        assert errors[0] > errors[1] > errors[2]
        assert errors[-1] < 1e-4 * size
        unstable = system.poles()[system.poles().real > 1e-6]
        for pole in unstable:
            assert np.abs(design.balanced(system, 6).poles() - pole).min() < 1e-6 * abs(pole)
    with pytest.raises(ParameterError, match="at least 2, the number of unstable modes"):
        design.balanced(system, 1)
    with pytest.raises(ParameterError, match="order is 99"):
        design.balanced(system, 99)
