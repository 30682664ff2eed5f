"""Threads that share the blocks of a kernel call."""

import gc
import threading
import time
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from gymnasium import make_vec
from numpy.testing import assert_array_equal

import railenv
from railenv import threads
from railenv.batch import Batch
from railenv.envs import fleet
from railenv.errors import ParameterError
from railenv.kernels import pool

PIECES = 200


class Pieces:
    """Work in Python that notes who took what; a lock stands for the kernels' atomic counter."""

    def __init__(self, pause=0.0, fails_at=None):
        self.taken, self.workers = [], set()
        self._lock, self._pause, self._fails_at = threading.Lock(), pause, fails_at

    def __call__(self, counter):
        while True:
            with self._lock:
                piece = int(counter[0])
                counter[0] += 1
            if piece >= PIECES:
                return
            if piece == self._fails_at:
                counter[0] = PIECES
                raise ValueError(f"piece {piece}")
            self.taken.append(piece)
            self.workers.add(threading.current_thread())
            time.sleep(self._pause)


def helpers():
    return [t for t in threading.enumerate() if t.name == "railenv-kernels"]


# -------------------------------------------------------------------------------- the pool


@pytest.mark.parametrize("n", [1, 2, 3, 8])
def test_every_piece_is_done_once(n):
    work = Pieces(pause=1e-4)
    pool.run(work, n)
    assert sorted(work.taken) == list(range(PIECES))
    assert 1 <= len(work.workers) <= n


def test_the_calling_thread_works_too_and_others_help():
    work = Pieces(pause=1e-3)
    pool.run(work, 3)
    assert threading.current_thread() in work.workers
    assert len(work.workers) > 1


def test_one_thread_starts_no_other(monkeypatch):
    monkeypatch.setattr(pool, "_helpers", lambda: pytest.fail("helpers are asked for"))
    work = Pieces()
    pool.run(work, 1)
    assert work.workers == {threading.current_thread()}


def test_threads_are_started_once_and_end_with_the_interpreter():
    pool.run(Pieces(), 3)
    before = helpers()
    for _ in range(20):
        pool.run(Pieces(), 3)
    assert helpers() == before
    assert all(t.daemon for t in before)


def test_a_helper_that_comes_late_is_not_waited_for():
    busy, release = threading.Event(), threading.Event()

    def long(counter):
        if threading.current_thread().name == "railenv-kernels":
            busy.set()
        release.wait(60.0)

    with ThreadPoolExecutor(1) as executor:
        first = executor.submit(pool.run, long, 1 + max(2, len(helpers())))
        assert busy.wait(60.0)
        work = Pieces()
        pool.run(work, 2)
        assert len(work.taken) == PIECES
        assert not first.done()
        release.set()
        first.result(60.0)


def test_callers_on_several_threads_do_not_disturb_each_other():
    works = [Pieces(pause=1e-5) for _ in range(40)]
    with ThreadPoolExecutor(4) as executor:
        list(executor.map(lambda work: pool.run(work, 3), works))
    assert all(sorted(work.taken) == list(range(PIECES)) for work in works)
    assert pool._helpers()._jobs == []


def test_a_call_within_a_call_is_served():
    def outer(counter):
        counter[0] += 1
        pool.run(Pieces(), 3)

    pool.run(outer, 3)


@pytest.mark.parametrize("piece", [0, 57, PIECES - 1])
def test_what_the_work_raises_reaches_the_caller(piece):
    with pytest.raises(ValueError, match=f"piece {piece}"):
        pool.run(Pieces(pause=1e-4, fails_at=piece), 3)
    assert pool._helpers()._jobs == []


def test_after_an_interrupt_nobody_works_on(monkeypatch):
    """Ctrl-C comes while the caller waits: it is raised when the last helper has left."""
    working = threading.Event()
    done = []

    def work(counter):
        if threading.current_thread() is threading.main_thread():
            working.wait(60.0)
            raise KeyboardInterrupt
        working.set()
        time.sleep(0.2)
        done.append(True)

    with pytest.raises(KeyboardInterrupt):
        pool.run(work, 2)
    assert done
    pool.run(work := Pieces(), 2)
    assert len(work.taken) == PIECES


def test_without_further_threads_the_caller_does_all(monkeypatch):
    def refuses(self):
        raise RuntimeError("can't start new thread")

    pool._helpers.cache_clear()
    monkeypatch.setattr(threading.Thread, "start", refuses)
    pool.run(work := Pieces(), 3)
    assert work.workers == {threading.current_thread()}
    pool._helpers.cache_clear()


def test_idle_threads_hold_nothing():
    class Data:
        pass

    data = Data()
    gone = weakref.ref(data)
    pool.run(lambda counter, data=data: time.sleep(0.01), 3)
    del data
    deadline = time.monotonic() + 10.0
    while gone() is not None and time.monotonic() < deadline:
        gc.collect()
        time.sleep(0.01)
    assert gone() is None


# --------------------------------------------------------------------- the number of threads


def test_number_of_threads_is_that_of_the_environment_variable(monkeypatch):
    monkeypatch.setenv("RAILENV_NUM_THREADS", " 3 ")
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    assert threads.usable_threads() == 3


@pytest.mark.parametrize("value", ["0", "-1", "two", "1.5", "1025", "9" * 5000, "²", "1_0"])
def test_impossible_numbers_of_threads_are_refused(monkeypatch, value):
    monkeypatch.setenv("RAILENV_NUM_THREADS", value)
    with pytest.raises(
        ParameterError, match=r"^RAILENV_NUM_THREADS is '.*; it must be a whole number from 1 to 1024"
    ):
        threads.usable_threads()
    batch = Batch([railenv.CooperriderBogie()] * 40)
    with pytest.raises(ParameterError, match="RAILENV_NUM_THREADS"):
        batch.integrate(step=1e-4, steps=1, parallel=True)


@pytest.mark.parametrize("value", [None, "", " "])
def test_without_the_variable_there_are_as_many_threads_as_processors(monkeypatch, value):
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    monkeypatch.setattr(threads, "_processors", lambda: 6)
    if value is None:
        monkeypatch.delenv("RAILENV_NUM_THREADS", raising=False)
    else:
        monkeypatch.setenv("RAILENV_NUM_THREADS", value)
    assert threads.usable_threads() == 6


@pytest.mark.parametrize(("share", "expected"), [("2", 2), ("64", 6), ("0", 6), ("x", 6), ("", 6)])
def test_share_that_joblib_gives_a_process_is_kept(monkeypatch, share, expected):
    monkeypatch.delenv("RAILENV_NUM_THREADS", raising=False)
    monkeypatch.setenv("NUMBA_NUM_THREADS", share)
    monkeypatch.setattr(threads, "_processors", lambda: 6)
    assert threads.usable_threads() == expected


# ------------------------------------------------------------------- the same to the bit


def steps_of_environments(count=520, steps=12):
    env = make_vec("railenv/Bogie-v1", count, observation="sensors", track="curve", duration=0.05)
    env.reset(seed=4)
    rng = np.random.default_rng(0)
    results = []
    for _ in range(steps):
        actions = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        results.append(env.step(actions)[:4])
    return [np.array(column) for column in zip(*results, strict=True)]


def test_environments_do_not_depend_on_the_number_of_threads(monkeypatch):
    monkeypatch.setattr(fleet, "THREAD_PAYS_FROM", 16)
    found = []
    for n in ("1", "2", "3"):
        monkeypatch.setenv("RAILENV_NUM_THREADS", n)
        found.append(steps_of_environments())
    for other in found[1:]:
        for a, b in zip(found[0], other, strict=True):
            assert_array_equal(a, b)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_batches_do_not_depend_on_the_number_of_threads(monkeypatch, dtype):
    model = railenv.CooperriderBogie()
    found = []
    for n in ("1", "2", "3"):
        monkeypatch.setenv("RAILENV_NUM_THREADS", n)
        batch = Batch([model] * 500, dtype)
        batch.conditions = [70.0, 0.0, 0.0]
        batch.states = np.linspace(0.0, 1e-3, 500)[:, None] * np.ones(model.n_states)
        for _ in range(20):
            batch.integrate(step=1e-4, steps=7, parallel=True)
        found.append(batch.states)
    assert np.isfinite(found[0]).all()
    assert_array_equal(found[0], found[1])
    assert_array_equal(found[0], found[2])


def test_two_threads_of_python_step_environments_of_their_own(monkeypatch):
    monkeypatch.setenv("RAILENV_NUM_THREADS", "3")
    monkeypatch.setattr(fleet, "THREAD_PAYS_FROM", 16)
    expected = steps_of_environments()
    with ThreadPoolExecutor(2) as executor:
        for found in executor.map(lambda _: steps_of_environments(), range(4)):
            for a, b in zip(expected, found, strict=True):
                assert_array_equal(a, b)
