"""Fuzzed: environments, controllers and their files, recipes of training."""

from __future__ import annotations

import dataclasses
import json
import math
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from hypothesis import strategies as st

import agents
import railenv
from agents.controllers.files import ControllerFile
from agents.controllers.load import controller_of
from agents.learning import recipe as recipes
from benchmarks.reliability import values
from benchmarks.reliability.fuzz import Area
from benchmarks.reliability.values import ANYTHING, number, rarely
from railenv.envs.episodes import RUNNING
from railenv.envs.settings import RANDOMIZABLE, RewardWeights, Settings

_FOLDER = Path(tempfile.mkdtemp(prefix="railenv-fuzz-"))
IDS = ("railenv/Bogie-v1", "railenv/DualWheelset-v1")

# --------------------------------------------------------------------------- environments


def _pairs(low: float, high: float) -> st.SearchStrategy[Any]:
    usual = st.tuples(st.floats(low, high), st.floats(low, high)).map(lambda p: tuple(sorted(p)))
    return rarely(usual, st.one_of(ANYTHING, st.tuples(ANYTHING, ANYTHING)))


_SETTINGS: dict[str, st.SearchStrategy[Any]] = {
    "vehicle": rarely(values.vehicles(), ANYTHING),
    "contact": rarely(
        st.sampled_from([None, railenv.Cone(0.1), railenv.HollowTread(0.2, 0.03, 0.3)]), ANYTHING
    ),
    "nadal_limit": rarely(st.sampled_from([0.8, 1.2, "contact angle"]), ANYTHING),
    "model": rarely(st.one_of(st.none(), values.MODELS), ANYTHING),
    "actuator": rarely(st.sampled_from(["secondary", "primary", "none"]), ANYTHING),
    "observation": rarely(st.sampled_from(["state", "sensors"]), ANYTHING),
    "context": rarely(st.booleans(), ANYTHING),
    "actuator_failure": rarely(st.sampled_from([0.0, 0.5, 1.0]), ANYTHING),
    "history": rarely(st.integers(0, 3), ANYTHING),
    "speed_range": _pairs(5.0, 150.0),
    "cant_range": _pairs(0.0, 0.15),
    "max_cant_deficiency": number(0.05, 0.3),
    "min_radius": number(200.0, 1000.0),
    "tangent_share": number(0.0, 1.0),
    "track": rarely(st.sampled_from(["constant", "curve"]), ANYTHING),
    "irregularity": rarely(st.sampled_from([None, "low", "high"]), ANYTHING),
    "irregularity_factor": _pairs(0.0, 3.0),
    "randomize": rarely(
        st.dictionaries(
            st.sampled_from(["conicity", "friction", "creep_factor", "body_mass", "mass"]),
            _pairs(0.05, 0.5),
            max_size=2,
        ),
        ANYTHING,
    ),
    "initial_offset": number(0.0, 0.02),
    "duration": number(0.01, 1.0),
    "control_period": number(0.002, 0.02),
    "time_step": number(2e-4, 2e-3),
    "critical_speed": number(50.0, 150.0),
    "weights": rarely(st.just(RewardWeights()), ANYTHING),
    "actuator_model": rarely(st.builds(railenv.Actuator.secondary), ANYTHING),
    "sensors": rarely(st.builds(railenv.Sensors.ideal), ANYTHING),
    "render_mode": st.sampled_from([None, "rgb_aray"]),
    "speed": ANYTHING,
}
_OPTIONS: dict[str, st.SearchStrategy[Any]] = {
    "speed": number(10.0, 150.0),
    "radius": rarely(values.RADII, ANYTHING),
    "curvature": number(-0.01, 0.01),
    "cant": rarely(values.CANTS, ANYTHING),
    "conicity": number(0.02, 0.4),
    "friction": number(0.1, 0.6),
    "creep_factor": number(0.3, 1.2),
    "body_mass": number(2e4, 5e4),
    "irregularity_factor": number(0.0, 3.0),
    "offset": number(-0.02, 0.02),
    "failed_actuator": rarely(st.integers(0, 2), ANYTHING),
    "failure_time": number(0.0, 2.0),
    "mass": ANYTHING,
}
assert set(_OPTIONS) == {*RUNNING, *RANDOMIZABLE, "mass"}
assert set(_SETTINGS) >= {f.name for f in dataclasses.fields(Settings)} - {"plant"}


@st.composite
def _some(draw: Any, all_of: dict[str, st.SearchStrategy[Any]], most: int) -> dict[str, Any]:
    """Draw a few entries of a table of strategies."""
    names = draw(st.lists(st.sampled_from(sorted(all_of)), unique=True, max_size=most))
    return {name: draw(all_of[name]) for name in names}


def _sane(space: Any, observation: Any, rewards: Any) -> None:
    assert observation in space, f"observation {observation} is not in its space"
    assert np.isfinite(rewards).all(), f"reward {rewards}"


def _new_environment(example: tuple[str, dict[str, Any]]) -> None:
    name, keywords = example
    env = gymnasium.make(name, disable_env_checker=True, **keywords).unwrapped
    observation, _ = env.reset(seed=1)
    _sane(env.observation_space, observation, 0.0)
    for _ in range(3):
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        _sane(env.observation_space, observation, reward)
        if terminated or truncated:
            break


@cache
def _environment(name: str, n: int) -> Any:
    if n:
        return gymnasium.make_vec(name, num_envs=n, irregularity="low")
    return gymnasium.make(name, disable_env_checker=True, irregularity="low").unwrapped


def _resets_and_steps(example: tuple[str, dict[str, Any], list[Any]]) -> None:
    name, options, actions = example
    env = _environment(name, 0)
    observation, info = env.reset(seed=3, options=options)
    _sane(env.observation_space, observation, 0.0)
    assert all(name in info for name in options if name != "radius")
    for action in actions:
        observation, reward, terminated, truncated, _ = env.step(action)
        _sane(env.observation_space, observation, reward)
        if terminated or truncated:
            break


_ACTION = st.one_of(
    st.lists(number(-1.0, 1.0), max_size=3),
    ANYTHING,
    st.floats(-1.0, 1.0).map(lambda a: np.array([a], dtype=np.float32)),
    st.floats(-1e30, 1e30).map(lambda a: np.array([a])),
)


def _vectors(example: dict[str, Any]) -> None:
    env = _environment(example["id"], 3)
    observation, _ = env.reset(seed=example.get("seed", 1), options=example.get("options"))
    assert observation in env.observation_space
    for action in example["actions"]:
        observation, rewards, *_ = env.step(action)
        _sane(env.observation_space, observation, rewards)


def _new_vector(example: dict[str, Any]) -> None:
    env = gymnasium.make_vec("railenv/Bogie-v1", vectorization_mode="vector_entry_point", **example)
    observation, _ = env.reset(seed=1)
    assert observation in env.observation_space


_VECTORS = st.fixed_dictionaries(
    {
        "id": st.sampled_from(IDS[:1]),
        "actions": st.lists(
            st.one_of(
                st.just(np.zeros((3, 1))),
                st.just(np.full((3, 1), np.nan)),
                st.just(np.full((3, 1), 1e300)),
                st.lists(_ACTION, min_size=3, max_size=3),
                ANYTHING,
            ),
            max_size=3,
        ),
    },
    optional={
        "seed": rarely(st.integers(0, 2**32), st.one_of(ANYTHING, st.lists(ANYTHING, max_size=3))),
        "options": rarely(
            _some(
                {
                    **_OPTIONS,
                    "reset_mask": st.one_of(st.just(np.array([True, False, True])), ANYTHING),
                    "speed": st.one_of(number(20.0, 120.0), st.lists(number(20.0, 120.0), max_size=3)),
                },
                2,
            ),
            ANYTHING,
        ),
    },
)

# ---------------------------------------------------------------------------- controllers


@cache
def _learned() -> agents.LearnedPolicy:
    """Return a small policy on top of a shipped controller."""
    from agents.controllers.memory import Memory, MemorySettings
    from agents.controllers.network import Network, Normalization

    base: Any = agents.shipped("yaw-rate")
    memory = MemorySettings(history=1, corners=(1.0,), past_commands=1)
    n = 2 * len(base.readings) + len(
        Memory(memory, base.readings, base.commands, base.period, base).names
    )
    rng = np.random.default_rng(0)
    network = Network(
        (rng.normal(size=(4, n)), rng.normal(size=(1, 4))),
        (np.zeros(4), np.zeros(1)),
        "tanh",
        "none",
        Normalization(np.zeros(n), np.ones(n), 10.0),
    )
    return agents.LearnedPolicy(
        network, base.readings, base.commands, base.limit, "sensors", memory, base, 0.3
    )


@cache
def controller_files() -> dict[str, ControllerFile]:
    """Return the content of a file of every kind."""
    names = ("yaw-rate", "lqg-scheduled", "output-feedback", "lqr")
    made: list[Any] = [agents.shipped(name) for name in names]
    return {type(c).__name__: c.to_file() for c in [*made, _learned()]}


_ARRAYS = st.one_of(
    st.sampled_from(
        [
            np.zeros(0),
            np.zeros((1, 1, 1)),
            np.array(1.0),
            np.array("text"),
            np.array([np.nan]),
            np.zeros((1, 3), dtype=complex),
            np.zeros((2, 2), dtype="M8[s]"),
            np.zeros(3, dtype=[("a", float)]),
            np.array([True]),
            np.zeros((1, 2, 3), dtype=np.int8),
        ]
    ),
    st.sampled_from(["drop", "nan", "inf", "transpose", "flatten", "text", "complex", "double"]),
)
_JSON = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(allow_nan=False, allow_infinity=False),
        st.text(max_size=5),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=3), inner, max_size=2)
    ),
    max_leaves=5,
)


@st.composite
def _controllers(draw: Any) -> ControllerFile:
    """Draw the content of a controller's file with something changed in it."""
    content = controller_files()[draw(st.sampled_from(sorted(controller_files())))]
    header = json.loads(json.dumps(content.header))
    arrays: dict[str, Any] = dict(content.arrays)
    for _ in range(draw(st.integers(1, 2))):
        if draw(st.booleans()):
            _replace_entry(draw, header)
        elif arrays:
            name = draw(st.sampled_from(sorted(arrays)))
            _replace_array(arrays, name, draw(_ARRAYS))
    kind = draw(rarely(st.just(content.kind), st.sampled_from([*controller_files(), "Passive", "?"])))
    return ControllerFile(kind, header, arrays)


def _replace_entry(draw: Any, tree: Any) -> None:
    """Replace something in plain data by something else, or remove it."""
    while True:
        places = list(tree) if isinstance(tree, dict) else list(range(len(tree)))
        if not places:
            return
        place = draw(st.sampled_from(places))
        if isinstance(tree[place], (dict, list)) and draw(st.booleans()):
            tree = tree[place]
        elif draw(st.integers(0, 3)) == 0:
            del tree[place]
            return
        else:
            tree[place] = draw(_JSON)
            return


def _replace_array(arrays: dict[str, Any], name: str, change: Any) -> None:
    value = arrays[name]
    if not isinstance(change, str):
        arrays[name] = change
    elif change == "drop":
        del arrays[name]
    elif np.asarray(value).dtype.kind not in "fiu":
        return  # changed already
    elif change in ("nan", "inf"):
        arrays[name] = np.full_like(np.asarray(value, dtype=float), float(change))
    elif change == "text":
        arrays[name] = np.asarray(value).astype(str)
    else:
        made = {
            "transpose": lambda: np.asarray(value).T,
            "flatten": lambda: np.ravel(value),
            "complex": lambda: np.asarray(value).astype(complex),
            "double": lambda: np.concatenate([np.atleast_1d(value)] * 2),
        }
        arrays[name] = made[change]()


def _controller_file(content: ControllerFile) -> None:
    from agents.controllers.files import write

    path = _FOLDER / "controller.npz"
    write(path, content)
    controller: Any = agents.load(path)
    observation = np.zeros(len(controller.readings))
    for _ in range(2):
        shares = np.asarray(controller.act(observation))
        assert np.isfinite(shares).all()
        assert np.abs(shares).max() <= 1.0


def _act(example: tuple[str, Any, Any]) -> None:
    kind, count, observation = example
    controller: Any = controller_of(controller_files()[kind], "fuzz")
    controller.reset(count)
    for _ in range(2):
        shares = np.asarray(controller.act(observation), dtype=float)
        assert np.isfinite(shares).all()
        assert np.abs(shares).max() <= 1.0


_OBSERVATIONS = st.one_of(
    st.lists(number(-10.0, 10.0), min_size=4, max_size=4),
    ANYTHING,
    st.just(np.zeros((2, 4))),
    st.just(np.full(4, 1e300)),
    st.just(np.full(4, np.nan)),
)


# -------------------------------------------------------------------------------- recipes


def _plain(env_id: str, algorithm: str) -> dict[str, Any]:
    return recipes.recipe(algorithm, env_id).plain()


@st.composite
def _recipe_files(draw: Any) -> tuple[str, str, bytes]:
    """Draw a recipe's file with something changed in it: its values, or its text."""
    import yaml

    algorithm = draw(st.sampled_from(["ppo", "sac", "td3"]))
    content = {IDS[0]: _plain(IDS[0], algorithm)}
    if draw(st.booleans()):
        content[IDS[0]].pop("algorithm")
    for _ in range(draw(st.integers(0, 2))):
        _replace_entry(draw, content[IDS[0]])
    suffix = draw(st.sampled_from([".yml", ".json"]))
    text = json.dumps(content) if suffix == ".json" else yaml.safe_dump(content)
    if draw(st.integers(0, 2)) == 0:
        return algorithm, suffix, draw(values.changed_text(text))
    return algorithm, suffix, text.encode()


def _recipe_file(example: tuple[str, str, bytes]) -> None:
    algorithm, suffix, content = example
    path = _FOLDER / f"recipe{suffix}"
    path.write_bytes(content)
    made = recipes.recipe(algorithm, IDS[0], None, path)
    json.dumps(made.plain(), allow_nan=True)
    gymnasium.make(IDS[0], disable_env_checker=True, **made.environment())


def _run_file(example: tuple[str, str, bytes]) -> None:
    """Resume a run that has nothing but this recipe: it must say so, whatever the recipe is."""
    path = _FOLDER / "run"
    path.mkdir(exist_ok=True)
    (path / "run.json").write_bytes(example[2])
    try:
        agents.resume(path)
    except railenv.ParameterError:
        raise
    raise AssertionError("a run without a checkpoint went on")


@st.composite
def _recipe_changes(draw: Any) -> tuple[str, dict[str, Any]]:
    names = [
        "n_timesteps",
        "n_envs",
        "seed",
        "threads",
        "symmetric",
        "normalize",
        "authority",
        "memory",
        "memory.corners",
        "curriculum",
        "curriculum.start",
        "evaluation",
        "evaluation.every",
        "env_kwargs",
        "env_kwargs.vehicle",
        "env_kwargs.weights",
        "env_kwargs.sensors",
        "env_kwargs.randomize",
        "env_kwargs.speed_range",
        "env_kwargs.actuator_model",
        "learning_rate",
        "policy",
        "",
        ".",
        "a.b.c",
    ]
    chosen = draw(st.lists(st.sampled_from(names), unique=True, min_size=1, max_size=2))
    return draw(st.sampled_from(["ppo", "sac"])), {
        name: draw(st.one_of(ANYTHING, _JSON)) for name in chosen
    }


def _changed_recipe(example: tuple[str, dict[str, Any]]) -> None:
    algorithm, changes = example
    made = recipes.recipe(algorithm, IDS[0], changes)
    gymnasium.make(IDS[0], disable_env_checker=True, **made.environment())
    assert 0.0 < made.authority <= 1.0
    assert math.isfinite(made.n_timesteps)


AREAS = (
    Area(
        "keywords of environments",
        st.tuples(st.sampled_from(IDS), _some(_SETTINGS, 4)),
        _new_environment,
        4000,
    ),
    Area(
        "options and actions of an environment",
        st.tuples(st.sampled_from(IDS), _some(_OPTIONS, 3), st.lists(_ACTION, max_size=3)),
        _resets_and_steps,
        8000,
    ),
    Area(
        "keywords of vector environments",
        st.fixed_dictionaries(
            {"num_envs": rarely(st.integers(1, 3), values.COUNTS)},
            optional={
                "autoreset_mode": rarely(
                    st.sampled_from(["NextStep", "SameStep", "Disabled"]), ANYTHING
                ),
                "max_episode_steps": rarely(st.integers(1, 9), ANYTHING),
                "render_mode": st.sampled_from([None, "human", 3]),
                "duration": number(0.01, 1.0),
            },
        ),
        _new_vector,
        1500,
    ),
    Area("options, seeds and actions of a vector environment", _VECTORS, _vectors, 5000),
    Area("controller files, values", _controllers(), _controller_file, 4000),
    Area(
        "observations of controllers",
        st.tuples(
            st.sampled_from(["YawRateFeedback", "LQG", "OutputFeedback", "LearnedPolicy"]),
            rarely(st.sampled_from([None, 2]), ANYTHING),
            _OBSERVATIONS,
        ),
        _act,
        3000,
    ),
    Area("recipe files", _recipe_files(), _recipe_file, 2500),
    Area("changes of recipes", _recipe_changes(), _changed_recipe, 2500),
    Area("run.json of training runs", _recipe_files(), _run_file, 1000, quick=15),
)
