"""Learned policies: networks, memory, linearisation, files."""

import copy
import dataclasses

import numpy as np
import pytest

import agents
import design
import railenv
from agents.controllers.files import ControllerFile
from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.network import Network, Normalization
from agents.controllers.scheduled import readings_of
from design.loop.feedback import CONDITIONS

PERIOD = 0.005
FULL = MemorySettings(history=2, corners=(0.5, 4.0), past_commands=2)
SCHEDULED = dataclasses.replace(FULL, schedule=(40.0, 160.0))


def network(signs, outputs=1, activation="tanh", squash="none", gain=0.3, seed=0):
    """A random network; odd if there are signs."""
    rng = np.random.default_rng(seed)
    n, hidden = len(signs), 16
    mean = np.where(signs < 0, 0.0, rng.normal(size=n))
    return Network(
        (rng.normal(size=(hidden, n)) / np.sqrt(n), gain * rng.normal(size=(outputs, hidden))),
        (rng.normal(size=hidden), rng.normal(size=outputs)),
        activation,
        squash,
        Normalization(mean, rng.uniform(0.5, 2.0, n), 10.0),
        signs,
    )


def policy(model, memory=FULL, base=None, observation="sensors", **keywords):
    readings = readings_of(model, observation)
    signs = Memory(memory, readings, model.command_names, PERIOD, base).signs
    net = network(signs, len(model.command_names), **keywords)
    limit = model.actuator.limit
    return agents.LearnedPolicy(
        net, readings, model.command_names, limit, observation, memory, base, 0.6, PERIOD, {"seed": 0}
    )


@pytest.fixture(scope="module")
def vehicle(coach):
    return railenv.Equipped(coach, "secondary")


@pytest.fixture(scope="module")
def lqg(vehicle):
    return agents.LQG.design(vehicle, speeds=[80.0, 120.0, 160.0])


@pytest.fixture(params=["alone", "scheduled", "on LQG", "scheduled, on LQG"])
def learned(request, vehicle):
    base = request.getfixturevalue("lqg") if "on LQG" in request.param else None
    return policy(vehicle, SCHEDULED if "scheduled" in request.param else FULL, base=base)


def observations(model, count, steps, observation="sensors", seed=1, speed=1.2):
    """Small random observations at a constant speed."""
    rng = np.random.default_rng(seed)
    names = [r.name for r in readings_of(model, observation)]
    y = 0.05 * rng.normal(size=(steps, count, len(names)))
    y[:, :, names.index("speed")] = speed
    return y.astype(np.float32)


# ---------------------------------------------------------------------------- networks


@pytest.mark.parametrize("activation", ["tanh", "relu", "elu"])
@pytest.mark.parametrize("squash", ["none", "tanh"])
def test_jacobian_is_that_of_torch(activation, squash):
    torch = pytest.importorskip("torch")
    signs = np.array([-1.0, -1.0, 1.0, -1.0, 1.0])
    net = network(signs, 2, activation, squash)
    function = getattr(torch.nn.functional, activation)

    def layers(x):
        W, b = [torch.tensor(a) for a in net.weights], [torch.tensor(a) for a in net.biases]
        return function(x @ W[0].T + b[0]) @ W[1].T + b[1]

    def whole(x):
        x = (x - torch.tensor(net.normalization.mean)) / torch.tensor(net.normalization.scale)
        value = 0.5 * (layers(x) - layers(x * torch.tensor(signs)))
        return torch.tanh(value) if squash == "tanh" else value

    for x in np.random.default_rng(3).normal(size=(5, 5)):
        expected = torch.autograd.functional.jacobian(whole, torch.tensor(x)).numpy()
        np.testing.assert_allclose(net.jacobian(x), expected, rtol=1e-10, atol=1e-13)
        np.testing.assert_allclose(net(x[None])[0], whole(torch.tensor(x)).numpy(), rtol=1e-10)


def test_inputs_beyond_the_bound_do_not_count():
    net = network(np.ones(3))
    x = np.array([0.1, 1e3, 0.2])
    assert not net.jacobian(x)[:, 1].any()
    np.testing.assert_array_equal(net(x[None]), net(np.array([[0.1, 2e3, 0.2]])))


def test_networks_that_do_not_fit_together_raise():
    net = network(-np.ones(3))
    with pytest.raises(railenv.ParameterError, match="layer 1"):
        dataclasses.replace(net, weights=(net.weights[0], net.weights[1][:, :-1]))
    with pytest.raises(railenv.ParameterError, match="not finite"):
        dataclasses.replace(net, biases=(net.biases[0] * np.nan, net.biases[1]))
    shifted = dataclasses.replace(net.normalization, mean=np.ones(3))
    with pytest.raises(railenv.ParameterError, match="mean"):
        dataclasses.replace(net, normalization=shifted)
    with pytest.raises(railenv.UnknownNameError, match="activation"):
        dataclasses.replace(net, activation="tan")


# ---------------------------------------------------------------------------- symmetry, running


@pytest.mark.parametrize("observation", ["sensors", "state"])
def test_mirrored_motion_gets_the_opposite_moment(vehicle, observation):
    learned = policy(vehicle, MemorySettings(corners=(1.0,)), observation=observation)
    y = observations(vehicle, 4, 20, observation)
    flipped = y * learned.network.signs[: y.shape[2]].astype(np.float32)
    learned.reset(4)
    there = np.array([learned.act(row) for row in y])
    learned.reset(4)
    back = np.array([learned.act(row) for row in flipped])
    np.testing.assert_allclose(back, -there, atol=1e-12)
    assert np.abs(there).max() > 1e-3


def test_no_deviation_gets_no_moment(vehicle):
    learned = policy(vehicle)
    learned.reset()
    assert learned.act(np.array([0.0, 0.0, 1.3, 0.0])) == 0.0
    assert learned.steady(np.array([0.0, 0.0, 130.0, 0.0])) == 0.0


def test_rows_run_alone_or_side_by_side_alike(learned, vehicle):
    y = observations(vehicle, 3, 30)
    learned.reset(3)
    together = np.array([learned.act(row) for row in y])
    for i in range(3):
        learned.reset()
        alone = np.array([learned.act(row[i]) for row in y])
        np.testing.assert_allclose(alone, together[:, i], rtol=1e-9, atol=1e-12)


def test_rows_that_restart_forget(vehicle, lqg):
    memory = Memory(FULL, lqg.readings, lqg.commands, PERIOD, lqg)
    y = observations(vehicle, 3, 12)
    memory.reset(3)
    for row in y[:8]:
        memory.features(row)
        memory.advance(np.clip(memory.demand, -1.0, 1.0))
    memory.reset_rows(np.array([False, True, False]))
    restarted = memory.features(y[8])
    fresh = Memory(FULL, lqg.readings, lqg.commands, PERIOD, lqg)
    fresh.reset(3)
    first = fresh.features(y[8])
    np.testing.assert_array_equal(restarted[1], first[1])
    assert not np.allclose(restarted[[0, 2]], first[[0, 2]])


def test_products_with_speed_go_from_minus_to_plus(vehicle):
    settings = MemorySettings(corners=(4.0,), past_commands=1, schedule=(40.0, 160.0))
    readings = readings_of(vehicle, "sensors")
    memory = Memory(settings, readings, vehicle.command_names, PERIOD)
    plain = len(MemorySettings(corners=(4.0,), past_commands=1).corners) * 3 + 1
    assert memory.names[plain:] == [
        f"{name} by speed"
        for name in (*(readings[i].name for i in memory.filtered), *memory.names[:plain])
    ]
    at = [r.name for r in readings].index("speed")
    for speed, share in ((30.0, -1.0), (40.0, -1.0), (100.0, 0.0), (130.0, 0.5), (200.0, 1.0)):
        memory.reset(1)
        y = np.full((1, len(readings)), 0.3)
        y[0, at] = speed / readings[at].scale
        memory.features(y)
        memory.advance(np.array([[0.7]]))
        found = memory.features(y)[0]
        np.testing.assert_allclose(found[plain + 2 :], share * found[:plain], atol=1e-12)
        np.testing.assert_allclose(found[plain : plain + 2], share * 0.3, atol=1e-12)


@pytest.mark.parametrize("schedule", [(100.0, 50.0), (0.0, 50.0), 3.0, (1.0, 2.0, 3.0)])
def test_impossible_schedules_raise(schedule):
    with pytest.raises(railenv.ParameterError, match=r"schedule|speed"):
        MemorySettings(schedule=schedule)


def test_wrong_shapes_raise(learned):
    learned.reset(2)
    with pytest.raises(railenv.ParameterError, match="2 vehicles"):
        learned.act(np.zeros((3, 4)))
    with pytest.raises(railenv.ParameterError, match="inputs"):
        dataclasses.replace(learned, memory=MemorySettings())
    with pytest.raises(railenv.ParameterError, match="authority"):
        dataclasses.replace(learned, authority=0.0)
    with pytest.raises(railenv.ParameterError, match="history"):
        MemorySettings(history=-1)
    with pytest.raises(railenv.ParameterError, match="corner"):
        MemorySettings(corners=(0.0,))


# ---------------------------------------------------------------------------- linearisation


def at_rest(learned, signals):
    """Let a policy see the same signals until it has settled."""
    y = (signals / learned._scales).astype(np.float32)
    learned.reset()
    for _ in range(4000):
        share = learned.act(y)
    return y, share


@pytest.mark.parametrize("turn", [0.0, 0.02])
def test_steady_is_where_it_settles(learned, turn):
    signals = np.array([0.3 * turn, turn, 110.0, turn])
    _, share = at_rest(learned, signals)
    # single-precision observations, and the slow drift that the filter estimates
    np.testing.assert_allclose(learned.steady(signals), share * learned.limit, rtol=3e-4, atol=1e-2)


@pytest.mark.parametrize("turn", [0.0, 0.02])
def test_linearisation_is_the_derivative_of_running(learned, turn):
    """Responses to a small disturbance of each signal, against those of the linear system."""
    signals = np.array([0.3 * turn, turn, 110.0, turn])
    system = learned.linearize(signals)
    steps, size = 12, 2e-3
    y, _ = at_rest(learned, signals)
    for k, label in enumerate(learned.input_labels):
        if label in CONDITIONS:
            continue  # frozen: the matrices of the base, and past values
        responses = []
        for sign in (1.0, -1.0):
            one, run = copy.deepcopy(learned), []
            for step in range(steps):
                disturbed = y.astype(float)
                disturbed[k] += sign * size * (step < 3)
                run.append(one.act(disturbed))
            responses.append(np.array(run)[:, 0])
        measured = (responses[0] - responses[1]) / 2.0 * learned.limit
        x, expected = np.zeros(system.nstates), []
        for step in range(steps):
            u = np.zeros(system.ninputs)
            u[k] = size * learned._scales[k] * (step < 3)
            expected.append((system.C @ x + system.D @ u)[0])
            x = system.A @ x + system.B @ u
        np.testing.assert_allclose(
            measured, expected, rtol=2e-3, atol=2e-3 * np.abs(expected).max() + 1e-6
        )


@pytest.mark.parametrize("gain", [0.0, 0.3])
def test_without_learning_the_critical_speed_is_the_bases(vehicle, lqg, gain):
    learned = policy(vehicle, base=lqg, gain=gain)
    found = design.critical_speed(vehicle, controller=learned).speed
    base = design.critical_speed(vehicle, controller=lqg).speed
    if gain:
        assert found != pytest.approx(base, rel=1e-3)
    else:
        assert found == pytest.approx(base, rel=1e-9)


def damping(vehicle, share=0.3):
    """A policy that mostly damps the yaw rate: its first layer passes the gyro on."""
    memory = MemorySettings(history=1, corners=(0.2, 2.0), past_commands=1)
    learned = policy(vehicle, memory, gain=0.02)
    names = [r.name for r in learned.readings] * 2 + learned._memory.names
    W, b = [w.copy() for w in learned.network.weights], [v.copy() for v in learned.network.biases]
    W[0][0], b[0][0] = 0.0, 0.0
    W[0][0, names.index("gyro_b")] = 0.2
    W[1][0, 0] = -share * 10.0 / learned.network.normalization.scale[names.index("gyro_b")]
    return dataclasses.replace(
        learned, network=dataclasses.replace(learned.network, weights=tuple(W), biases=tuple(b))
    )


def test_critical_speed_is_where_motions_begin_to_grow(vehicle):
    learned = damping(vehicle)
    predicted = design.critical_speed(vehicle, controller=learned)
    passive = design.critical_speed(vehicle)
    assert abs(predicted.speed - passive.speed) > 3.0  # the policy matters
    measured = agents.simulated_critical_speed(vehicle, learned, predicted.speed)
    assert measured == pytest.approx(predicted.speed, rel=0.01)


# ---------------------------------------------------------------------------- files


def test_files_give_back_the_policy(learned, vehicle, tmp_path):
    learned.save(tmp_path / "policy.npz")
    again = agents.load(tmp_path / "policy.npz")
    assert isinstance(again, agents.LearnedPolicy)
    assert again.about == learned.about
    assert again.memory == learned.memory
    y = observations(vehicle, 2, 25)
    runs = []
    for one in (learned, again, agents.LearnedPolicy.load(tmp_path / "policy.npz")):
        one.reset(2)
        runs.append([one.act(row) for row in y])
    np.testing.assert_array_equal(runs[0], runs[1])
    np.testing.assert_array_equal(runs[0], runs[2])


def test_damaged_files_raise(learned, tmp_path):
    path = tmp_path / "policy.npz"
    learned.save(path)
    whole = path.read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"PK\x03\x04" + bytes(100)):
        path.write_bytes(content)
        with pytest.raises(railenv.ParameterError, match="damaged"):
            agents.load(path)
    content = learned.to_file()
    for name in content.arrays:
        if name.startswith("base_"):
            continue
        arrays = {key: value for key, value in content.arrays.items() if key != name}
        with pytest.raises(railenv.ParameterError, match=name):
            agents.LearnedPolicy.from_file(ControllerFile(content.kind, content.header, arrays))
    for name in content.header:
        header = {key: value for key, value in content.header.items() if key != name}
        if name == "base":
            match = "inputs"
        else:
            match = name
        with pytest.raises(railenv.ParameterError, match=match):
            agents.LearnedPolicy.from_file(ControllerFile(content.kind, header, content.arrays))
    complex_ones = {**content.arrays, "W0": content.arrays["W0"].astype(complex)}
    with pytest.raises(railenv.ParameterError, match="complex128; it must be real"):
        agents.LearnedPolicy.from_file(ControllerFile(content.kind, content.header, complex_ones))
    short = {**content.arrays, "W0": content.arrays["W0"][:, 1:]}
    with pytest.raises(railenv.ParameterError, match="layer 0"):
        agents.LearnedPolicy.from_file(ControllerFile(content.kind, content.header, short))


def test_pickles_are_not_opened(tmp_path):
    np.savez(tmp_path / "bad.npz", header=np.array({"schema": 1}, dtype=object))
    with pytest.raises(railenv.ParameterError, match="damaged"):
        agents.load(tmp_path / "bad.npz")
