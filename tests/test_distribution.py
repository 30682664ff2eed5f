"""What is distributed: files of sdist and wheel, the installed package, its types from outside."""

import os
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

import agents
import railenv
from agents.controllers.shipped import shipped_problems
from tests.pages import ROOT
from tests.sources import PACKAGES

pytest.importorskip("build")
pytest.importorskip("hatchling")

NOT_IN_THE_SDIST = {".ci/run", ".editorconfig", ".gitattributes", ".pre-commit-config.yaml"}
NAME = f"railenv-{railenv.__version__}"


def call(*command, **keywords):
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, check=False, **keywords
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def build(kind, source, folder):
    call(sys.executable, "-m", "build", "--no-isolation", f"--{kind}", "--outdir", folder, source)


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    """The unpacked sdist of the checkout."""
    folder = tmp_path_factory.mktemp("sdist")
    build("sdist", ROOT, folder)
    with tarfile.open(folder / f"{NAME}.tar.gz") as archive:
        archive.extractall(folder, filter="data")
    return folder / NAME


@pytest.fixture(scope="module")
def wheel(sdist, tmp_path_factory):
    """The wheel, built from the sdist as installers build it."""
    folder = tmp_path_factory.mktemp("wheel")
    build("wheel", sdist, folder)
    return folder / f"{NAME}-py3-none-any.whl"


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The Python of an environment with the wheel, on the dependencies of this one."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, with_pip=False)
    python = folder / "bin" / "python"
    call(
        sys.executable,
        "-m",
        "pip",
        "--python",
        python,
        "install",
        "-q",
        "--no-deps",
        "--no-index",
        wheel,
    )
    (packages,) = folder.glob("lib/python*/site-packages")
    others = [path for path in sys.path if path.endswith("site-packages")]
    (packages / "dependencies.pth").write_text("\n".join(others))
    return python


def files(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


# -------------------------------------------------------------------------------- files


@pytest.mark.skipif(
    not ((ROOT / ".git").exists() and shutil.which("git")), reason="no checkout, or no git"
)
def test_sdist_has_what_the_checkout_has(sdist):
    listed = call(
        "git", "ls-files", "--cached", "--others", "--exclude-standard", cwd=ROOT
    ).splitlines()
    there = {name for name in listed if (ROOT / name).exists()}
    assert there >= NOT_IN_THE_SDIST
    assert files(sdist) == there - NOT_IN_THE_SDIST | {"PKG-INFO"}


def test_wheel_has_the_packages_and_nothing_else(sdist, wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    own = {name for name in names if ".dist-info/" not in name}
    assert own == {name for name in files(sdist) if name.split("/")[0] in PACKAGES}
    data = {name for name in own if not name.endswith(".py")}
    assert {f"{package}/py.typed" for package in PACKAGES} < data
    shipped = {f"{p}/{n}" for p in shipped_problems() for n in agents.shipped_names(p)}
    assert {f"agents/controllers/data/{name}.npz" for name in shipped} < data
    assert {f"agents/learning/hyperparams/{name}.yml" for name in ("ppo", "sac", "td3")} < data
    assert "design/reproduction/templates/page.html" in data
    assert {f"railenv/vehicles/{name}.toml" for name in ("bogie", "dual_wheelset")} < data
    texts = ("environment", "integrators", "pictures")
    assert {f"railenv/kernels/texts/{name}.pyk" for name in texts} < data
    computed = {f"design/reproduction/data/{name}.json" for name in ("readings", "simplifications")}
    assert computed == {name for name in own if name.endswith(".json")}
    kinds = {Path(name).suffix for name in own}
    assert kinds == {
        ".py",
        ".pyk",
        ".toml",
        ".typed",
        ".npz",
        ".yml",
        ".html",
        ".css",
        ".csv",
        ".json",
        ".md",
    }


def test_wheel_says_what_it_is(wheel):
    with zipfile.ZipFile(wheel) as archive:
        folder = f"{NAME}.dist-info"
        said = Parser().parsestr(archive.read(f"{folder}/METADATA").decode())
        assert f"{folder}/licenses/LICENSE" in archive.namelist()
        assert "railenv = railenv.cli:main" in archive.read(f"{folder}/entry_points.txt").decode()
    assert said["Version"] == railenv.__version__
    assert said["Requires-Python"] == ">=3.11"
    assert said["License-Expression"] == "MIT"
    assert said.get_payload().startswith("# railenv")


# ---------------------------------------------------------------------------- installed

USE = """
from pathlib import Path
import sys
import importlib.metadata
import agents, design, railenv

home = Path(sys.prefix)
assert all(home in Path(package.__file__).parents for package in (agents, design, railenv))
assert importlib.metadata.version("railenv") == railenv.__version__
coach = agents.equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))
for name in agents.shipped_names():
    found = design.critical_speed(coach, controller=agents.shipped(name), speed_range=(20.0, 400.0))
    print(name, found.speed)
"""


def outside(python, folder, *command):
    """Run the environment's Python away from the checkout."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return call(python, *command, cwd=folder, env=environment)


def use(python, folder):
    """Do with an installed package what everyone does first."""
    command = [python.parent / "railenv", "critical-speed"]
    assert (
        outside(*command[:1], folder, *command[1:]) == "bogie: hunting from 116.4739 m/s at 3.1135 Hz\n"
    )
    lines = outside(python, folder, "-c", USE).splitlines()
    assert [line.split()[0] for line in lines] == list(agents.shipped_names())
    passive = next(line for line in lines if line.startswith("passive"))
    assert float(passive.split()[1]) == pytest.approx(116.4739, abs=1e-3)


def test_installed_package_works_outside_the_checkout(installed, tmp_path):
    use(installed, tmp_path)


@pytest.mark.slow
def test_wheel_in_an_empty_environment(wheel, tmp_path):
    """Dependencies come from the index, without any extra."""
    folder = tmp_path / "environment"
    venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    call(python, "-m", "pip", "install", "-q", "-c", ROOT / "constraints.txt", wheel)
    use(python, tmp_path)
    for package in ("torch", "stable_baselines3", "cma", "pygame", "xarray", "pytest"):
        found = outside(
            python, tmp_path, "-c", f"import importlib.util as u; print(u.find_spec({package!r}))"
        )
        assert found.strip() == "None"
    done = subprocess.run(
        [folder / "bin" / "railenv", "train", "ppo", "--out", tmp_path / "run"],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 1
    assert "pip install 'railenv[rl]'" in done.stderr


@pytest.mark.slow
def test_tests_of_the_sdist_run_in_it(sdist):
    """All can be collected; those that read files beside the packages run, and so do some others."""
    environment = {**os.environ, "PYTHONPATH": str(sdist)}
    code = "import railenv, sys; sys.exit(not railenv.__file__.startswith(sys.argv[1]))"
    call(sys.executable, "-c", code, sdist, cwd=sdist, env=environment)
    pytest_there = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    call(*pytest_there, "--collect-only", cwd=sdist, env=environment)
    names = (
        "documents",
        "environment_pages",
        "generated_pages",
        "layers",
        "recipes",
        "release",
        "site",
    )
    chosen = [f"tests/test_{name}.py" for name in names] + ["tests/railenv/test_models.py"]
    call(*pytest_there, *chosen, cwd=sdist, env=environment)


# -------------------------------------------------------------------------------- types

CONSUMER = '''
import math

import gymnasium
import numpy as np
from numpy.typing import NDArray

import agents
import design
import railenv


def fastest(vehicle: railenv.Vehicle, radius: float = math.inf) -> float | None:
    """Use what the README uses."""
    model = railenv.Bogie(vehicle.replace(conicity=0.1))
    found: design.CriticalSpeed = design.critical_speed(model, radius=radius, cant=0.05)
    branch = design.cycle_branch(model, parameter_range=(60.0, 130.0))
    fold: float | None = branch.nonlinear_critical_speed
    names: tuple[str, ...] = tuple(model.state_names)
    print(found, fold, names)
    return found.speed


class Damper(agents.Controller):
    def reset(self, count: int | None = None) -> None:
        self.gain = 1.0

    def act(self, observation: NDArray[np.floating]) -> NDArray[np.float64]:
        return np.asarray(-self.gain * observation[..., :1], dtype=np.float64)


def controllers() -> None:
    coach = agents.equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))
    regulator = agents.LQR.design(coach, speed=160.0)
    margins: design.Margins = design.margins(coach, regulator, speed=130.0)
    evaluation: agents.Evaluation = agents.evaluate(Damper(), coach)
    environment = gymnasium.make("railenv/Bogie-v1")
    print(margins, evaluation, environment)


design.critical_speed("bogie")  # wrong
railenv.Bogie(3.0)  # wrong
railenv.find_equilibrium(railenv.CooperriderBogie(), speed="fast")  # wrong
design.critical_speed(railenv.CooperriderBogie()).velocity  # wrong
agents.shipped(1)  # wrong
'''


@pytest.mark.slow
def test_types_are_seen_from_outside(installed, tmp_path):
    script = tmp_path / "consumer.py"
    script.write_text(CONSUMER)
    options = ["--strict", "--no-color-output", "--no-error-summary", "--cache-dir", tmp_path / "cache"]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, "--python-executable", installed, script],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    found = {int(line.split(":")[1]) for line in done.stdout.splitlines() if ": error:" in line}
    wrong = {i for i, line in enumerate(CONSUMER.splitlines(), start=1) if line.endswith("# wrong")}
    assert found == wrong, done.stdout + done.stderr
