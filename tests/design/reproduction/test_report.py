"""The report as the command line writes it."""

import json

import pytest
from typer.testing import CliRunner

import agents
import design.reproduction
from design.reproduction import Interrupted
from design.reproduction.cases import VEHICLES
from design.reproduction.sections.adhesion import Adhesion
from design.reproduction.sections.critical_speeds import CriticalSpeeds
from design.reproduction.sections.vehicles import Vehicles
from railenv import cli
from tests.design.reproduction.test_run import Reader

runner = CliRunner()


@pytest.fixture
def short(monkeypatch):
    """A first page of the sections that take little time."""

    def sections(settings, leading=()):
        return (CriticalSpeeds(), Adhesion(settings, whole=False), Vehicles())

    monkeypatch.setattr(design.reproduction, "first_page", sections)


@pytest.mark.usefixtures("short")
def test_first_page_is_printed_within_80_columns_and_written(tmp_path):
    found = runner.invoke(cli.app, ["reproduce", "--first-page", "--jobs", "1", "--out", str(tmp_path)])
    assert found.exit_code == 0, found.output
    assert max(map(len, found.output.splitlines())) <= 80
    row = next(line for line in found.output.splitlines() if "HIGH_SPEED_COACH bogie" in line)
    assert row.split()[2:] == ["116.5", "107.0", "95.7", "48.6", "f", "83.8", "w"]
    document = Reader((tmp_path / "report.html").read_text())
    assert document.tags.count("figure") == 4
    assert all(value.startswith("data:") for value in document.loads)
    assert (tmp_path / "data" / "critical_speeds.csv").stat().st_size > 1000
    again = runner.invoke(cli.app, ["reproduce", "--first-page", "--jobs", "1", "--out", str(tmp_path)])
    assert "0 computations, 6 kept" in " ".join(again.output.split())


def test_interrupt_exits_with_130_and_says_what_to_do(monkeypatch, tmp_path):
    def stopped(*args, **kwargs):
        raise Interrupted("run the same command again")

    monkeypatch.setattr(design.reproduction, "reproduce", stopped)
    found = runner.invoke(cli.app, ["reproduce", "--out", str(tmp_path)])
    assert found.exit_code == 130
    assert "run the same command again" in found.output


def test_unknown_options_are_rejected():
    found = runner.invoke(cli.app, ["reproduce", "--fast"])
    assert found.exit_code == 2
    assert "--fast" in found.output


def test_help_names_every_option():
    found = runner.invoke(cli.app, ["reproduce", "--help"])
    assert all(
        name in found.output for name in ("--out", "--quick", "--first-page", "--fresh", "--jobs")
    )


@pytest.mark.slow
def test_whole_report_in_its_quick_form(tmp_path):
    found = runner.invoke(cli.app, ["reproduce", "--quick", "--out", str(tmp_path)])
    assert found.exit_code == 0, found.output
    text = (tmp_path / "report.html").read_text()
    document = Reader(text)
    assert all(value.startswith("data:") for value in document.loads)
    figures = {path.stem for path in (tmp_path / "figures").glob("*.svg")}
    for number in ("05", "06", "07", "08", "09", "10", "11", "12", "13"):
        assert sum(name.startswith(f"fig{number}") for name in figures) >= 2, number
    assert {"hopf_push_tangent", "growth_rates_sensors", "closed_loop_passive"} <= figures
    speeds = json.loads((tmp_path / "data" / "hopf_push.json").read_text())
    assert set(speeds["controller"]) == set(agents.shipped_names())
    for name in (v.name for v in VEHICLES):
        assert text.count(name) > 50
    assert json.dumps("") not in (tmp_path / "data" / "claims.csv").read_text()
