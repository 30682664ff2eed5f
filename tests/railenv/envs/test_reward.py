"""Rewards: the documented formula and its range, what scores well and badly; ends by derailment."""

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

TERMS = ("hunting", "excursion", "ride", "effort", "derailment")


def idle(env):
    return np.zeros(env.action_space.shape)


# ---------------------------------------------------------------- formula


def rails_at(env, kind, distance):
    record = getattr(irregularity.line(env.settings.irregularity), kind)
    position = distance / irregularity.SPACING
    cell = math.floor(position)
    a, b = record[cell % len(record)], record[(cell + 1) % len(record)]
    return a + (position - cell) * (b - a)


def expected_terms(env, equilibrium, c, rails):
    """Terms of the reward from states, in plain Python."""
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
    terms = [s / (1.0 + s) for s in (hunting, excursion, (ride / (0.3 * 9.81)) ** 2)]
    return [*terms, effort]


@both
@pytest.mark.parametrize("level", [None, "low"])
def test_reward_is_the_documented_formula(name, level):
    weights = RewardWeights(hunting=0.5, excursion=0.2, ride=0.7, effort=0.3, derailment=7.0)
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
    for k in range(1, 40):
        _, reward, terminated, _, info = env.step(rng.uniform(-1, 1, env.action_space.shape))
        rails = np.zeros(6)
        if level:
            s = k * 0.005 * c["speed"]
            ahead = [start + s + half, start + s - half]
            values = [rails_at(env, kind, d) for kind in ("align", "vert", "cross") for d in ahead]
            rails = min(s / 20.0, 1.0) * np.array(values)
        terms = expected_terms(env, equilibrium, c, rails)
        assert [info[t] for t in TERMS[:4]] == pytest.approx(terms, rel=1e-5, abs=1e-7)
        total = 0.5 * terms[0] + 0.2 * terms[1] + 0.7 * terms[2] + 0.3 * terms[3]
        assert reward == pytest.approx(-total - 7.0 * terminated, rel=1e-5, abs=1e-7)


@both
def test_rewards_lie_in_their_range(name):
    env = make(name, irregularity="high", duration=2.0)
    lowest = 0.0
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
            bare = reward + 100.0 * terminated
            assert -1.0 < bare <= 0.0
            lowest = min(lowest, bare)
            done = terminated or truncated
    assert lowest < -0.2


# ---------------------------------------------------------------- what scores well


@both
@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_steady_running_in_a_curve_costs_nothing(name, hand):
    env = make(name, duration=3.0)
    speed, radius, cant = (95.0, 6250.0, 0.0873) if name == BOGIE else (25.0, 500.0, 0.05)
    pins = {"speed": speed, "radius": hand * radius, "cant": hand * cant, "offset": 0.0}
    found, _ = mean_reward(env, pins)
    assert abs(env.fleet.equilibrium(0)[0]) > 1e-4  # there is an offset that could be punished
    assert -1e-9 < found <= 0.0


def test_slow_change_of_curvature_costs_little():
    env = make(BOGIE, track="curve", tangent_share=0.0)
    for seed in range(3):
        env.reset(seed=seed, options={"speed": 70.0, "offset": 0.0})
        rewards = [env.step([0.0])[1] for _ in range(2000)]
        assert min(rewards) > -0.05
        assert np.mean(rewards) > -0.01


def test_idle_below_the_critical_speed_scores_near_the_best():
    env = make(BOGIE)
    for speed in (70.0, 100.0):
        pins = {"speed": speed, "radius": math.inf, "offset": 0.003}
        assert mean_reward(env, pins)[0] > -0.01


@pytest.mark.parametrize("speed", [125.0, 130.0, 140.0])
def test_above_the_critical_speed_idle_scores_badly_and_lqr_well(speed, capsys):
    env = make(BOGIE)
    pins = {"speed": speed, "radius": math.inf, "offset": 0.003}
    passive, info = mean_reward(env, pins)
    active, with_lqr = mean_reward(env, pins, Feedback(env, speed))
    with capsys.disabled():
        print(f"\n{speed:g} m/s: idle {passive:.4f} a step, LQR {active:.4f}", end="")
    assert passive < -0.25
    assert info["hunting_amplitude"] > 0.01
    assert active > -0.02
    assert with_lqr["hunting_amplitude"] < 1e-3


def test_idle_dual_wheelset():
    env = make(DUAL)
    calm = mean_reward(env, {"speed": 25.0, "radius": math.inf, "offset": 0.003})[0]
    wild = mean_reward(env, {"speed": 50.0, "radius": math.inf, "offset": 0.003})[0]
    assert calm > -0.02
    assert wild < -0.2


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
    assert reward < -100.0
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


def test_weight_of_derailment():
    env = make(BOGIE, weights=RewardWeights(derailment=3.0))
    env.reset(seed=0)
    state = env.fleet.state(0)
    state[0] = 0.1
    env.fleet.set_state(0, state)
    _, reward, terminated, *_ = env.step([0.0])
    assert terminated
    assert -4.0 < reward < -3.0


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
