"""Background work: the newest task runs in its own thread, older ones are given up."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from typing import Any, Protocol

Deliver = Callable[[Any], None]


class Runner(Protocol):
    """A runner of tasks, which delivers what they yield."""

    def start(self, task: Iterable[Any]) -> None:
        """Run a task instead of the one that runs."""

    def cancel(self) -> None:
        """Give up the task that runs, after what it is computing at the moment."""

    def close(self) -> None:
        """Stop running tasks."""


class Worker(Runner):
    """A runner of tasks in a thread.

    Parameters
    ----------
    deliver : callable
        Called in the thread with what a task yields; never for a task that was given up.
    failed : callable
        Called with an unexpected exception of a task.
    """

    def __init__(self, deliver: Deliver, failed: Callable[[Exception], None]) -> None:
        self._deliver, self._failed = deliver, failed
        self._changed = threading.Condition()
        self._waiting: Iterable[Any] | None = None
        self._number = 0
        self._open = True
        self._thread = threading.Thread(target=self._run, name="railenv explorer", daemon=True)
        self._thread.start()

    def start(self, task: Iterable[Any]) -> None:
        """Run a task instead of the one that runs."""
        with self._changed:
            self._waiting, self._number = task, self._number + 1
            self._changed.notify()

    def cancel(self) -> None:
        """Give up the task that runs, after what it is computing at the moment."""
        with self._changed:
            self._waiting, self._number = None, self._number + 1

    def close(self) -> None:
        """Stop running tasks; the thread ends after its present computation."""
        with self._changed:
            self._open, self._waiting, self._number = False, None, self._number + 1
            self._changed.notify()

    @property
    def running(self) -> bool:
        """Whether the thread is alive."""
        return self._thread.is_alive()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting is not None or not self._open)
                if not self._open:
                    return
                task, number, self._waiting = self._waiting, self._number, None
            assert task is not None
            try:
                for item in task:
                    with self._changed:
                        if number != self._number:
                            break
                        self._deliver(item)
            except Exception as error:  # the page says what happened, and goes on
                self._failed(error)


class AtOnce(Runner):
    """A runner that runs each task at once, to its end."""

    def __init__(self, deliver: Deliver) -> None:
        self._deliver = deliver

    def start(self, task: Iterable[Any]) -> None:
        """Run a task."""
        for item in task:
            self._deliver(item)

    def cancel(self) -> None:
        """Do nothing: no task is running."""

    def close(self) -> None:
        """Do nothing."""
