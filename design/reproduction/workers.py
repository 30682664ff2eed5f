"""Computes pieces in several processes; each stores what it computed."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing

import joblib

from design.reproduction.store import Piece, Store


def compute(pieces: Sequence[Piece], store: Store, jobs: int) -> Generator[Piece, None, None]:
    """Compute pieces and store their results; yields each when it is done, in any order.

    Parameters
    ----------
    pieces : sequence of Piece
    store : Store
    jobs : int
        Number of processes; 1 computes in this one.
    """
    tasks = (joblib.delayed(_stored)(piece, store) for piece in _spread(pieces))
    parallel = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)
    with closing(parallel(tasks)) as done:
        yield from done


def _spread(pieces: Sequence[Piece]) -> list[Piece]:
    """Order pieces so that two processes begin with different models: each compiles other kernels."""
    kinds: dict[str, list[Piece]] = {}
    for piece in pieces:
        kinds.setdefault(type(piece.inputs.get("model")).__name__, []).append(piece)
    first, *others = kinds.values() if kinds else [[]]
    return [*first[:1], *(piece for kind in others for piece in kind), *first[1:]]


def _stored(piece: Piece, store: Store) -> Piece:
    store.save(piece, piece.function(**piece.inputs))
    return piece
