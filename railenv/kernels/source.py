"""Python source of a model's kernels, written from its expression graph.

The text defines ``rhs(w, t)``, ``jacobian(w, t)`` and ``parameter_jacobian(w, t)`` over one flat
buffer ``w[row * L + lane]``; what the rows hold is said by :class:`Layout`. ``t`` holds the tables, see
:mod:`railenv.tables`. It is completed by ``railenv/kernels/texts`` and compiled by
:mod:`railenv.kernels.loader`. With L = 1 the same text is the scalar kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

import sympy
from sympy.printing.pycode import PythonCodePrinter

from railenv.equations.symbolic import TableValue
from railenv.kernels.graph import Assignment, Graph, differentiate, needed, trace
from railenv.kernels.layout import Layout
from railenv.tables import names_of, width

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
        where = ", ".join(names_of(str(expr.args[0])))
        order, column, columns = map(int, expr.args[2:])
        return f"_table{order}(t, {where}, {self._print(expr.args[1])}, {column}, {width(columns)})"

    def _print__Cell(self, expr: Any) -> str:
        start, first, per, last = names_of(str(expr.args[0]))
        x, size = self._print(expr.args[1]), int(expr.args[2])
        if len(expr.args) == 3:
            return f"_fma(real({size}), _cell({x}, {first}, {per}, {last}), {start})"
        return f"({x} - {first})*{per} - _cell({x}, {first}, {per}, {last})"

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
    sites: Sequence[str] = (),
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
    sites : sequence of str
        Names of further numbers that equations read, behind the parameters: the track at each body's
        place. No derivatives are taken by them.

    Returns
    -------
    str
        A Python module, not yet complete: see :mod:`railenv.kernels.loader`.
    """
    graph = trace(equations, states, inputs, (*parameters, *sites), signals)
    jacobian = differentiate(graph)
    by_parameter = differentiate(graph, graph.parameters[: len(parameters)])
    lookups = _lookups(graph)
    layout = Layout(
        len(states),
        len(inputs),
        len(parameters),
        len(jacobian.entries),
        len(graph.signals),
        len(by_parameter.entries),
        lookups.n_rows,
        len(sites),
    )
    rows = lookups.numbered(layout.lookups)
    functions = [_function("rhs", graph, (), graph.outputs, range(layout.dx, layout.work), rows)]
    for name, derivative, stored in (
        ("jacobian", jacobian, range(layout.j, layout.q)),
        ("parameter_jacobian", by_parameter, range(layout.q, layout.all_rows)),
    ):
        functions.append(_function(name, graph, derivative.assignments, derivative.values, stored))
    if graph.signals:
        functions.append(
            _function("signals", graph, (), graph.signals, range(layout.o, layout.j), rows)
        )
    return "\n".join(
        [
            f'"""Kernels of the {title}."""',
            f"STATES = {tuple(states)!r}",
            f"INPUTS = {tuple(inputs)!r}",
            f"PARAMETERS = {tuple(parameters)!r}",
            f"SITES = {tuple(sites)!r}",
            f"N_SIGNALS = {len(graph.signals)}",
            f"N_LOOKUPS = {lookups.n_rows}",
            f"CELLS = {jacobian.cells!r}  # (row, column) of each nonzero entry of the Jacobian",
            f"PARAMETER_CELLS = {by_parameter.cells!r}  # of the derivatives by the parameters",
            *(f"{name} = {value!r}" for name, value in (constants or {}).items()),
            "",
            *functions,
        ]
    )


@dataclass(frozen=True)
class _Lookups:
    """What the equations look up in tables, and the rows of the buffer that hold it.

    Lanes look up one after the other, in a loop of their own, so that the other loops vectorise.

    Attributes
    ----------
    groups : dict
        For each table, number of its columns and argument: symbol, order and column of each value.
    rows : dict
        Row of the cell of each argument and of the place within it, and of each value's symbol.
    """

    groups: dict[tuple[Any, Any, int], list[tuple[sympy.Symbol, int, int]]]
    rows: dict[Any, int]

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return len(self._named())

    def _named(self) -> list[Any]:
        """Return what has a row: cells and places within them, values.

        Columns of a table with several are looked up together, so all of them have rows.
        """
        named: list[Any] = []
        for group, values in self.groups.items():
            columns = range(group[2]) if group[2] > 1 else ()
            named += [(group, part) for part in ("cell", "within", *columns)]
            named += [symbol for symbol, order, _ in values if order > 0 or not columns]
        return named

    def numbered(self, first: int) -> _Lookups:
        """Return the lookups with their rows, from the first one on."""
        rows = {name: first + i for i, name in enumerate(self._named())}
        for group, values in self.groups.items():
            rows |= {
                symbol: rows[group, c]
                for symbol, order, c in values
                if (group, c) in rows and not order
            }
        return _Lookups(self.groups, rows)


def _lookups(graph: Graph) -> _Lookups:
    groups: dict[tuple[Any, Any, int], list[tuple[sympy.Symbol, int, int]]] = {}
    for symbol, value in graph.assignments:
        if isinstance(value, TableValue):
            name, x, order, column, columns = value.args
            groups.setdefault((name, x, int(columns)), []).append((symbol, int(order), int(column)))
    return _Lookups(groups, {})


def _function(
    name: str,
    graph: Graph,
    further: Sequence[Assignment],
    values: Sequence[sympy.Expr],
    rows: range,
    lookups: _Lookups | None = None,
) -> str:
    """Write a function that stores some values in rows of the buffer.

    The values start from the assignments of the graph, and ``further`` ones. With ``lookups``, what is
    looked up in tables passes through rows of the buffer, and lanes do it one after the other.
    """
    printer = _KernelPrinter()
    every = [*graph.assignments, *further]
    where = dict(zip((*graph.states, *graph.inputs, *graph.conditions, *graph.parameters), count()))
    stages = []
    if lookups is not None:
        computed = [(s, e) for s, e in every if s not in lookups.rows]
        for groups in _in_turn(lookups, needed(every, values), computed):
            cells, places = _cells(lookups, groups)
            stages.append(_loop(printer, computed, cells, places, where))
            stages.append(_lookup_loop(lookups, groups, where))
            where |= {
                symbol: lookups.rows[symbol] for g in groups for symbol, _, _ in lookups.groups[g]
            }
        every = computed
    stages.append(_loop(printer, every, values, rows, where))
    constants = [f"{k} = real({value!r})" for value, k in printer.constants.items()]
    body = [line for stage in stages for line in stage]
    text = [f"    {line}" for line in (*constants, "rows = _rows(w)", *body)]
    return "\n".join(["", "@jit", f"def {name}(w, t):", *text, ""])


def _loop(
    printer: _KernelPrinter,
    assignments: Sequence[Assignment],
    values: Sequence[sympy.Expr],
    rows: Sequence[int],
    where: Mapping[sympy.Symbol, int],
) -> list[str]:
    """Write the loop over the lanes that computes some values and stores them in rows."""
    kept = needed(assignments, values)
    body = [f"{symbol} = {printer.doprint(value)}" for symbol, value in kept]
    results = list(zip(rows, values, strict=True))
    stores = [f"_write(rows, {row}*L + lane, {printer.doprint(value)})" for row, value in results]
    used = {s for _, value in (*kept, *results) for s in value.free_symbols}
    for table in {e.args[0] for _, v in (*kept, *results) for e in v.atoms(TableValue, _Cell)}:
        used |= {sympy.Symbol(name) for name in names_of(str(table))}
    loads = [
        f"{symbol} = _read(rows, {row}*L + lane)" for symbol, row in where.items() if symbol in used
    ]
    return ["for lane in range(L):", *(f"    {line}" for line in (*loads, *body, *stores) or ("pass",))]


def _in_turn(
    lookups: _Lookups, wanted: Sequence[Assignment], computed: Sequence[Assignment]
) -> list[list[tuple[Any, Any, int]]]:
    """Return the lookups that are wanted, those first whose arguments need no lookup."""
    symbols = {symbol for symbol, _ in wanted}
    left = {
        group: {s for _, value in needed(computed, [group[1]]) for s in value.free_symbols} | {group[1]}
        for group, values in lookups.groups.items()
        if any(symbol in symbols for symbol, _, _ in values)
    }
    waiting = {symbol: group for group in left for symbol, _, _ in lookups.groups[group]}
    turns = []
    while left:
        ready = [g for g, before in left.items() if not any(waiting.get(s) in left for s in before)]
        turns.append(ready)
        left = {g: before for g, before in left.items() if g not in ready}
    return turns


class _Cell(sympy.Function):
    """``_Cell(t, x, n)`` is the first coefficient of the cell of ``x``.

    With a fourth argument it is the place within the cell.
    """


def _cells(
    lookups: _Lookups, groups: Sequence[tuple[Any, Any, int]]
) -> tuple[list[sympy.Expr], list[int]]:
    """Return the cells in which some arguments lie and the places within, and the rows for them."""
    values, rows = [], []
    for group in groups:
        name, x, columns = group
        size = 4 * width(columns)
        values += [_Cell(name, x, size), _Cell(name, x, size, 1)]
        rows += [lookups.rows[group, "cell"], lookups.rows[group, "within"]]
    return values, rows


def _lookup_loop(
    lookups: _Lookups, groups: Sequence[tuple[Any, Any, int]], where: Mapping[sympy.Symbol, int]
) -> list[str]:
    """Write the loop that looks up the values of some arguments, lane by lane."""
    together, apart = [], []
    for group in groups:
        name, _, columns = group
        cell, within = (lookups.rows[group, part] for part in ("cell", "within"))
        per = f"w[{where[sympy.Symbol(names_of(str(name))[2])]}*L + lane]"
        if columns > 1:
            first = lookups.rows[group, 0]
            together.append(f"_look_up(w, t, lane, {cell}, {within}, {first}, {columns})")
        apart.append(f"c, s = int(w[{cell}*L + lane]), w[{within}*L + lane]")
        for symbol, order, column in lookups.groups[group]:
            if columns == 1 or order > 0:
                value = f"_cubic{order}(t, c + {column}, s, {per}, {width(columns)})"
                apart.append(f"w[{lookups.rows[symbol]}*L + lane] = {value}")
        if not apart[-1].startswith("w"):
            apart.pop()
    lines = []
    if together:
        lines += ["for lane in range(0, L, AT_ONCE):", *(f"    {line}" for line in together)]
    if apart:
        lines += ["for lane in range(L):", *(f"    {line}" for line in apart)]
    return lines
