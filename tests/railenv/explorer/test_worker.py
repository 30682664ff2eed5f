"""The thread beside the page."""

import queue
import threading
import time

from railenv.explorer.worker import AtOnce, Worker


class Heard:
    """What a worker delivers."""

    def __init__(self):
        self.items, self.errors = queue.Queue(), queue.Queue()
        self.worker = Worker(self.items.put, self.errors.put)

    def next(self):
        return self.items.get(timeout=20)


def test_results_come_one_after_the_other_from_another_thread():
    heard = Heard()
    heard.worker.start((k, threading.current_thread().name) for k in (1, 2))
    assert [heard.next(), heard.next()] == [(1, "railenv explorer"), (2, "railenv explorer")]
    heard.worker.close()


def test_the_newest_task_wins():
    heard, begun, go_on = Heard(), threading.Event(), threading.Event()

    def slow():
        begun.set()
        go_on.wait(20)
        yield "old"

    heard.worker.start(slow())
    assert begun.wait(20)
    heard.worker.start(iter(["skipped"]))
    heard.worker.start(iter(["new"]))
    go_on.set()
    assert heard.next() == "new"
    assert heard.items.empty()
    heard.worker.close()


def test_a_task_that_is_given_up_delivers_nothing_more():
    heard, go_on = Heard(), threading.Event()

    def task():
        yield 1
        go_on.wait(20)
        yield 2
        yield 3

    heard.worker.start(task())
    assert heard.next() == 1
    heard.worker.cancel()
    go_on.set()
    heard.worker.start(iter(["after"]))
    assert heard.next() == "after"
    heard.worker.close()


def test_failures_are_told_and_work_goes_on():
    heard = Heard()

    def broken():
        yield 1
        raise ZeroDivisionError("by zero")

    heard.worker.start(broken())
    assert heard.next() == 1
    assert isinstance(heard.errors.get(timeout=20), ZeroDivisionError)
    heard.worker.start(iter([2]))
    assert heard.next() == 2
    heard.worker.close()


def test_a_closed_worker_ends_its_thread():
    heard = Heard()
    heard.worker.close()
    end = time.monotonic() + 20
    while heard.worker.running and time.monotonic() < end:
        time.sleep(0.01)
    assert not heard.worker.running


def test_at_once_delivers_before_it_returns():
    items = []
    runner = AtOnce(items.append)
    runner.start(iter([1, 2]))
    assert items == [1, 2]
    runner.cancel()
    runner.close()
