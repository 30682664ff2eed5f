"""The claims on creep follow the laws that they are given; the section shows the same numbers."""

import dataclasses

import numpy as np
import pytest

from design.reproduction import QUICK, reproduce, whole_report
from design.reproduction.cases import COACH, VEHICLES
from design.reproduction.claims import Evidence
from design.reproduction.claims_of_creep import CREEP_RULES, creep_pieces
from design.reproduction.creep import TREAD, creep_laws
from design.reproduction.sections.claims import Claims
from design.reproduction.sections.creep import Creep


@pytest.fixture(scope="module")
def computed():
    return {piece.name: piece.function(**piece.inputs) for piece in creep_pieces()}


@pytest.fixture
def data(computed):
    return dict(computed)


def judged(data, key):
    claims = {c.key: c for c in (rule(Evidence(data, QUICK)) for rule in CREEP_RULES)}
    return claims[key]


def verdicts(claim):
    return [claim.findings[v.name].verdict for v in VEHICLES]


def test_heuristic_law_is_near_the_simplified_theory(data):
    claim = judged(data, "creep-simplified-theory")
    assert verdicts(claim) == ["agrees"] * 3
    found = claim.findings["HIGH_SPEED_COACH"].text
    assert found == "1.0% of μN off without spin, 7.3% with the tread's spin of 0.11 1/m"


def test_heuristic_law_fails_at_high_spin(data):
    claim = judged(data, "creep-high-spin")
    assert verdicts(claim) == ["agrees"] * 3
    assert claim.findings["TABLE_1"].text == "73% of μN off at a spin of 2.05 1/m"
    assert "f12 is 6% (TABLE_1), 3% (TABLE_1_PRINTED_LOADS) and 6% (HIGH_SPEED_COACH)" in claim.why


def test_verdicts_follow_the_forces(data):
    name = creep_laws(COACH).name
    found = data[name]
    off = {**found.lateral, "heuristic": found.lateral["fastsim"]}
    data[name] = dataclasses.replace(found, lateral=off)
    assert verdicts(judged(data, "creep-high-spin")) == ["agrees", "agrees", "differs"]
    shifted = found.lateral["fastsim"].copy()
    shifted[TREAD] += 0.11 * found.patch.adhesion
    data[name] = dataclasses.replace(found, lateral={**found.lateral, "heuristic": shifted})
    assert verdicts(judged(data, "creep-simplified-theory")) == ["agrees", "agrees", "differs"]


def test_patch_is_that_of_the_vehicles_wheel(data):
    found = data[creep_laws(COACH).name]
    assert found.patch.load == pytest.approx(55.9e3, rel=1e-3)
    assert 1e3 * found.patch.rolling == pytest.approx(5.9, abs=0.05)
    assert found.spin == pytest.approx(np.array([0.0, 0.1092, 2.054]), rel=1e-3)


def test_claims_are_in_the_table_of_both_reports():
    for whole in (False, True):
        names = {piece.name for piece in Claims(QUICK, whole=whole).pieces()}
        assert {piece.name for piece in creep_pieces()} <= names
    assert "creep" in [section.key for section in whole_report(QUICK)]


def test_section_is_written(tmp_path):
    report = reproduce([Creep()], tmp_path)
    text = report.path.read_text()
    assert "semi-axes of 5.9\u00a0mm in the rolling direction and 4.5\u00a0mm across" in text
    assert "<td>lateral, spin of a flange</td>" in text
    figures = {path.stem for path in (tmp_path / "figures").glob("*.svg")}
    assert figures == {f"creep_lateral_{n}" for n in ("no_spin", "tread", "flange")} | {
        "creep_longitudinal_no_spin"
    }
    rows = (tmp_path / "data" / "creep_laws.csv").read_text().splitlines()
    assert rows[0] == "direction,spin_1_per_m,creepage,kalker_N,heuristic_N,polach_N,fastsim_N"
    assert len(rows) == 1 + 4 * 61
    again = reproduce([Creep()], tmp_path)
    assert (again.computed, again.kept) == (0, 1)
