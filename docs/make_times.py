"""Measure what a newcomer waits for, and write it into README and docs/reproduction.md.

    python docs/make_times.py        (a quarter of an hour and a network connection)

The last commit is cloned to a temporary directory, with an environment of its own and an empty cache of
kernels. Run it while nothing else runs.
"""

from __future__ import annotations

import os
import platform
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from blocks import refilled

DOCS = Path(__file__).resolve().parent
README, PAGE = DOCS.parent / "README.md", DOCS / "reproduction.md"


@dataclass(frozen=True)
class Step:
    """One thing that a newcomer does: its command, and what it is called on the page."""

    command: str
    what: str


INSTALL = Step("make .venv/.installed", "environment and installation, as the first `make demo` does")
DEMO = Step("make demo", "`make demo` after it, which compiles kernels")
PREPARE = Step("make .venv/.developed", "installation of what the tests need, as `make test` does")
TEST = Step("make test", "`make test` after it")
STEPS = (
    INSTALL,
    DEMO,
    Step(".venv/bin/railenv reproduce --first-page --fresh", "the same again, from nothing stored"),
    Step(".venv/bin/railenv reproduce --quick --out results/quick", "`railenv reproduce --quick`"),
    Step(".venv/bin/railenv reproduce --out results/full", "`railenv reproduce`"),
    PREPARE,
    TEST,
)


def measured() -> dict[Step, float]:
    """Do everything once, in turn; return the elapsed times, s."""
    times = {}
    with tempfile.TemporaryDirectory() as directory:
        clone = Path(directory, "railenv")
        subprocess.run(["git", "clone", "--quiet", DOCS.parent, clone], check=True)
        variables = {**os.environ, "RAILENV_CACHE_DIR": str(Path(directory, "cache"))}
        for step in STEPS:
            start = time.perf_counter()
            done = subprocess.run(
                step.command,
                shell=True,
                cwd=clone,
                env=variables,
                capture_output=True,
                text=True,
                check=False,
            )
            times[step] = time.perf_counter() - start
            if done.returncode:
                raise SystemExit(f"{step.command} failed:\n{done.stdout}\n{done.stderr}")
            print(f"{step.command}: {times[step]:.1f} s", flush=True)
    return times


def duration(seconds: float) -> str:
    """Return seconds, or minutes and seconds, for a table."""
    whole = round(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60:02d} s"


def table(times: dict[Step, float]) -> str:
    """Return the block of docs/reproduction.md."""
    about = f"Python {platform.python_version()}, {os.cpu_count()} processors:"
    lines = ["| what | elapsed |", "|---|---:|"]
    lines += [f"| {step.what} | {duration(seconds)} |" for step, seconds in times.items()]
    return "\n".join([about, "", *lines])


def sentence(times: dict[Step, float]) -> str:
    """Return the block of README."""
    return (
        f"[Measured](docs/reproduction.md#how-long-it-takes) on {os.cpu_count()} processors: "
        f"{duration(times[INSTALL])} to install with a fast network, then {duration(times[DEMO])}, "
        "of which the compilation of kernels is needed once."
    )


def main() -> None:
    """Measure, and write both pages."""
    times = measured()
    for page, name, make in ((README, "times", sentence), (PAGE, "times", table)):
        text = refilled(page.read_text(encoding="utf-8"), {name: lambda make=make: make(times)})
        page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
