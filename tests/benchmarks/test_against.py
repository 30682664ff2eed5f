"""The comparison with a commit runs, judges ratios, and goes on where a commit lacks something."""

import subprocess

import pytest

from benchmarks import against, against_worker, run
from benchmarks.against import Compared, Unmeasurable
from tests.pages import DOCS, ROOT


def has_commits():
    done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, check=False)
    return done.returncode == 0


@pytest.mark.skipif(not has_commits(), reason="not a clone of the repository")
def test_one_round_against_the_last_commit():
    before = against.git("worktree", "list")
    rows = against.compare("HEAD", 1, 0, ["Evaluator.rhs", "import railenv"])
    assert [row.what for row in rows] == ["Evaluator.rhs", "import railenv"]
    for row in rows:
        assert row.value > 0.0
        assert 0.01 < row.ratio < 100.0
    assert against.git("worktree", "list") == before


@pytest.mark.skipif(not has_commits(), reason="not a clone of the repository")
def test_unknown_commit_is_told():
    with pytest.raises(SystemExit, match="git rev-parse"):
        against.compare("no-such-commit", 1, 0)


def compared(old, new, **settings):
    found = Compared("something", "shortest", **settings)
    for k, pair in enumerate(zip(old, new, strict=True)):
        found.measure([lambda pair=pair: pair[0], lambda pair=pair: pair[1]], (k % 2, 1 - k % 2))
    return found.row("commit")


def test_only_what_is_slower_throughout_is_flagged():
    assert compared([1.0, 1.0, 1.0], [1.04, 1.04, 1.2]).holds
    assert not compared([1.0, 1.0, 1.0], [1.06, 1.07, 1.0 + 0.08]).holds
    assert compared([1.0, 1.0, 1.0], [1.5, 1.5, 1.0]).holds  # one undisturbed round
    row = compared([2.0, 1.0, 4.0], [1.0, 1.0, 3.0])
    assert row.ratio == 0.75
    assert "ratios 0.500 to 1.000" in row.compared_with


def test_first_use_is_judged_by_seconds():
    assert compared([8.0], [9.9], by_difference=True).holds
    assert not compared([8.0], [10.1], by_difference=True).holds


def test_shortest_of_the_turns_of_a_round_counts():
    found = Compared("something", "shortest", turns=2)
    times = iter([3.0, 5.0, 4.0, 2.0])  # old, new; new, old
    found.measure([lambda: next(times)] * 2, (0, 1))
    assert found.times == ([2.0], [4.0])


def test_what_a_commit_lacks_is_told():
    def lacking():
        raise Unmeasurable("ImportError: no such thing")

    found = Compared("something", "shortest")
    found.measure([lacking, lambda: 1.0], (0, 1))
    assert found.row("commit").statistic == "not measured"
    assert "no such thing" in found.row("commit").compared_with


def test_every_case_can_be_prepared_here():
    cheap = ("RK4 step, scalar", "critical speed", "env.step of Bogie, as made")
    for name in cheap:
        case = against_worker.CASES[name]
        assert case.seconds([case.make()]) > 0.0


def test_page_tells_the_commands():
    text = (DOCS / "benchmarks.md").read_text(encoding="utf-8")
    for paragraph in run.ABOUT:
        assert paragraph in text
