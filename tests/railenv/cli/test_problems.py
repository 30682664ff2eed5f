"""Problems on the command line: what is asked for is rated, and shown."""

import json

import pytest
from typer.testing import CliRunner

import agents
from agents import problems
from railenv import cli
from tests.pages import DOCS

NAME = "dual-wheelset-v1"
STORED = json.loads((DOCS / "problems.json").read_text(encoding="utf-8"))[NAME]["ratings"]


def invoke(*arguments):
    result = CliRunner().invoke(cli.app, list(arguments))
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture
def rated(monkeypatch):
    """Let ratings, which take minutes, be the stored ones; return what is rated."""
    calls = []

    def passive(problem, *, damped):
        name = "best passive damper" if damped else "no yaw damper"
        calls.append((problem.name, name))
        return problems.Rating.from_summary(STORED[name])

    def controlled(controller, problem, *, name):
        calls.append((problem.name, type(controller).__name__))
        return problems.Rating.from_summary({**STORED["output-feedback"], "controller": name})

    monkeypatch.setattr(problems, "rate_passive", passive)
    monkeypatch.setattr(problems, "rate", controlled)
    return calls


def test_a_controller_is_rated_beside_the_passive_vehicles(rated):
    shown = invoke("evaluate", "output-feedback", "--problem", NAME)
    assert rated == [
        (NAME, "no yaw damper"),
        (NAME, "best passive damper"),
        (NAME, "OutputFeedback"),
    ]
    assert f"{STORED['output-feedback']['robust']:.1f}" in shown
    found = json.loads(invoke("evaluate", "output-feedback", "--problem", NAME, "--json"))
    assert [one["controller"] for one in found] == [
        "no yaw damper",
        "best passive damper",
        "output-feedback",
    ]


def test_all_shipped_controllers_of_a_problem_are_rated_when_none_is_named(rated, tmp_path):
    invoke("evaluate", "--problem", NAME, "--leaderboard", "--plot", str(tmp_path / "ratings.png"))
    assert len(rated) == 2 + len(agents.shipped_names(NAME))
    assert (tmp_path / "ratings.png").stat().st_size > 0


def test_a_file_is_rated(rated, tmp_path):
    path = tmp_path / "mine.npz"
    agents.shipped("output-feedback", NAME).save(path)
    invoke("evaluate", str(path), "--problem", NAME)
    assert rated[-1] == (NAME, "OutputFeedback")


def test_a_controller_is_designed_for_a_problem(tmp_path):
    path = tmp_path / "mine.npz"
    assert "wrote" in invoke("tune", "passive", "--problem", "bogie-secondary-v1", "--out", str(path))
    assert agents.load(path).commands == ("command_b",)


def test_kinds_that_a_problem_has_no_design_for_are_refused(tmp_path):
    out = str(tmp_path / "mine.npz")
    result = CliRunner().invoke(cli.app, ["tune", "lqr", "--problem", NAME, "--out", out])
    assert result.exit_code != 0
    assert "allowed are output-feedback" in str(result.exception)


def test_a_policy_is_told_by_the_identifier_in_a_file(tmp_path):
    pytest.importorskip("stable_baselines3", reason="needs the extra rl")
    model = problems.problem("bogie-secondary-v1").model()
    bank = [{"conicity": conicity} for conicity in (0.05, 0.4)]
    agents.AdaptiveLQG.design(model, speeds=[60.0, 120.0], vehicles=bank).save(tmp_path / "bank.npz")
    invoke(
        *("train-through", "--problem", "bogie-secondary-v1", "--evaluations", "1"),
        *("--identifier", str(tmp_path / "bank.npz"), "--out", str(tmp_path / "policy.npz")),
    )
    policy = agents.load(tmp_path / "policy.npz")
    assert policy.told == ["conicity"]
    assert [dict(vehicle) for vehicle in policy.identifier.vehicles] == bank
