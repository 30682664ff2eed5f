"""The plant behind a single environment: model, actuators, growth of disturbances."""

import math

import numpy as np
import pytest

import design
import railenv
from tests.railenv.envs.runs import BOGIE, DUAL, actions_of, both, make


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
        _, c = env.reset(seed=seed, options={"offset": 0.0})
        found = railenv.find_equilibrium(
            env.fleet.model,
            speed=c["speed"],
            radius=env.fleet.episodes[0].radius,
            cant=c["cant"],
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
