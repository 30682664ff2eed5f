"""Sampled-data closed loop: against simulation of the environment, python-control and brute force."""

import math

import control
import numpy as np
import pytest

import agents
import design
import railenv
from agents.controllers.scheduled import readings_of
from design.loop.sampled import SampledDynamics
from railenv.errors import EquilibriumError, ParameterError, UnknownNameError


@pytest.fixture(scope="module")
def coach():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))


def soft_gain(model):
    """A state feedback of a quarter of the LQR's gain: it loses stability within reach."""
    regulator = design.lqr(model, speed=130.0)
    labels = [*model.state_names, *[n for n in regulator.system.state_labels if "[-" in n]]
    gain = np.zeros((1, len(labels)))
    gain[:, [labels.index(n) for n in regulator.system.state_labels]] = 0.25 * regulator.gain
    return gain, labels


def as_controller(model, gain, labels):
    """The same matrix as a controller that reads the environment's observation."""
    readings = readings_of(model, "state")
    signals = [reading.signal for reading in readings]
    D = np.zeros((1, 1, len(signals)))
    D[0][:, [signals.index(label) for label in labels]] = -gain
    law = agents.Law.of([100.0], D)
    return agents.ScheduledController(law, readings, model.command_names, model.actuator.limit, "state")


def torch_copy(gain, labels):
    """A torch policy with the same gain, its Jacobian by autograd."""
    torch = pytest.importorskip("torch", reason="needs the extra rl")
    layer = torch.nn.Linear(len(labels), 1, bias=False, dtype=torch.float64)
    with torch.no_grad():
        layer.weight[:] = torch.from_numpy(-gain)

    def function(signals):
        return layer(torch.from_numpy(signals)).detach().numpy()

    def jacobian(signals):
        return torch.autograd.functional.jacobian(layer, torch.from_numpy(signals)).numpy()

    return design.StaticFeedback(function, jacobian, labels, ["command_b"])


def test_without_gain_the_loop_is_the_vehicle_alone(coach):
    alone = design.critical_speed(coach)
    idle = design.critical_speed(coach, controller=np.zeros((1, coach.n_states)))
    assert idle.speed == pytest.approx(alone.speed, rel=1e-8)
    assert idle.frequency == pytest.approx(alone.frequency, rel=1e-8)
    assert idle.loss == "hunting"
    assert idle.hopf is None
    assert alone.period is None
    assert idle.period == 0.005


@pytest.mark.parametrize("delay", [0.0, 0.005, 0.010, 0.020])
def test_critical_speed_is_where_the_environment_turns_from_decay_to_growth(coach, delay):
    model = coach.replace(delay=delay)
    gain, labels = soft_gain(model)
    matrix = design.critical_speed(model, controller=gain, speed_range=(20.0, 400.0))
    assert matrix.loss == "hunting"
    controller = as_controller(model, gain, labels)
    simulated = agents.simulated_critical_speed(model, controller, matrix.speed)
    assert simulated == pytest.approx(matrix.speed, rel=5e-3)


def test_a_network_of_torch_with_its_jacobian_has_the_critical_speed_of_its_matrix(coach):
    gain, labels = soft_gain(coach)
    matrix, policy = (
        design.critical_speed(coach, controller=controller, speed_range=(20.0, 400.0))
        for controller in (gain, torch_copy(gain, labels))
    )
    assert policy.speed == pytest.approx(matrix.speed, rel=1e-9)


def test_delay_between_samples_is_exact_in_the_environment_too(coach):
    model = coach.replace(delay=0.0077)
    gain, labels = soft_gain(model)
    linear = design.critical_speed(model, controller=gain, speed_range=(20.0, 400.0))
    simulated = agents.simulated_critical_speed(model, as_controller(model, gain, labels), linear.speed)
    assert simulated == pytest.approx(linear.speed, rel=5e-3)


def test_closed_loop_equals_python_controls_own_connection(coach):
    sampled = design.lateral_model(coach, speed=120.0, sensors=True)
    controller = control.ss(
        [[0.99]], [[0.0, 1.0]], [[2e4]], [[100.0, -2e4]], 0.005,
        inputs=["accel_b", "gyro_b"], outputs=["command_b"],
    )  # fmt: skip
    theirs = control.feedback(sampled, controller, sign=1)
    ours = design.closed_loop(coach, controller, speed=120.0)
    expected = np.linalg.eigvals(theirs.A)
    for value in expected[np.abs(expected) > 0.2]:
        assert np.abs(ours.multipliers - value).min() < 1e-7
    assert ours.system.state_labels[-2:] == ["command_b[-2]", "controller_x[0]"]
    assert ours.stable == (np.abs(expected).max() < 1.0)
    assert ours.growth == pytest.approx(np.log(ours.spectral_radius) / 0.005)
    assert "spectral radius" in str(ours)
    assert ours.plot().figure.axes[0].get_xlabel() == "real part (1)"


def test_a_law_with_a_steady_command_moves_the_equilibrium(coach):
    """A static law of the readings settles where its command and the vehicle agree."""
    limit = coach.actuator.limit

    def function(signals):
        return np.array([5e3 - 1e5 * signals[0]])

    law = design.StaticFeedback(function, lambda s: np.array([[-1e5]]), ["psi_b"], ["command_b"])
    loop = design.closed_loop(coach, law, speed=80.0)
    psi = loop.state[coach.state_names.index("psi_b")]
    assert loop.commands[0] == pytest.approx(5e3 - 1e5 * psi, rel=1e-9)
    assert 100.0 < loop.commands[0] < limit
    inputs = np.zeros(coach.n_inputs)
    inputs[0] = loop.commands[0]
    assert np.abs(coach.rhs(loop.state, inputs, speed=80.0)).max() < 1e-5


def _falling(x, u, speed, curvature, cant, p):
    return [x[1], u[0] - p.weight]


def test_what_nothing_holds_has_no_equilibrium_under_a_controller():
    """Its Jacobian is singular, as that of a vehicle whose wheels have lifted can be."""
    model = railenv.Model("falling", ["z", "dz"], ["lift"], _falling, {"weight": 9.81})
    law = design.StaticFeedback(lambda _: np.ones(1), lambda _: np.zeros((1, 1)), ["z"], ["lift"])
    dynamics = SampledDynamics(model, law)
    with pytest.raises(EquilibriumError, match="no running equilibrium"):
        dynamics.equilibrium(np.zeros(2), 80.0, 0.0, 0.0)


def test_loop_on_a_curve_is_about_the_curves_equilibrium(coach):
    gain, _ = soft_gain(coach)
    loop = design.closed_loop(coach, gain, speed=80.0, radius=3000.0, cant=0.08)
    own = design.equilibrium(coach, speed=80.0, radius=3000.0, cant=0.08).states
    np.testing.assert_allclose(loop.state, own)
    assert np.all(loop.commands == 0.0)
    mirrored = design.closed_loop(coach, gain, speed=80.0, radius=-3000.0, cant=-0.08)
    assert mirrored.spectral_radius == pytest.approx(loop.spectral_radius, rel=1e-9)


@pytest.mark.parametrize(
    ("controller", "message"),
    [
        ("lqr", "must be a matrix, a control.StateSpace or an object"),
        (np.zeros((2, 28)), "gain has shape"),
        (np.zeros((1, 27)), "gain has shape"),
        (control.ss([], [], [], [[1.0]], 0, inputs=["gyro_b"], outputs=["command_b"]), "discrete time"),
    ],
)
def test_what_is_no_controller_is_refused(coach, controller, message):
    with pytest.raises(ParameterError, match=message):
        design.closed_loop(coach, controller, speed=100.0)


def test_unknown_signals_and_commands_are_named(coach):
    def static(signal, command):
        return control.ss([], [], [], [[1.0]], 0.005, inputs=[signal], outputs=[command])

    with pytest.raises(UnknownNameError, match="gyro_x"):
        design.closed_loop(coach, static("gyro_x", "command_b"), speed=100.0)
    with pytest.raises(UnknownNameError, match="command_w1"):
        design.closed_loop(coach, static("gyro_b", "command_w1"), speed=100.0)
    with pytest.raises(UnknownNameError, match="past command"):
        design.closed_loop(coach, static("command_w1[-1]", "command_b"), speed=100.0)
    with pytest.raises(ParameterError, match=r"period is 0.01 s, but the controller's own is 0.005"):
        design.closed_loop(coach, static("gyro_b", "command_b"), speed=100.0, period=0.01)
    with pytest.raises(ParameterError, match="without a controller"):
        design.critical_speed(coach, period=0.01)


def test_cant_deficiency_needs_a_model_with_gravity():
    law = control.ss([], [], [], [[1.0]], 0.005, inputs=["cant_deficiency"], outputs=["M"])

    def decay(x, u, speed, curvature, cant, p):
        return [-x[0] + u[0]]

    model = railenv.Model("decay", ["x"], ["M"], decay, {})
    with pytest.raises(UnknownNameError, match="cant_deficiency"):
        design.closed_loop(model, law, speed=10.0)


def test_any_model_can_be_closed_with_named_signals():
    """A pendulum with sampled rate feedback, against the closed form of its map."""

    def pendulum(x, u, speed, curvature, cant, p):
        angle, rate = x
        return [rate, -p.stiffness * angle + (speed - 10.0) * rate + u[0]]

    model = railenv.Model("pendulum", ["angle", "rate"], ["M"], pendulum, {"stiffness": 4.0})
    T, k = 0.01, 5.0
    law = control.ss([], [], [], [[-k]], T, inputs=["rate"], outputs=["M"])
    found = design.critical_speed(model, controller=law, speed_range=(5.0, 30.0))

    def radius(speed):
        system = control.ss([[0, 1], [-4, speed - 10]], [[0], [1]], np.eye(2), np.zeros((2, 1)))
        sampled = control.c2d(system, T)
        return np.abs(np.linalg.eigvals(sampled.A - sampled.B @ [[0.0, k]])).max()

    assert radius(found.speed) == pytest.approx(1.0, abs=1e-9)
    assert radius(found.speed - 0.1) < 1.0 < radius(found.speed + 0.1)


def test_robust_critical_speed_against_brute_force(coach):
    controller = agents.YawRateFeedback.design(coach, gain=1e5, washout=0.5)
    box = {"conicity": (0.05, 0.4), "creep_factor": (0.6, 1.0)}
    robust = design.robust_critical_speed(coach, controller, box, samples=12)
    grid = [
        design.critical_speed(
            coach.replace(conicity=c, creep_factor=f), controller=controller, speed_range=(20.0, 400.0)
        ).speed
        or math.inf
        for c in np.linspace(0.05, 0.4, 8)
        for f in np.linspace(0.6, 1.0, 5)
    ]
    assert robust.speed <= min(grid) * (1.0 + 1e-6)
    assert robust.speed > 0.98 * min(grid)
    again = design.critical_speed(
        coach.replace(**robust.worst), controller=controller, speed_range=(20.0, 400.0)
    )
    assert again.speed == pytest.approx(robust.speed, rel=1e-6)
    assert set(robust.worst) == set(box)
    assert "worst vehicle has conicity" in str(robust)
    assert robust.summary()["vehicles"] == len(robust.samples)
    assert robust.plot().figure.axes[0].get_ylabel() == "stable up to (m/s)"


def test_robust_critical_speed_says_when_low_speed_is_unstable(coach):
    controller = agents.YawRateFeedback.design(coach, gain=2e6)
    robust = design.robust_critical_speed(coach, controller, {"conicity": (0.05, 0.2)}, samples=2)
    assert robust.speed is None
    assert "unstable already at 20 m/s" in str(robust)


@pytest.mark.parametrize(
    ("box", "error", "message"),
    [
        ({}, ParameterError, "box is empty"),
        ({"conicityy": (0.1, 0.2)}, UnknownNameError, "conicityy"),
        ({"conicity": (0.3, 0.2)}, ParameterError, "the lowest must not exceed the highest"),
        ({"conicity": (0.1, 0.9)}, ParameterError, "conicity of Cone is 0.9"),
        ({"conicity": 0.2}, ParameterError, "must be a pair"),
    ],
)
def test_impossible_boxes_are_refused(coach, box, error, message):
    with pytest.raises(error, match=message):
        design.robust_critical_speed(coach, None, box)
