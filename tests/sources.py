"""The sources of the packages, and what they import."""

import ast
import functools
from typing import NamedTuple

from tests.pages import ROOT

PACKAGES = ("railenv", "design", "agents")


class Import(NamedTuple):
    """An import somewhere in a module of the packages."""

    file: str
    name: str
    where: str
    """``module`` (runs when the module is imported), ``function`` or ``typing`` (never runs)."""


@functools.cache
def imports():
    """Return every import in the packages."""
    found = []
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            _collect(tree, str(path.relative_to(ROOT)), "module", found)
    return found


def _collect(node, file, where, found):
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import):
            found += [Import(file, alias.name, where) for alias in child.names]
        elif isinstance(child, ast.ImportFrom):
            assert child.level == 0, f"{file} has a relative import"
            found.append(Import(file, child.module, where))
        elif isinstance(child, ast.FunctionDef):
            _collect(child, file, "typing" if where == "typing" else "function", found)
        elif isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
            _collect(child, file, "typing", found)
        elif isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            _collect(child, file, where, found)
