"""Environments made again from their specs: keywords as names and as mappings, through JSON."""

import json

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

import railenv
from railenv.envs import RewardWeights
from railenv.envs.given import plain, vehicle
from railenv.envs.settings import settings
from railenv.errors import ParameterError, UnknownNameError
from railenv.irregularity import Line
from tests.railenv.envs.runs import BOGIE

ASSEMBLY = railenv.Bogie(railenv.HIGH_SPEED_COACH).assembly
POINTS = railenv.Profile.named("S1002").points
OWN_PROFILE = railenv.Profile.of(POINTS[::2], kind="wheel", name="MEASURED")
PAIR = railenv.ProfilePair(wheel=OWN_PROFILE, rail="UIC60", step=4e-5)
LINE = Line(np.zeros(200), np.linspace(0.0, 1e-3, 200), np.zeros(200), 0.25, repeats=False)

CASES = {
    "defaults": {},
    "a name": {"vehicle": "HIGH_SPEED_COACH_S1002"},
    "a shipped vehicle": {"vehicle": railenv.HIGH_SPEED_COACH_S1002},
    "a vehicle": {"vehicle": railenv.HIGH_SPEED_COACH.replace(friction=0.31)},
    "a hollow tread": {"contact": railenv.HIGH_SPEED_COACH_HOLLOW.contact.replace(conicity=0.17)},
    "arcs": {"contact": railenv.ArcProfile(0.0335, 0.4, 0.3)},
    "profiles of a vehicle": {"vehicle": railenv.HIGH_SPEED_COACH.replace(contact=PAIR)},
    "profiles that wear": {
        "contact": railenv.ProfileFamily(new=railenv.ProfilePair(), worn=PAIR, wear=0.4),
        "randomize": {"wear": (0.0, np.float64(1.0))},
    },
    "an assembly": {"vehicle": ASSEMBLY, "actuator": "secondary", "speed_range": (90.0, 120.0)},
    "records": {
        "weights": RewardWeights(ride=0.5),
        "sensors": railenv.Sensors.ideal(),
        "actuator_model": railenv.Actuator.secondary().replace(delay=0.02),
        "speed_range": np.array([70.0, 90.0]),
        "history": 2,
    },
    "a line": {"irregularity": LINE, "irregularity_factor": (0.5, 1.5)},
}
"""Keywords of environments, of every type that is not plain."""


def alike(one, other):
    """Whether two settings say the same; lines compare by their values."""
    return plain(one) == plain(other)


@pytest.mark.parametrize("keywords", CASES.values(), ids=CASES)
def test_environments_are_made_again_from_json(keywords):
    env = gym.make(BOGIE, **keywords)
    text = env.spec.to_json()
    spec = EnvSpec.from_json(text)
    assert spec == env.spec
    assert spec.to_json() == text
    again = gym.make(spec)
    assert again.spec == env.spec
    assert alike(again.unwrapped.settings, env.unwrapped.settings)
    np.testing.assert_array_equal(again.reset(seed=1)[0], env.reset(seed=1)[0])
    assert alike(gym.make(env.spec).unwrapped.settings, env.unwrapped.settings)


@pytest.mark.parametrize("keywords", CASES.values(), ids=CASES)
def test_batches_are_made_again_from_json(keywords):
    own = {"max_episode_steps": 40, "autoreset_mode": gym.vector.AutoresetMode.SAME_STEP}
    vector = gym.make_vec(BOGIE, num_envs=2, **own, **keywords)
    spec = EnvSpec.from_json(vector.spec.to_json())
    assert spec == vector.spec
    again = gym.make_vec(spec)
    assert again.spec == vector.spec
    assert (again.num_envs, again.autoreset_mode) == (2, own["autoreset_mode"])
    assert alike(again.settings, vector.settings)
    assert again._steps == 40
    np.testing.assert_array_equal(again.reset(seed=1)[0], vector.reset(seed=1)[0])


@pytest.mark.parametrize("name", ["Bogie", "DualWheelset", "Coach"])
def test_every_id_is_made_again_from_json(name):
    env = gym.make(f"railenv/{name}-v1", observation="sensors", tangent_share=0.5)
    spec = EnvSpec.from_json(env.spec.to_json())
    assert spec == env.spec
    assert gym.make(spec).unwrapped.settings == env.unwrapped.settings
    vector = gym.make_vec(f"railenv/{name}-v1", num_envs=3, vehicle=railenv.HIGH_SPEED_COACH)
    spec = EnvSpec.from_json(vector.spec.to_json())
    assert gym.make_vec(spec).settings == vector.settings


def test_specs_tell_the_steps_of_an_episode():
    assert gym.make(BOGIE).spec.max_episode_steps == 2000
    assert gym.make(BOGIE, duration=0.3, control_period=0.1).spec.max_episode_steps == 3
    assert gym.make(BOGIE, max_episode_steps=50).spec.max_episode_steps == 50
    assert gym.make_vec(BOGIE, num_envs=2).spec.max_episode_steps == 2000
    assert gym.make_vec(BOGIE, num_envs=2, max_episode_steps=50).spec.max_episode_steps == 50
    assert gym.spec(BOGIE).max_episode_steps is None  # it would cut longer durations
    assert BOGIE in repr(gym.make_vec(BOGIE, num_envs=2))


def test_models_of_ones_own_have_no_json():
    env = gym.make(BOGIE, model=railenv.Bogie(railenv.HIGH_SPEED_COACH))
    assert isinstance(env.spec.kwargs["model"], railenv.Bogie)
    assert gym.make(env.spec).unwrapped.settings.model.vehicle == railenv.HIGH_SPEED_COACH
    with pytest.raises(TypeError, match="JSON"):
        env.spec.to_json()


# ---------------------------------------------------------------- names and mappings


def setting(name, value):
    return getattr(settings("bogie", {name: value}), name)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("weights", {"ride": 0.5}, RewardWeights(ride=0.5)),
        ("sensors", "ideal", railenv.Sensors.ideal()),
        ("sensors", {"gyro_noise": 0.0}, railenv.Sensors.standard().replace(gyro_noise=0.0)),
        (
            "sensors",
            {"base": "ideal", "gyro_noise": 0.1},
            railenv.Sensors.ideal().replace(gyro_noise=0.1),
        ),
        ("actuator_model", "lateral", railenv.Actuator.lateral()),
        (
            "actuator_model",
            {"base": "primary", "delay": 0.0},
            railenv.Actuator.primary().replace(delay=0.0),
        ),
        ("contact", {"law": "cone", "conicity": 0.2}, railenv.Cone(0.2)),
        ("contact", "profiles", railenv.ProfilePair()),
        (
            "vehicle",
            {"base": "HIGH_SPEED_COACH", "friction": 0.4},
            railenv.HIGH_SPEED_COACH.replace(friction=0.4),
        ),
        (
            "vehicle",
            {"base": "HIGH_SPEED_COACH_HOLLOW", "conicity": 0.2},
            railenv.HIGH_SPEED_COACH_HOLLOW.replace(contact=railenv.Cone(0.2)),
        ),
        ("randomize", {"friction": [0.1, 0.2]}, {"friction": (0.1, 0.2)}),
    ],
)
def test_names_and_mappings_stand_for_records(name, value, expected):
    assert setting(name, value) == expected
    assert setting(name, json.loads(json.dumps(value))) == expected


def test_a_mapping_of_a_vehicle_is_what_a_file_holds(tmp_path):
    for given in (railenv.CRH380A.replace(name="mine"), CASES["profiles of a vehicle"]["vehicle"]):
        fields = json.loads(json.dumps(plain(given)))
        assert vehicle(fields) == given
        given.to_toml(tmp_path / "vehicle.toml")
        assert railenv.Vehicle.from_toml(tmp_path / "vehicle.toml") == vehicle(fields)
    assert plain(railenv.CRH380A) == "CRH380A"
    assert plain(railenv.CRH380A.replace(friction=0.1)) != "CRH380A"


@pytest.mark.parametrize(
    ("name", "value", "kind", "message"),
    [
        ("vehicle", 3, ParameterError, "vehicle is 3; it must be a railenv.Vehicle"),
        ("vehicle", "HIGH_SPEED", UnknownNameError, "did you mean 'HIGH_SPEED_COACH'"),
        ("vehicle", {"friction": 0.4}, ParameterError, "vehicle lacks name, .*or a base"),
        ("vehicle", {"base": "COACH"}, UnknownNameError, "unknown base of vehicle: 'COACH'"),
        ("vehicle", {"base": "TABLE_1", "frictoin": 0.4}, UnknownNameError, "mean 'friction'"),
        ("vehicle", {"base": ["TABLE_1"]}, UnknownNameError, "unknown base of vehicle"),
        ("sensors", "good", UnknownNameError, "unknown sensors: 'good'; allowed are standard, ideal"),
        ("sensors", 3, ParameterError, "must be a railenv.Sensors, its name"),
        ("sensors", {"noise": 1.0}, UnknownNameError, "unknown field of sensors: 'noise'"),
        ("sensors", {"gyro_noise": -1.0}, ParameterError, "gyro_noise"),
        ("actuator_model", {"delay": 0.0}, ParameterError, "actuator_model lacks limit, .*a base"),
        ("weights", [1.0], ParameterError, "must be a RewardWeights or a mapping"),
        ("weights", "heavy", ParameterError, "must be a RewardWeights or a mapping"),
        ("weights", {"base": 1.0}, UnknownNameError, "unknown field of weights: 'base'"),
        ("contact", "cone", ParameterError, "contact law 'cone' lacks conicity"),
        ("contact", "disc", UnknownNameError, "unknown contact law: 'disc'"),
        ("irregularity", {"align": [0.0]}, ParameterError, "irregularity lacks vert, cross, spacing"),
    ],
)
def test_names_and_mappings_that_stand_for_nothing_raise(name, value, kind, message):
    with pytest.raises(kind, match=message):
        setting(name, value)
