"""Training through the simulator: derivatives are those of the environments' rollouts."""

import numpy as np
import pytest

import agents
import design
import railenv
from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.scheduled import readings_of
from agents.evaluation.rollout import Case, Rollout, Track
from agents.learning.adjoint import Adjoint
from agents.learning.steady import cancelled

torch = pytest.importorskip("torch", reason="needs the extra rl")
pytest.importorskip("stable_baselines3", reason="needs the extra rl")

MEMORY = MemorySettings(corners=(0.2, 2.0))
OWN = MemorySettings(corners=(0.2, 2.0), past_commands=1)
CASES = [
    Case(40.0, vehicle={"conicity": 0.1}),
    Case(90.0, vehicle={"conicity": 0.4, "creep_factor": 0.6}),
    Case(125.0, vehicle={"conicity": 0.25, "creep_factor": 1.4}),
]
LARGE = [Case(c.speed, offset=0.004, vehicle=c.vehicle) for c in CASES]
ROUGH = Track("low", seed=3)
SHORT = agents.Exercises(levels=2, stops=3, horizon=0.3, rough=2, speeds=(60.0, 130.0))


class Given(agents.Controller):
    """Gives commands that are known before."""

    def __init__(self, shares):
        self.shares, self.k = shares, 0

    def reset(self, count=None):
        self.k = 0

    def act(self, observation):
        self.k += 1
        return self.shares[self.k - 1]


@pytest.fixture(scope="module")
def coach():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))


def states_of(coach, cases, track, shares, nudge=None):
    """Return the states of a rollout, that at the start included, and the rollout."""
    rollout = Rollout(coach, Given(shares), cases, track)
    adjoint = Adjoint(rollout)
    if nudge is not None:
        for i, change in enumerate(nudge):
            rollout.fleet.set_state(i, rollout.fleet.state(i) + change)
    states = [rollout.fleet.all_states()]
    for _ in shares:
        rollout.step()
        states.append(rollout.fleet.all_states())
    return np.array(states), adjoint


def pulled_back(adjoint, states, shares, last):
    """Return the derivatives of ``last`` times the last state by the first one and every command."""
    back, by_shares = last, np.zeros_like(shares)
    for k in reversed(range(len(shares))):
        pulled = adjoint.back(k, states[k], shares, back)
        back = pulled.state
        for age, by in pulled.commands.items():
            by_shares[k - age] += by
    return back, by_shares


@pytest.mark.parametrize("delay", [0.01, 0.0125, 0.0], ids=["two periods", "between", "none"])
def test_derivatives_are_differences_of_rollouts_on_rough_track(coach, delay):
    """Several mm, commands beyond what the actuator follows, any delay."""
    late = coach.replace(delay=delay)
    rng = np.random.default_rng(0)
    shares = rng.uniform(-0.9, 0.9, (12, 3, 1))
    last = rng.standard_normal((3, coach.n_states)) / coach.scale
    states, adjoint = states_of(late, LARGE, ROUGH, shares)
    by_state, by_shares = pulled_back(adjoint, states, shares, last)

    commands = rng.standard_normal(shares.shape)
    nudge = rng.standard_normal(by_state.shape) * coach.scale
    step = 1e-5
    ends = [states_of(late, LARGE, ROUGH, shares + s * commands)[0][-1] for s in (step, -step)]
    change = ((ends[0] - ends[1]) / (2.0 * step) * last).sum(axis=1)
    np.testing.assert_allclose((by_shares * commands).sum(axis=(0, 2)), change, rtol=1e-6)
    ends = [states_of(late, LARGE, ROUGH, shares, s * nudge)[0][-1] for s in (step, -step)]
    change = ((ends[0] - ends[1]) / (2.0 * step) * last).sum(axis=1)
    np.testing.assert_allclose((by_state * nudge).sum(axis=1), change, rtol=1e-6)


def test_a_period_at_rest_is_the_linear_models(coach):
    """Another way to the same numbers: the exact transition of the linearised vehicle."""
    rollout = Rollout(coach, Given(np.zeros((1, 3, 1))), CASES)
    adjoint = Adjoint(rollout)
    basis = np.eye(coach.n_states)
    shares = np.zeros((3, 3, 1))
    rows = [adjoint.back(2, adjoint.still, shares, np.tile(unit, (3, 1))).state[2] for unit in basis]
    worn = coach.replace(**CASES[2].vehicle)
    linear = design.linearize(worn, speed=CASES[2].speed)
    from scipy.linalg import expm

    exact = expm(np.asarray(linear.A) * 0.005)
    size = coach.scale[:, None] / coach.scale
    assert (np.abs(np.array(rows) - exact) / size).max() < 1e-3 * (np.abs(exact) / size).max()


def test_commands_beyond_the_limit_and_of_a_full_actuator_have_no_effect(coach):
    """Where the actuator is at its limit, a moment more inside it changes nothing of the vehicle."""
    rollout = Rollout(coach, Given(np.zeros((1, 3, 1))), CASES)
    adjoint = Adjoint(rollout)
    state = adjoint.still.copy()
    moment = coach.state_names.index("T_b")
    rate = coach.state_names.index("dT_b")
    state[:, moment] = 1.3 * coach.limits[0]
    last = np.zeros_like(state)
    last[:, coach.state_names.index("dpsi_b")] = 1.0
    found = adjoint.back(2, state, np.ones((3, 3, 1)), last).state
    assert (found[:, moment] == 0.0).all()
    assert (found[:, rate] == 0.0).all()
    state[:, moment] = 0.5 * coach.limits[0]
    assert (adjoint.back(2, state, np.zeros((3, 3, 1)), last).state[:, moment] > 0.0).all()


def test_small_motions_share_one_map_that_large_ones_reach_step_by_step(coach):
    rng = np.random.default_rng(1)
    shares, last = np.zeros((3, 3, 1)), rng.standard_normal((3, coach.n_states)) / coach.scale
    adjoint = Adjoint(Rollout(coach, Given(shares), CASES))
    nudge = rng.standard_normal(last.shape) * coach.scale
    small = adjoint.back(2, adjoint.still + 9e-4 * np.sign(nudge) * coach.scale, shares, last)
    large = adjoint.back(2, adjoint.still + 1.1e-3 * np.sign(nudge) * coach.scale, shares, last)
    units = np.abs(small.state * coach.scale).max()
    assert (np.abs(small.state - large.state) * coach.scale).max() < 1e-3 * units
    assert not np.array_equal(small.state, large.state)
    np.testing.assert_allclose(small.commands[2], large.commands[2], rtol=1e-3)


@pytest.mark.parametrize(
    ("cases", "track", "step"),
    [(CASES, Track(), 2e-3), (LARGE, ROUGH, 5e-4)],  # observations are single precision
    ids=["small", "large"],
)
@pytest.mark.parametrize("hidden", [(), (8,)], ids=["linear", "network"])
def test_gradient_of_a_policy_is_the_difference_of_its_costs(coach, cases, track, step, hidden):
    from agents.learning.through import OddNetwork, Runs

    readings = tuple(readings_of(coach, "sensors", 0.005))
    inner = Memory(OWN, readings, coach.command_names, 0.005)
    torch.manual_seed(0)
    network = OddNetwork(cancelled(inner, even=bool(hidden)), inner.signs, hidden, 1)
    frame = agents.LearnedPolicy(
        network.plain(), readings, coach.command_names, coach.limits, "sensors", OWN
    )
    nudges = 1e-6 * coach.scale * np.random.default_rng(0).standard_normal((3, coach.n_states))
    runs = Runs(coach, frame, cases, track, 40, 1.0, 0.3, nudges)
    runs.cost(network)
    ways = [torch.randn_like(p) for p in network.parameters()]
    slope = sum(float((p.grad * way).sum()) for p, way in zip(network.parameters(), ways, strict=True))

    def cost(step):
        with torch.no_grad():
            for p, way in zip(network.parameters(), ways, strict=True):
                p += step * way
        states, _, shares = runs.run(network.plain())
        value, _ = runs.judge(states, shares)
        with torch.no_grad():
            for p, way in zip(network.parameters(), ways, strict=True):
                p -= step * way
        return value

    assert slope == pytest.approx((cost(step) - cost(-step)) / (2.0 * step), rel=5e-4)


@pytest.fixture(scope="module")
def identifier(coach):
    bank = [{"conicity": c, "creep_factor": k} for c in (0.05, 0.4) for k in (0.6, 1.4)]
    return agents.AdaptiveLQG.design(coach, speeds=[60.0, 130.0], vehicles=bank)


def test_a_policy_with_an_identifier_is_told_the_true_vehicle_in_training(coach, identifier):
    """The gradient, in one direction, is the difference of costs; what it is told changes its gains."""
    from agents.learning.train_through import _Path

    one = agents.Exercises(levels=2, stops=2, horizon=0.2, rough=2, speeds=(60.0, 120.0))
    path = _Path(coach, one, MEMORY, identifier, (8,), 0, 0.005)
    start = torch.nn.utils.parameters_to_vector(path._network.parameters()).detach().numpy()
    _, slope = path._cost(start)
    way = np.random.default_rng(0).standard_normal(len(start))
    ends = [path._cost(start + step * way)[0] for step in (5e-4, -5e-4)]
    assert slope @ way == pytest.approx((ends[0] - ends[1]) / 1e-3, rel=1e-3)
    last = path._network._layers[0].weight.shape[1] - 2  # columns of what it is told
    first = next(iter(path._network.parameters()))
    assert (first.grad[:, last:] != 0.0).all()


def test_training_with_an_identifier_gives_an_adaptive_policy(coach, identifier):
    keywords = {"exercises": SHORT, "memory": MEMORY, "hidden": (8,), "evaluations": 12}
    found = agents.train_through(coach, identifier=identifier, **keywords)
    assert isinstance(found.policy, agents.AdaptivePolicy)
    assert found.costs[-1] < 0.7 * found.costs[0]
    worn = {"conicity": 0.4, "creep_factor": 1.4}
    new = {"conicity": 0.05, "creep_factor": 0.6}
    laws = [found.last.knowing(one) for one in (worn, new)]
    signals = np.array([100.0 if r.signal == "speed" else 0.0 for r in found.last.readings])
    gains = [law.linearize(signals).D for law in laws]
    assert np.abs(gains[0] - gains[1]).max() > 1e-3 * np.abs(gains[0]).max()
    rollout = Rollout(coach, found.policy, CASES)
    rollout.run(0.1)
    assert found.policy.identifier.likely.shape == (3, 4)


def test_an_identifier_that_does_not_fit_is_told(coach, identifier):
    with pytest.raises(railenv.ParameterError, match="needs a hidden layer"):
        agents.train_through(coach, identifier=identifier, hidden=())
    only = agents.Exercises(ranges={"creep_factor": (0.6, 1.4)})
    with pytest.raises(railenv.ParameterError, match="conicity does not differ in the exercises"):
        agents.train_through(coach, identifier=identifier, exercises=only)
    rough = [{"friction": f} for f in (0.2, 0.4)]
    other = agents.AdaptiveLQG.design(coach, speeds=[60.0, 130.0], vehicles=rough)
    both = agents.Exercises(ranges={"friction": (0.2, 0.4)})
    with pytest.raises(railenv.UnknownNameError, match="friction"):
        agents.train_through(coach, identifier=other, exercises=both)
    with pytest.raises(railenv.ParameterError, match="it must be designed for"):
        agents.train_through(coach, identifier=identifier, period=0.01)
    with pytest.raises(railenv.ParameterError, match="must be an agents"):
        agents.train_through(coach, identifier="bank.npz")


def test_networks_are_odd_and_steady_readings_cancel(coach):
    from agents.learning.through import OddNetwork

    readings = tuple(readings_of(coach, "sensors", 0.005))
    inner = Memory(MEMORY, readings, coach.command_names, 0.005)
    torch.manual_seed(0)
    network = OddNetwork(cancelled(inner, even=True), inner.signs, (8,), 1)
    policy = agents.LearnedPolicy(
        network.plain(), readings, coach.command_names, coach.limits, "sensors", MEMORY
    )
    steady = np.array([0.3, -0.2, 0.9, 0.5])  # scaled: acceleration, yaw rate, speed, cant deficiency
    for _ in range(3):
        assert policy.act(steady)[0] == pytest.approx(0.0, abs=1e-6)
    mirror, change = np.array([-1.0, -1.0, 1.0, -1.0]), np.array([0.1, 0.05, 0.0, 0.0])
    moved = policy.act(steady + change)[0]
    assert abs(moved) > 1e-3
    policy.reset()
    for _ in range(3):
        policy.act(steady * mirror)
    assert policy.act((steady + change) * mirror)[0] == pytest.approx(-moved, rel=1e-6)


def test_exercises_are_every_vehicle_at_every_speed(coach):
    cases = agents.Exercises(levels=3, stops=4, speeds=(20.0, 120.0)).small(coach)
    vehicles = {tuple(case.vehicle.items()) for case in cases}
    assert len(cases) == 3 * 3 * 4
    assert len(vehicles) == 9
    assert (("conicity", 0.05), ("creep_factor", 1.4)) in vehicles
    speeds = sorted({case.speed for case in cases})
    assert (speeds[0], speeds[-1]) == (20.0, 120.0)
    assert (np.diff(speeds, 2) < 0.0).all()


def test_training_lowers_the_cost_and_repeats_itself(coach):
    keywords = {"exercises": SHORT, "memory": MEMORY, "hidden": (8,), "evaluations": 12}
    first = agents.train_through(coach, judge_every=5, **keywords)
    assert len(first.costs) <= 12
    assert first.costs[-1] < 0.7 * first.costs[0]
    assert first.judged[0, 0] == 0
    assert first.judged[-1, 0] == len(first.costs)
    assert (np.diff(first.judged[:-1, 0]) >= 5).all()
    assert first.steps == len(first.costs) * 60 * (2 * 2 * 3 + 2)
    assert first.policy.about["chosen"] == first.judged[first.judged[:, 2].argmax(), 0]
    again = agents.train_through(coach, judge_every=12, **keywords)
    np.testing.assert_array_equal(first.costs, again.costs)
    np.testing.assert_array_equal(first.last.network.weights[0], again.last.network.weights[0])
    other = agents.train_through(coach, seed=1, **{**keywords, "evaluations": 1})
    assert other.costs[0] != first.costs[0]
    assert first.plot().axes[0, 0].get_xlabel() == "evaluation"


def test_an_interrupt_loses_nothing_that_was_judged(coach, monkeypatch):
    from agents.learning.through import Runs

    cost, calls = Runs.cost, []

    def interrupted(self, network):
        calls.append(1)
        if len(calls) == 9:  # in the fifth evaluation of two groups
            raise KeyboardInterrupt
        return cost(self, network)

    monkeypatch.setattr(Runs, "cost", interrupted)
    found = agents.train_through(coach, exercises=SHORT, memory=MEMORY, hidden=(), judge_every=1)
    assert len(found.costs) == 4
    assert 1 <= found.judged[-1, 0] <= 4


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"evaluations": 0}, "evaluations"),
        ({"hidden": "32"}, "hidden is '32'"),
        ({"hidden": (0,)}, "width of a hidden layer"),
        ({"seed": -1}, "seed"),
        ({"memory": MemorySettings(history=3)}, "history of the memory is 3"),
        ({"memory": OWN}, "past_commands of the memory is 1"),
    ],
)
def test_bad_arguments_are_told(coach, changes, match):
    with pytest.raises(railenv.ParameterError, match=match):
        agents.train_through(coach, **changes)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"levels": 1}, "levels of exercises"),
        ({"stops": 1}, "stops of exercises"),
        ({"horizon": 0.0}, "horizon"),
        ({"speeds": (90.0, 20.0)}, "speeds"),
        ({"ranges": {"conicity": (0.4, 0.05)}}, "range of conicity"),
        ({"offset": 0.5}, "offset"),
    ],
)
def test_bad_exercises_are_told(changes, match):
    with pytest.raises(railenv.ParameterError, match=match):
        agents.Exercises(**changes)


def test_a_model_without_actuators_is_told():
    bare = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW), "none")
    with pytest.raises(railenv.ParameterError, match="no actuators"):
        agents.train_through(bare)
