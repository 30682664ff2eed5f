"""The run of a report: compute missing pieces, then write the report with figures and data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from joblib.externals.loky.process_executor import BrokenProcessPool
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from design.reproduction.document import Part, page
from design.reproduction.section import Data, Section
from design.reproduction.store import Piece, Results, Store
from design.reproduction.workers import compute, write
from railenv.errors import ParameterError, RailenvError
from railenv.files import write_whole

Update = Callable[..., None]
"""Update of the progress bar; takes ``advance`` and ``description``."""

STORE = "pieces"
"""Folder of the stored computations, in the directory of the report."""


class Interrupted(RailenvError):
    """The run was stopped before the report was written."""


@dataclass(frozen=True)
class Report:
    """A finished report.

    Attributes
    ----------
    path : Path
        The HTML file.
    files : tuple of Path
        Figures and data beside it.
    data : mapping
        Results of all pieces, by name.
    computed, kept : int
        Pieces computed in this run, and taken from an earlier one.
    """

    path: Path
    files: tuple[Path, ...]
    data: Data
    computed: int
    kept: int


def reproduce(
    sections: Sequence[Section],
    directory: Path,
    *,
    note: str = "",
    fresh: bool = False,
    jobs: int = 1,
    console: Console | None = None,
) -> Report:
    """Write a report of some sections into a directory.

    Pieces that were computed before, with the same inputs and the same code, are not computed again.
    Each is stored as soon as it is done, so that a killed run continues where it stopped.

    Parameters
    ----------
    sections : sequence of Section
    directory : Path
        Directory for ``report.html``, ``figures``, ``data`` and the stored pieces.
    note : str
        Note about the run at the top of the report.
    fresh : bool
        Ignore earlier results.
    jobs : int
        Number of processes that compute, and then draw.
    console : rich.console.Console, optional
        Console that shows the progress; none when left out.

    Raises
    ------
    Interrupted
        On Ctrl-C, or if one of several processes is killed; finished results are kept.
    """
    if jobs < 1:
        raise ParameterError(f"jobs is {jobs}; it must be at least 1")
    store = Store(directory / STORE)
    if fresh:
        store.clear()
    pieces = list({piece.name: piece for s in sections for piece in s.pieces()}.values())
    missing = [piece for piece in pieces if not store.has(piece)]
    with _bar(console) as bar:
        task = bar.add_task("", total=len(pieces) + len(sections), completed=len(pieces) - len(missing))
        update = partial(bar.update, task)
        try:
            _compute(missing, store, jobs, update)
            data = Results(store, pieces)
            parts, files = _write(sections, data, directory, jobs, update)
        except (KeyboardInterrupt, BrokenProcessPool) as error:
            raise _interrupted(error, store, pieces) from None
    path = directory / "report.html"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, page(parts, note))
    return Report(path, tuple(files), data, len(missing), len(pieces) - len(missing))


def _bar(console: Console | None) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console or Console(quiet=True),
        transient=True,
    )


def _compute(missing: Sequence[Piece], store: Store, jobs: int, update: Update) -> None:
    """Compute the missing pieces into the store."""
    update(description="computing (kernels are compiled once)")
    with closing(compute(missing, store, jobs)) as computed:
        for piece in computed:
            update(advance=1, description=f"done: {piece.label or piece.name}")


def _write(
    sections: Sequence[Section], data: Results, directory: Path, jobs: int, update: Update
) -> tuple[list[Part], list[Path]]:
    """Write figures and data of all sections; return their parts of the page, and the files."""
    parts: list[Part] = []
    files: list[Path] = []
    update(description="writing")
    with closing(write(sections, data, directory, jobs)) as done:
        for part, written in done:
            parts.append(part)
            files += written
            update(advance=1, description=f"written: {part.title}")
    return parts, files


def _interrupted(error: BaseException, store: Store, pieces: Sequence[Piece]) -> Interrupted:
    stored = sum(store.has(piece) for piece in pieces)
    what = "interrupted" if isinstance(error, KeyboardInterrupt) else "a process was killed"
    return Interrupted(
        f"{what} with {stored} of {len(pieces)} computations done; they are kept in "
        f"{store.directory}. Run the same command again, without --fresh, to go on"
    )
