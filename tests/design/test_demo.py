"""The demonstration writes what it says, and the sweep's plot tells how running ends."""

import csv
import json

import numpy as np
import pytest
from rich.console import Console

import design
import design.demo
import railenv


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    directory = tmp_path_factory.mktemp("results")
    with (directory / "terminal.txt").open("w") as stream:
        files = design.demo.run(directory, Console(file=stream, width=80))
    return directory, files


def test_every_file_is_written(results):
    _, files = results
    assert sorted(f.name for f in files) == [
        "critical_speed_over_radius.csv",
        "critical_speed_over_radius.png",
        "critical_speed_tangent.json",
        "critical_speeds.md",
        "speed_locus.csv",
        "speed_locus.png",
        "time_histories.csv",
        "time_histories.png",
    ]
    assert all(f.stat().st_size > 500 for f in files)


def test_table_on_the_terminal_fits_80_columns_and_tells_the_critical_speeds(results):
    text = (results[0] / "terminal.txt").read_text()
    row = next(line for line in text.splitlines() if "HIGH_SPEED_COACH bogie" in line)
    assert row.split() == [
        "HIGH_SPEED_COACH",
        "bogie",
        "116.1",
        "106.8",
        "95.5",
        "48.1",
        "f",
        "85.5",
        "w",
    ]
    assert max(map(len, text.splitlines())) <= 80


def test_data_covers_both_models_and_vehicles_over_the_papers_radii(results):
    with (results[0] / "critical_speed_over_radius.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert {(r["model"], r["vehicle"]) for r in rows} == {
        (m, v) for m in ("bogie", "dual_wheelset") for v in ("TABLE_1", "HIGH_SPEED_COACH")
    }
    radii = sorted({float(r["radius_m"]) for r in rows})
    assert radii[0] == pytest.approx(250.0)
    assert radii[-1] == pytest.approx(10_000.0)
    tangent = json.loads((results[0] / "critical_speed_tangent.json").read_text())
    assert [t["speed"] is None for t in tangent] == [False, False, False, True]


def test_motion_decays_below_and_grows_above_the_critical_speed(results):
    data = np.loadtxt(results[0] / "time_histories.csv", delimiter=",", skiprows=1)
    _, below, above = data.T
    half = len(data) // 2
    assert np.ptp(below[half:]) < 0.5 * np.ptp(below[:half])
    assert np.abs(above[half:]).max() > 9e-3


def test_sweep_reports_nan_where_there_is_no_critical_speed():
    sweep = design.curve_sweep(railenv.DualWheelset(railenv.TABLE_1), [500.0, 5000.0], cant=0.0873)
    assert np.isnan(sweep.speed[0])
    assert sweep.results[0].loss == "none"
    assert sweep.frequency[1] == pytest.approx(1.86, abs=0.01)
    texts = [t.get_text() for t in sweep.plot().axes[0, 0].get_legend().get_texts()]
    assert texts == ["dual_wheelset", "hunting", "stable to the end of the range"]
