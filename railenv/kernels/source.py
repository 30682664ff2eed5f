"""Python source of a model's kernels, written from its expression graph.

The text defines ``rhs(w, t)``, ``jacobian(w, t)`` and ``parameter_jacobian(w, t)`` over one flat
buffer ``w[row * L + lane]``; what the rows hold is said by :class:`Layout`. ``t`` holds the tables, see
:mod:`railenv.tables`. It is completed by ``railenv/kernels/texts`` and compiled by
:mod:`railenv.kernels.loader`. With L = 1 the same text is the scalar kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import sympy
from sympy.printing.pycode import PythonCodePrinter

from railenv.kernels.graph import Assignment, Graph, differentiate, needed, trace
from railenv.kernels.layout import Layout

_NATIVE = {"exp": "math.exp", "log": "math.log", "tanh": "math.tanh", "atan": "math.atan"}
_LONGEST_PRODUCT = 8  # powers up to this are written as products
_OWN = {"sin": "_sin", "cos": "_cos", "tan": "_tan"}  # branch-free, in the integrators' text


def _is_plain_product(term: Any) -> bool:
    """Whether a term is a product that a multiply-add takes: neither a negation nor a quotient."""
    if not term.is_Mul or any(f.is_Pow and f.exp.is_negative for f in term.args):
        return False
    coefficient, rest = term.as_coeff_Mul()
    return bool(coefficient != -1 or rest.is_Mul)


class _KernelPrinter(PythonCodePrinter):
    """Prints one assignment; numbers become names of constants of the kernel's own float type.

    A literal would be a float64 and turn float32 lanes into float64 ones.
    """

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False, "allow_unknown_functions": True})
        self.constants: dict[float, str] = {}

    def _constant(self, value: Any) -> str:
        return self.constants.setdefault(float(value), f"_k{len(self.constants)}")

    def _print_Float(self, expr: Any) -> str:
        return self._constant(expr)

    _print_Integer = _print_Rational = _print_Half = _print_One = _print_Zero = _print_Float
    _print_NegativeOne = _print_Float

    def _print_Pow(self, expr: Any, **_: Any) -> str:
        base, exponent = expr.args
        text = self._print(base)
        if exponent == sympy.Rational(1, 2):
            return f"math.sqrt({text})"
        if exponent.is_Integer and abs(exponent) <= _LONGEST_PRODUCT:
            power = "*".join([text] * abs(int(exponent)))
            if exponent > 0:
                return f"({power})"
            return f"({self._constant(1)}/{text if exponent == -1 else f'({power})'})"
        return f"{text}**{self._constant(exponent)}"

    def _print_Mul(self, expr: Any) -> str:
        coefficient, rest = expr.as_coeff_Mul()
        if coefficient == -1:
            return f"(-{self._print(rest)})"
        inverse = [f for f in expr.args if f.is_Pow and f.exp.is_Integer and f.exp < 0]
        factors = [self._print(f) for f in expr.args if f not in inverse]
        text = "*".join(factors) or self._constant(1)
        for f in inverse:
            text += f"/{self._print(sympy.Pow(f.base, -f.exp))}"
        return f"({text})"

    def _print_Add(self, expr: Any, order: Any = None) -> str:
        """Print a sum with its products fused into multiply-adds, innermost first.

        The fusion is written out because the compiler, left to itself, fuses differently for one lane
        than for many, and the last bit of the result would depend on it.
        """
        products = [term for term in expr.args if _is_plain_product(term)]
        text = " + ".join(self._print(term) for term in expr.args if term not in products)
        for product in products:
            coefficient, rest = product.as_coeff_Mul()
            if coefficient == -1 and rest.is_Mul:
                first, others = rest.args[0], rest.args[1:]
                left, right = f"-{self._print(first)}", self._print(sympy.Mul(*others, evaluate=False))
            else:
                first, others = product.args[0], product.args[1:]
                left, right = self._print(first), self._print(sympy.Mul(*others, evaluate=False))
            text = f"_fma({left}, {right}, {text})" if text else f"({left})*{right}"
        return f"({text})"

    def _print_WherePositive(self, expr: Any) -> str:
        condition, then, otherwise = (self._print(arg) for arg in expr.args)
        return f"({then} if {condition} > {self._constant(0)} else {otherwise})"

    def _print_TableValue(self, expr: Any) -> str:
        name, x = (self._print(arg) for arg in expr.args[:2])
        order, column, columns = map(int, expr.args[2:])
        return f"_table{order}(t, {name}, {x}, {4 * column}, {4 * columns})"

    def _print_Function(self, expr: Any) -> str:
        name = expr.func.__name__
        known = {**_NATIVE, **_OWN}
        return f"{known[name]}({', '.join(self._print(arg) for arg in expr.args)})"

    _print_sin = _print_cos = _print_tan = _print_tanh = _print_Function
    _print_exp = _print_log = _print_atan = _print_Function


def kernel_source(
    equations: Callable[..., Sequence[Any]],
    states: Sequence[str],
    inputs: Sequence[str],
    parameters: Sequence[str],
    title: str,
    signals: Callable[..., Sequence[Any]] | None = None,
    constants: Mapping[str, Any] | None = None,
) -> str:
    """Write the kernels of some equations of motion.

    Parameters
    ----------
    equations : callable
        ``f(x, u, speed, curvature, cant, p)`` as in :mod:`railenv.equations`.
    states, inputs, parameters : sequence of str
        Names, in the order in which the buffer's rows hold them.
    title : str
        What the equations describe, for the text's first line.
    signals : callable, optional
        Further results, of the same arguments as the equations; they get a function ``signals(w, t)``.
    constants : mapping of str to Any, optional
        Further names that the text defines.

    Returns
    -------
    str
        A Python module, not yet complete: see :mod:`railenv.kernels.loader`.
    """
    graph = trace(equations, states, inputs, parameters, signals)
    jacobian, by_parameter = differentiate(graph), differentiate(graph, graph.parameters)
    layout = Layout(
        len(states),
        len(inputs),
        len(parameters),
        len(jacobian.entries),
        len(graph.signals),
        len(by_parameter.entries),
    )
    functions = [_function("rhs", graph, (), graph.outputs, range(layout.dx, layout.work))]
    for name, derivative, rows in (
        ("jacobian", jacobian, range(layout.j, layout.q)),
        ("parameter_jacobian", by_parameter, range(layout.q, layout.all_rows)),
    ):
        functions.append(_function(name, graph, derivative.assignments, derivative.values, rows))
    if graph.signals:
        functions.append(_function("signals", graph, (), graph.signals, range(layout.o, layout.j)))
    return "\n".join(
        [
            f'"""Kernels of the {title}."""',
            f"STATES = {tuple(states)!r}",
            f"INPUTS = {tuple(inputs)!r}",
            f"PARAMETERS = {tuple(parameters)!r}",
            f"N_SIGNALS = {len(graph.signals)}",
            f"CELLS = {jacobian.cells!r}  # (row, column) of each nonzero entry of the Jacobian",
            f"PARAMETER_CELLS = {by_parameter.cells!r}  # of the derivatives by the parameters",
            *(f"{name} = {value!r}" for name, value in (constants or {}).items()),
            "",
            *functions,
        ]
    )


def _function(
    name: str,
    graph: Graph,
    further: Sequence[Assignment],
    values: Sequence[sympy.Expr],
    rows: range,
) -> str:
    """Write a function that stores some values in rows of the buffer.

    The values start from the assignments of the graph, and ``further`` ones.
    """
    printer = _KernelPrinter()
    assignments = needed([*graph.assignments, *further], values)
    body = [f"{symbol} = {printer.doprint(value)}" for symbol, value in assignments]
    results = list(zip(rows, values, strict=True))
    stores = [f"w[{row}*L + lane] = {printer.doprint(value)}" for row, value in results]
    used = {s for _, value in (*assignments, *results) for s in value.free_symbols}
    own = enumerate((*graph.states, *graph.inputs, *graph.conditions, *graph.parameters))
    loads = [f"{symbol} = w[{row}*L + lane]" for row, symbol in own if symbol in used]
    constants = [f"{k} = real({value!r})" for value, k in printer.constants.items()]
    return "\n".join(
        [
            "",
            "@jit",
            f"def {name}(w, t):",
            *(f"    {line}" for line in constants),
            "    for lane in range(L):",
            *(f"        {line}" for line in (*loads, *body, *stores) or ("pass",)),
            "",
        ]
    )
