"""The sections whose numbers are computed ahead: simplifications and readings of the print."""

import pytest

import design
import railenv
from design.reproduction import QUICK, first_page, paper, reproduce, whole_report
from design.reproduction.readings import UNITS
from design.reproduction.readings import results as searched
from design.reproduction.sections.readings import Readings
from design.reproduction.sections.simplifications import Simplifications
from design.reproduction.simplifications import BODIES, CONTACTS, PAPERS, model, of, results


def test_every_contact_has_both_bodies():
    assert [(one.contact, one.body) for one in results()] == [(c, b) for c in CONTACTS for b in BODIES]


@pytest.mark.parametrize("contact", list(CONTACTS)[:2])
def test_kept_speeds_are_those_of_the_bogie_on_a_cone(contact):
    kept = of(results(), contact, "at rest")
    assert design.critical_speed(model(contact, "at rest", curving=True)).speed == pytest.approx(
        kept.tangent, rel=1e-6
    )
    for curving, speed in ((False, kept.without_curving), (True, kept.with_curving)):
        found = design.critical_speed(
            model(contact, "at rest", curving=curving), radius=paper.RADIUS, cant=paper.CANT
        )
        assert found.speed == pytest.approx(speed, rel=1e-6)


def test_hunting_persists_from_where_simulation_finds_its_end():
    """Established hunting, slowed down, dies out near the kept speed."""
    kept = of(results(), PAPERS, "at rest")
    bogie = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    ramp = design.speed_ramp(
        bogie,
        start=1.1 * kept.persists_from,
        stop=0.9 * kept.persists_from,
        rate=0.5,
        perturbation={"y_w1": 9e-3, "y_b": 9e-3},
    )
    assert 0.96 < ramp.critical_speed / kept.persists_from < 1.005  # a ramp lags behind


@pytest.mark.parametrize("body", BODIES)
def test_one_more_truth_changes_the_right_speeds(body):
    for contact in CONTACTS:
        one = of(results(), contact, body)
        assert one.persists_from <= one.tangent * (1.0 + 1e-6)
        assert one.with_curving != one.without_curving


@pytest.mark.slow
@pytest.mark.parametrize("contact", list(CONTACTS))
@pytest.mark.parametrize("body", BODIES)
def test_kept_speeds_are_computed_again(contact, body):
    kept = of(results(), contact, body)
    found = design.critical_speed(model(contact, body, curving=True))
    assert found.speed == pytest.approx(kept.tangent, rel=1e-6)
    assert found.mode_shape.name == kept.mode


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    directory = tmp_path_factory.mktemp("ahead")
    return reproduce([Simplifications(), Readings(QUICK)], directory), directory


def test_sections_are_in_both_forms_of_the_report(written):
    report, directory = written
    text = report.path.read_text()
    assert "What the simplifications cost" in text
    assert "S1002 on UIC 60" in text
    assert (directory / "figures" / "simplifications.svg").is_file()
    for sections in (first_page(QUICK), whole_report(QUICK)):
        keys = [section.key for section in sections]
        assert keys.index("claims") < keys.index("simplifications") < keys.index("readings")


def test_report_says_what_the_search_has_found(written):
    report, _ = written
    text = report.path.read_text()
    found = searched()
    for search in found["searches"].values():
        assert f'<td class="number">{search["readings"]}</td>' in text
    hits = sum(search[unit]["both"] for search in found["searches"].values() for unit in UNITS)
    assert ("None was found" in text) == (hits == 0)
    assert "two conjectures, and no more" in text.lower()
    assert "34560 readings" in text


def test_ratio_of_the_critical_speeds_is_in_the_text(written):
    report, _ = written
    bogie, dual = (
        design.critical_speed(kind(railenv.TABLE_1), radius=paper.RADIUS, cant=paper.CANT).speed
        for kind in (railenv.Bogie, railenv.DualWheelset)
    )
    text = report.path.read_text().replace("\u00a0", " ")
    assert f"{dual / bogie:.2f} ({bogie:.1f} and {dual:.1f} m/s)" in text
    assert "ratio of 1.08 to 1.22" in text
