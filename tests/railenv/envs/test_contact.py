"""Environments on every kind of contact: what vehicles they take, draw and tell, and what derails."""

import json
import math

import gymnasium as gym
import numpy as np
import pytest

import railenv
from railenv.envs import DERAILED
from railenv.envs.derailment import nadal
from railenv.envs.episodes import draw
from railenv.envs.settings import settings
from railenv.errors import ParameterError, UnknownNameError
from tests.railenv.envs.runs import BOGIE, DUAL, both, make

PROFILES = railenv.HIGH_SPEED_COACH_S1002
FAMILY = PROFILES.replace(
    contact=railenv.ProfileFamily(
        PROFILES.contact, railenv.HIGH_SPEED_COACH_S1002_WORN.contact, wear=0.0
    )
)
LAWS = {
    "hollow": {"randomize": {"conicity": (0.05, 0.4), "contact_angle": (0.02, 0.04)}},
    "linear": {
        "contact": railenv.LinearProfile(0.1, 0.03, 5.0),
        "randomize": {"contact_angle_rate": (0.0, 10.0)},
    },
    "arcs": {
        "contact": railenv.ArcProfile(0.03, 0.6, 0.3),
        "randomize": {"wheel_profile_radius": (0.5, 0.9)},
    },
    "profiles": {"vehicle": "HIGH_SPEED_COACH_S1002", "randomize": {"friction": (0.2, 0.4)}},
    "family": {"vehicle": FAMILY, "randomize": {"wear": (0.0, 1.0), "creep_factor": (0.6, 1.0)}},
}


# ------------------------------------------------------------------------------ identity


@both
def test_the_first_version_says_what_it_is_followed_by(name):
    before = name.replace("v1", "v0")
    for make_it in (gym.make, gym.make_vec):
        with pytest.raises(ParameterError, match=f"{before} is gone.*; make {name}"):
            make_it(before)


def test_the_default_vehicle_is_on_hollow_treads():
    assert make(BOGIE).settings.vehicle is railenv.HIGH_SPEED_COACH_HOLLOW
    assert make(DUAL).settings.vehicle is railenv.TABLE_1


def test_a_specification_of_names_and_plain_values_goes_through_json():
    keywords = {"vehicle": "HIGH_SPEED_COACH", "contact": {"law": "cone", "conicity": 0.2}}
    spec = gym.make(BOGIE, disable_env_checker=True, **keywords).spec
    again = gym.make(gym.envs.registration.EnvSpec.from_json(spec.to_json())).unwrapped
    assert json.loads(spec.to_json())["kwargs"] == keywords
    assert again.settings.vehicle == railenv.HIGH_SPEED_COACH.replace(conicity=0.2)


def test_contact_is_short_for_a_vehicle_with_it():
    law = railenv.HollowTread(0.2, 0.03, 0.3)
    short = settings("bogie", {"contact": law, "vehicle": railenv.HIGH_SPEED_COACH})
    assert short.vehicle == railenv.HIGH_SPEED_COACH.replace(contact=law)
    with pytest.raises(UnknownNameError, match="contact law"):
        make(BOGIE, contact={"law": "cube"})
    with pytest.raises(ParameterError, match="contact is 3; it must be a contact law"):
        make(BOGIE, contact=3)


# ------------------------------------------------------------------------------- drawing


@pytest.mark.parametrize("law", ["hollow", "profiles", "family"])
def test_rows_of_a_vector_environment_are_single_environments_to_the_bit(law):
    n, steps = 3, 12
    keywords = {"speed_range": (60.0, 80.0), "irregularity": "low", **LAWS[law]}
    envs = gym.make_vec(BOGIE, num_envs=n, vectorization_mode="vector_entry_point", **keywords)
    observations, infos = envs.reset(seed=7)
    rng = np.random.default_rng(2)
    actions = rng.uniform(-1.0, 1.0, (steps, *envs.action_space.shape)).astype(np.float32)
    seen = [(observations.copy(), np.zeros(n))]
    seen += [tuple(np.array(part) for part in envs.step(a)[:2]) for a in actions]
    env = make(BOGIE, **keywords)
    for i in range(n):
        first, info = env.reset(seed=7 + i)
        np.testing.assert_array_equal(first, seen[0][0][i])
        for name in keywords["randomize"]:
            assert info[name] == infos[name][i]
        for k, action in enumerate(actions):
            observation, reward, *_ = env.step(action[i])
            np.testing.assert_array_equal(observation, seen[k + 1][0][i])
            assert reward == seen[k + 1][1][i]


@pytest.mark.parametrize("law", LAWS)
def test_what_is_drawn_varies_is_told_and_reaches_the_equations(law):
    drawn = {name: [] for name in LAWS[law]["randomize"]}
    for seed in range(12):
        episode = draw(settings("bogie", LAWS[law]), np.random.default_rng(seed), {})
        for name, values in drawn.items():
            values.append(episode.conditions()[name])
            if name != "creep_factor":
                assert episode.plant.parameters[name] == values[-1]
    for name, (low, high) in LAWS[law]["randomize"].items():
        assert low <= min(drawn[name]) < max(drawn[name]) <= high
        assert np.ptp(drawn[name]) > 0.4 * (high - low)


def test_draws_of_friction_do_not_depend_on_the_contact():
    ranges = {"friction": (0.2, 0.4)}
    found = []
    for given in ({}, {"vehicle": PROFILES}, {"contact": railenv.Cone(0.1)}):
        made = settings("bogie", {"randomize": ranges, **given})
        found.append(draw(made, np.random.default_rng(3), {}).conditions()["friction"])
    assert found[0] == found[1] == found[2]


def test_a_vehicle_has_the_numbers_of_its_own_contact_only():
    with pytest.raises(
        UnknownNameError,
        match=r"contact is ProfilePair\): 'conicity'; allowed are friction, creep_factor, body_mass$",
    ):
        make(BOGIE, vehicle=PROFILES, randomize={"conicity": (0.1, 0.2)})
    with pytest.raises(UnknownNameError, match=r"contact is ProfileFamily.*allowed are.*wear"):
        make(BOGIE, vehicle=FAMILY).reset(options={"conicity": 0.1})


def test_numbers_of_a_contact_must_go_together_wherever_they_are_drawn():
    ranges = {"conicity": (0.05, 0.4), "contact_angle": (0.02, 0.06)}  # each alone is possible
    with pytest.raises(ParameterError, match=r"conicity of HollowTread is 0\.05 and its contact_angle"):
        make(BOGIE, randomize=ranges)


def test_a_worn_vehicle_hunts_where_a_new_one_runs_calmly():
    env = make(BOGIE, duration=4.0)
    amplitude = {}
    for conicity in (0.05, 0.4):
        pins = {"speed": 80.0, "radius": math.inf, "offset": 0.003, "conicity": conicity}
        env.reset(seed=0, options=pins)
        done = False
        while not done:
            *_, terminated, truncated, info = env.step([0.0])
            done = terminated or truncated
        amplitude[conicity] = info["hunting_amplitude"]
    # 0.4: 70 m/s is critical, and a little beyond it the cycle is a small one
    assert amplitude[0.05] < 1e-4
    assert amplitude[0.4] > 2e-3


# ---------------------------------------------------------------------------- derailment


def test_limit_of_nadal_is_the_formula_of_flange_and_friction():
    assert nadal(math.radians(70.0), 0.36) == pytest.approx(1.2, abs=0.01)
    assert nadal(math.radians(70.0), 0.0) == pytest.approx(math.tan(math.radians(70.0)))
    env = make(BOGIE, vehicle=PROFILES, nadal_limit="contact angle")
    k = env.fleet._kernels
    for friction in (0.2, 0.5):
        env.reset(seed=0, options={"friction": friction, "speed": 70.0})
        limits = env.fleet._view(env.fleet._extras, 0)[k.E_NADAL : k.E_NADAL + k.N_WHEELS]
        assert limits == pytest.approx(nadal(math.radians(70.0), friction), rel=2e-3)


@pytest.mark.parametrize(("limit", "derails"), [(0.1, True), (0.8, False)])
def test_nadal_limit_is_what_the_ratio_is_compared_with(limit, derails):
    """In this cycle Y/Q over 2 m lies between the two."""
    env = make(BOGIE, duration=1.0, nadal_limit=limit)
    env.reset(seed=0, options={"speed": 118.0, "radius": math.inf, "offset": 0.009})
    done = False
    while not done:
        *_, terminated, truncated, info = env.step([0.0])
        done = terminated or truncated
    assert terminated == derails
    assert DERAILED[info["derailed"]] == ("Nadal: Y/Q above its limit over 2 m" if derails else "")


@pytest.mark.parametrize("law", ["hollow", "linear", "arcs"])
def test_a_contact_without_a_flange_has_no_angle_for_nadal(law):
    with pytest.raises(ParameterError, match="has no flange with an angle"):
        make(BOGIE, nadal_limit="contact angle", **LAWS[law])


@pytest.mark.parametrize("limit", ["flange", -0.1, 0.0, math.nan])
def test_impossible_limits_raise(limit):
    with pytest.raises(ParameterError, match="nadal_limit is"):
        make(BOGIE, nadal_limit=limit)


def on_the_flange(env, side, shift, lifted):
    """Set the leading wheelset on the lift of its profile at a shift of one wheel."""
    law, names = env.settings.vehicle.contact, env.fleet.model.state_names
    w1 = env.fleet.model.guided[0]
    state = env.fleet.state(0)
    phi = side * float(law.height(shift) - law.height(-shift)) / (2.0 * w1.half_gauge) * lifted
    state[names.index("phi_w1")] = phi
    state[names.index("z_w1")] = 0.5 * float(law.height(shift) + law.height(-shift)) * lifted
    state[names.index("y_w1")] = side * shift - w1.wheel_radius * phi
    env.fleet.set_state(0, state)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_wheel_beyond_the_top_of_its_flange_has_derailed(side):
    env = make(BOGIE, vehicle=PROFILES, control_period=0.0005, time_step=0.0005)
    shift, lift = PROFILES.contact.flange_top
    assert 0.007 < shift < 0.010
    assert lift == pytest.approx(float(PROFILES.contact.height(shift)))
    ends = {}
    for at, lifted in ((shift + 0.004, 1.0), (shift + 0.004, 0.0), (shift - 0.002, 1.0)):
        env.reset(seed=0, options={"speed": 50.0, "radius": math.inf, "offset": 0.0})
        on_the_flange(env, side, at, lifted)
        ends[at - shift > 0.0, lifted] = DERAILED[env.step([0.0])[4]["derailed"]]
    assert ends == {
        (True, 1.0): "flange climbed onto the rail",
        (True, 0.0): "",  # the rail gives way
        (False, 1.0): "",
    }


def test_cones_have_no_flange_to_climb():
    env = make(BOGIE)
    k = env.fleet._kernels
    env.reset(seed=0)
    tops = env.fleet._view(env.fleet._extras, 0)[k.E_TOP : k.E_PLACE]
    assert (tops >= 1e300).all()


def test_an_episode_on_profiles_derails_far_beyond_the_critical_speed():
    env = make(BOGIE, vehicle=PROFILES, nadal_limit="contact angle", duration=5.0)
    env.reset(seed=0, options={"speed": 60.0, "radius": math.inf, "offset": 0.004})
    ends = []
    for speed in (60.0, 160.0):
        env.reset(seed=0, options={"speed": speed, "radius": math.inf, "offset": 0.004})
        done = False
        while not done:
            *_, terminated, truncated, info = env.step([0.0])
            done = terminated or truncated
        ends.append(info["derailed"])
    assert ends[0] == 0
    assert ends[1] > 0


# ------------------------------------------------------------------------------ pictures


def test_frames_show_the_clearance_of_the_profiles_of_the_episode():
    pytest.importorskip("pygame")
    env = make(BOGIE, vehicle=FAMILY, render_mode="rgb_array", randomize={"wear": (0.0, 1.0)})
    found = []
    for wear in (0.0, 1.0):
        env.reset(seed=0, options={"wear": wear, "speed": 70.0})
        scene = env._recorder.scene()
        law = FAMILY.contact.replace(wear=wear)
        assert scene.flange_clearance == pytest.approx(law.flange_clearance)
        found.append(scene.flange_clearance)
    assert found[0] != found[1]
    assert env.render().shape == (600, 960, 3)
