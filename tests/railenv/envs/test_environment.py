"""The single environments: Gymnasium's contract, reproducibility, and the plant behind them."""

import copy
import math
import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import design
import railenv
from railenv.envs.environment import BogieEnv
from railenv.envs.settings import RewardWeights
from railenv.errors import ParameterError, UnknownNameError

IDS = ("railenv/Bogie-v0", "railenv/DualWheelset-v0")
BOGIE, DUAL = IDS
ALLOWED_WARNINGS: tuple[str, ...] = ()
"""Beginnings of the checker's warnings that are accepted, each with its reason beside it."""

both = pytest.mark.parametrize("name", IDS)


def make(name, **keywords):
    return gym.make(name, disable_env_checker=True, **keywords).unwrapped


def actions_of(env, count, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (count, *env.action_space.shape)).astype(np.float32)


def roll(env, actions):
    """Everything that some steps return, and the states, as one array."""
    rows = []
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        terms = [info[k] for k in ("hunting", "excursion", "ride", "effort", "derailment")]
        rows.append([*observation, reward, terminated, truncated, *terms, *env.fleet.state(0)])
        if terminated or truncated:
            break
    return np.array(rows, dtype=float)


# ---------------------------------------------------------------- Gymnasium's contract


@both
@pytest.mark.parametrize("keywords", [{}, {"observation": "sensors", "history": 2}])
def test_gymnasium_checker_is_satisfied(name, keywords):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(gym.make(name, **keywords).unwrapped, skip_render_check=True)
    messages = [str(w.message) for w in caught]
    assert [m for m in messages if not m.startswith(ALLOWED_WARNINGS or ("\0",))] == []


@both
def test_pickled_and_copied_environments_go_on_alike(name):
    env = make(name, observation="sensors", history=1, irregularity="low")
    env.reset(seed=5)
    actions = actions_of(env, 12)
    roll(env, actions[:4])
    copies = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    expected, following = roll(env, actions[4:]), env.reset()[0]
    for other in copies:
        np.testing.assert_array_equal(roll(other, actions[4:]), expected)
        np.testing.assert_array_equal(other.reset()[0], following)


def test_wrapped_environment_can_be_pickled():
    env = pickle.loads(pickle.dumps(gym.make(BOGIE, max_episode_steps=3)))
    env.reset(seed=0)
    assert [env.step(env.action_space.sample())[3] for _ in range(3)] == [False, False, True]


@both
def test_close_can_be_called_twice(name):
    env = gym.make(name)
    env.reset(seed=0)
    env.close()
    env.close()


@both
def test_global_generator_is_untouched(name):
    np.random.seed(3)  # noqa: NPY002 - the point of the test
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    env = make(name, irregularity="high", observation="sensors", randomize={"conicity": (0.05, 0.1)})
    env.reset(seed=1)
    roll(env, actions_of(env, 5))
    env.reset()
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


@both
def test_steps_need_a_reset(name):
    env = make(name, duration=0.01)
    action = env.action_space.sample()
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        env.step(action)
    env.reset(seed=0)
    assert env.step(action)[3] is False
    assert env.step(action)[3] is True
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        env.step(action)


@both
def test_duration_ends_an_episode_and_max_episode_steps_before_it(name):
    env = gym.make(name)
    assert env.spec.max_episode_steps is None
    assert env.unwrapped.settings.duration == 10.0
    assert env.unwrapped.settings.control_period == 0.005
    env = gym.make(name, duration=0.02, max_episode_steps=3)
    env.reset(seed=0)
    ends = [env.step(np.zeros(env.action_space.shape))[2:4] for _ in range(3)]
    assert ends == [(False, False), (False, False), (False, True)]


@both
@pytest.mark.parametrize("action", [[np.nan] * 2, [0.0] * 3, [np.inf, 0.0]])
def test_impossible_actions_raise(name, action):
    env = make(name, actuator="primary")
    env.reset(seed=0)
    with pytest.raises(ParameterError, match="finite number"):
        env.step(np.array(action))


# ---------------------------------------------------------------- keywords


@both
def test_unknown_keywords_raise_with_a_suggestion(name):
    with pytest.raises(UnknownNameError, match=r"'speed_rang' \(did you mean 'speed_range'\?\)"):
        gym.make(name, speed_rang=(60.0, 80.0))


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"speed_range": 80.0}, "speed_range is 80.0; it must be a pair"),
        ({"speed_range": (90.0, 80.0)}, "the lowest must not exceed"),
        ({"speed_range": (1.0, 80.0)}, "at least 5 m/s"),
        ({"cant_range": (0.0, 0.9)}, "cant_range"),
        ({"history": -1}, "history is -1"),
        ({"duration": 0.001}, "at least one control period"),
        ({"duration": math.inf}, "duration"),
        ({"time_step": 0.0}, "time_step is 0 s"),
        ({"tangent_share": 1.5}, "tangent_share"),
        ({"initial_offset": 0.1}, "initial_offset"),
        ({"observation": "pixels"}, "allowed are state, sensors"),
        ({"actuator": "tertiary"}, "allowed are none, secondary, primary"),
        ({"track": "loop"}, "allowed are constant, curve"),
        ({"irregularity": "medium"}, "allowed are low, high"),
        ({"weights": {"ride": 1.0}}, "must be RewardWeights"),
        ({"randomize": {"frictio": (0.1, 0.2)}}, "did you mean 'friction'"),
        ({"actuator_model": 3}, "must be a railenv.Actuator"),
        ({"sensors": 3}, "must be a railenv.Sensors"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_impossible_keywords_raise(keywords, message):
    with pytest.raises(ParameterError, match=message.replace("(", r"\(")):
        make(BOGIE, **keywords)


def test_dual_wheelset_has_no_secondary_actuator():
    with pytest.raises(ParameterError, match="'none', 'primary'"):
        make(DUAL, actuator="secondary")


def test_unknown_render_modes_raise():
    with pytest.raises(ParameterError, match="render_mode is 'ansi'"):
        BogieEnv(render_mode="ansi")


def test_unknown_and_negative_weights_raise():
    with pytest.raises(TypeError):
        RewardWeights(comfort=1.0)
    with pytest.raises(ParameterError, match="reward weight ride"):
        RewardWeights(ride=-1.0)


# ---------------------------------------------------------------- reproducibility


def everything():
    return {
        "observation": "sensors",
        "history": 1,
        "irregularity": "low",
        "irregularity_factor": (0.5, 1.5),
        "randomize": {"conicity": (0.05, 0.1), "creep_factor": (0.7, 1.0)},
        "track": "curve",
    }


@both
@pytest.mark.parametrize("keywords", [{}, everything()], ids=["defaults", "everything"])
def test_same_seed_same_trajectory_and_others_differ(name, keywords):
    def run(seed):
        env = make(name, **keywords)
        first, _ = env.reset(seed=seed)
        return first, roll(env, actions_of(env, 20))

    (o1, a), (o2, b), (o3, c) = run(4), run(4), run(5)
    np.testing.assert_array_equal(o1, o2)
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(o1, o3)
    assert not np.array_equal(a, c)


@both
def test_a_seed_means_the_same_whatever_ran_before(name):
    used = make(name)
    used.reset(seed=1000)
    for seed in range(5):
        fresh = make(name)
        fresh.reset(seed=seed)
        used.reset(seed=seed)
        np.testing.assert_array_equal(fresh.fleet.state(0), used.fleet.state(0))
        np.testing.assert_array_equal(fresh.fleet.equilibrium(0), used.fleet.equilibrium(0))


@both
@pytest.mark.parametrize("keywords", [{}, everything()], ids=["defaults", "everything"])
def test_state_can_be_kept_and_resumed_exactly(name, keywords):
    model = railenv.Actuator.primary().replace(delay=0.0123)
    env = make(name, actuator="primary", actuator_model=model, **keywords)
    actions = actions_of(env, 30)
    env.reset(seed=8)
    roll(env, actions[:7])
    kept = env.get_state()
    expected = roll(env, actions[7:])
    following = env.reset()[0]
    for other in (env, make(name, actuator="primary", actuator_model=model, **keywords)):
        other.set_state(kept)
        np.testing.assert_array_equal(roll(other, actions[7:]), expected)
        np.testing.assert_array_equal(other.reset()[0], following)


def test_state_of_an_ended_episode_stays_ended():
    env = make(BOGIE, duration=0.01)
    env.reset(seed=0)
    before = env.get_state()
    env.step([0.0])
    env.step([0.0])
    after = env.get_state()
    env.set_state(before)
    env.step([0.0])
    env.set_state(after)
    with pytest.raises(gym.error.ResetNeeded):
        env.step([0.0])


def test_state_of_another_size_is_refused():
    one, other = make(BOGIE), make(BOGIE, actuator="primary")
    one.reset(seed=0)
    other.reset(seed=0)
    before = one.fleet.state(0)
    with pytest.raises(ParameterError, match="same settings"):
        one.set_state(other.get_state())
    np.testing.assert_array_equal(one.fleet.state(0), before)


# ---------------------------------------------------------------- spaces and observations


@both
def test_without_actuators_the_environment_is_passive(name):
    env = make(name, actuator="none")
    assert env.action_space == gym.spaces.Discrete(1)
    env.reset(seed=2)
    armed = make(name)
    armed.reset(seed=2)
    n = env.fleet.model.plant.n_states
    for _ in range(50):
        _, reward, *_ = env.step(0)
        _, other, *_ = armed.step(np.zeros(armed.action_space.shape))
        assert reward == pytest.approx(other, rel=1e-8, abs=1e-12)
    passive, active = env.fleet.state(0)[:n], armed.fleet.state(0)[:n]
    np.testing.assert_allclose(passive, active, rtol=1e-8, atol=1e-12)


def test_action_spaces():
    for name, place, n in ((BOGIE, "secondary", 1), (BOGIE, "primary", 2), (DUAL, "primary", 2)):
        assert make(name, actuator=place).action_space == gym.spaces.Box(-1, 1, (n,), np.float32)


@both
@pytest.mark.parametrize("kind", ["state", "sensors"])
def test_observations_are_those_of_the_table(name, kind):
    quiet = railenv.Sensors.standard().replace(
        accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_bias=0.0, gyro_bias=0.0
    )
    env = make(name, observation=kind, sensors=quiet, irregularity="low")
    env.reset(seed=3)
    actions = actions_of(env, 9)
    observation = None
    for action in actions:
        observation, *_ = env.step(action)
    fleet = env.fleet
    table = fleet.observation_table
    assert env.observation_space.shape == (len(table),)
    assert np.isfinite(env.observation_space.low).all()
    assert np.isfinite(env.observation_space.high).all()
    assert (env.observation_space.low == -10).all()
    assert (env.observation_space.high == 10).all()
    speed, curvature, cant = fleet.conditions(0)
    known = dict(zip(fleet.model.state_names, fleet.state(0), strict=True))
    known |= {"speed": speed, "cant": cant}
    known["cant_deficiency"] = speed**2 * curvature / fleet.settings.vehicle.gravity - cant
    for body in fleet.model.equipment.sensed:
        known[f"accelerometer_{body}"] = known[f"accel_{body}"]
        known[f"gyro_{body}"] = known[f"gyro_{body}"]
    for j, body in enumerate(fleet.model.equipment.actuated):
        for age in range(1, 4):
            command = fleet.model.actuator.limit * float(actions[-age, j])
            known[f"command_{body}[-{age}]"] = command
    for value, (entry, unit, scale, _) in zip(observation, table, strict=True):
        assert unit
        assert scale > 0.0
        assert value == np.float32(known[entry] / scale), entry


def test_observations_are_clipped_at_their_bounds():
    env = make(BOGIE)
    env.reset(seed=0, options={"radius": math.inf})
    state = env.fleet.state(0)
    state[env.fleet.model.state_names.index("dT_b")] = 1e12
    env.fleet.set_state(0, state)
    observation, *_ = env.step([0.0])
    assert np.abs(observation).max() == 10.0
    assert observation in env.observation_space


def test_noise_and_bias_are_as_set():
    sensors = railenv.Sensors.standard()
    env = make(BOGIE, observation="sensors", sensors=sensors)
    errors, biases = [], []
    for seed in range(40):
        env.reset(seed=seed, options={"radius": math.inf, "offset": 0.0, "speed": 60.0})
        run = np.array([env.step([0.0])[0][:2] for _ in range(100)]) * [5.0, 0.2]
        biases.append(run.mean(axis=0))
        errors.append(run - run.mean(axis=0))
    spread = np.concatenate(errors).std(axis=0) * math.sqrt(100 / 99)
    np.testing.assert_allclose(spread, [sensors.accelerometer_noise, sensors.gyro_noise], rtol=0.05)
    # of 40 biases the standard deviation is known to 11 %, beside the noise's mean
    expected = np.hypot(
        [sensors.accelerometer_bias, sensors.gyro_bias], np.array(spread) / math.sqrt(100)
    )
    np.testing.assert_allclose(np.std(biases, axis=0), expected, rtol=0.4)
    flat = np.concatenate(errors)
    lag = (flat[1:] * flat[:-1]).mean(axis=0) / flat.var(axis=0)
    assert (np.abs(lag) < 0.05).all()


@both
@pytest.mark.parametrize("kind", ["state", "sensors"])
def test_history_stacks_past_observations_newest_first(name, kind):
    plain, stacked = (make(name, observation=kind, history=k) for k in (0, 3))
    first, _ = plain.reset(seed=6)
    past = [first] * 4
    np.testing.assert_array_equal(stacked.reset(seed=6)[0], np.concatenate(past))
    for action in actions_of(plain, 6):
        past = [plain.step(action)[0], *past[:3]]
        np.testing.assert_array_equal(stacked.step(action)[0], np.concatenate(past))
    assert stacked.observation_space.shape == (4 * len(first),)


# ---------------------------------------------------------------- the plant behind it


@both
@pytest.mark.parametrize("command", [0.0, 0.3])
@pytest.mark.parametrize("curved", [False, True])
def test_environment_is_the_simulation_of_the_equipped_model(name, command, curved):
    place = "secondary" if name == BOGIE else "primary"
    actuator = getattr(railenv.Actuator, place)().replace(delay=0.0)
    speed, radius, cant = (100.0, 6250.0, 0.0873) if name == BOGIE else (30.0, 800.0, 0.08)
    if not curved:
        radius, cant = math.inf, 0.0
    env = make(name, actuator_model=actuator)
    pins = {"speed": speed, "radius": radius, "cant": cant, "offset": 0.002}
    env.reset(seed=1, options=pins)
    model = env.fleet.model
    commands = {n: command * actuator.limit for n in model.input_names if n.startswith("command")}
    response = railenv.simulate(
        model,
        speed=speed,
        radius=radius,
        cant=cant,
        duration=1.0,
        initial_state=env.fleet.state(0),
        inputs=commands,
        step=0.001,
        output_step=0.005,
    )
    for expected in response.states.T[1:]:
        env.step(np.full(env.action_space.shape, command))
        np.testing.assert_allclose(
            env.fleet.state(0), expected, rtol=1e-7, atol=1e-9 * np.abs(model.scale).max()
        )
        np.testing.assert_allclose(env.fleet.state(0) / model.scale, expected / model.scale, atol=1e-6)


@both
def test_environment_starts_at_the_running_equilibrium(name):
    env = make(name)
    for seed in range(6):
        _, info = env.reset(seed=seed, options={"offset": 0.0})
        c = info["conditions"]
        found = railenv.find_equilibrium(
            env.fleet.model, speed=c["speed"], radius=c["radius"], cant=c["cant"]
        )
        scale = env.fleet.model.scale
        np.testing.assert_allclose(env.fleet.state(0) / scale, found.state / scale, atol=1e-5)


def lag(actuator, t):
    """Unit step response of the actuators' second-order lag."""
    omega, zeta = 2.0 * math.pi * actuator.bandwidth, actuator.damping
    damped = omega * math.sqrt(1.0 - zeta**2)
    late = np.maximum(t, 0.0)
    decay = np.exp(-zeta * omega * late)
    turning = np.cos(damped * late) + zeta * omega / damped * np.sin(damped * late)
    return np.where(t > 0.0, 1.0 - decay * turning, 0.0)


@both
@pytest.mark.parametrize("delay", [0.0, 0.005, 0.0075, 0.010, 0.0123])
def test_delay_is_exactly_as_set(name, delay):
    base = railenv.Actuator.secondary() if name == BOGIE else railenv.Actuator.primary()
    actuator = base.replace(delay=delay)
    env = make(name, actuator_model=actuator)
    env.reset(seed=0, options={"radius": math.inf})
    T, n = 0.005, 30
    n_plant, n_actuators = env.fleet.model.plant.n_states, env.fleet.n_actuators
    actions = actions_of(env, n).astype(float)
    times = T * np.arange(1, n + 1)
    changes = np.diff(np.vstack([np.zeros((1, n_actuators)), actions]), axis=0)
    since = times[:, None] - T * np.arange(n)[None, :] - delay
    since[np.abs(since) < 1e-12] = 0.0
    expected = lag(actuator, since) @ changes
    for k, action in enumerate(actions):
        env.step(action)
        state = env.fleet.state(0)[n_plant : n_plant + 2 * n_actuators : 2] / actuator.limit
        if times[k] <= delay + 1e-12:
            assert (state == 0.0).all()
        else:
            assert (state != 0.0).all()
        np.testing.assert_allclose(state, expected[k], atol=2e-5)


@both
def test_moments_stay_within_their_limit(name):
    base = railenv.Actuator.secondary() if name == BOGIE else railenv.Actuator.primary()
    actuator = base.replace(damping=0.1, delay=0.0)
    env = make(name, actuator_model=actuator)
    env.reset(seed=0, options={"radius": math.inf})
    model = env.fleet.model
    n = model.plant.n_states
    overshoot = 0.0
    for k in range(60):
        sign = 1.0 if (k // 5) % 2 else -1.0
        _, _, _, _, info = env.step(np.full(env.action_space.shape, sign))
        state = env.fleet.state(0)
        developed = state[n : n + 2 * env.fleet.n_actuators : 2]
        assert (np.abs(env.fleet.moments(0)) <= 1.0).all()
        assert 0.0 <= info["effort"] <= 1.0
        if np.abs(developed).min() > actuator.limit:
            overshoot = max(overshoot, np.abs(developed).max() / actuator.limit)
            clipped = state.copy()
            clipped[n : n + 2 * env.fleet.n_actuators : 2] = np.clip(
                developed, -actuator.limit, actuator.limit
            )
            np.testing.assert_array_equal(
                model.rhs(state, speed=60.0)[:n], model.rhs(clipped, speed=60.0)[:n]
            )
    assert overshoot > 1.2


@both
def test_actions_beyond_one_count_as_one(name):
    one, other = make(name), make(name)
    one.reset(seed=0)
    other.reset(seed=0)
    for sign in (1.0, -1.0, 1.0):
        a, *_ = one.step(np.full(one.action_space.shape, sign))
        b, *_ = other.step(np.full(one.action_space.shape, 7.0 * sign))
        np.testing.assert_array_equal(a, b)


def test_rate_limit_bounds_the_moments_rate():
    actuator = railenv.Actuator.secondary().replace(rate_limit=2e5, delay=0.0)
    env = make(BOGIE, actuator_model=actuator)
    env.reset(seed=0)
    k = env.fleet.model.state_names.index("T_b")
    moments = [0.0]
    for _ in range(20):
        env.step([1.0])
        moments.append(env.fleet.state(0)[k])
    steps = np.diff(moments)
    assert steps.max() <= 2e5 * 0.005 * (1.0 + 1e-9)
    assert steps.max() > 0.99 * 2e5 * 0.005


CASES = {
    "coach-tangent": (BOGIE, math.inf, 0.0),
    "coach-curve": (BOGIE, 6250.0, 0.0873),
    "dual-tangent": (DUAL, math.inf, 0.0),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("factor", [0.97, 1.03])
def test_disturbances_decay_below_and_grow_above_the_critical_speed(case, factor):
    name, radius, cant = CASES[case]
    env = make(name, max_cant_deficiency=0.3, duration=20.0)
    model = env.fleet.model
    critical = design.critical_speed(model, radius=radius, cant=cant)
    assert critical.loss == "hunting"
    speed = factor * critical.speed
    pins = {"speed": speed, "radius": radius, "cant": cant, "offset": 1e-5}
    env.reset(seed=0, options=pins)
    found = railenv.find_equilibrium(model, speed=speed, radius=radius, cant=cant)
    A = design.linearize(model, speed=speed, radius=radius, cant=cant, state=found.state).A
    values, vectors = np.linalg.eig(A.T)
    k = np.argmax(values.real)
    start = env.fleet.state(0).copy()

    def mode():
        return abs(vectors[:, k] @ (env.fleet.state(0) - found.state))

    idle = np.zeros(env.action_space.shape)
    for _ in range(40):
        env.step(idle)
    first, seconds = mode(), 2.0
    for _ in range(round(seconds / 0.005)):
        env.step(idle)
    growth = math.log(mode() / first) / seconds
    assert (growth > 0.0) == (factor > 1.0)
    assert growth == pytest.approx(values[k].real, rel=0.03, abs=0.01)
    assert start[0] != env.fleet.state(0)[0]
