"""Studies over many cells: what is kept on disk, what a rerun computes, what an interrupt leaves."""

import json
import os
import signal
import subprocess
import sys
import time

import joblib
import pytest

import design
import railenv
from design.studies.store import Store


def squares(cells):
    return [{"square": cell**2} for cell in cells]


class Recorder:
    """Squares, and a note of every cell that was computed."""

    def __init__(self):
        self.computed = []

    def __call__(self, cells):
        self.computed += cells
        return squares(cells)


class Interrupted(Recorder):
    def __call__(self, cells):
        if 5 in cells:
            raise KeyboardInterrupt
        return super().__call__(cells)


@pytest.mark.parametrize("backend", ["sequential", "loky", "multiprocessing", "threading"])
def test_every_backend_gives_the_records_in_the_order_of_the_cells(backend):
    with joblib.parallel_config(backend=backend):
        study = design.run_study(squares, range(23), batches=[range(10), range(10, 23)], n_jobs=2)
    assert [r["square"] for r in study.records] == [n**2 for n in range(23)]
    assert study.ended is None


def test_a_rerun_computes_only_what_is_missing(tmp_path):
    arguments = {"store": tmp_path / "study.jsonl", "settings": {"power": 2}, "n_jobs": 1}
    first = design.run_study(Interrupted(), range(8), **arguments)
    assert first.ended == "interrupted after 5 of 8 cells"
    assert first.records[4] == {"square": 16}
    assert first.records[5:] == (None, None, None)
    again = Recorder()
    second = design.run_study(again, range(8), **arguments)
    assert again.computed == [5, 6, 7]
    assert [r["square"] for r in second.records] == [n**2 for n in range(8)]


def test_a_store_is_refused_to_other_settings(tmp_path):
    path = tmp_path / "study.jsonl"
    Store(path, {"model": {"mass": 1.0, "friction": 0.3}, "values": [1.0, 2.0, 3.0, float("inf")]})
    with pytest.raises(railenv.ParameterError, match=r"model\.mass is 1\.0 there, 2\.0 now") as error:
        Store(path, {"model": {"mass": 2.0, "friction": 0.3}, "values": [1.0, 2.0, 3.0, 4.0]})
    assert "values is [1.0, 2.0, ..., inf] (4 values) there, [1.0, 2.0, ..., 4.0]" in str(error.value)
    assert "friction" not in str(error.value)


def test_a_line_cut_short_is_dropped_and_a_damaged_one_told(tmp_path):
    path = tmp_path / "study.jsonl"
    settings = {"a": 1}
    Store(path, settings).add({0: {"v": 0.1}, 1: {"v": None}})
    whole = path.read_bytes()
    for cut in range(1, len(whole)):  # killed at any byte
        path.write_bytes(whole[:cut])
        kept = Store(path, settings).records
        lines = whole[:cut].count(b"\n")
        assert kept == dict(list({0: {"v": 0.1}, 1: {"v": None}}.items())[: max(lines - 1, 0)])
        Store(path, settings).add({7: {"v": 1}})
        assert Store(path, settings).records == {**kept, 7: {"v": 1}}
    path.write_bytes(whole + b"nonsense\n")
    with pytest.raises(railenv.ParameterError, match="line 4 is not as it was written"):
        Store(path, settings)


def test_other_files_are_not_touched(tmp_path):
    for content in (b"speed,radius\n1,2\n", b"no newline", b'{"format": "another"}\n', b"[1]\n"):
        path = tmp_path / "other"
        path.write_bytes(content)
        with pytest.raises(railenv.ParameterError, match="not the store of a study"):
            Store(path, {})
        assert path.read_bytes() == content
    with pytest.raises(railenv.ParameterError, match="a directory"):
        Store(tmp_path, {})


def test_arguments_are_checked(tmp_path):
    with pytest.raises(railenv.ParameterError, match="n_jobs is 0"):
        design.run_study(squares, range(3), n_jobs=0)
    with pytest.raises(railenv.ParameterError, match="settings is None"):
        design.run_study(squares, range(3), store=tmp_path / "s")


def fails(cells):
    raise railenv.EquilibriumError("no equilibrium", 0.5, 12.0)


def test_exceptions_come_back_whole_from_processes():
    with pytest.raises(railenv.EquilibriumError, match="no equilibrium") as caught:
        design.run_study(fails, range(2), n_jobs=2)
    assert (caught.value.residual, caught.value.reached) == (0.5, 12.0)


_SLOW = """
import signal, sys, time
import design

# a test run in the background has been told to ignore it, and would pass that on
signal.signal(signal.SIGINT, signal.default_int_handler)

def slowly(cells):
    time.sleep(0.1)
    return [{"double": 2 * cell} for cell in cells]

if __name__ == "__main__":
    study = design.run_study(
        slowly, range(200), store=sys.argv[1], settings={}, n_jobs=int(sys.argv[2])
    )
    print(study.ended)
"""


def _started(tmp_path, n_jobs):
    """Start a slow study and wait until it has kept some cells."""
    script, store = tmp_path / "slow.py", tmp_path / "study.jsonl"
    script.write_text(_SLOW)
    process = subprocess.Popen(
        [sys.executable, script, store, str(n_jobs)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        start_new_session=True,
    )
    limit = time.monotonic() + 120.0
    while not store.exists() or store.read_bytes().count(b"\n") < 6:
        assert process.poll() is None
        assert time.monotonic() < limit
        time.sleep(0.05)
    return process, store


def test_cells_survive_that_the_process_is_killed(tmp_path):
    process, store = _started(tmp_path, n_jobs=2)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = Store(store, {}).records
    assert 5 <= len(kept) < 200
    assert all(record == {"double": 2 * cell} for cell, record in kept.items())
    again = Recorder()
    study = design.run_study(again, range(200), store=store, settings={}, n_jobs=1)
    assert sorted(again.computed) == sorted(set(range(200)) - set(kept))
    assert all(study.records)


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_an_interrupt_from_the_keyboard_returns_what_is_finished(tmp_path, n_jobs):
    process, store = _started(tmp_path, n_jobs)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all processes
    output, _ = process.communicate(timeout=60)
    lines = store.read_text().splitlines()
    assert output == f"interrupted after {len(lines) - 1} of 200 cells\n"
    assert json.loads(lines[-1])["double"] == 2 * json.loads(lines[-1])["cell"]
