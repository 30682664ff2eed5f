"""A report goes on where a run was stopped, is one file, and escapes what it is given."""

import csv
import json
import math
import signal
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest

import railenv
from agents.reproduction import computations as closed_loops
from design.reproduction import DataTable, Interrupted, Piece, Store, computations, reproduce
from design.reproduction import store as store_module
from design.reproduction.output import write_json
from design.reproduction.store import Results
from design.reproduction.workers import spread
from railenv.errors import ParameterError
from tests.design.reproduction.toy import EVIL, Squares, square


class Reader(HTMLParser):
    """Collects what a document loads, and its elements."""

    def __init__(self, text):
        super().__init__()
        self.loads, self.tags = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        wanted = ("src", "srcset", "data", "poster", "action") + (("href",) if tag != "a" else ())
        self.loads += [value for name, value in attrs if name in wanted]


def logged(directory):
    return (directory / "log").read_text().split()


def test_run_that_was_killed_goes_on_without_loss(tmp_path):
    command = [sys.executable, "-m", "tests.design.reproduction.toy", str(tmp_path)]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    assert logged(tmp_path) == ["1", "2"]
    report = reproduce([Squares(tmp_path / "log")], tmp_path / "report")
    assert logged(tmp_path) == ["1", "2", "3"]
    assert (report.kept, report.computed) == (2, 1)
    assert "<p>14</p>" in report.path.read_text()


def test_several_processes_store_what_they_computed_also_when_one_is_killed(tmp_path):
    with pytest.raises(Interrupted, match=r"a process was killed.*to go on"):
        reproduce([Squares(tmp_path / "log", "kill")], tmp_path / "report", jobs=2)
    report = reproduce([Squares(tmp_path / "log")], tmp_path / "report", jobs=2)
    assert report.computed >= 1
    assert set(logged(tmp_path)) == {"1", "2", "3"}
    assert "<p>14</p>" in report.path.read_text()


def test_pieces_that_compile_other_kernels_come_first():
    bogie, dual = railenv.Bogie(railenv.TABLE_1), railenv.DualWheelset(railenv.TABLE_1)
    pieces = [
        *(Piece(f"bogie {i}", computations.critical_speeds, {"model": bogie}) for i in range(3)),
        *(Piece(f"dual {i}", computations.critical_speeds, {"model": dual}) for i in range(2)),
        *(Piece(f"loop {i}", closed_loops.evaluation, {"model": bogie}) for i in range(2)),
    ]
    names = [piece.name for piece in spread(pieces)]
    assert names == ["loop 0", "dual 0", "bogie 0", "bogie 1", "bogie 2", "dual 1", "loop 1"]
    assert spread([]) == []


@pytest.mark.parametrize("jobs", [0, -1])
def test_number_of_processes_is_checked(tmp_path, jobs):
    with pytest.raises(ParameterError, match="at least 1"):
        reproduce([Squares(tmp_path / "log")], tmp_path / "report", jobs=jobs)


def test_interrupt_keeps_what_is_done_and_says_how_to_go_on(tmp_path):
    with pytest.raises(Interrupted, match=r"2 of 3 computations.*without --fresh"):
        reproduce([Squares(tmp_path / "log", "interrupt")], tmp_path / "report")
    assert not (tmp_path / "report" / "report.html").exists()
    reproduce([Squares(tmp_path / "log")], tmp_path / "report")
    assert logged(tmp_path) == ["1", "2", "3"]


def test_fresh_computes_everything_again(tmp_path):
    for fresh, runs in ((False, 1), (False, 1), (True, 2)):
        reproduce([Squares(tmp_path / "log")], tmp_path / "report", fresh=fresh)
        assert logged(tmp_path) == ["1", "2", "3"] * runs


def test_report_loads_nothing_and_escapes_titles_captions_and_headings(tmp_path):
    report = reproduce([Squares(tmp_path / "log")], tmp_path / "report", note=EVIL)
    text = report.path.read_text()
    document = Reader(text)
    assert document.loads
    assert all(value.startswith("data:image/svg+xml;base64,") for value in document.loads)
    assert not {"script", "link", "iframe", "object"} & set(document.tags)
    assert EVIL not in text
    assert text.count("&lt;script&gt;") >= 4
    assert "@import" not in text
    assert "url(" not in text


def test_figures_and_data_are_written_beside_the_report(tmp_path):
    reproduce([Squares(tmp_path / "log")], tmp_path / "report")
    figures = tmp_path / "report" / "figures"
    assert (figures / "squares.svg").read_text().count("<svg") == 1
    assert (figures / "squares.png").read_bytes().startswith(b"\x89PNG")
    columns = json.loads((tmp_path / "report" / "data" / "squares.json").read_text())
    assert columns == {"number": [1, 2, 3], "square": [1, 4, 9]}
    with (tmp_path / "report" / "data" / "squares.csv").open() as stream:
        assert list(csv.reader(stream)) == [["number", "square"], ["1", "1"], ["2", "4"], ["3", "9"]]


def test_a_report_is_the_same_to_the_byte_when_written_again(tmp_path):
    first = reproduce([Squares(tmp_path / "log")], tmp_path / "report").path.read_bytes()
    assert reproduce([Squares(tmp_path / "log")], tmp_path / "report").path.read_bytes() == first


def test_several_processes_write_the_same_report(tmp_path):
    one, two = (
        reproduce([Squares(tmp_path / "log"), Squares(tmp_path / "log")], tmp_path / f"{n}", jobs=n)
        for n in (1, 2)
    )
    assert one.path.read_bytes() == two.path.read_bytes()
    assert [p.name for p in one.files] == [p.name for p in two.files]


def test_key_of_a_piece_depends_on_its_inputs():
    keys = {Piece("a", square, {"number": n, "log": ""}).key for n in (1, 1, 2)}
    assert len(keys) == 2


def test_key_of_a_piece_depends_on_the_code_that_it_names(tmp_path, monkeypatch):
    monkeypatch.setattr(store_module, "_ROOT", tmp_path)
    monkeypatch.setattr(store_module, "_CODE", ())
    keys = []
    for text in ("x = 1", "x = 1", "x = 2"):
        (tmp_path / "own.py").write_text(text)
        store_module._fingerprint.cache_clear()
        keys.append(Piece("a", square, {"number": 1, "log": ""}, code=("*.py",)).key)
    store_module._fingerprint.cache_clear()
    assert keys[0] == keys[1] != keys[2]
    with pytest.raises(ParameterError, match=r"'\*\.txt', which no file"):
        _ = Piece("a", square, {"number": 1, "log": ""}, code=("*.txt",)).key


def test_results_are_read_when_asked_for(tmp_path):
    store = Store(tmp_path)
    pieces = [Piece(f"p{n}", square, {"number": n, "log": ""}) for n in (1, 2)]
    results = Results(store, pieces)
    store.save(pieces[1], {"square": 4})
    assert (list(results), len(results), results["p2"]) == (["p1", "p2"], 2, {"square": 4})
    with pytest.raises(FileNotFoundError):
        results["p1"]


def test_numbers_that_are_not_finite_are_null_in_json(tmp_path):
    table = DataTable("a", ("x", "y"), [(1.5, math.inf), (np.float64(2.0), math.nan), (None, True)])
    path = write_json(table, tmp_path)
    assert json.loads(path.read_text()) == {"x": [1.5, 2.0, None], "y": [None, None, True]}


def test_tables_that_no_file_could_hold_are_refused():
    with pytest.raises(ParameterError, match="a name occurs twice"):
        DataTable("a", ("x", "x"), [])
    with pytest.raises(ParameterError, match="has 1 entries; it must have 2"):
        DataTable("a", ("x", "y"), [(1, 2), (3,)])


def test_damaged_file_is_computed_again(tmp_path):
    store, piece = Store(tmp_path), Piece("a", square, {"number": 1, "log": ""})
    store.save(piece, {"square": 1})
    assert store.load(piece) == {"square": 1}
    store.path(piece).write_bytes(store.path(piece).read_bytes()[:100])
    assert not store.has(piece)


def test_failed_write_leaves_nothing(tmp_path):
    store, piece = Store(tmp_path), Piece("a", square, {"number": 1, "log": ""})
    with pytest.raises(ValueError, match="cannot be stored"):
        store.save(piece, {"what": object()})
    assert not list(tmp_path.iterdir())
