"""What RL libraries rely on, beyond Gymnasium's own checks."""

import math
import pickle
import subprocess
import sys
import types

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import RecordVideo, TimeAwareObservation, TimeLimit
from gymnasium.wrappers.vector import DictInfoToList, RecordEpisodeStatistics

from railenv.envs import DERAILED, BogieEnv, BogieVectorEnv, infos
from railenv.envs.metrics import METRICS
from railenv.envs.showing import steps_a_frame
from railenv.errors import ParameterError, UnknownKeywordError, UnknownNameError
from tests.railenv.envs.runs import BOGIE, both, make

SHORT = {"duration": 0.05}
every_id = pytest.mark.parametrize("name", ["Bogie", "DualWheelset", "Coach"])
modes = pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.value)


def zeros(env):
    return np.zeros(env.action_space.shape, np.float32)


# ---------------------------------------------------------------- unknown keywords


@pytest.mark.parametrize(
    "creator",
    [
        lambda **keywords: gym.make(BOGIE, **keywords),
        lambda **keywords: gym.make_vec(BOGIE, num_envs=2, **keywords),
        lambda **keywords: gym.make_vec(BOGIE, num_envs=2, vectorization_mode="sync", **keywords),
        BogieEnv,
        BogieVectorEnv,
    ],
    ids=["make", "make_vec", "sync", "class", "vector class"],
)
def test_unknown_keywords_are_those_of_python_and_of_the_package(creator):
    with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'") as caught:
        creator(frameskip=1)
    assert isinstance(caught.value, UnknownNameError)
    assert isinstance(caught.value, UnknownKeywordError)
    copy = pickle.loads(pickle.dumps(caught.value))
    assert type(copy) is UnknownKeywordError
    assert str(copy) == str(caught.value)
    with pytest.raises(UnknownKeywordError) as caught:
        creator(frameskip=1, duratoin=2.0)
    for said in ("argument 'frameskip'", "argument 'duratoin' (did you mean 'duration'?)"):
        assert f"unexpected keyword {said}" in str(caught.value)


def test_a_library_that_tries_keywords_goes_on_without_them():
    keywords, env, dropped = {"frameskip": 1, "mode": 0, **SHORT}, None, []
    while env is None:
        try:
            env = gym.make(BOGIE, **keywords)
        except TypeError as error:  # as TorchRL does with the keywords that it adds
            said = str(error)
            name = next(n for n in keywords if f"unexpected keyword argument {n!r}" in said)
            dropped.append(name)
            del keywords[name]
    assert dropped == ["frameskip", "mode"]
    assert env.unwrapped.settings.duration == SHORT["duration"]


# ---------------------------------------------------------------- infos


@every_id
def test_infos_have_the_same_names_and_types_from_reset_to_end(name):
    env = make(f"railenv/{name}-v1", **SHORT)
    _, first = env.reset(seed=0)
    kinds = {key: type(value) for key, value in first.items()}
    assert set(kinds.values()) == {np.float64, np.int64}  # TorchRL reads their dtype
    assert {"speed", "curvature", "cant", "friction", "derailed", *METRICS} <= set(kinds)
    for k in range(10):
        *_, truncated, info = env.step(zeros(env))
        assert list(info) == list(first)
        assert {key: type(value) for key, value in info.items()} == kinds
        assert np.isfinite(list(info.values())).all()
        assert info["speed"] == first["speed"]
        assert (info["distance"] > 0.0) == truncated == (k == 9)
    assert info["distance"] == pytest.approx(0.05 * info["speed"], rel=1e-12)
    assert first["distance"] == first["hunting"] == first["derailed"] == 0


@every_id
@modes
def test_infos_of_batches_have_them_too(name, mode):
    vector = gym.make_vec(f"railenv/{name}-v1", num_envs=3, autoreset_mode=mode, **SHORT)
    single = set(make(f"railenv/{name}-v1").reset(seed=0)[1])
    _, first = vector.reset(seed=0)
    assert set(first) == single | {f"_{key}" for key in single}
    kinds = {key: value.dtype for key, value in first.items()}
    done = np.zeros(3, dtype=bool)
    for _ in range(12):
        if done.any() and mode is AutoresetMode.DISABLED:
            vector.reset(options={"reset_mask": done})
        *_, terminated, truncated, found = vector.step(zeros(vector))
        done = terminated | truncated
        final = found.pop("final_info", None)
        for key in ("final_obs", "_final_obs", "_final_info"):
            found.pop(key, None)
        for info in (found, final or found):
            assert {key: value.dtype for key, value in info.items()} == kinds
        assert all(found[f"_{key}"].all() for key in single)
        ends = found if final is None else final
        np.testing.assert_array_equal(ends["distance"] > 0.0, done)
        assert (found["speed"] > 0.0).all()


def test_infos_of_batches_are_not_overwritten_later():
    vector = gym.make_vec(BOGIE, num_envs=2, **SHORT)
    _, first = vector.reset(seed=0)
    kept = {key: value.copy() for key, value in first.items()}
    _, *_, second = vector.step(np.ones((2, 1)))
    later = {key: value.copy() for key, value in second.items()}
    vector.reset(seed=7)
    for info, copies in ((first, kept), (second, later)):
        for key, value in info.items():
            np.testing.assert_array_equal(value, copies[key])


def test_the_number_of_a_derailment_stands_for_its_reason():
    assert DERAILED[0] == ""
    assert all(DERAILED[1:])
    vector = gym.make_vec(BOGIE, num_envs=3)
    vector.reset(seed=0)
    state = vector.fleet.state(1)
    state[0] = 0.05
    vector.fleet.set_state(1, state)
    *_, terminated, _, found = vector.step(zeros(vector))
    np.testing.assert_array_equal(terminated, [False, True, False])
    np.testing.assert_array_equal(found["derailed"] > 0, terminated)
    assert DERAILED[found["derailed"][1]] == "lateral displacement above 30 mm"
    *_, found = vector.step(zeros(vector))
    assert not found["derailed"].any()


def test_numbers_of_a_model_do_not_take_the_place_of_others():
    infos.check_names(types.SimpleNamespace(variable=("friction", "stiffness")))
    for taken in ("cant", "hunting", "distance", "derailed"):
        with pytest.raises(ParameterError, match=f"randomize has {taken}, which an info has"):
            infos.check_names(types.SimpleNamespace(variable=("friction", taken)))


# ---------------------------------------------------------------- limits of time


def last_info(env, **keywords):
    env.reset(seed=4, **keywords)
    for k in range(1, 2001):
        *_, terminated, truncated, info = env.step(zeros(env))
        if terminated or truncated:
            return k, info
    raise AssertionError("the episode does not end")


@both
def test_the_last_info_within_a_time_limit_has_the_metrics(name):
    vector = gym.make_vec(name, num_envs=1, max_episode_steps=50)
    vector.reset(seed=4)
    for _ in range(50):
        *_, found = vector.step(zeros(vector))
    makers = {
        "make": gym.make(name, max_episode_steps=50),
        "wrapped by hand": TimeLimit(BogieEnv() if name == BOGIE else make(name), 50),
        "two limits": TimeLimit(gym.make(name, max_episode_steps=50), 1000),
        "wrappers around": TimeAwareObservation(gym.make(name, max_episode_steps=50)),
        "spec": gym.make(gym.make(name, max_episode_steps=50).spec),
    }
    for how, env in makers.items():
        steps, info = last_info(env)
        assert steps == 50, how
        for key, value in info.items():
            assert value == found[key][0], (how, key)
        assert info["distance"] > 0.0, how
        assert last_info(env)[0] == 50, how


def test_an_environment_reset_by_itself_has_no_limit_but_its_own():
    env = gym.make(BOGIE, max_episode_steps=5, duration=0.1)
    assert last_info(env)[0] == 5
    assert last_info(env.unwrapped)[0] == 20
    other = make(BOGIE, duration=0.1)

    class Resetting(gym.Wrapper):
        def reset(self, **keywords):
            other.reset(seed=0)
            return super().reset(**keywords)

    TimeLimit(Resetting(gym.make(BOGIE)), 5).reset(seed=0)  # of another environment
    assert other._steps == 20


# ---------------------------------------------------------------- seeds


@modes
def test_seeds_are_those_of_gymnasium(mode):
    ours = gym.make_vec(BOGIE, num_envs=3, autoreset_mode=mode, **SHORT)
    theirs = SyncVectorEnv([lambda: gym.make(BOGIE, **SHORT)] * 3, autoreset_mode=mode)
    for seed in (5, None, [7, None, 9]):
        for vector in (ours, theirs):
            vector.reset(seed=seed)
        assert ours.np_random_seed == theirs.np_random_seed
    assert ours.np_random_seed == (7, 6, 9)
    mask = np.array([False, True, False])
    for vector in (ours, theirs):
        vector.reset(seed=20, options={"reset_mask": mask})
    assert ours.np_random_seed == theirs.np_random_seed == (7, 21, 9)
    for a, b in zip(ours.np_random, theirs.np_random, strict=True):
        assert a.bit_generator.state == b.bit_generator.state


def test_seeds_that_were_asked_for_before_the_reset_are_used():
    vector = gym.make_vec(BOGIE, num_envs=2)
    seeds = vector.np_random_seed
    first, _ = vector.reset()
    assert vector.np_random_seed == seeds
    np.testing.assert_array_equal(vector.reset(seed=list(seeds))[0], first)


def test_seeds_are_part_of_the_state():
    vector, other = (gym.make_vec(BOGIE, num_envs=2) for _ in range(2))
    vector.reset(seed=5)
    other.set_state(vector.get_state())
    assert other.np_random_seed == (5, 6)
    env, twin = make(BOGIE), make(BOGIE)
    env.reset(seed=5)
    twin.set_state(env.get_state())
    assert twin.np_random_seed == 5


# ---------------------------------------------------------------- wrappers and libraries


def test_time_can_be_observed():
    env = TimeAwareObservation(gym.make(BOGIE, **SHORT), normalize_time=True)
    observation, _ = env.reset(seed=0)
    times = [observation[-1]]
    for _ in range(10):
        observation, *_ = env.step(zeros(env))
        times.append(observation[-1])
    np.testing.assert_allclose(times, np.linspace(0.0, 1.0, 11), rtol=1e-6)


@modes
def test_statistics_and_lists_of_infos(mode):
    ours = RecordEpisodeStatistics(gym.make_vec(BOGIE, num_envs=2, autoreset_mode=mode, **SHORT))
    lists = DictInfoToList(gym.make_vec(BOGIE, num_envs=2, autoreset_mode=mode, **SHORT))
    ours.reset(seed=0)
    _, first = lists.reset(seed=0)
    assert [set(info) for info in first] == [set(make(BOGIE).reset(seed=0)[1])] * 2
    for _ in range(10):
        *_, found = ours.step(zeros(ours))
        lists.step(zeros(lists))
    ends = found["final_info"] if mode is AutoresetMode.SAME_STEP else found
    assert found["episode"]["l"].tolist() == [10, 10]
    assert (ends["distance"] > 0.0).all()


def test_libraries_that_look_at_the_bases_see_gymnasium():
    for env in (BogieEnv(), gym.make_vec(BOGIE, num_envs=2)):
        kinds = [f"{base.__module__}." for base in type(env).__bases__]
        assert any(kind.startswith("gymnasium.") for kind in kinds)


def test_batches_are_called_as_those_of_gymnasium():
    vector = gym.make_vec(BOGIE, num_envs=2, vectorization_mode="vector_entry_point")
    vector.reset(seed=5)
    vector.step(zeros(vector))
    assert [m["distance"] > 0.0 for m in vector.call("episode_metrics")] == [True, True]
    assert vector.get_attr("np_random_seed") == (5, 6)
    assert vector.get_attr("observation_space") == (vector.single_observation_space,) * 2
    assert vector.get_attr("settings") == (vector.settings,) * 2
    with pytest.warns(UserWarning, match="render mode"):
        assert vector.call("render") == (None, None)
    for name in ("step", "gallop"):
        with pytest.raises(AttributeError, match=name):
            vector.call(name)


_IN_A_CHILD = """
import functools, gymnasium
if __name__ == "__main__":
    import railenv
    make = functools.partial(gymnasium.make, "railenv:railenv/Bogie-v1")
    env = gymnasium.vector.AsyncVectorEnv([make], context="spawn")
    print(env.reset(seed=3)[1]["speed"][0])
    env.close()
"""


def test_environments_are_made_by_name_in_processes_that_are_spawned(tmp_path):
    script = tmp_path / "spawns.py"
    script.write_text(_IN_A_CHILD, encoding="utf-8")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == make(BOGIE).reset(seed=3)[1]["speed"]


# ---------------------------------------------------------------- films


@pytest.mark.parametrize(
    "creator", [BogieEnv, lambda **keywords: gym.make_vec(BOGIE, num_envs=2, **keywords)]
)
def test_pictures_need_a_reset(creator):
    pytest.importorskip("pygame")
    env = creator(render_mode="rgb_array")
    with pytest.raises(gym.error.ResetNeeded, match=r"reset\(\) before render"):
        env.render()
    env.reset(seed=0)
    env.render()
    listing = gym.make_vec(BOGIE, num_envs=2, render_mode="rgb_array_list")
    with pytest.raises(gym.error.ResetNeeded, match=r"reset\(\) before render"):
        listing.render()


def filmed(monkeypatch, tmp_path, wrapper, env):
    """Frames a second and number of frames of the films that a wrapper writes of an episode."""
    films = []

    class Clip:
        def __init__(self, frames, fps):
            films.append((fps, len(frames)))

        def write_videofile(self, path, logger=None):
            pass

    module = types.ModuleType("moviepy.video.io.ImageSequenceClip")
    module.ImageSequenceClip = Clip
    for name in ("moviepy", "moviepy.video", "moviepy.video.io"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    env = wrapper(env, str(tmp_path / "films"), episode_trigger=lambda _: True)
    env.reset(seed=0, options={"speed": 70.0})
    done = False
    while not done:
        *_, terminated, truncated, _ = env.step(zeros(env))
        done = bool(np.all(terminated | truncated))
    env.close()
    return films


@pytest.mark.filterwarnings("ignore:.*Overwriting existing videos")
@pytest.mark.parametrize("period", [0.005, 0.003, 0.04])
@pytest.mark.parametrize("wrapper", [RecordVideo, gym.wrappers.vector.RecordVideo])
def test_films_run_at_true_speed(monkeypatch, tmp_path, wrapper, period):
    pytest.importorskip("pygame")
    keywords = {"render_mode": "rgb_array", "control_period": period, "duration": 0.12}
    single = wrapper is RecordVideo
    env = gym.make(BOGIE, **keywords) if single else gym.make_vec(BOGIE, num_envs=2, **keywords)
    ((rate, frames),) = filmed(monkeypatch, tmp_path, wrapper, env)
    assert (frames - 1) / rate == pytest.approx(0.12, rel=1e-9)


@pytest.mark.parametrize(
    ("period", "steps"), [(0.005, 4), (0.0001, 200), (0.003, 7), (0.02, 1), (0.5, 1), (1.0, 1)]
)
def test_windows_show_the_motion_at_true_speed(monkeypatch, period, steps):
    pytest.importorskip("pygame")
    assert steps_a_frame(period) == steps
    assert 1.0 / (period * steps) <= 60.0
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = make(BOGIE, render_mode="human", control_period=period, duration=(3 * steps + 1) * period)
    shown = []
    monkeypatch.setattr(env, "render", lambda: shown.append(int(env.fleet.steps[0])))
    env.reset(seed=0, options={"speed": 20.0, "radius": math.inf, "offset": 0.0})
    done = False
    while not done:
        *_, terminated, truncated, _ = env.step(zeros(env))
        done = terminated or truncated
    assert shown == sorted({0, steps, 2 * steps, 3 * steps, 3 * steps + 1})
    env._recorder.draw()
    assert env._recorder._renderer.fps == pytest.approx(1.0 / (period * steps))
    env.close()


@modes
def test_lists_of_pictures_are_those_of_gymnasium(mode):
    pytest.importorskip("pygame")
    keywords = {"render_mode": "rgb_array_list", "duration": 0.02}
    ours = gym.make_vec(BOGIE, num_envs=2, autoreset_mode=mode, **keywords)
    theirs = SyncVectorEnv([lambda: gym.make(BOGIE, **keywords)] * 2, autoreset_mode=mode)
    counts = []
    for vector in (ours, theirs):
        vector.reset(seed=0)
    for asked in (2, 0, 1, 3):
        for _ in range(asked):
            (*_, done, _), _ = ours.step(zeros(ours)), theirs.step(zeros(theirs))
            if mode is AutoresetMode.DISABLED and done.any():
                for vector in (ours, theirs):
                    vector.reset(options={"reset_mask": done.copy()})
        found, expected = ours.render(), theirs.render()
        counts.append([len(pictures) for pictures in found])
        assert counts[-1] == [len(pictures) for pictures in expected]
        for a, b in zip(found, expected, strict=True):
            np.testing.assert_array_equal(a, b)
    assert counts[0] == [3, 3]
