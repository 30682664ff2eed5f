"""Kernels beside a C build of the same assignments: ``python -m benchmarks.c_build``.

A model's graph is printed as C: the same operations in the same order on the same buffer, completed by
``c_build.c``, which has the same integrator and the same branch-free tangent, sine and cosine (calls
of the C library would keep gcc from vectorising). ``FLAGS`` allow what Numba's compiler is allowed;
further sets of flags are tried, and the fastest build counts. gcc may fuse more products and sums than
the text does, except in the build ``UNFUSED``, whose results are those of Numba to the bit.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from rich.console import Console

import railenv
from benchmarks.plant import CANT, RADIUS, REPETITIONS, SPEED, STEP, curving_state
from benchmarks.table import Row, number, terminal
from benchmarks.timing import Action, shortest
from railenv.kernels import buffers, loader
from railenv.kernels.graph import Graph, needed, trace
from railenv.kernels.layout import Layout
from railenv.kernels.source import _KernelPrinter

Array = NDArray[np.float64]

COMPILER = "gcc"
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC")
UNFUSED = ("-ffp-contract=off",)
FURTHER_FLAGS: tuple[tuple[str, ...], ...] = (
    (),
    UNFUSED,
    ("-mprefer-vector-width=256",),
    ("-mprefer-vector-width=512", "-fschedule-insns", "-fsched-pressure"),
)

CASES = (  # name, lanes, systems, steps (a fraction of a millisecond)
    ("float64 lanes", loader.LANES["float64"], 64, 40),
    ("scalar kernel", loader.SCALAR, 1, 1000),
)
SMALLEST_SHARE = 0.9  # of the rate of C, in lanes
TOLERANCE = 1e-12
CHECKED_STEPS = 40

_TEXT = Path(__file__).with_suffix(".c")
_GOES_HERE = "/* --- right-hand side goes here --- */\n"


class _CPrinter(_KernelPrinter):
    """Prints the same text as for Numba where that is C already, and C where it is not."""

    def _constant(self, value: Any) -> str:
        return f"({float(value)!r})"

    def _print_Pow(self, expr: Any, **keywords: Any) -> str:
        base, exponent = expr.args
        if exponent == sympy.Rational(1, 2):
            return f"sqrt({self._print(base)})"
        text = super()._print_Pow(expr, **keywords)
        if "**" in text:
            return f"pow({self._print(base)}, {self._constant(exponent)})"
        return text

    def _print_WherePositive(self, expr: Any) -> str:
        condition, then, otherwise = (self._print(arg) for arg in expr.args)
        return f"({condition} > 0.0 ? {then} : {otherwise})"

    def _print_Function(self, expr: Any) -> str:
        return super()._print_Function(expr).removeprefix("math.")

    _print_sin = _print_cos = _print_tan = _print_tanh = _print_Function
    _print_exp = _print_log = _print_atan = _print_Function


def graph_of(model: railenv.Model) -> Graph:
    """Trace a model's equations, as its kernels were."""
    names = (*model.parameters, *model.site_names)
    return trace(model.equations, model.state_names, model.input_names, names)


def c_source(graph: Graph, layout: Layout, lanes: int) -> str:
    """Write the C text: right-hand side and RK4 on buffers of ``layout.j`` rows, as batches have."""
    printer = _CPrinter()
    assignments = needed(graph.assignments, graph.outputs)
    used = {s for value in (*(v for _, v in assignments), *graph.outputs) for s in value.free_symbols}
    rows = enumerate((*graph.states, *graph.inputs, *graph.conditions, *graph.parameters))
    lines = [
        *(f"double {symbol} = w[{row}*L + lane];" for row, symbol in rows if symbol in used),
        *(f"double {symbol} = {printer.doprint(value)};" for symbol, value in assignments),
        *(f"w[{layout.dx + i}*L + lane] = {printer.doprint(v)};" for i, v in enumerate(graph.outputs)),
    ]
    constants = {
        "L": lanes,
        "NX": layout.n_states,
        "DX": layout.dx,
        "X0": layout.work,
        "ACC": layout.work + layout.n_states,
        "WIDTH": layout.j,
    }
    body = "\n".join(f"        {line}" for line in lines)
    before, after = _TEXT.read_text(encoding="utf-8").split(_GOES_HERE)
    return "\n".join(
        [
            "#include <math.h>",
            *(f"#define {name} {value}" for name, value in constants.items()),
            before,
            "static void rhs(double *restrict w)\n{",
            "#pragma GCC ivdep",  # rows of different lanes never overlap
            f"    for (int lane = 0; lane < L; lane++) {{\n{body}\n    }}\n}}",
            after,
        ]
    )


def available() -> bool:
    """Whether there is a compiler to compare with."""
    return shutil.which(COMPILER) is not None


@dataclass(frozen=True)
class CKernels:
    """Compiled C; the functions take a contiguous array of blocks."""

    library: ctypes.CDLL

    def rhs_blocks(self, blocks: Array) -> None:
        self.library.rhs_blocks(ctypes.c_void_p(blocks.ctypes.data), ctypes.c_long(len(blocks)))

    def rk4_blocks(self, blocks: Array, h: float, steps: int) -> None:
        self.library.rk4_blocks(
            ctypes.c_void_p(blocks.ctypes.data),
            ctypes.c_long(len(blocks)),
            ctypes.c_double(h),
            ctypes.c_long(steps),
        )


@dataclass(frozen=True)
class OurKernels:
    """A model's kernels under the same names, on one thread."""

    kernels: Any

    def rhs_blocks(self, blocks: Array) -> None:
        self.kernels.rhs_blocks(blocks, _NO_TABLES)

    def rk4_blocks(self, blocks: Array, h: float, steps: int) -> None:
        self.kernels.rk4_blocks(blocks, _NO_TABLES, h, steps, np.zeros(1, dtype=np.int64))


_NO_TABLES = None


def compiled(text: str, flags: Sequence[str] = ()) -> CKernels:
    """Compile a C text and load it."""
    with tempfile.TemporaryDirectory() as directory:
        source, library = Path(directory, "kernel.c"), Path(directory, "kernel.so")
        source.write_text(text, encoding="utf-8")
        command = [COMPILER, *FLAGS, *flags, "-o", str(library), str(source), "-lm"]
        subprocess.run(command, check=True, capture_output=True, text=True)
        return CKernels(ctypes.CDLL(str(library)))


def blocks_of(model: railenv.Model, lanes: int, n: int) -> Array:
    """Return buffers of n systems in different states on the curve, aligned for vectors."""
    layout = model.kernels(lanes).LAYOUT
    values = np.zeros((n, layout.j))
    values[:, : layout.u] = np.outer(np.linspace(0.99, 1.01, n), curving_state(model))
    values[:, layout.c : layout.p] = SPEED, 1.0 / RADIUS, CANT
    values[:, layout.p : layout.dx] = model.rows()[0]
    in_lanes = values.reshape(-1, lanes, layout.j).transpose(0, 2, 1).reshape(-1, layout.j * lanes)
    blocks = buffers.zeros(in_lanes.shape)
    blocks[:] = in_lanes
    return blocks


def disagreement(model: railenv.Model, c: CKernels, lanes: int, blocks: Array) -> float:
    """Largest difference between kernel and C in derivatives, and in states after some steps.

    It is a share of the largest magnitude of the state or derivative over the systems.
    """
    kernels = OurKernels(model.kernels(lanes))
    layout, found = kernels.kernels.LAYOUT, 0.0
    cases: tuple[tuple[int, str, tuple[float, ...]], ...] = (
        (layout.dx, "rhs_blocks", ()),
        (layout.x, "rk4_blocks", (STEP, CHECKED_STEPS)),
    )
    for row, function, arguments in cases:
        results = []
        for k in (kernels, c):
            w = blocks.copy()
            getattr(k, function)(w, *arguments)
            results.append(w.reshape(-1, layout.j, lanes)[:, row : row + layout.n_states])
        ours, theirs = results
        size = abs(ours).max(axis=(0, 2))
        apart = abs(ours - theirs).max(axis=(0, 2)) / np.where(size > 0.0, size, 1.0)
        if not np.isfinite(apart).all():
            return np.inf
        found = max(found, float(apart.max()))
    return found


def builds(text: str) -> Iterator[tuple[str, CKernels]]:
    """Compile a C text with each set of flags that this processor's compiler takes."""
    for flags in FURTHER_FLAGS:
        try:
            yield " ".join((COMPILER, "-O3", *flags)), compiled(text, flags)
        except subprocess.CalledProcessError:
            if not flags:
                raise


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    if not available():
        yield Row(f"kernels beside a C build: there is no {COMPILER} here", "", "", "")
        return
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    graph = graph_of(model)
    for case in CASES:
        yield _row(model, graph, *case)


def _row(model: railenv.Model, graph: Graph, name: str, lanes: int, n: int, steps: int) -> Row:
    kernels, w = OurKernels(model.kernels(lanes)), blocks_of(model, lanes, n)
    built = dict(builds(c_source(graph, kernels.kernels.LAYOUT, lanes)))
    for flags, c in built.items():
        apart = disagreement(model, c, lanes, w)
        if not apart <= TOLERANCE:
            raise RuntimeError(f"results of {flags} differ from the kernel's by {apart:.1e}")
    start = w.copy()

    def run(k: Any) -> None:
        w[:] = start  # one buffer for all: its place in memory matters
        k.rk4_blocks(w, STEP, steps)

    actions: list[Action] = [partial(run, k) for k in (kernels, *built.values())]
    ours, *theirs = (1e-6 * n * steps / s for s in shortest(actions, REPETITIONS))
    rate, flags = max(zip(theirs, built, strict=True))
    judged = lanes > 1
    return Row(
        f"RK4 steps of the bogie beside C, {name}, one thread",
        ours,
        "million steps/s",
        f"shortest of {REPETITIONS}",
        f"the same assignments in C, {flags}, {number(rate)}",
        ours / rate,
        f"at least {SMALLEST_SHARE:g} of C" if judged else "",
        ours / rate >= SMALLEST_SHARE if judged else None,
    )


if __name__ == "__main__":
    Console(width=150).print(terminal(rows(), "Kernels beside C"))
