"""Studies over many cells, in parallel with joblib: with progress, kept on disk and continued.

A cell is one set of values. A function takes a batch of cells and returns a record for each. Batches
run in processes of this machine, or on a dask or ray cluster that ``joblib.parallel_config`` selects.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import joblib

from design.studies.store import Record, Store
from railenv.errors import ParameterError

Cell = TypeVar("Cell")

_WAVE = 4  # batches per worker given at once to a backend that returns only whole lists


@dataclass(frozen=True)
class Study:
    """The results of a study.

    Attributes
    ----------
    records : tuple of (dict or None)
        One for each cell; None if it was not computed.
    ended : str or None
        Reason why not all cells were computed.
    """

    records: tuple[Record | None, ...]
    ended: str | None


def run_study(
    function: Callable[[Sequence[Cell]], Sequence[Record]],
    cells: Sequence[Cell],
    *,
    batches: Sequence[Sequence[int]] | None = None,
    store: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    n_jobs: int | None = -1,
    progress: bool = False,
    title: str = "study",
) -> Study:
    """Compute a function for many cells, in parallel.

    Parameters
    ----------
    function : callable
        Takes some cells and returns a record for each: a dict of finite numbers, strings, None and
        lists of these.
    cells : sequence
    batches : sequence of sequences of int, optional
        Indices of the cells that go to the function together; each alone when left out. Results arrive,
        and are stored, by batches.
    store : path, optional
        File to which results are appended as they arrive; results in it are not computed again.
    settings : mapping, optional
        Everything on which the results depend; needed for a store, which rejects other settings.
    n_jobs : int or None
        Number of workers; -1 for all available (processors of this machine, or workers of a cluster),
        None for the number in ``joblib.parallel_config``.
    progress : bool
        Show a progress bar.
    title : str
        Title of the progress bar.

    Returns
    -------
    Study
        The results; after an interrupt (Ctrl-C), those of the finished cells.

    Raises
    ------
    ParameterError
        If the store has other settings.
    """
    if n_jobs is not None and (n_jobs == 0 or int(n_jobs) != n_jobs):
        raise ParameterError(f"n_jobs is {n_jobs!r}; it must be None or an integer other than 0")
    kept = None if store is None else _opened(store, settings)
    done: dict[int, Record] = {} if kept is None else dict(kept.records)
    groups = [[i] for i in range(len(cells))] if batches is None else batches
    todo = [left for group in groups if (left := [i for i in group if i not in done])]
    ended: str | None = None
    with _bar(progress, title, len(cells), len(done)) as advance:
        try:
            with closing(_results(function, cells, todo, n_jobs)) as results:
                for found in results:
                    if kept is not None:
                        kept.add(found)
                    done.update(found)
                    advance(len(found))
        except KeyboardInterrupt:
            ended = f"interrupted after {len(done)} of {len(cells)} cells"
    return Study(tuple(done.get(i) for i in range(len(cells))), ended)


def _opened(store: str | Path, settings: Mapping[str, Any] | None) -> Store:
    if settings is None:
        raise ParameterError("settings is None; a store needs them, to know what it holds")
    return Store(store, settings)


def _results(
    function: Callable[[Sequence[Cell]], Sequence[Record]],
    cells: Sequence[Cell],
    todo: Sequence[Sequence[int]],
    n_jobs: int | None,
) -> Generator[dict[int, Record], None, None]:
    """Yield the records of each batch as it finishes, in any order."""
    tasks = [joblib.delayed(_batch)(function, group, [cells[i] for i in group]) for group in todo]
    backend, _ = joblib.parallel.get_active_backend()
    if backend.supports_return_generator:
        parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator_unordered", batch_size=1)
        with closing(parallel(tasks)) as results:
            yield from results
        return
    parallel = joblib.Parallel(n_jobs=n_jobs)  # as on ray, where results come as whole lists
    wave = _WAVE * joblib.effective_n_jobs(n_jobs)
    for first in range(0, len(tasks), wave):
        yield from parallel(tasks[first : first + wave])


def _batch(
    function: Callable[[Sequence[Cell]], Sequence[Record]], group: Sequence[int], cells: list[Cell]
) -> dict[int, Record]:
    return dict(zip(group, function(cells), strict=True))


@contextmanager
def _bar(shown: bool, title: str, total: int, done: int) -> Iterator[Callable[[int], None]]:
    if not shown:
        yield lambda count: None
        return
    from rich.progress import Progress

    with Progress() as bar:
        task = bar.add_task(title, total=total, completed=done)
        yield lambda count: bar.advance(task, count)
