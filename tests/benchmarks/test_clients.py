"""What a client's program prints becomes its row, and so does its failure."""

import json
import sys

import pytest

from benchmarks.clients.environments import Place, StepFailedError
from benchmarks.clients.listed import CLIENTS, PROGRAMS, REQUIREMENTS


@pytest.fixture
def place(tmp_path):
    """A folder with this interpreter in place of a virtual environment."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "python").symlink_to(sys.executable)
    return Place(tmp_path)


def program(place, text):
    path = place.folder / "program.py"
    path.write_text(text, encoding="utf-8")
    return path


def test_result_of_a_program_is_its_last_line_of_results(place):
    path = program(place, 'print("result: 1")\nprint("result: {}")\nprint("bye")')
    assert place.result(path, None) == "{}"


def test_programs_run_in_a_folder_of_their_own_and_know_the_source(place):
    text = 'import os; print("result:", os.getcwd(), os.environ["CLIENT_SOURCE"])'
    found = place.result(program(place, text), place.folder / "there")
    assert found.split() == [str(place.folder / "work" / "program"), str(place.folder / "there")]


def test_failure_keeps_the_traceback_without_paths_of_this_machine(place):
    with pytest.raises(StepFailedError) as caught:
        place.result(program(place, 'raise RuntimeError("no luck")'), None)
    message = str(caught.value)
    assert 'File "ENVIRONMENT/program.py", line 1' in message
    assert message.endswith("RuntimeError: no luck\n(exit status 1)")
    assert str(place.folder) not in message


def test_a_program_without_a_result_has_failed(place):
    with pytest.raises(StepFailedError, match="no result"):
        place.result(program(place, "pass"), None)


def test_every_program_and_every_file_of_pins_is_of_a_client():
    used = {path for client in CLIENTS for path in client.requirement_files if path is not None}
    assert used == set(REQUIREMENTS.iterdir())
    programs = {path for path in PROGRAMS.glob("*.py") if "\nreport(" in path.read_text()}
    assert programs == {client.program for client in CLIENTS}


def test_report_of_a_program_is_one_line_of_json(capsys, monkeypatch):
    monkeypatch.syspath_prepend(str(PROGRAMS))
    import judged

    judged.report("`x`", steps=3, before=1.04, after=2.06)
    printed = capsys.readouterr().out
    expected = {"ran": "`x`", "steps": 3, "before": 1.0, "after": 2.1, "improved": True}
    assert json.loads(printed.removeprefix("result: ")) == expected
