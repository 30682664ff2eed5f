"""Without the extras: what does not need them works, and what needs them says which one."""

import re
import subprocess
import sys
import textwrap
import tomllib

import pytest

import agents
import railenv
from tests.agents.controllers.test_learned import policy
from tests.pages import ROOT
from tests.sources import PACKAGES, imports

EXTRAS = {  # the packages of each extra, as they are imported, and what they alone bring in
    "dask": ("dask", "distributed"),
    "explore": ("bokeh", "panel", "param"),
    "offline": ("h5py", "jax", "minari"),
    "render": ("pygame",),
    "rl": ("cma", "sb3_contrib", "stable_baselines3", "torch", "yaml"),
    "tensorboard": ("tensorboard",),
    "xarray": ("pandas", "xarray"),
}
HIDE = f"""
import sys
from importlib.machinery import PathFinder

HIDDEN = {[name for names in EXTRAS.values() for name in names]}


class Rest:
    @staticmethod
    def find_spec(name, path=None, target=None):
        return None if name.partition(".")[0] in HIDDEN else PathFinder.find_spec(name, path, target)


sys.meta_path[sys.meta_path.index(PathFinder)] = Rest
"""


def run(code, folder):
    """Run code in a fresh interpreter that does not find the packages of the extras."""
    command = [sys.executable, "-c", HIDE + textwrap.dedent(code)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_what_needs_no_extra_works(tmp_path, coach):
    policy(agents.equipped(coach)).save(tmp_path / "policy.npz")
    (tmp_path / "recipe.json").write_text('{"railenv/Bogie-v1": {"n_timesteps": 100}}')
    printed = run(
        """
        import gymnasium, numpy as np
        import agents, design, railenv
        from agents.learning.recipe import recipe
        from railenv import cli
        from typer.testing import CliRunner

        coach = railenv.Bogie(railenv.HIGH_SPEED_COACH)
        print(design.critical_speed(coach))
        plant = agents.equipped(coach)
        print(design.critical_speed(plant, controller=agents.shipped("passive")))
        env = gymnasium.make("railenv/Bogie-v1", observation="sensors")
        observation, info = env.reset(seed=1)
        for controller in (agents.shipped("output-feedback"), agents.load("policy.npz")):
            controller.reset()
            print(env.step(controller.act(observation))[0].shape)
        envs = gymnasium.make_vec("railenv/Bogie-v1", num_envs=3)
        print(envs.reset(seed=1)[0].shape)
        axes = {"radius": [2000.0, 8000.0], "conicity": [0.05, 0.1]}
        chart = design.stability_map(coach, axes, cant=0.05, n_jobs=1)
        print(chart.critical_speed.shape)
        chart.plot()
        print(recipe("ppo", "railenv/Bogie-v1", config="recipe.json").n_timesteps)
        for command in (["critical-speed"], ["vehicles", "TABLE_1", "--toml"], ["train", "--help"]):
            print(CliRunner().invoke(cli.app, command).exit_code)
        print([name for name in HIDDEN if name in sys.modules])
        """,
        tmp_path,
    )
    assert printed == [
        "hunting from 116.4739 m/s at 3.1135 Hz",
        "hunting from 116.4739 m/s at 3.1135 Hz",
        "(4,)",
        "(4,)",
        "(3, 34)",
        "(2, 2)",
        "100",
        "0",
        "0",
        "0",
        "[]",
    ]


def test_what_needs_an_extra_names_it(tmp_path):
    (tmp_path / "recipe.json").write_text('{"railenv/Bogie-v1": {"n_timesteps": 100}}')
    tries = {
        "importlib.import_module('agents.learning.sb3')": "rl",
        "agents.train('ppo', 'railenv/Bogie-v1')": "rl",
        "agents.train('ppo', 'railenv/Bogie-v1', config='recipe.json')": "rl",
        "agents.resume('nowhere')": "rl",
        "agents.search_policy(agents.equipped(coach), agents.shipped('yaw-rate'))": "rl",
        "agents.LearnedPolicy.from_sb3('model.zip', None, None)": "rl",
        "chart.to_xarray()": "xarray",
        "env.render()": "render",
    }
    printed = run(
        f"""
        import importlib
        import gymnasium
        import agents, design, railenv

        coach = railenv.Bogie(railenv.HIGH_SPEED_COACH)
        axes = {{"radius": [6e3, 8e3], "conicity": [0.05, 0.1]}}
        chart = design.stability_map(coach, axes, n_jobs=1)
        env = gymnasium.make("railenv/Bogie-v1", render_mode="rgb_array").unwrapped
        env.reset()
        for attempt in {list(tries)}:
            try:
                eval(attempt)
            except (ImportError, gymnasium.error.DependencyNotInstalled) as error:
                print(str(error).replace(chr(10), " "))
            else:
                print("nothing is missing")
        """,
        tmp_path,
    )
    for (attempt, extra), message in zip(tries.items(), printed, strict=True):
        assert f"railenv[{extra}]" in message, attempt
        assert "not installed" in message, attempt


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        (["train", "ppo", "--out", "run", "--steps", "100"], "rl"),
        (["explore", "--no-browser"], "explore"),
    ],
)
def test_a_command_that_needs_an_extra_ends_in_one_line(words, extra, tmp_path):
    printed = run(
        f"""
        from railenv import cli

        sys.argv = ["railenv", *{words}]
        sys.stderr = sys.stdout
        try:
            cli.main()
        except SystemExit as stopped:
            print(stopped.code)
        """,
        tmp_path,
    )
    assert len(printed) == 2
    assert printed[0].startswith("error: ")
    assert printed[0].endswith(f"pip install 'railenv[{extra}]'")
    assert printed[1] == "1"
    assert not (tmp_path / "run").exists()


def test_every_package_that_is_imported_is_a_dependency_or_of_an_extra():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(EXTRAS) == set(project["optional-dependencies"]) - {"dev", "docs"}
    declared = {re.match(r"[\w-]+", text)[0].lower() for text in project["dependencies"]}
    names = {
        "yaml": "pyyaml",
        "mpl_toolkits": "matplotlib",
        "stable_baselines3": "stable-baselines3",
        "sb3_contrib": "sb3-contrib",
    }
    optional = {name for packages in EXTRAS.values() for name in packages}
    own = {*PACKAGES, "__future__", *sys.stdlib_module_names}
    for i in imports():
        name = i.name.partition(".")[0]
        assert name in own | optional or names.get(name, name) in declared, i


def test_missing_packages_are_import_errors_of_the_package():
    from railenv.extras import require

    with pytest.raises(
        railenv.MissingPackageError, match=r"dreams need Nowhere.*railenv\[rl\]"
    ) as caught:
        require("nowhere_at_all", "Nowhere", "dreams need Nowhere, and")
    assert isinstance(caught.value, ImportError)
    assert caught.value.name == "nowhere_at_all"
