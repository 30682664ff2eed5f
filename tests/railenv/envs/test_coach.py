"""The environment of a whole vehicle: four wheelsets, two frames and a body."""

import math
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import railenv
from railenv.envs import DERAILED
from railenv.envs.metrics import CFR_LIMIT, band_passed, largest_sliding_rms
from railenv.errors import ParameterError, UnknownNameError
from tests.railenv.envs.runs import BOGIE, actions_of, make, roll

COACH = "railenv/Coach-v1"
WHEELSETS = ("w1", "w2", "w3", "w4")
CURVE = {"speed": 70.0, "radius": 2800.0, "cant": 0.0873}
VARIED = {
    "observation": "sensors",
    "history": 1,
    "irregularity": "low",
    "randomize": {"conicity": (0.05, 0.1), "body_mass": (30e3, 38e3)},
    "track": "curve",
}


@pytest.fixture(scope="module")
def env():
    """The environment as it comes; tests reset it first."""
    return make(COACH)


def state_of(env):
    return dict(zip(env.fleet.model.state_names, env.fleet.state(0), strict=True))


def set_states(env, **values):
    state, names = env.fleet.state(0), env.fleet.model.state_names
    for name, value in values.items():
        state[names.index(name)] = value
    env.fleet.set_state(0, state)


# ------------------------------------------------------------------------------- contract


@pytest.mark.parametrize("observation", ["state", "sensors"])
def test_gymnasium_checker_is_satisfied(observation):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(COACH, observation=observation), skip_render_check=True)


@pytest.mark.parametrize(
    ("place", "commands", "entries"),
    [
        ("secondary", ["b1", "b2"], 81),
        ("lateral", ["b1", "b2"], 81),
        ("primary", list(WHEELSETS), 91),
        ("both", [*WHEELSETS, "b1", "b2"], 101),
    ],
)
def test_spaces_of_each_place(place, commands, entries):
    """62 states, 2 of each actuator, 6 of the sensors, 3 commands on their way, 3 of the run."""
    env = make(COACH, actuator=place)
    assert env.fleet.model.command_names == tuple(f"command_{name}" for name in commands)
    assert env.action_space == gym.spaces.Box(-1, 1, (len(commands),), np.float32)
    assert env.observation_space == gym.spaces.Box(-10, 10, (entries,), np.float32)


def test_without_actuators_there_is_nothing_to_do():
    assert make(COACH, actuator="none").action_space == gym.spaces.Discrete(1)


def test_a_vehicle_without_a_body_is_refused():
    with pytest.raises(ParameterError, match="TABLE_1 has no body"):
        make(COACH, vehicle="TABLE_1")


@pytest.mark.parametrize("keywords", [{}, VARIED], ids=["defaults", "varied"])
def test_rows_of_a_vector_environment_are_single_environments_to_the_bit(keywords):
    n, steps = 3, 15
    envs = gym.make_vec(COACH, num_envs=n, vectorization_mode="vector_entry_point", **keywords)
    observations, infos = envs.reset(seed=7)
    rng = np.random.default_rng(2)
    actions = rng.uniform(-1.0, 1.0, (steps, *envs.action_space.shape)).astype(np.float32)
    seen = [(observations.copy(), np.zeros(n))]
    seen += [tuple(np.array(part) for part in envs.step(a)[:2]) for a in actions]
    for i in range(n):
        env = make(COACH, **keywords)
        first, info = env.reset(seed=7 + i)
        np.testing.assert_array_equal(first, seen[0][0][i])
        assert info["body_mass"] == infos["body_mass"][i]
        for k, action in enumerate(actions):
            observation, reward, *_ = env.step(action[i])
            np.testing.assert_array_equal(observation, seen[k + 1][0][i])
            assert reward == seen[k + 1][1][i]


def test_same_seed_same_episode_and_exact_resume():
    def started(seed):
        env = make(COACH, **VARIED)
        return env, env.reset(seed=seed)[0]

    (env, first), (again, same), (_, other) = started(3), started(3), started(4)
    actions = actions_of(env, 20)
    np.testing.assert_array_equal(first, same)
    assert not np.array_equal(first, other)
    head = roll(env, actions[:8])
    np.testing.assert_array_equal(head, roll(again, actions[:8]))
    kept = env.get_state()
    tail = roll(env, actions[8:])
    again.reset()
    again.set_state(kept)
    np.testing.assert_array_equal(tail, roll(again, actions[8:]))


def test_options_pin_an_episode(env):
    pins = {**CURVE, "offset": 0.002, "friction": 0.3, "body_mass": 36e3, "conicity": 0.08}
    _, info = env.reset(seed=1, options=pins)
    drawn = {name: value for name, value in pins.items() if name != "radius"}
    assert {name: info[name] for name in drawn} == drawn
    assert info["curvature"] == 1.0 / pins["radius"]
    assert state_of(env)["y_body"] - env.fleet.equilibrium(0)[26] == pytest.approx(0.002)
    assert env.fleet.episodes[0].plant.parameters["body_mass"] == 36e3
    with pytest.raises(UnknownNameError, match="frame_mass"):
        env.reset(options={"frame_mass": 3e3})


# ---------------------------------------------------------------- observations and sensors


def test_frames_and_body_carry_sensors(env):
    model = env.fleet.model
    assert model.sensed == ("b1", "b2", "body")
    assert (model.felt, model.watched) == (("body",), ("b1", "b2"))
    bogie = make(BOGIE).fleet.model
    assert bogie.sensed == bogie.felt == bogie.watched == ("b",)
    names = [f"{kind}_{body}" for body in model.sensed for kind in ("accelerometer", "gyro")]
    table = make(COACH, observation="sensors").fleet.observation_table
    assert [r.name for r in table] == [*names, "speed", "cant_deficiency"]


def test_entries_are_scaled_states_and_the_height_of_the_body_counts_from_its_rest(env):
    env.reset(seed=3, options=CURVE)
    for action in actions_of(env, 5):
        observation, *_ = env.step(action)
    states = state_of(env)
    for value, reading in zip(observation, env.fleet.observation_table, strict=True):
        if reading.name in states:
            assert value == np.float32((states[reading.name] - reading.rest) / reading.scale)
    rests = {r.name: r.rest for r in env.fleet.observation_table if r.rest}
    at_rest = railenv.find_equilibrium(env.fleet.model.plant, speed=100.0)["z_body"]
    assert rests == {"z_body": pytest.approx(at_rest, rel=1e-9)}
    assert at_rest < -0.2


def test_no_entry_of_a_steady_run_is_near_its_bound(env):
    for radius in (math.inf, 3700.0):  # with a cant deficiency of 149 mm
        pins = {"speed": 60.0, "radius": radius, "cant": 0.0, "offset": 0.0}
        observation, _ = env.reset(seed=0, options=pins)
        assert np.abs(observation).max() < 2.0


def test_readings_of_a_curve_are_those_of_a_steady_body():
    """Specific force and yaw rate of a body that runs steadily on the curve, rolled outwards."""
    quiet = railenv.Sensors.ideal()
    env = make(COACH, observation="sensors", sensors=quiet)
    observation, _ = env.reset(seed=0, options={**CURVE, "offset": 0.0})
    entry = dict(zip(env.fleet.observation_names, observation, strict=True))
    scale = {r.name: r.scale for r in env.fleet.observation_table}
    roll_angle = state_of(env)["phi_body"]
    sideways = CURVE["speed"] ** 2 / CURVE["radius"] - 9.81 * CURVE["cant"]
    force = entry["accelerometer_body"] * scale["accelerometer_body"]
    assert force == pytest.approx(9.81 * roll_angle - sideways, rel=1e-5)
    assert abs(force) > 1.05 * sideways  # the body rolls outwards on its springs
    turning = entry["gyro_body"] * scale["gyro_body"]
    assert turning == pytest.approx(-CURVE["speed"] / CURVE["radius"], rel=1e-5)


# ---------------------------------------------------------------------------------- reward


def expected_terms(env, equilibrium, actions):
    """Terms of the reward from states and the last two actions, in plain Python."""
    model, x = env.fleet.model, state_of(env)
    x0 = dict(zip(model.plant.state_names, equilibrium, strict=True))
    speed, curvature, cant = env.fleet.conditions(0)
    vehicle = env.settings.vehicle
    k, delta = 2.0 * math.pi / vehicle.klingel_wavelength, vehicle.flange_clearance
    hunting = excursion = 0.0
    for w in WHEELSETS:
        rate = x[f"dy_{w}"] / (speed * k * delta)
        turn = (x[f"psi_{w}"] - x0[f"psi_{w}"]) / (k * delta)
        hunting += 0.5 * (rate**2 + turn**2) / 4.0
        excursion += ((x[f"y_{w}"] - x0[f"y_{w}"]) / delta) ** 2 / 4.0
    signals = dict(
        zip(
            model.signal_names,
            model.signals(env.fleet.state(0), speed=speed, curvature=curvature, cant=cant),
            strict=True,
        )
    )
    steady = 9.81 * x0["phi_body"] - (speed**2 * curvature - 9.81 * cant)
    ride = signals["force_body"] - steady
    shares = [x[n] / limit for n, limit in zip(state_of_actuators(model), model.limits, strict=True)]
    effort = sum(s * s for s in shares) / len(shares)
    amplitudes = [8.0 * math.sqrt(hunting), 8.0 * math.sqrt(excursion), abs(ride) / (0.5 / 3.0)]
    now, before = actions
    commands = [np.mean(np.square(now)), np.mean(np.abs(now - before)) / 2.0]
    return [*(s / (1.0 + s) for s in amplitudes), effort, *commands]


def state_of_actuators(model):
    return [mount.state_names[0] for mount in model.equipment.mounts]


@pytest.mark.parametrize("place", ["secondary", "lateral"])
def test_reward_is_the_documented_formula(place):
    env = make(COACH, actuator=place)
    env.reset(seed=2, options=CURVE)
    equilibrium = railenv.find_equilibrium(env.fleet.model.plant, **CURVE).state
    before = np.zeros(env.action_space.shape)
    for action in actions_of(env, 25):
        _, reward, terminated, _, info = env.step(action)
        terms = expected_terms(env, equilibrium, (np.asarray(action), before))
        before = np.asarray(action)
        found = [info[t] for t in ("hunting", "excursion", "ride", "effort", "command", "change")]
        assert found == pytest.approx(terms, rel=1e-5, abs=1e-7)
        cost = np.dot([0.35, 0.25, 0.2, 0.05, 0.05, 0.1], terms)
        assert reward == pytest.approx(1.0 - cost, rel=1e-5, abs=1e-7)
        assert not terminated
    assert found[2] > 0.01


def test_ride_is_that_of_the_body_and_instability_that_of_the_frames(env):
    env.reset(seed=0, options={"speed": 115.0, "radius": math.inf, "offset": 0.003})
    felt, shaken = [], []
    for _ in range(240):
        *_, terminated, _, info = env.step([0.0, 0.0])
        assert not terminated
        felt.append(info["ride"])
        force = env.fleet.model.signals(env.fleet.state(0), speed=115.0)
        shaken.append(force[:2])
    metrics, shaken = env.episode_metrics(), np.array(shaken)
    ride = 0.5 / 3.0 * np.array(felt) / (1.0 - np.array(felt))
    assert metrics["acceleration_peak"] == pytest.approx(ride.max(), rel=1e-9)
    assert metrics["acceleration_rms"] == pytest.approx(math.sqrt(np.mean(ride**2)), rel=1e-9)
    by_frame = [
        largest_sliding_rms(band_passed(own, (0.5, 10.0), 0.005), 400) / CFR_LIMIT for own in shaken.T
    ]
    assert metrics["cfr_213_333"] == pytest.approx(max(by_frame), rel=1e-6)
    assert abs(by_frame[0] - by_frame[1]) > 1e-3
    assert np.abs(shaken).max() > 3.0 * metrics["acceleration_peak"]


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_steady_running_in_a_curve_costs_nothing(env, hand):
    pins = {"speed": 80.0, "radius": hand * 4000.0, "cant": hand * 0.0873, "offset": 0.0}
    env.reset(seed=0, options=pins)
    assert abs(state_of(env)["y_body"]) > 5e-3  # there is an offset that could be punished
    rewards = [env.step([0.0, 0.0])[1] for _ in range(200)]
    assert 1.0 - 1e-4 < min(rewards) <= 1.0


def test_damped_above_the_critical_speed_it_scores_well_and_idle_badly(env):
    yaw_rates = [env.fleet.model.state_names.index(f"dpsi_{b}") for b in ("b1", "b2")]
    scores = []
    for gain in (0.0, 20.0):
        env.reset(seed=0, options={"speed": 115.0, "radius": math.inf, "offset": 0.003})
        rewards = []
        for _ in range(600):
            action = np.clip(-gain * env.fleet.state(0)[yaw_rates], -1.0, 1.0)
            _, reward, terminated, _, _ = env.step(action)
            rewards.append(reward)
            assert not terminated
        scores.append(np.mean(rewards))
    assert scores[0] < 0.7
    assert scores[1] > scores[0] + 0.2


# ------------------------------------------------------------------------------ derailment


@pytest.mark.parametrize("wheelset", WHEELSETS)
def test_any_wheelset_derails(env, wheelset):
    env.reset(seed=0, options={"speed": 60.0, "radius": math.inf})
    set_states(env, **{f"y_{wheelset}": 0.06})
    *_, terminated, _, info = env.step([0.0, 0.0])
    assert terminated
    assert DERAILED[info["derailed"]] == "lateral displacement above 30 mm"
    env.reset(seed=0, options={"speed": 50.0, "radius": math.inf})
    set_states(env, **{f"z_{wheelset}": 0.05, f"dz_{wheelset}": 1.0})
    for k in range(8):  # 0.25 m a step
        *_, terminated, _, info = env.step([0.0, 0.0])
        assert terminated == (k == 7), k
    assert DERAILED[info["derailed"]] == "wheel lift over 2 m"


# ------------------------------------------------------------------------------- actuators


def test_lateral_actuators_act_on_frame_and_body_with_opposite_forces():
    model = railenv.Equipped(railenv.Coach(railenv.HIGH_SPEED_COACH_HOLLOW), "lateral")
    assert model.equipment.mounts[1].between == ("b2", "body")
    x = model.steady_state(
        railenv.find_equilibrium(model.plant, speed=60.0).state, speed=60.0, curvature=0.0, cant=0.0
    )
    still = model.rhs(x, speed=60.0)
    force = 12e3
    x[model.state_names.index("F_b2")] = force
    change = dict(zip(model.state_names, model.rhs(x, speed=60.0) - still, strict=True))
    inertia = model.body_inertias

    def on(body, c):
        return inertia[body][c] * change[f"d{c}_{body}"]

    assert on("b2", "y") == pytest.approx(force)
    assert on("body", "y") == pytest.approx(-force)
    assert on("body", "psi") == pytest.approx(9.0 * force)  # the reaction acts 9 m behind its centre
    # the pair of forces has no moment about any axis along the track
    heights = model.body_heights
    about = sum(on(body, "phi") - heights[body] * on(body, "y") for body in ("b2", "body"))
    assert about == pytest.approx(0.0, abs=1e-6 * force)
    assert on("body", "phi") == pytest.approx((0.44 - heights["body"]) * force)
    others = (*WHEELSETS, "b1")
    assert {n for n, c in change.items() if n.endswith(others) and abs(c) > 1e-9} == set()


def test_lateral_actuators_damp_the_sway_of_the_body():
    """Skyhook damping: forces against the lateral velocity of the body above each bogie."""
    env = make(COACH, actuator="lateral", irregularity="low")
    names = env.fleet.model.state_names
    sways = []
    for gain in (0.0, 6.0):
        env.reset(seed=5, options={"speed": 60.0, "radius": math.inf, "offset": 0.0})
        body = []
        for _ in range(2000):
            x = env.fleet.state(0)
            body.append(x[names.index("y_body")])
            sway, yaw = x[names.index("dy_body")], x[names.index("dpsi_body")]
            # a positive command pushes the frame to the left and the body to the right
            action = gain * np.array([sway + 9.0 * yaw, sway - 9.0 * yaw])
            *_, terminated, _, _ = env.step(np.clip(action, -1.0, 1.0))
            assert not terminated
        sways.append(np.std(body))
    assert sways[1] < 0.75 * sways[0]


# ----------------------------------------------------------------------------- transitions


def test_a_transition_is_run_as_in_a_simulation_and_the_leading_bogie_enters_it_first():
    env = make(COACH, track="curve", time_step=5e-4)
    env.reset(seed=1, options={**CURVE, "offset": 0.0})
    fleet, episode = env.fleet, env.fleet.episodes[0]
    k, c = episode.curvature, episode.cant
    track = railenv.Track(episode.plan, (0.0, k, k, 0.0), (0.0, c, c, 0.0))
    run = railenv.simulate(
        fleet.model, speed=70.0, track=track, duration=4.0, output_step=0.005, step=2.5e-4,
        initial_state=fleet.state(0),
    )  # fmt: skip
    rolls = [fleet.model.state_names.index(f"phi_{frame}") for frame in ("b1", "b2")]
    halfway = math.ceil(episode.plan[0] / (70.0 * 0.005))  # one frame on the transition, one before it
    for i in range(1, 801):
        *_, terminated, _, _ = env.step([0.0, 0.0])
        assert not terminated
        state = fleet.state(0)
        if i % 50 == 0:
            np.testing.assert_allclose(state[:31], run.outputs[:31, i], rtol=0.0, atol=2e-5)
        if i == halfway:
            leading, trailing = np.abs(state[rolls])
            assert leading > 3.0 * trailing > 0.0


# ------------------------------------------------------------------------------- rendering


def test_frames_show_body_bogies_and_wheelsets():
    pytest.importorskip("pygame")
    env = make(COACH, render_mode="rgb_array")
    env.reset(seed=0, options=CURVE)
    for action in actions_of(env, 20):
        env.step(action)
    scene = env.unwrapped._recorder.scene()
    assert scene.wheelsets == pytest.approx((10.2, 7.8, -7.8, -10.2))
    assert [(o.x, o.kind) for o in scene.outlines] == [(9.0, "frame"), (-9.0, "frame"), (0.0, "body")]
    assert scene.bodies.shape == (7, 4)
    frame = env.render()
    assert frame.shape == (600, 960, 3)
    later = [env.step(action) for action in actions_of(env, 5)] and env.render()
    assert (frame != later).any()
    env.close()
