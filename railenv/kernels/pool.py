"""A few threads that work through the blocks of one kernel call together.

Kernels that may be shared take a counter: each thread that runs the kernel takes the next block from it
until none is left. So a thread that the operating system stops holds back one block and no more, and
results do not depend on how many threads there are. The thread that calls works too; helpers that have
not begun when it finds no more blocks are not waited for.

Numba's own threads are not used. On a busy machine they wait for each other for long, after a fork they
hang, and one of their kinds aborts the process when two threads of Python use it at once.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from functools import cache
from queue import SimpleQueue

import numpy as np
from numpy.typing import NDArray

Counter = NDArray[np.int64]
Work = Callable[[Counter], object]


def run(work: Work, threads: int) -> None:
    """Do some work on several threads, and return when all of it is done.

    Parameters
    ----------
    work : callable
        ``work(counter)`` takes pieces from the counter, an array of one number that is 0 at first,
        until none is left. It runs on several threads at once, and must give the GIL away.
    threads : int
        At most so many, the calling one included.

    Raises
    ------
    Exception
        What the work raises, on whatever thread.
    """
    job = _Job(work, threads - 1)
    if threads <= 1:
        job.work()
        return
    helpers = _helpers()
    try:
        helpers.call(job, threads - 1)
        job.work()
    finally:
        try:
            job.close()
        finally:
            job.close()  # an interrupt may have come before the first began; else this is nothing
            helpers.dismiss(job)
    if job.error is not None:
        raise job.error


class _Job:
    """Work of one call, for the calling thread and any helper that comes before it is closed."""

    def __init__(self, work: Work, places: int) -> None:
        self._work: Work | None = work
        self._counter = np.zeros(1, dtype=np.int64)
        self._lock = threading.Lock()
        self._places = places
        self._helping = 0
        self._left = threading.Lock()  # released by the last helper to leave
        self._left.acquire()
        self.error: BaseException | None = None

    def work(self) -> None:
        """Take pieces until none is left."""
        assert self._work is not None
        self._work(self._counter)

    def help(self) -> None:
        """Take pieces on another thread, unless the job is closed or has helpers enough."""
        with self._lock:
            if self._work is None or not self._places:
                return
            work = self._work
            self._places -= 1
            self._helping += 1
        try:
            work(self._counter)
        except BaseException as error:
            self.error = error
        finally:
            del work  # before the caller may go on: the arrays are its own again
            with self._lock:
                self._helping -= 1
                if self._work is None and not self._helping:
                    self._left.release()

    def close(self) -> None:
        """Let no helper begin any more, and wait for those at work.

        They are waited for in any case, or they would write where the caller goes on. So an interrupt
        from the keyboard comes when the pieces begun are done.
        """
        with self._lock:
            self._work = None
        interrupt: BaseException | None = None
        # Asked again after each interrupt: one may come when the lock has just been acquired.
        while self._helping:
            try:
                self._left.acquire()
            except BaseException as error:
                interrupt = error
        if interrupt is not None:
            raise interrupt


class _Helpers:
    """Threads that wait for jobs; started when first needed."""

    def __init__(self) -> None:
        self._jobs: list[_Job] = []
        self._calls: SimpleQueue[None] = SimpleQueue()
        self._started = 0

    def call(self, job: _Job, count: int) -> None:
        """Ask so many threads to help."""
        self._jobs.append(job)
        while self._started < count:
            # Two callers at once may start one too many, which then waits with the others.
            self._started += 1
            try:
                # A daemon: it waits for ever, and the interpreter must not wait for it at its end.
                threading.Thread(
                    target=_help, args=(self._jobs, self._calls), name="railenv-kernels", daemon=True
                ).start()
            except RuntimeError:  # no more threads are allowed, or the interpreter ends
                self._started -= 1
                break
        # Where helpers are long at work elsewhere, calls do not pile up.
        for _ in range(min(count, self._started - self._calls.qsize())):
            self._calls.put(None)

    def dismiss(self, job: _Job) -> None:
        """Forget a job that is closed."""
        self._jobs.remove(job)


def _help(jobs: list[_Job], calls: SimpleQueue[None]) -> None:
    while True:
        calls.get()
        for job in tuple(jobs):
            job.help()
            del job  # while waiting for the next call, or its arrays would live on


@cache
def _helpers() -> _Helpers:
    """Return the threads of this process.

    They are the one thing here that outlives a call. To start threads takes longer than most calls, and
    to have some for each environment would leave as many idle as there are environments.
    """
    return _Helpers()


if hasattr(os, "register_at_fork"):
    # a forked process has none of the threads, and maybe a lock that nobody will release
    os.register_at_fork(after_in_child=_helpers.cache_clear)
