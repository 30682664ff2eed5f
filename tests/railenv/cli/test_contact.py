"""``railenv contact`` as a user runs it."""

import json
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from railenv import ProfilePair, cli

runner = CliRunner()


def invoke(*arguments):
    result = runner.invoke(cli.app, ["contact", *map(str, arguments)])
    assert result.exit_code == 0, result.output
    return result.output


def test_it_prints_contact_and_conicity_and_draws(tmp_path):
    picture = tmp_path / "pair.png"
    said = invoke("S1002", "UIC60", "--plot", picture)
    assert "S1002 on UIC60, inclination 1:40, gauge 1435 mm" in said
    assert "3     0.173     0.173" in said
    assert "flange: reached at 6.39 mm, largest contact angle 1.2217 rad" in said
    assert "…" not in said
    assert picture.stat().st_size > 10_000


def test_json_has_the_numbers_of_the_pair():
    data = json.loads(
        invoke("UIC519_A", "UIC519_RAIL_A", "--inclination", 0, "--gauge", 1.4352, "--json")
    )
    pair = ProfilePair("UIC519_A", "UIC519_RAIL_A", inclination=0.0, gauge=1.4352)
    assert data["linear"]["conicity"] == pytest.approx(pair.linear(0.003).conicity)
    assert data["conicity"]["EN 15302"][2] == pytest.approx(pair.equivalent_conicity(0.003))
    assert len(data["contact"]["y"]) == 11


def test_files_take_units(tmp_path):
    wheel = tmp_path / "mine.txt"
    points = 1e3 * ProfilePair().wheel.points
    wheel.write_text("\n".join(f"{y} {z}" for y, z in points.tolist()))
    data = json.loads(invoke(wheel, "UIC60", "--units", "mm", "--json"))
    assert data["wheel"] == "mine"
    assert data["flange_clearance"] == pytest.approx(ProfilePair().flange_clearance, abs=1e-9)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("S1003",), "wheel is 'S1003'; it must be a file or one of S1002"),
        (("S1002", "UIC60", "--gauge", "1.42"), "on its flange at the centre"),
        (("S1002", "UIC60", "--mirror-rail"), "--mirror-rail is for files"),
        (("none.prw",), "No such file"),
    ],
)
def test_errors_are_one_line(arguments, message):
    done = subprocess.run(
        [sys.executable, "-m", "railenv.cli", "contact", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
