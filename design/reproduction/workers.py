"""Computes pieces in several processes, each result stored by the process that computed it."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import traceback
from collections import deque
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from design.reproduction.store import Piece, Store
from railenv.errors import RailenvError


class WorkerError(RailenvError):
    """A computation failed in another process; the message holds its traceback."""


def compute(pieces: Sequence[Piece], store: Store, jobs: int) -> Iterator[Piece]:
    """Compute pieces and store their results; yields a piece when it begins, or (several jobs) is done.

    Half of the processes begin at the end of the list, so that models at either end of it have their
    kernels compiled at the same time, each once.

    Parameters
    ----------
    pieces : sequence of Piece
        With several jobs their functions must be importable, and so must the main module.
    store : Store
    jobs : int
        Number of processes; 1 computes in this one.

    Raises
    ------
    WorkerError
        If a computation fails in another process.
    """
    if jobs == 1 or len(pieces) < 2:
        for piece in pieces:
            yield piece
            store.save(piece, piece.function(**piece.inputs))
        return
    grouped = sorted(pieces, key=lambda p: type(p.inputs.get("model")).__name__)  # stable
    waiting = deque(grouped)
    context = multiprocessing.get_context("spawn")
    workers: dict[Connection, tuple[Any, bool]] = {}
    try:
        for i in range(min(jobs, len(pieces))):
            ours, theirs = context.Pipe()
            process = context.Process(target=_work, args=(theirs, store.directory), daemon=True)
            process.start()
            theirs.close()
            workers[ours] = (process, bool(i % 2))
            ours.send(waiting.pop() if i % 2 else waiting.popleft())
        for _ in pieces:
            (ready, *_rest) = wait(list(workers))
            assert isinstance(ready, Connection)
            piece, failure = _received(ready)
            if failure:
                raise WorkerError(f"{piece.name} failed in another process:\n{failure}")
            if waiting:
                ready.send(waiting.pop() if workers[ready][1] else waiting.popleft())
            yield piece
    finally:
        for connection, (process, _) in workers.items():
            connection.close()
            process.terminate()
            process.join()


def _received(connection: Connection) -> tuple[Piece, str]:
    try:
        found: tuple[Piece, str] = connection.recv()
    except EOFError:
        raise WorkerError(
            "a process of the report ended without a result, as one does that is killed for its "
            "memory; run the same command again to go on, with --jobs 1 if it happens again"
        ) from None
    return found


def _work(connection: Connection, directory: Path) -> None:
    """Compute pieces as they come, until the other end is closed."""
    import numba

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    numba.set_num_threads(1)  # the other processes use the other cores
    store = Store(directory)
    while True:
        try:
            piece = connection.recv()
        except EOFError:
            return
        try:
            store.save(piece, piece.function(**piece.inputs))
            failure = ""
        except Exception:
            failure = traceback.format_exc()
        with contextlib.suppress(BrokenPipeError):  # the parent was killed; what is stored stays
            connection.send((piece, failure))
