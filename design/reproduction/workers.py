"""Several processes, each of which stores results or writes sections."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path

import joblib

from design.reproduction.document import Part
from design.reproduction.output import write_part
from design.reproduction.section import Section
from design.reproduction.store import Piece, Results, Store


def compute(pieces: Sequence[Piece], store: Store, jobs: int) -> Generator[Piece, None, None]:
    """Compute pieces and store their results; yield each when it is done, in any order.

    Parameters
    ----------
    pieces : sequence of Piece
    store : Store
    jobs : int
        Number of processes; 1 for this one.
    """
    tasks = (joblib.delayed(_stored)(piece, store) for piece in spread(pieces))
    parallel = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)
    with closing(parallel(tasks)) as done:
        yield from done


def spread(pieces: Sequence[Piece]) -> list[Piece]:
    """Order pieces so that two processes seldom compile the same kernels at the same time.

    Kernels differ between models and, for closed loops, between the modules that compute. The first
    piece of each such kind comes before all others; closed loops, which are last in the report and
    compile longest, come first.
    """
    kinds: dict[tuple[str, str], list[Piece]] = {}
    for piece in pieces:
        kind = (piece.function.__module__, type(piece.inputs.get("model")).__name__)
        kinds.setdefault(kind, []).append(piece)
    first = [kind[0] for kind in reversed(kinds.values())]
    names = {piece.name for piece in first}
    return [*first, *(piece for piece in pieces if piece.name not in names)]


def write(
    sections: Sequence[Section], results: Results, directory: Path, jobs: int
) -> Generator[tuple[Part, list[Path]], None, None]:
    """Write sections into a directory; yield each with its files when it is done, in order.

    Parameters
    ----------
    sections : sequence of Section
    results : Results
        Results of all pieces; each process reads those it needs.
    directory : Path
    jobs : int
        Number of processes; 1 for this one.
    """
    tasks = (joblib.delayed(write_part)(section, results, directory) for section in sections)
    parallel = joblib.Parallel(n_jobs=jobs, return_as="generator", batch_size=1)
    with closing(parallel(tasks)) as done:
        yield from done


def _stored(piece: Piece, store: Store) -> Piece:
    store.save(piece, piece.function(**piece.inputs))
    return piece
