"""Rewards: the documented formula and its range, what scores well and badly; ends by derailment."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

import railenv
from examples.reward_of_idle_and_lqr import Feedback, markdown, mean_reward
from railenv import irregularity
from railenv.envs import DERAILED
from railenv.envs.settings import RewardWeights
from railenv.errors import ParameterError
from tests.railenv.envs.runs import BOGIE, DUAL, both, make

TERMS = ("hunting", "excursion", "ride", "effort", "command", "change")


def idle(env):
    return np.zeros(env.action_space.shape)


# ---------------------------------------------------------------- formula


def rails_at(env, kind, distance):
    record = getattr(irregularity.line(env.settings.irregularity), kind)
    position = distance / irregularity.SPACING
    cell = math.floor(position)
    a, b = record[cell % len(record)], record[(cell + 1) % len(record)]
    return a + (position - cell) * (b - a)


def expected_terms(env, equilibrium, c, rails, actions):
    """Terms of the reward from states and the last two actions, in plain Python."""
    model = env.fleet.model
    x = dict(zip(model.state_names, env.fleet.state(0), strict=True))
    x0 = dict(zip(model.plant.state_names, equilibrium, strict=False))
    vehicle = env.fleet.episodes[0].plant.vehicle
    k, delta = 2.0 * math.pi / vehicle.klingel_wavelength, vehicle.flange_clearance
    hunting = excursion = 0.0
    for i, w in enumerate(("w1", "w2")):
        rate = x[f"dy_{w}"] / (c["speed"] * k * delta)
        turn = (x[f"psi_{w}"] - x0[f"psi_{w}"]) / (k * delta)
        hunting += 0.5 * (rate**2 + turn**2) / 2.0
        excursion += 0.5 * ((x[f"y_{w}"] - rails[i] - x0[f"y_{w}"]) / delta) ** 2
    signals = model.signals(
        env.fleet.state(0),
        [*[0.0] * (model.n_inputs - 6), *rails],
        speed=c["speed"],
        curvature=c["curvature"],
        cant=c["cant"],
    )
    sideways = c["speed"] ** 2 * c["curvature"] - vehicle.gravity * c["cant"]
    ride = max(
        abs(signals[i] - (vehicle.gravity * x0[f"phi_{body}"] - sideways))
        for i, body in enumerate(model.equipment.sensed)
    )
    moments = [x[f"T_{b}"] / model.actuator.limit for b in model.equipment.actuated]
    effort = sum(min(m * m, 1.0) for m in moments) / max(len(moments), 1)
    amplitudes = [8.0 * math.sqrt(hunting), 8.0 * math.sqrt(excursion), ride / (0.1 * 9.81)]
    now, before = actions
    commands = [np.mean(np.square(now)), np.mean(np.abs(now - before)) / 2.0]
    return [*(s / (1.0 + s) for s in amplitudes), effort, *commands]


@both
@pytest.mark.parametrize("level", [None, "low"])
def test_reward_is_the_documented_formula(name, level):
    weights = RewardWeights(hunting=2.0, excursion=0.5, ride=0.7, effort=0.3, command=0.2, change=0.3)
    env = make(name, irregularity=level, weights=weights, tangent_share=0.0)
    _, info = env.reset(seed=2, options={"speed": 50.0})
    c = info
    equilibrium = railenv.find_equilibrium(
        env.fleet.model.plant,
        speed=c["speed"],
        radius=env.fleet.episodes[0].radius,
        cant=c["cant"],
    ).state
    half, start = env.settings.vehicle.half_wheelbase, env.fleet.episodes[0].line_offset
    rng = np.random.default_rng(0)
    before = np.zeros(env.action_space.shape)
    for k in range(1, 40):
        action = rng.uniform(-1, 1, env.action_space.shape)
        _, reward, terminated, _, info = env.step(action)
        rails = np.zeros(6)
        if level:
            s = k * 0.005 * c["speed"]
            ahead = [start + s + half, start + s - half]
            values = [rails_at(env, kind, d) for kind in ("align", "vert", "cross") for d in ahead]
            rails = min(s / 20.0, 1.0) * np.array(values)
        terms = expected_terms(env, equilibrium, c, rails, (action, before))
        before = action
        assert [info[t] for t in TERMS] == pytest.approx(terms, rel=1e-5, abs=1e-7)
        cost = np.dot([0.5, 0.125, 0.175, 0.075, 0.05, 0.075], terms)  # weights over their sum
        assert reward == pytest.approx(0.0 if terminated else 1.0 - cost, rel=1e-5, abs=1e-7)


@both
def test_rewards_lie_in_their_range(name):
    env = make(name, irregularity="high", duration=2.0)
    lowest = 1.0
    for seed in range(15):
        env.reset(seed=seed)
        rng = np.random.default_rng(seed)
        done = False
        while not done:
            _, reward, terminated, truncated, info = env.step(
                rng.choice([-1.0, 1.0], env.action_space.shape)
            )
            assert all(0.0 <= info[t] <= 1.0 for t in TERMS)
            assert info["derailment"] == terminated
            assert reward == 0.0 if terminated else 0.0 < reward <= 1.0
            lowest = min(lowest, reward)
            done = terminated or truncated
    assert lowest < 0.5


# ---------------------------------------------------------------- what scores well


@both
@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_steady_running_in_a_curve_costs_nothing(name, hand):
    env = make(name, duration=3.0)
    speed, radius, cant = (95.0, 6250.0, 0.0873) if name == BOGIE else (25.0, 500.0, 0.05)
    pins = {"speed": speed, "radius": hand * radius, "cant": hand * cant, "offset": 0.0}
    found, _ = mean_reward(env, pins)
    assert abs(env.fleet.equilibrium(0)[0]) > 1e-4  # there is an offset that could be punished
    assert 1.0 - 1e-6 < found <= 1.0


def test_slow_change_of_curvature_costs_little():
    env = make(BOGIE, track="curve", tangent_share=0.0)
    for seed in range(3):
        env.reset(seed=seed, options={"speed": 70.0, "offset": 0.0})
        rewards = [env.step([0.0])[1] for _ in range(2000)]
        assert min(rewards) > 0.7
        assert np.mean(rewards) > 0.93


def test_idle_below_the_critical_speed_scores_near_the_best():
    env = make(BOGIE)
    for speed in (70.0, 100.0):
        pins = {"speed": speed, "radius": math.inf, "offset": 0.003}
        assert mean_reward(env, pins)[0] > 0.94


@pytest.mark.parametrize("speed", [125.0, 130.0, 140.0])
def test_above_the_critical_speed_idle_scores_badly_and_lqr_well(speed, capsys):
    env = make(BOGIE)
    pins = {"speed": speed, "radius": math.inf, "offset": 0.003}
    passive, info = mean_reward(env, pins)
    active, with_lqr = mean_reward(env, pins, Feedback(env, speed))
    with capsys.disabled():
        print(f"\n{speed:g} m/s: idle {passive:.4f} a step, LQR {active:.4f}", end="")
    assert passive < 0.5
    assert info["hunting_amplitude"] > 0.01
    assert active > 0.995
    assert with_lqr["hunting_amplitude"] < 1e-3


def test_idle_dual_wheelset():
    env = make(DUAL)
    calm = mean_reward(env, {"speed": 25.0, "radius": math.inf, "offset": 0.003})[0]
    wild = mean_reward(env, {"speed": 50.0, "radius": math.inf, "offset": 0.003})[0]
    assert calm > 0.7
    assert wild < 0.5


STEPS = 2000
HUNTING = {"speed": 118.0, "radius": math.inf}
CURVE = {"speed": 110.0, "radius": 8000.0, "cant": 0.0873}
ROUGH = {"speed": 100.0, "radius": math.inf}


def returns(env, pins, policy):
    """Mean of what each step of an episode still has to come, for several discounts; 1 is the sum.

    What comes after a derailment is nothing.
    """
    env.reset(seed=1, options=pins)
    rewards = np.zeros(STEPS)
    for k in range(STEPS):
        _, rewards[k], terminated, truncated, _ = env.step([policy(env, k)])
        if terminated or truncated:
            break
    found = [rewards.mean()]
    for discount in (0.9, 0.95, 0.99, 0.999):
        ahead, values = 0.0, []
        for reward in rewards[::-1]:
            ahead = (1.0 - discount) * reward + discount * ahead
            values.append(ahead)
        found.append(np.mean(values))
    return np.array(found)


def crash(env, k):
    """Push the frame the way it turns."""
    turning = env.fleet.state(0)[env.fleet.model.state_names.index("dpsi_b")]
    return float(np.sign(turning)) or 1.0


def chatter(env, k):
    """Command all there is to either side in turn."""
    return 1.0 if k % 2 else -1.0


@pytest.mark.parametrize(
    ("pins", "options"),
    [(HUNTING, {}), (CURVE, {}), (ROUGH, {"irregularity": "low"})],
    ids=["tangent", "curve", "rough"],
)
def test_a_crash_is_worse_than_hunting_and_a_good_controller_best_for_every_discount(pins, options):
    env = make(BOGIE, **options)
    env.reset(options=pins)
    good = Feedback(env, pins["speed"])
    scores = {
        "crash": returns(env, pins, crash),
        "chatter": returns(env, pins, chatter),
        "idle": returns(env, pins, lambda env, k: 0.0),
        "mediocre": returns(env, pins, lambda env, k: 0.15 * float(good(env)[0])),
        "good": returns(env, pins, lambda env, k: float(good(env)[0])),
    }
    for worse, better in itertools.pairwise(scores):
        assert (scores[worse] < scores[better]).all(), (worse, better, scores)
    # what is left to gain shows: a good controller has a third less to lose than a mediocre one
    left = 1.0 - scores["good"][0], 1.0 - scores["mediocre"][0]
    assert left[0] < (0.97 if options else 0.4) * left[1]


def test_idle_below_the_critical_speed_is_among_the_best_and_chattering_is_not():
    env = make(BOGIE)
    pins = {"speed": 100.0, "radius": math.inf}
    env.reset(options=pins)
    good = Feedback(env, 100.0)
    best = returns(env, pins, lambda env, k: float(good(env)[0]))
    still = returns(env, pins, lambda env, k: 0.0)
    assert (still > 0.98 * best).all()
    assert (returns(env, pins, chatter) < 0.9 * best).all()


# ---------------------------------------------------------------- derailment


@both
def test_hunting_on_the_flange_is_not_a_derailment(name):
    env = make(name, duration=1.0)
    speed = 118.0 if name == BOGIE else 36.0
    _, info = mean_reward(env, {"speed": speed, "radius": math.inf, "offset": 0.009})
    assert info["derailed"] == 0


@both
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_more_than_30_mm_is_a_derailment(name, side):
    env = make(name)
    env.reset(seed=0, options={"speed": 50.0, "radius": math.inf})
    state = env.fleet.state(0)
    state[4] = side * 0.06
    env.fleet.set_state(0, state)
    _, reward, terminated, truncated, info = env.step(idle(env))
    assert terminated
    assert not truncated
    assert DERAILED[info["derailed"]] == "lateral displacement above 30 mm"
    assert info["derailment"] == 1.0
    assert reward == 0.0
    assert info["distance"] > 0.0


@both
def test_a_wheelset_in_the_air_is_a_derailment_after_2_m(name):
    env = make(name)
    env.reset(seed=0, options={"speed": 50.0, "radius": math.inf})
    state = env.fleet.state(0)
    state[env.fleet.model.state_names.index("z_w1")] = 0.05
    state[env.fleet.model.state_names.index("dz_w1")] = 1.0
    env.fleet.set_state(0, state)
    for k in range(8):
        *_, terminated, _, info = env.step(idle(env))
        assert terminated == (k == 7), k  # 0.25 m a step
    assert DERAILED[info["derailed"]] == "wheel lift over 2 m"


def test_wheels_lifted_in_turn_are_no_wheel_without_load_for_2_m():
    """A wheel has to be without load for 2 m; another one's lift does not go on its account."""
    env = make(BOGIE)
    env.reset(seed=0, options={"speed": 50.0, "radius": math.inf, "offset": 0.0})
    start = env.fleet.state(0)
    names = env.fleet.model.state_names
    for k in range(12):
        state = start.copy()
        body = "w1" if k % 2 else "w2"
        state[names.index(f"z_{body}")] = 0.01
        env.fleet.set_state(0, state)
        *_, terminated, _, info = env.step([0.0])
        assert not terminated, (k, info)


def test_high_guiding_forces_are_a_derailment():
    """A wheelset pressed against its flange with high friction and little load."""
    env = make(BOGIE, initial_offset=0.02, duration=2.0)
    reasons = set()
    for seed in range(40):
        env.reset(seed=seed, options={"speed": 150.0, "friction": 0.4})
        done = False
        while not done:
            *_, terminated, truncated, info = env.step(idle(env))
            done = terminated or truncated
        if terminated:
            reasons.add(DERAILED[info["derailed"]])
    assert "Nadal: Y/Q above its limit over 2 m" in reasons
    assert reasons <= set(DERAILED[1:])


def test_only_ratios_of_weights_count_and_not_all_may_be_zero():
    ten = RewardWeights(hunting=3.5, excursion=2.5, ride=2.0, effort=0.5, command=0.5, change=1.0)
    assert ten.shares == pytest.approx(RewardWeights().shares)
    with pytest.raises(ParameterError, match="all reward weights are 0"):
        RewardWeights(hunting=0.0, excursion=0.0, ride=0.0, effort=0.0, command=0.0, change=0.0)


@pytest.mark.parametrize("period", [0.001, 0.002])
def test_short_control_periods_keep_the_window_of_2_m(period):
    """At 20 m/s the window of Nadal's criterion is 2 m, so 100 steps of 1 ms."""
    try:
        env = make(DUAL, control_period=period, observation="state")
        env.reset(seed=0, options={"speed": 20.0 if period == 0.001 else 10.0, "radius": math.inf})
    except ParameterError:
        return  # refusing it is fine too
    # whatever leaked into the delay line would arrive as a command
    commands = [i for i, n in enumerate(env.fleet.observation_names) if n.startswith("command")]
    for _ in range(300):
        observation, *_ = env.step([0.0, 0.0])
        assert (observation[commands] == 0.0).all()


def test_page_of_rewards_is_what_the_example_computes():
    page = Path(railenv.__file__).parent.parent / "docs" / "environments" / "rewards.md"
    assert page.read_text() == markdown()
