"""What import-linter cannot say of imports: where they stand, and what they cost."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import railenv
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


def test_only_functions_of_commands_import_what_stands_above_railenv():
    """That only the Explorer does so too is a contract of import-linter (``make lint``)."""
    above = [
        i
        for i in imports()
        if i.file.startswith("railenv/cli/") and i.name.partition(".")[0] in ("design", "agents")
    ]
    assert above
    for i in above:
        assert i.where in ("function", "typing"), i


def test_drawing_is_imported_inside_functions():
    """Data types are read, computed and sent to workers without it."""
    drawing = [i for i in imports() if i.name.endswith("_plots")]
    assert drawing
    for i in drawing:
        beside = i.file.endswith(("_plots.py", "/__init__.py")) or "/reproduction/" in i.file
        assert i.where in ("function", "typing") or beside, i


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


def test_names_load_lazily_from_where_type_checkers_see_them():
    tree = ast.parse(Path(railenv.__file__).read_text(encoding="utf-8"))
    seen = {
        alias.name: node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module.startswith("railenv.")
        for alias in node.names
    }
    assert seen == {name: f"railenv.{module}" for name, module in railenv._HOME.items()}
    assert sorted(railenv.__all__) == sorted(seen)
    for name in seen:
        assert getattr(railenv, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'Boogie'"):
        railenv.Boogie  # noqa: B018
