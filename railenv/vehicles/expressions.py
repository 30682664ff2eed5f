"""Arithmetic on the names of parameters, for the numbers of an assembly.

A field of a body or an element is a number, or a text such as ``"frame_mass + body_mass / 2"``. Only
names, numbers, ``+ - * /`` and brackets are read, and nothing else is ever executed.
"""

from __future__ import annotations

import ast
from functools import cache
from types import CodeType
from typing import Any

from railenv.errors import ParameterError, UnknownNameError, shown

_ALLOWED = (ast.Expression, ast.BinOp, ast.UnaryOp, ast.Name, ast.Constant, ast.Load)
_OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.USub, ast.UAdd)


@cache
def _compiled(text: str) -> tuple[CodeType, tuple[str, ...]] | None:
    """Return the code of an expression and the names that it reads; None if it is not arithmetic."""
    try:
        tree = ast.parse(text.strip(), mode="eval")
        for node in ast.walk(tree):
            number = isinstance(node, ast.Constant) and type(node.value) in (int, float)
            allowed = isinstance(node, (*_ALLOWED, *_OPERATORS))
            if not allowed or (isinstance(node, ast.Constant) and not number):
                return None
        names = sorted({node.id for node in ast.walk(tree) if isinstance(node, ast.Name)})
        return compile(tree, "<expression>", "eval"), tuple(names)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def evaluate(text: str, values: Any, label: str = "expression") -> Any:
    """Return an expression's value; ``values`` maps names to numbers or symbols.

    Parameters
    ----------
    text : str
    values : mapping of str to number or symbol
    label : str
        Name of the result in messages.

    Raises
    ------
    UnknownNameError
        If it reads a name that does not exist.
    ParameterError
        If it is not arithmetic on names and numbers, or divides by zero.
    """
    found = _compiled(text)
    if found is None:
        raise ParameterError(
            f"{label} is {shown(text)}; it must be a number, or arithmetic (+ - * / and brackets) on "
            "numbers and names of parameters"
        )
    code, names = found
    for name in names:
        if name not in values:
            raise UnknownNameError(f"parameter in {label}", name, list(values))
    try:
        return eval(code, {"__builtins__": {}}, dict(values))
    except ZeroDivisionError:
        raise ParameterError(f"{label} is {shown(text)}, which divides by zero") from None
