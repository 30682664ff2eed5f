"""What a first use costs: the import, and the kernels from a cold and from a warm cache."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from benchmarks.table import Row, with_unit
from benchmarks.timing import interleaved

_ROOT = Path(__file__).resolve().parent.parent
_LAZY = ("numba", "control")
_REPORT_LAZY = f"import railenv, sys; print(*[m for m in {_LAZY} if m in sys.modules])"


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    yield from _import_time()
    yield from _compiling()


def _python(*arguments: str, **variables: str) -> str:
    """Run the interpreter afresh in the project's directory and return what it prints."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=_ROOT,
        env={**os.environ, **variables},
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout


def _import_time() -> Iterator[Row]:
    limit, repetitions = 0.5, 15  # s
    actions = [partial(_python, "-c", code) for code in ("pass", "import railenv")]
    bare, full = (times.elapsed for times in interleaved(actions, repetitions))
    seconds = statistics.median(b - a for a, b in zip(bare, full, strict=True))
    yield Row(
        "import railenv, start of the interpreter taken off",
        seconds,
        "s",
        f"median of {repetitions} differences, elapsed",
        f"bare interpreter, {with_unit(statistics.median(bare), 'ms')}",
        required=f"less than {limit:g} s",
        holds=seconds < limit,
    )
    loaded = _python("-c", _REPORT_LAZY).split()
    yield Row(
        f"modules loaded by import railenv, of {' and '.join(_LAZY)}",
        ", ".join(loaded) or "none",
        "",
        "one look",
        required="none",
        holds=not loaded,
    )


def _compiling() -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as directory:
        cold, warm = (
            json.loads(_python("-m", "benchmarks.first_use", RAILENV_CACHE_DIR=directory))
            for _ in range(2)
        )
    for what, seconds in cold.items():
        yield Row(
            f"{what}, cold cache",
            seconds,
            "s",
            "one run, elapsed",
            f"warm cache, {with_unit(warm[what], 'ms')}",
            seconds / warm[what],
        )
