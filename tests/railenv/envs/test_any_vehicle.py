"""Environments of assemblies and of equations of one's own, and what they refuse."""

import dataclasses
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import railenv
from railenv.envs import DERAILED
from railenv.envs.settings import settings
from railenv.equations.functions import tanh
from railenv.errors import ParameterError, UnknownNameError

NAME = "railenv/Bogie-v1"
ASSEMBLY = railenv.Bogie(railenv.HIGH_SPEED_COACH).assembly  # has the kernels of the shipped bogie
SPEEDS = (90.0, 120.0)


def wheelset(x, u, speed, curvature, cant, p):
    """The sprung wheelset of the how-to page, with a lateral force as a second input."""
    y, psi, dy, dpsi = x
    lateral = p.adhesion * tanh(2 * p.creep * (dy / speed - psi) / p.adhesion)
    steering = 2 * p.creep * p.a * (p.a * dpsi / speed + p.conicity * y / p.r0)
    return [dy, dpsi, (-p.k * y - lateral + u[1]) / p.m, (-p.kpsi * psi - steering + u[0]) / p.I]


NUMBERS = {"m": 1250.0, "I": 760.0, "a": 0.75, "r0": 0.45, "conicity": 0.05, "clearance": 0.009}
NUMBERS |= {"creep": 10e6, "adhesion": 40e3, "k": 0.2e6, "kpsi": 2.5e6}
CONTACT = {
    "flange_clearance": "clearance",
    "half_gauge": "a",
    "wheel_radius": "r0",
    "conicity": "conicity",
}


def own(**body):
    bodies = [railenv.MovingBody(name="w", y="y", psi="psi", **body)] if body else []
    states = ["y", "psi", "dy", "dpsi"]
    return railenv.Model("wheelset", states, ["M", "F"], wheelset, NUMBERS, scale=1e-3, bodies=bodies)


@pytest.fixture(scope="module")
def sprung():
    """The sprung wheelset with a yaw and a lateral actuator."""
    plant = own(yaw_moment="M", lateral_force="F", **CONTACT)
    actuator = railenv.Actuator.primary()
    pair = ("w", "ground")
    actuators = [
        railenv.YawActuator(between=pair, actuator=actuator),
        railenv.LateralActuator(between=pair, actuator=actuator, name="side"),
    ]
    return railenv.Equipped(plant, actuators=actuators)


@pytest.fixture(params=["assembly", "own equations"])
def keywords(request, sprung):
    if request.param == "assembly":
        return {"vehicle": ASSEMBLY, "randomize": {"conicity": (0.05, 0.1)}, "speed_range": SPEEDS}
    return {"model": sprung, "randomize": {"conicity": (0.05, 0.1)}, "speed_range": SPEEDS}


def make(**keywords):
    return gym.make(NAME, disable_env_checker=True, **keywords).unwrapped


def roll(env, count, seed=0):
    """Observations, rewards and ends of some steps of an environment."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(count):
        action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, _ = env.step(action)
        rows.append([*observation, reward, terminated, truncated])
        if terminated or truncated:
            break
    return np.array(rows)


# ------------------------------------------------------------------------------- contract


@pytest.mark.parametrize("observation", ["state", "sensors"])
def test_gymnasium_checker_is_satisfied(keywords, observation):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(observation=observation, history=1, **keywords), skip_render_check=True)


def test_rows_of_a_vector_environment_are_single_environments_to_the_bit(keywords):
    n, steps = 3, 20
    envs = gym.make_vec(NAME, num_envs=n, vectorization_mode="vector_entry_point", **keywords)
    observations, infos = envs.reset(seed=7)
    rng = np.random.default_rng(2)
    actions = rng.uniform(-1.0, 1.0, (steps, *envs.action_space.shape)).astype(np.float32)
    seen = [(observations.copy(), np.zeros(n))]
    seen += [tuple(np.array(part) for part in envs.step(a)[:2]) for a in actions]
    for i in range(n):
        env = make(**keywords)
        first, info = env.reset(seed=7 + i)
        np.testing.assert_array_equal(first, seen[0][0][i])
        assert info["conicity"] == infos["conicity"][i]
        for k, action in enumerate(actions):
            observation, reward, *_ = env.step(action[i])
            np.testing.assert_array_equal(observation, seen[k + 1][0][i])
            assert reward == seen[k + 1][1][i]


def test_a_parameter_is_drawn_and_pinned_and_reaches_the_equations(keywords):
    env = make(**keywords)
    drawn = [env.reset(seed=k)[1]["conicity"] for k in range(20)]
    assert min(drawn) >= 0.05
    assert max(drawn) <= 0.1
    assert np.ptp(drawn) > 0.02
    _, info = env.reset(seed=1, options={"conicity": 0.07, "speed": 100.0, "offset": 0.001})
    assert info["conicity"] == 0.07
    assert info["offset"] == 0.001
    assert env.fleet.conditions(0)[0] == 100.0
    plant = env.fleet.episodes[0].plant
    assert plant.parameters["conicity"] == 0.07
    layout, w = env.fleet._layout, env.fleet._view(env.fleet._blocks, 0)
    assert 0.07 in w[layout.p : layout.dx]


def test_an_assembly_runs_as_the_shipped_bogie_of_the_same_parts():
    """The same structure and numbers: the same bits."""
    pins = {"speed": 90.0, "radius": 8000.0, "cant": 0.05, "offset": 0.002}
    rows = []
    for env in (make(vehicle=ASSEMBLY), make(vehicle=railenv.HIGH_SPEED_COACH)):
        env.reset(seed=3, options=pins)
        rows.append(roll(env, 30))
    np.testing.assert_array_equal(*rows)


def test_the_sprung_wheelset_hunts_above_its_critical_speed_and_derails(sprung):
    env = make(model=sprung, speed_range=(80.0, 140.0))
    ends = {}
    for speed in (100.0, 130.0):
        env.reset(seed=1, options={"speed": speed, "radius": np.inf, "offset": 0.003})
        while True:
            *_, terminated, truncated, info = env.step(np.zeros(2))
            if terminated or truncated:
                break
        ends[speed] = DERAILED[info["derailed"]]
    assert ends == {100.0: "", 130.0: "lateral displacement above 30 mm"}


def test_a_moment_and_a_force_push_the_wheelset_each_their_way(sprung):
    found = []
    for action in ([0.0, 0.0], [0.2, 0.0], [0.0, 0.2]):
        env = make(model=sprung, speed_range=(80.0, 140.0))
        env.reset(seed=1, options={"speed": 90.0, "radius": np.inf, "offset": 0.0})
        for _ in range(400):
            env.step(np.array(action))
        found.append(env.fleet.state(0)[:2])
    still, turned, pushed = found
    assert turned[0] > still[0] + 1e-5
    assert pushed[0] > still[0] + 1e-5


def test_a_shipped_bogie_with_a_lateral_actuator():
    plant = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    actuator = railenv.Actuator.secondary().replace(limit=10e3)
    side = railenv.LateralActuator(between=("b", "ground"), actuator=actuator, z=0.44)
    env = make(model=railenv.Equipped(plant, actuators=[side]), speed_range=(80.0, 100.0))
    lateral = {}
    for command in (-0.5, 0.5):
        env.reset(seed=1, options={"speed": 80.0, "radius": np.inf, "offset": 0.0})
        roll_to = [env.step(np.array([command])) for _ in range(200)]
        assert not roll_to[-1][2]
        lateral[command] = env.fleet.state(0)[plant.state_names.index("y_b")]
    assert lateral[0.5] > 5e-4
    assert lateral[0.5] == pytest.approx(-lateral[-0.5], rel=1e-6)


def test_both_places_at_once():
    env = make(vehicle=ASSEMBLY, actuator="both", speed_range=SPEEDS)
    assert env.action_space.shape == (3,)
    assert env.fleet.model.limits.tolist() == [5e3, 5e3, 26e3]
    env.reset(seed=0)
    assert np.isfinite(roll(env, 10)).all()


# --------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"model": "coach"}, "model is 'coach'; it must be a railenv.Model"),
        ({"vehicle": "coach"}, "unknown vehicle: 'coach'; allowed are TABLE_1, "),
        ({"vehicle": 3}, "vehicle is 3; it must be a railenv.Vehicle, a railenv.Assembly, the name"),
        ({"vehicle": ASSEMBLY, "contact": railenv.Cone(0.1)}, "contact is given with a model or an"),
        ({"vehicle": ASSEMBLY, "randomize": {"w1_mass": (1.0, 2.0)}}, "unknown name in randomize"),
        ({"vehicle": ASSEMBLY, "randomize": {"conicity": (0.05, 0.9)}}, "conicity of Cone is 0.9"),
    ],
)
def test_what_is_no_vehicle_is_refused(given, message):
    with pytest.raises(ParameterError, match=message):
        make(**given)


def test_a_model_that_does_not_say_its_bodies_is_refused():
    with pytest.raises(ParameterError, match="does not say which of its states are whose motion"):
        make(model=own())


def test_a_model_without_wheelsets_is_refused():
    with pytest.raises(ParameterError, match="wheelset has no wheelsets; say which of its bodies are"):
        make(model=own(yaw_moment="M"))


def test_equipment_is_given_once(sprung):
    for given in ({"actuator_model": railenv.Actuator.primary()}, {"sensors": railenv.Sensors.ideal()}):
        with pytest.raises(ParameterError, match="it has its own"):
            make(model=sprung, **given)


def test_unknown_pins_say_what_may_be_pinned(keywords):
    env = make(**keywords)
    with pytest.raises(UnknownNameError, match=r"'conicty' \(did you mean 'conicity'\?\)"):
        env.reset(seed=0, options={"conicty": 0.1})


def test_a_body_at_rest_has_no_actuator_above_it():
    dual = dataclasses.replace(railenv.DualWheelset(railenv.TABLE_1).assembly, name="dual_wheelset")
    assert settings("bogie", {"vehicle": dual}).equipped.command_names == ("command_w1", "command_w2")
    with pytest.raises(
        ParameterError, match="place is 'secondary'; actuators of a dual_wheelset are at"
    ):
        make(vehicle=dual, actuator="secondary")


# -------------------------------------------------------------------------------- pictures


def test_frames_of_any_vehicle_are_drawn(keywords):
    pytest.importorskip("pygame")
    env = gym.make(NAME, render_mode="rgb_array", **keywords)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    assert env.render().shape == (600, 960, 3)
    env.close()
