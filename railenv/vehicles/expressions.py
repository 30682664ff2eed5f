"""Arithmetic on the names of parameters: how the numbers of an assembly are written.

A field of a body or an element is a number, or a text such as ``"frame_mass + body_mass / 2"``. Nothing
but names, numbers, ``+ - * /`` and brackets is read, and nothing else is ever executed.
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
def compiled(text: str) -> tuple[CodeType, tuple[str, ...]]:
    """Return the code of an expression and the names that it reads.

    Raises
    ------
    ParameterError
        If it is anything but arithmetic on names and numbers.
    """
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ParameterError(f"expression is {shown(text)}; {_ADVICE}") from None
    for node in ast.walk(tree):
        number = isinstance(node, ast.Constant) and type(node.value) in (int, float)
        allowed = isinstance(node, (*_ALLOWED, *_OPERATORS))
        if not allowed or (isinstance(node, ast.Constant) and not number):
            raise ParameterError(f"expression is {shown(text)}; {_ADVICE}")
    names = sorted({node.id for node in ast.walk(tree) if isinstance(node, ast.Name)})
    return compile(tree, "<expression>", "eval"), tuple(names)


_ADVICE = "it must be arithmetic (+ - * / and brackets) on names of parameters and numbers"


def evaluate(text: str, values: Any) -> Any:
    """Return an expression's value; ``values`` maps names to numbers or symbols.

    Raises
    ------
    UnknownNameError
        If it reads a name that there is not.
    ParameterError
        If it divides by zero.
    """
    code, names = compiled(text)
    for name in names:
        if name not in values:
            raise UnknownNameError("parameter", name, list(values))
    try:
        return eval(code, {"__builtins__": {}}, dict(values))
    except ZeroDivisionError:
        raise ParameterError(f"{text} divides by zero") from None
