"""Measure everything and print one table: ``python -m benchmarks.run``.

Bounds are reported as holding or not and never enforced: times depend on the machine.
"""

from __future__ import annotations

import json as json_format
import platform
from pathlib import Path
from typing import Annotated

import llvmlite.binding  # type: ignore[import-untyped]
import numba
import numpy as np
import scipy
import typer
from rich.console import Console

import railenv
from benchmarks import (
    analysis,
    c_build,
    contact,
    cycles,
    environments,
    learning,
    plant,
    scaling,
    startup,
    threads,
)
from benchmarks.table import Row, markdown, records, terminal
from benchmarks.timing import processor_share
from railenv.threads import usable_threads

ABOUT = (
    "`make bench` (`python -m benchmarks.run`) measures this; `make docs` writes it to this page. "
    "Things that are compared are timed in turns. C is a build by gcc of the same assignments as in a "
    "kernel, on the same buffer and with the same tangent, sine and cosine "
    "(`python -m benchmarks.c_build`); of several sets of flags the fastest counts.",
    "`make bench-against COMMIT=main` (`python -m benchmarks.against main`) shows how a change affects "
    "the speed: it checks the commit out beside the working tree, times both in turns in one run, and "
    "flags rows that have become slower by more than 5 %. Against `HEAD`, without changes, it shows "
    "its own noise; more `--rounds` reduce it, `--only RK4` measures a part.",
)
_WIDE = 150  # columns where the output is no terminal


def circumstances(share: float) -> dict[str, str]:
    """What the numbers depend on; ``share`` is that of a processor which a busy loop had."""
    return {
        "railenv": railenv.__version__,
        "Python": platform.python_version(),
        "NumPy": np.__version__,
        "SciPy": scipy.__version__,
        "Numba": numba.__version__,
        "processor (LLVM)": llvmlite.binding.get_host_cpu_name(),
        "threads": str(usable_threads()),
        "share of a processor": f"{share:.0%}",
    }


def main(
    json: Annotated[
        Path | None, typer.Option("--json", help="Write the results to this file, too.")
    ] = None,
    table: Annotated[
        Path | None, typer.Option("--markdown", help="Write the table to this file, too.")
    ] = None,
) -> None:
    """Run the benchmarks."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=_WIDE)
    rows: list[Row] = []
    shares = [processor_share()]
    with Console(stderr=True).status("compiling what is not in the cache ...") as status:
        modules = (
            plant, contact, c_build, analysis, cycles, scaling, environments, threads, learning,
            startup,
        )  # fmt: skip
        for module in modules:
            for row in module.rows():
                rows.append(row)
                status.update(f"measured: {row.what}")
            shares.append(processor_share())
    about = circumstances(min(shares))
    title = "Benchmarks on " + ", ".join(f"{name} {value}" for name, value in about.items())
    console.print(terminal(rows, title))
    if json is not None:
        content = {"circumstances": about, "rows": records(rows)}
        text = json_format.dumps(content, indent=2, ensure_ascii=False)
        json.write_text(text + "\n", encoding="utf-8")
    if table is not None:
        table.write_text(markdown(rows, title, ABOUT), encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
