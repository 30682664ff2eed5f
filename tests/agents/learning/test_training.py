"""Training: recipes, symmetry of Stable-Baselines3's networks, exact resume, import."""

import dataclasses
import json
import math
import os
import shutil
import signal
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
from typer.testing import CliRunner

import agents
import railenv
from agents.learning.recipe import Curriculum, Evaluation, Recipe, recipe
from railenv import cli
from railenv.tasks import TASKS

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from agents.controllers.memory import MemorySettings
from agents.learning import checkpoints, trainer
from agents.learning.memory_env import MemoryVecEnv
from agents.learning.sb3 import HuntingVecEnv
from agents.learning.trainer import Trainer

BOGIE, DUAL = "railenv/Bogie-v1", "railenv/DualWheelset-v1"

TINY = {
    "n_envs": 8,
    "threads": 1,
    "normalize": True,
    "env_kwargs": {"observation": "sensors", "duration": 0.3, "randomize": {"conicity": [0.05, 0.1]}},
    "memory": {"corners": [0.5, 5.0]},
    "evaluation": {"every": 128, "episodes": 2},
    "checkpoint_every": 128,
    "curriculum": {"start": 80.0, "by": "success", "episodes": 5, "share": 0.5},
}
OWN = {
    "ppo": {"n_steps": 16, "batch_size": 64, "n_epochs": 2},
    "sac": {"learning_starts": 40, "batch_size": 32, "train_freq": 8},
    "td3": {"learning_starts": 40, "batch_size": 32, "train_freq": 8},
    "tqc": {"learning_starts": 40, "batch_size": 32, "train_freq": 8},
}


def tiny(algorithm, **more):
    return {**TINY, **OWN[algorithm], **more}


def arrays(policy):
    return policy.network.arrays()


@pytest.fixture(params=OWN)
def algorithm(request):
    return request.param


# ---------------------------------------------------------------------------- recipes


@pytest.mark.parametrize("env_id", [BOGIE, DUAL])
def test_shipped_recipes_make_environments_and_come_back_from_json(algorithm, env_id):
    made = recipe(algorithm, env_id)
    data = json.loads(json.dumps(made.plain()))
    assert Recipe.of(data.pop("algorithm"), env_id, data) == made
    Trainer(dataclasses.replace(made, n_envs=2, evaluation=Evaluation(episodes=1)), None, None)


def test_files_of_ones_own(tmp_path):
    path = tmp_path / "mine.yml"
    path.write_text(
        f"{BOGIE}:\n  n_timesteps: 500\n  learning_rate: lin_0.002\n  memory: {{corners: [3]}}\n"
    )
    made = recipe("ppo", BOGIE, {"env_kwargs.history": 4, "evaluation.every": 7}, path)
    assert (made.n_timesteps, made.memory, made.evaluation.every) == (500, MemorySettings(4, (3.0,)), 7)
    assert made.hyperparameters == {"learning_rate": "lin_0.002"}
    with pytest.raises(railenv.UnknownNameError, match="DualWheelset"):
        recipe("ppo", DUAL, None, path)
    path.write_text(f"{BOGIE}:\n  n_timesteps: 500\n  env_kwargs: null\n")
    with pytest.raises(railenv.ParameterError, match="env_kwargs is None; it must be a mapping"):
        recipe("ppo", BOGIE, None, path)
    path.write_text(f"{BOGIE}:\n  seed: 3\n")
    with pytest.raises(railenv.ParameterError, match="recipe lacks n_timesteps"):
        recipe("ppo", BOGIE, None, path)
    path.write_text("- 1\n- : [")
    with pytest.raises(railenv.ParameterError, match="cannot be read"):
        recipe("ppo", BOGIE, None, path)
    path.write_text("3")
    with pytest.raises(railenv.ParameterError, match="no entries"):
        recipe("ppo", BOGIE, None, path)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"n_envs": 0}, "n_envs is 0"),
        ({"learning_rat": 0.1}, "learning_rat'.*learning_rate"),
        ({"learning_rate": "fast"}, "fast"),
        ({"memory.cornes": [1]}, "cornes"),
        ({"curriculum": {"start": 100.0, "by": "luck"}}, "luck"),
        ({"curriculum.start": -3.0}, "start of the curriculum is -3"),
        ({"evaluation.criterion": "speed"}, "criterion"),
        ({"env_kwargs.durration": 3.0}, "durration"),
        ({"env_kwargs.weights": {"huntin": 1.0}}, "huntin"),
        ({"env_kwargs.actuator": "none"}, "no actuators"),
        ({"policy_kwargs.activation_fn": "sine"}, "sine"),
        ({"policy_kwargs.squash_output": True}, "squash_output"),
        ({"authority": 2.0}, "authority is 2"),
        ({"symmetric": "yes"}, "symmetric"),
        ({"normalize": "all"}, "normalize is 'all'; it must be 'rewards' or 'observations'"),
    ],
)
def test_wrong_recipes_raise(changes, match):
    with pytest.raises(railenv.ParameterError, match=match):
        agents.train("ppo", BOGIE, total_timesteps=16, changes={"n_envs": 2, **changes})


def test_unknown_algorithms_and_environments_raise():
    with pytest.raises(railenv.UnknownNameError, match="ppp"):
        agents.train("ppp", BOGIE)
    with pytest.raises(railenv.UnknownNameError, match="CartPole"):
        agents.train("ppo", "CartPole-v1")


@pytest.mark.parametrize("given", ["ppo", "sac", "td3", "tqc"])
def test_recipes_change_nothing_of_the_tasks(given):
    """What a baseline is trained in is what the task's page describes."""
    for task in TASKS:
        made = recipe(given, task.id)
        assert not made.env_kwargs
        assert made.memory.history == task.keywords.get("history", 0)
        assert made.evaluation.criterion == "critical_speed"
        assert not any(made.normalizes)


def test_what_is_normalised():
    made = {v: recipe("ppo", BOGIE, {"normalize": v}) for v in (False, True, "rewards", "observations")}
    assert [m.normalizes for m in made.values()] == [
        (False, False),
        (True, True),
        (False, True),
        (True, False),
    ]


def test_missing_packages_are_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(railenv.MissingPackageError, match=r"railenv\[rl\]"):
        agents.resume("nowhere")
    with pytest.raises(railenv.MissingPackageError, match="PyYAML"):
        recipe("ppo", BOGIE)


# ---------------------------------------------------------------------------- what is trained


@pytest.mark.parametrize("symmetric", [True, False])
def test_the_policy_does_what_stable_baselines3_does(algorithm, symmetric, coach, tmp_path):
    """The same actions in the same environment, with history, memory and a base controller."""
    vehicle = railenv.Equipped(coach, "secondary")
    lqg = agents.LQG.design(vehicle, speed=120.0)
    own = {**TINY["env_kwargs"], "history": 2}
    done = agents.train(
        algorithm,
        BOGIE,
        total_timesteps=256,
        directory=tmp_path / "run",
        base=lqg,
        changes=tiny(algorithm, symmetric=symmetric, authority=0.4, env_kwargs=own),
    )
    env = HuntingVecEnv.make(BOGIE, num_envs=3, seed=5, **done.recipe.environment())
    wrapped = MemoryVecEnv(env, done.recipe.memory, lqg, 0.4)
    folder = tmp_path / "run"
    policy = agents.LearnedPolicy.from_sb3(
        folder / "best_model.zip", folder / "best_vecnormalize.pkl", wrapped
    )
    normalized = VecNormalize.load(str(folder / "best_vecnormalize.pkl"), wrapped)
    normalized.training = False
    model = trainer.ALGORITHMS[algorithm].load(folder / "best_model.zip")
    observations = normalized.reset()
    width = len(policy.readings)
    for step in range(40):
        actions, _ = model.predict(observations, deterministic=True)
        expected = np.clip(wrapped.memory.demand + 0.4 * actions, -1.0, 1.0)
        if step == 0:
            policy.reset(3)
        shares = policy.act(normalized.get_original_obs()[:, :width])
        np.testing.assert_allclose(shares, expected, rtol=1e-5, atol=2e-6)
        observations, _, dones, _ = normalized.step(actions)
        assert not dones.any()
    assert np.abs(shares).max() > 1e-4
    best = agents.load(folder / "best.npz")
    np.testing.assert_array_equal(best.network.weights[0], policy.network.weights[0])
    assert (best.network.signs is None) == (not symmetric)


def test_any_model_of_stable_baselines3_can_be_imported(tmp_path):
    env = HuntingVecEnv.make(BOGIE, num_envs=2, seed=1, observation="state", history=1, duration=0.2)
    model = PPO("MlpPolicy", env, n_steps=8, batch_size=16, seed=0, device="cpu")
    model.save(tmp_path / "model.zip")
    policy = agents.LearnedPolicy.from_sb3(tmp_path / "model.zip", None, env)
    first = env.reset()
    policy.reset(2)
    expected = model.predict(first, deterministic=True)[0]
    np.testing.assert_allclose(policy.act(first[:, : len(policy.readings)]), expected, atol=1e-6)
    (tmp_path / "no.zip").write_bytes(b"no")
    with pytest.raises(railenv.ParameterError, match="not a model"):
        agents.LearnedPolicy.from_sb3(tmp_path / "no.zip", None, env)
    with pytest.raises(railenv.ParameterError, match="railenv environment"):
        agents.LearnedPolicy.from_sb3(model, None, 3)


def test_ends_of_episodes_have_their_own_features():
    env = HuntingVecEnv.make(BOGIE, num_envs=2, seed=1, observation="sensors", duration=0.05)
    wrapped = MemoryVecEnv(env, MemorySettings(corners=(1.0,), past_commands=2))
    first = wrapped.reset()
    width = len(env.vector_env.fleet.observation_names)
    np.testing.assert_array_equal(first[:, width : width + 2], first[:, :2])  # filters are settled
    for k in range(10):
        observations, _, dones, infos = wrapped.step(np.full((2, 1), 0.1 * (k + 1)))
    assert dones.all()
    past = infos[0]["terminal_observation"][-2:]
    np.testing.assert_allclose(past, [1.0, 0.9], rtol=1e-6)
    assert not observations[:, -2:].any()
    np.testing.assert_array_equal(observations[:, width : width + 2], observations[:, :2])


# ---------------------------------------------------------------------------- learning, resuming


def test_a_policy_improves_in_seconds():
    """A vehicle beyond its critical speed: the return rises well above that of the start."""
    done = agents.train(
        "ppo",
        BOGIE,
        total_timesteps=61_440,
        seed=0,
        changes={
            "n_envs": 64,
            "n_steps": 64,
            "batch_size": 1024,
            "threads": 1,
            "learning_rate": 0.002,
            "policy_kwargs.net_arch": {"pi": [32, 32], "vf": [32, 32]},
            "curriculum": None,
            "checkpoint_every": 0,
            "env_kwargs": {
                "speed_range": [130, 130],
                "duration": 2.0,
                "randomize": {},
                "tangent_share": 1.0,
                "initial_offset": 0.002,
                "irregularity": None,
            },
            "evaluation": {"every": 40_000, "episodes": 16},
        },
    )
    first, *_, last = done.evaluations
    assert last.mean_return > 1.2 * first.mean_return, (first, last)
    assert done.policy.about["mean_return"] >= last.mean_return
    done.plot()
    plt.close("all")


def interrupt(monkeypatch, after):
    step = trainer.Between._on_step

    def interrupted(self):
        if self.num_timesteps > after:
            raise KeyboardInterrupt
        return step(self)

    monkeypatch.setattr(trainer.Between, "_on_step", interrupted)


@pytest.mark.parametrize("after", [100, 600])  # from the checkpoint at 0 steps, and from a later one
def test_resumed_training_is_uninterrupted_training(algorithm, after, tmp_path, monkeypatch):
    changes = tiny(algorithm)
    whole = agents.train(
        algorithm, BOGIE, total_timesteps=1024, seed=3, changes=changes, directory=tmp_path / "a"
    )
    with monkeypatch.context() as patch:
        interrupt(patch, after)
        with pytest.raises(KeyboardInterrupt):
            agents.train(
                algorithm,
                BOGIE,
                total_timesteps=1024,
                seed=3,
                changes=changes,
                directory=tmp_path / "b",
            )
    torch.rand(3)  # what others draw in between does not matter
    resumed = agents.resume(tmp_path / "b")
    for name, value in arrays(whole.last).items():
        np.testing.assert_array_equal(arrays(resumed.last)[name], value)
    assert str(resumed.evaluations) == str(whole.evaluations)
    assert resumed.policy.about == whole.policy.about
    for name in ("evaluations.csv", "run.json"):
        assert (tmp_path / "a" / name).read_text() == (tmp_path / "b" / name).read_text()
    assert len(list((tmp_path / "b" / "checkpoints").iterdir())) == 2
    assert not np.array_equal(arrays(whole.last)["W0"], arrays(whole.policy)["W0"]) or (
        whole.policy.about["timesteps"] == whole.last.about["timesteps"]
    )


@pytest.mark.slow
def test_killed_training_resumes(tmp_path):
    script = (
        "import os, signal, agents\nfrom agents import trainer\n"
        "step = trainer.Between._on_step\n"
        "def killed(self):\n"
        "    if self.num_timesteps > 600: os.kill(os.getpid(), signal.SIGKILL)\n"
        "    return step(self)\n"
        "trainer.Between._on_step = killed\n"
        f"agents.train('ppo', {BOGIE!r}, total_timesteps=1024, seed=3, changes={tiny('ppo')!r}, "
        f"directory={str(tmp_path / 'b')!r})\n"
    )
    done = subprocess.run([sys.executable, "-c", script], env=dict(os.environ), check=False)
    assert done.returncode == -signal.SIGKILL
    whole = agents.train("ppo", BOGIE, total_timesteps=1024, seed=3, changes=tiny("ppo"))
    resumed = agents.resume(tmp_path / "b")
    for name, value in arrays(whole.last).items():
        np.testing.assert_array_equal(arrays(resumed.last)[name], value)


def test_damaged_checkpoints_are_refused_and_never_opened(tmp_path):
    run = tmp_path / "run"
    whole = agents.train("ppo", BOGIE, total_timesteps=512, seed=3, changes=tiny("ppo"), directory=run)
    last = checkpoints.latest(run)
    for path in sorted(last.iterdir()):
        kept = path.read_bytes()
        for content in (kept[: len(kept) // 2], kept[:50] + b"?" + kept[51:], b""):
            path.write_bytes(content)
            with pytest.raises(railenv.ParameterError, match="is damaged; delete that folder"):
                agents.resume(run)
        path.write_bytes(kept)
    exploded = tmp_path / "exploded"
    bomb = f"cos\nsystem\n(S'touch {exploded}'\ntR.".encode()
    (last / "state.pkl").write_bytes(bomb)
    with pytest.raises(railenv.ParameterError, match="is damaged"):
        agents.resume(run)
    assert not exploded.exists()
    shutil.rmtree(last)
    again = agents.resume(run)  # from the one before
    for name, value in arrays(whole.last).items():
        np.testing.assert_array_equal(arrays(again.last)[name], value)


def test_runs_do_not_write_over_each_other(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(railenv.ParameterError, match="not empty"):
        agents.train("ppo", BOGIE, total_timesteps=16, changes=tiny("ppo"), directory=tmp_path)
    with pytest.raises(railenv.ParameterError, match="no training run"):
        agents.resume(tmp_path)
    (tmp_path / "run.json").write_text(json.dumps({BOGIE: recipe("ppo", BOGIE, tiny("ppo")).plain()}))
    with pytest.raises(railenv.ParameterError, match="no checkpoint"):
        agents.resume(tmp_path)


def test_curriculum_widens_the_speeds():
    changes = tiny("ppo", n_envs=16, checkpoint_every=0)
    changes["evaluation"] = {"every": 0}
    changes["env_kwargs"] = {**TINY["env_kwargs"], "speed_range": [40.0, 160.0]}
    made = recipe("ppo", BOGIE, changes)
    made = dataclasses.replace(made, curriculum=Curriculum(80.0, "progress", share=0.5))
    run = Trainer(made, None, None)
    env, tops = run.env.hunting.vector_env, []
    seen = env.set_speed_range
    env.set_speed_range = lambda low, high: (tops.append((low, high)), seen(low, high))
    run.run(1024, progress=False)
    assert tops[0] == (40.0, 80.0)
    assert tops[-1] == (40.0, 160.0)
    assert tops[2] == (40.0, pytest.approx(80.0 + 80.0 * 256 / 512))
    speeds = [episode.speed for episode in env.fleet.episodes]
    assert all(40.0 <= v <= 160.0 for v in speeds)


def test_speed_range_stays_within_that_of_the_environment():
    env = HuntingVecEnv.make(BOGIE, num_envs=16, speed_range=(50.0, 90.0)).vector_env
    env.set_speed_range(60.0, 61.0)
    _, infos = env.reset(seed=1)
    assert (infos["speed"] >= 60.0).all()
    assert (infos["speed"] <= 61.0).all()
    for low, high in ((40.0, 60.0), (60.0, 91.0), (70.0, 60.0)):
        with pytest.raises(railenv.ParameterError, match="speed"):
            env.set_speed_range(low, high)


def test_best_policy_by_its_critical_speed():
    changes = tiny("ppo", checkpoint_every=0)
    changes["evaluation"] = {**TINY["evaluation"], "criterion": "robust_critical_speed", "every": 512}
    done = agents.train("ppo", BOGIE, total_timesteps=512, changes=changes)
    speeds = [e.critical_speed for e in done.evaluations]
    assert all(math.isfinite(v) for v in speeds)
    assert done.policy.about["critical_speed"] == max(speeds)


def test_command_line(tmp_path):
    options = [f"--set={name}={json.dumps(value)}" for name, value in tiny("ppo").items()]
    out = str(tmp_path / "run")
    run = CliRunner().invoke
    shown = run(cli.app, ["train", "ppo", BOGIE, "--show", "--seed", "4", *options])
    assert json.loads(shown.output)[BOGIE]["seed"] == 4
    done = run(cli.app, ["train", "ppo", BOGIE, "--steps", "128", "--out", out, *options])
    assert done.exit_code == 0, done.output
    assert agents.load(tmp_path / "run" / "best.npz").observation == "sensors"
    more = run(cli.app, ["train", "--resume", "--steps", "256", "--out", out, "--json"])
    assert more.exit_code == 0, more.output
    assert json.loads(more.output)["directory"] == out
    assert isinstance(run(cli.app, ["train"]).exception, railenv.ParameterError)
    assert isinstance(run(cli.app, ["train", "ppo", "--resume"]).exception, railenv.ParameterError)
    assert isinstance(run(cli.app, ["train", "ppo", "--set", "x"]).exception, railenv.ParameterError)
