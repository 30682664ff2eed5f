"""Which package may import which, and what an import costs."""

import subprocess
import sys

import pytest

from tests.sources import imports

HEAVY = (
    "numba",
    "llvmlite",
    "sympy",
    "matplotlib",
    "scipy",
    "control",
    "pandas",
    "torch",
    "stable_baselines3",
)


def crossing(package, others):
    """Imports of other packages in one package."""
    return [
        i for i in imports() if i.file.startswith(f"{package}/") and i.name.partition(".")[0] in others
    ]


def test_railenv_knows_the_others_only_inside_its_commands():
    found = crossing("railenv", {"design", "agents"})
    assert found  # the commands do
    for i in found:
        command = i.file.startswith("railenv/cli") and i.where == "function"
        assert command or i.where == "typing", i


def test_design_does_not_know_agents():
    assert crossing("design", {"agents"}) == []


@pytest.mark.parametrize(
    ("packages", "left_out"),
    [
        ("railenv", HEAVY),
        ("railenv, railenv.cli", HEAVY),
        ("design", ("numba", "sympy", "pandas", "torch")),
        (
            "design, agents",
            ("numba", "sympy", "pandas", "torch", "stable_baselines3", "yaml", "pygame"),
        ),
    ],
)
def test_imports_leave_out_what_loads_slowly(packages, left_out):
    code = f"import sys, {packages}; print([name for name in {left_out} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
