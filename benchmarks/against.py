"""Compare the speed of the working tree with that of another commit, in one run.

    python -m benchmarks.against COMMIT [--rounds N]

The commit is checked out beside the working tree, and both are timed in turns on the same machine, with
the same text (``benchmarks/against_worker.py``): a disturbance meets both. Every round starts new
processes, since the speed of a kernel depends by several percent on where a process has its memory, and
gives a ratio of the two times. Flagged is what is slower both in the median of the ratios and in the
shortest times of all rounds; the range of the ratios shows how far they can be trusted. Against
``HEAD``, with nothing changed, they show the noise of the comparison itself.
"""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from benchmarks.against_worker import CASES, VECTOR_CASES, Case
from benchmarks.table import Row, markdown, terminal, with_unit
from benchmarks.timing import processor_share

ROOT = Path(__file__).resolve().parent.parent
SLOWER = 1.05  # a ratio above is flagged
LATER = 2.0  # s, for the first use
TURNS = 6  # of a round
WIDE = 150  # columns where the output is no terminal

ONE_THREAD = {"NUMBA_NUM_THREADS": "1", "RAILENV_NUM_THREADS": "1"}
"""Whichever of them a commit reads."""

_SHIPPED = ("__init__.py", "timing.py", "against_worker.py")

_IMPORT = """
import time
start = time.perf_counter()
import railenv
print(time.perf_counter() - start)
print(railenv.__file__)
"""
_FIRST_RESULT = """
import time
start = time.perf_counter()
import railenv
try:
    from railenv import design
except ImportError:
    import design
design.critical_speed(railenv.Bogie(railenv.HIGH_SPEED_COACH))
print(time.perf_counter() - start)
print(design.__file__)
"""


class Unmeasurable(Exception):
    """A commit cannot do what is to be timed."""


@dataclass
class Compared:
    """Times of one thing in every round, s: the other commit's and the working tree's."""

    what: str
    statistic: str
    turns: int = 1  # of a round; the shortest time counts
    by_difference: bool = False
    times: tuple[list[float], list[float]] = field(default_factory=lambda: ([], []))
    problem: str = ""

    def measure(self, measures: Sequence[Callable[[], float]], order: Sequence[int]) -> None:
        """Measure both sides in an order."""
        if self.problem:
            return
        try:
            seconds = [
                {side: measures[side]() for side in order[:: (1, -1)[k % 2]]} for k in range(self.turns)
            ]
        except Unmeasurable as error:
            self.problem = str(error)
            return
        for times, side in zip(self.times, (0, 1), strict=True):
            times.append(min(pair[side] for pair in seconds))

    def row(self, other: str) -> Row:
        """Return the row of the table."""
        if self.problem:
            return Row(self.what, "", "", "not measured", self.problem.splitlines()[-1])
        before, now = map(statistics.median, self.times)
        unit, scale = next(
            (unit, scale)
            for unit, scale in (("s", 1.0), ("ms", 1e3), ("µs", 1e6), ("ns", 1e9))
            if now * scale >= 0.1 or unit == "ns"
        )
        ratios = [new / old for old, new in zip(*self.times, strict=True)]
        ratio = statistics.median(ratios)
        of_shortest = min(self.times[1]) / min(self.times[0])
        later = min(now - before, min(self.times[1]) - min(self.times[0])) > LATER
        slower = min(ratio, of_shortest) > SLOWER
        return Row(
            self.what,
            now * scale,
            unit,
            f"{self.statistic}, median of {len(ratios)}",
            f"{other}, {with_unit(before, unit)}; ratios {min(ratios):.3f} to {max(ratios):.3f}, "
            f"of the shortest {of_shortest:.3f}",
            ratio,
            f"at most {LATER:g} s more" if self.by_difference else f"at most {SLOWER:g}",
            not (later if self.by_difference else slower),
        )


# ------------------------------------------------------------------------------ two trees


def git(*arguments: str) -> str:
    """Run git in the project and return what it prints."""
    done = subprocess.run(["git", *arguments], cwd=ROOT, check=False, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"git {arguments[0]}: {done.stderr.strip()}")
    return done.stdout.strip()


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """Check out a commit into a temporary directory."""
    with tempfile.TemporaryDirectory() as directory:
        tree = Path(directory, "tree").resolve()
        git("worktree", "add", "--quiet", "--detach", str(tree), commit)
        try:
            yield tree
        finally:
            git("worktree", "remove", "--force", str(tree))


def _environment(tree: Path, variables: Mapping[str, str]) -> dict[str, str]:
    """Return variables under which the interpreter imports the packages of a tree."""
    kept = {k: v for k, v in os.environ.items() if k not in ONE_THREAD}
    return {**kept, "PYTHONPATH": str(tree), "PYTHONSAFEPATH": "", **variables}


class Worker:
    """A process with the packages of one tree, which times cases when asked."""

    def __init__(self, tree: Path, shipped: Path, variables: Mapping[str, str]) -> None:
        # the directory it starts in, with this version of the worker, comes before the tree's packages
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.against_worker"],
            cwd=shipped,
            env=_environment(tree, variables),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        _check_place(self._read(), tree)

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()

    def _read(self) -> str | float:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"a worker ended with status {self._process.wait()}")
        return json.loads(line)

    def time(self, case: str) -> float:
        """Return seconds of one call."""
        assert self._process.stdin is not None
        print(json.dumps(case), file=self._process.stdin, flush=True)
        answer = self._read()
        if isinstance(answer, str):
            raise Unmeasurable(answer)
        return answer


def _check_place(file: str | float, tree: Path) -> None:
    if not Path(str(file)).resolve().is_relative_to(tree):
        raise SystemExit(f"{file} was imported in place of the package in {tree}")


def _fresh(tree: Path, code: str, **variables: str) -> float:
    """Run some code in a fresh process, and return the seconds that it prints."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tree,
        env=_environment(tree, variables),
        check=False,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise Unmeasurable(done.stderr.strip() or f"status {done.returncode}")
    seconds, file = done.stdout.splitlines()[-2:]
    _check_place(file, tree)
    return float(seconds)


def _fresh_from_cold(tree: Path) -> float:
    with tempfile.TemporaryDirectory() as directory:
        return _fresh(tree, _FIRST_RESULT, RAILENV_CACHE_DIR=directory)


# ------------------------------------------------------------------------------ the comparison


def compare(commit: str, rounds: int, first_uses: int, only: Sequence[str] = ()) -> list[Row]:
    """Time what contains a text of ``only``, or everything, in both trees."""
    short = git("rev-parse", "--short", f"{commit}^{{commit}}")
    with (
        checked_out(short) as other,
        tempfile.TemporaryDirectory() as directory,
        Console(stderr=True).status("preparing ...") as status,
    ):
        trees, shipped = (other, ROOT), Path(directory)
        (shipped / "benchmarks").mkdir()
        for name in _SHIPPED:
            shutil.copy(ROOT / "benchmarks" / name, shipped / "benchmarks" / name)
        parts = _parts(trees, shipped, first_uses, only)
        for k in range(max(rounds, first_uses)):
            for part in parts:
                if k < (rounds if part.rounds is None else part.rounds):
                    status.update(f"round {k + 1} of {rounds}: {part.name}")
                    part.turn((0, 1) if k % 2 == 0 else (1, 0))
    return [
        found.row(short) for part in parts for found in part.found if found.times[0] or found.problem
    ]


@dataclass
class Part:
    """What is measured together; ``turn`` adds a round, with the two sides in an order."""

    name: str
    found: list[Compared]
    turn: Callable[[Sequence[int]], None]
    rounds: int | None = None  # all of them


def _parts(trees: Sequence[Path], shipped: Path, first_uses: int, only: Sequence[str]) -> list[Part]:
    def chosen(what: str) -> bool:
        return not only or any(text in what for text in only)

    parts = []
    for name, cases, suffix, variables in (
        ("kernels, analysis, environments", CASES, "", {}),
        ("vector environments", VECTOR_CASES, ", threads by default", {}),
        ("vector environments on one thread", VECTOR_CASES, ", one thread", ONE_THREAD),
    ):
        named = {case: _compared(f"{case}{suffix}", cases[case]) for case in cases}
        named = {case: found for case, found in named.items() if chosen(found.what)}
        if named:
            turn = partial(_turn_of_workers, trees, shipped, variables, named)
            parts.append(Part(name, list(named.values()), turn))
    for what, measure, n in (
        ("import railenv", partial(_fresh, code=_IMPORT), None),
        ("first critical speed, kernels in the cache", partial(_fresh, code=_FIRST_RESULT), None),
        ("first critical speed, empty cache", _fresh_from_cold, first_uses),
    ):
        if chosen(what):
            found = Compared(what, "elapsed, new process", by_difference=n is not None)
            if n is None:  # compiles what is in no cache yet
                for tree in trees:
                    with suppress(Unmeasurable):  # the first round tells it
                        measure(tree)
            both = [partial(measure, tree) for tree in trees]
            parts.append(Part(what, [found], partial(found.measure, both), n))
    return parts


def _compared(what: str, case: Case) -> Compared:
    time = "shortest" if case.clock == "elapsed" else "shortest processor time"
    return Compared(what, f"{time} of {case.repetitions * TURNS}", TURNS)


def _turn_of_workers(
    trees: Sequence[Path],
    shipped: Path,
    variables: Mapping[str, str],
    named: Mapping[str, Compared],
    order: Sequence[int],
) -> None:
    with Worker(trees[0], shipped, variables) as old, Worker(trees[1], shipped, variables) as new:
        for case, found in named.items():
            found.measure([partial(worker.time, case) for worker in (old, new)], order)


def main(
    commit: Annotated[str, typer.Argument(help="What to compare the working tree with.")],
    rounds: Annotated[int, typer.Option(min=1, help="Measurements of everything.")] = 11,
    first_uses: Annotated[int, typer.Option(min=0, help="Starts with an empty cache.")] = 2,
    only: Annotated[
        list[str] | None, typer.Option(help="Measure only what contains this text; may be repeated.")
    ] = None,
    table: Annotated[
        Path | None, typer.Option("--markdown", help="Write the table to this file, too.")
    ] = None,
) -> None:
    """Compare the speed of the working tree with that of a commit."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDE)
    share = processor_share()
    rows = compare(commit, rounds, first_uses, only or ())
    slower = sum(row.holds is False for row in rows)
    title = (
        f"Working tree against {commit}, {rounds} rounds; share of a processor "
        f"{min(share, processor_share()):.0%}; slower: {slower}"
    )
    console.print(terminal(rows, title))
    if table is not None:
        table.write_text(markdown(rows, title), encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
