"""A few of the examples that ``python -m benchmarks.reliability.run`` runs by thousands."""

import subprocess
import sys
import time

import pytest
from hypothesis import strategies as st

from benchmarks.reliability import fuzz
from benchmarks.reliability.run import AREAS
from railenv.errors import ParameterError, RailenvError

RL = {"recipe files", "changes of recipes", "run.json of training runs"}


@pytest.mark.parametrize("area", AREAS, ids=lambda area: area.name)
def test_every_example_gives_a_sane_result_or_an_exception_of_the_package(area):
    if area.name in RL:
        pytest.importorskip("stable_baselines3")
    tally = fuzz.run(area, area.quick)
    assert not tally.failures
    assert tally.examples > area.quick // 2
    assert len(tally.outcomes) >= 2, "examples must reach results and errors"


def _nothing(example):
    pass


def _raises(error):
    def check(example):
        raise error

    return check


def _endless(example):
    end = time.process_time() + 5.0
    while time.process_time() < end:
        pass


@pytest.mark.parametrize(
    ("check", "outcome", "failure"),
    [
        (_nothing, fuzz.RESULT, None),
        (_raises(ParameterError("x is 3; it must be 4")), "ParameterError", None),
        (_raises(ParameterError("")), fuzz.FAILURE, "says nothing"),
        (_raises(RailenvError("x" * 5000)), fuzz.FAILURE, "5000 characters"),
        (_raises(ValueError("bare")), fuzz.FAILURE, "bare"),
        (_endless, fuzz.FAILURE, "no end"),
    ],
)
def test_what_is_not_allowed_counts_as_a_failure(monkeypatch, check, outcome, failure):
    monkeypatch.setattr(fuzz, "LONGEST", 0.05)
    tally = fuzz.run(fuzz.Area("own", st.just(1), check, 1), 1)
    assert dict(tally.outcomes) == {outcome: 1}
    assert bool(tally.failures) == (failure is not None)
    assert failure is None or failure in "".join(tally.failures.values())


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (["critical-speed", "--set", "conicity=-1"], 1, "conicity of Cone is -1; it must be"),
        (["critical-speed", "--radius", "abc"], 2, "Invalid value"),
        (["vehicles", "absent.toml"], 1, "absent.toml"),
    ],
)
def test_the_command_itself_fails_without_a_traceback(tmp_path, arguments, status, said):
    done = subprocess.run(
        [sys.executable, "-m", "railenv.cli", *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == status
    assert "Traceback" not in done.stderr
    assert said in done.stderr
    assert status == 2 or len(done.stderr.strip().splitlines()) == 1
