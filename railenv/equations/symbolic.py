"""The SymPy functions that the equations need beyond SymPy's own."""

from __future__ import annotations

from typing import Any

import sympy


class WherePositive(sympy.Function):
    """``WherePositive(c, a, b)`` is ``a`` where ``c > 0``, else ``b``; see ``where_positive``.

    SymPy's own ``Piecewise`` rewrites its conditions and folds nested cases, which is slow and
    changes the order of evaluation; this stays what was written.
    """

    nargs = 3

    @classmethod
    def eval(cls, condition: Any, then: Any, otherwise: Any) -> Any:
        """Choose at once where the condition is a number or makes no difference."""
        if condition.is_Number:
            return then if condition > 0 else otherwise
        if then == otherwise:
            return then
        return None

    def fdiff(self, argindex: int = 1) -> Any:
        """Partial derivative with respect to argument ``argindex`` (1, 2 or 3)."""
        condition, _, _ = self.args
        if argindex == 1:
            return sympy.S.Zero  # true everywhere but on the switching surface itself
        return WherePositive(condition, int(argindex == 2), int(argindex == 3))

    def _latex(self, printer: Any) -> str:
        condition, then, otherwise = (printer._print(arg) for arg in self.args)
        return rf"\begin{{cases}} {then} & {condition} > 0 \\ {otherwise} & \text{{else}} \end{{cases}}"


class TableValue(sympy.Function):
    """``TableValue(t, x, k, i, n)`` is the k-th derivative at ``x`` of the table that ``t`` names.

    It is column ``i`` of ``n``.
    """

    nargs = 5

    def fdiff(self, argindex: int = 1) -> Any:
        """Partial derivative: by ``x`` the table of the next order; the name is no variable."""
        name, x, order, column, columns = self.args
        return TableValue(name, x, order + 1, column, columns) if argindex == 2 else sympy.S.Zero

    def _latex(self, printer: Any) -> str:
        name, x = (printer._print(arg) for arg in self.args[:2])
        order, column, columns = map(int, self.args[2:])
        index = rf"_{{{column + 1}}}" if columns > 1 else ""
        return rf"{name}{index}{chr(39) * order}\left( {x} \right)"
