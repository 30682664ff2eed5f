"""Number of threads of the package: for kernels, and for linear algebra with small matrices."""

from __future__ import annotations

import functools
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from railenv.errors import ParameterError, shown

MOST_THREADS = 1024
_VARIABLE = "RAILENV_NUM_THREADS"


def usable_threads() -> int:
    """Return the number of threads that kernels may use.

    ``RAILENV_NUM_THREADS`` sets it. By default it is the number of processors of the process, or fewer
    if joblib started the process beside others.

    Raises
    ------
    ParameterError
        If ``RAILENV_NUM_THREADS`` is not a whole number from 1 to 1024.
    """
    chosen = os.environ.get(_VARIABLE, "").strip()
    if chosen:
        # isdecimal alone would accept digits of other scripts
        if not (chosen.isascii() and chosen.isdecimal() and 1 <= int(chosen[:9]) <= MOST_THREADS):
            raise ParameterError(
                f"{_VARIABLE} is {shown(chosen)}; it must be a whole number from 1 to {MOST_THREADS}, "
                "or not be set"
            )
        return int(chosen)
    # joblib's limit for the libraries of its processes, so that together they use each processor once
    share = os.environ.get("NUMBA_NUM_THREADS", "")
    least = int(share) if share.isascii() and share.isdecimal() else 0
    processors = _processors()
    return min(processors, least) if least else processors


def _processors() -> int:
    """Return the number of processors that the process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS to one thread within the block.

    The matrices here have some thirty rows. On a machine with other work, threads that share so little
    take three times the processor time of a single one.
    """
    with _controller().limit(limits=1, user_api="blas"):
        yield


@functools.cache
def _controller() -> Any:
    import scipy.linalg  # noqa: F401  its BLAS must be loaded to be found
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
