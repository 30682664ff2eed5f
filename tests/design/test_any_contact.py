"""Maps, loci, boxes and branches over the numbers of any contact law, not of a cone only."""

import math

import numpy as np
import pytest

import design
import railenv
from design.linear.quantities import meaning_of

S1002 = railenv.HIGH_SPEED_COACH_S1002
FAMILY = railenv.ProfileFamily(railenv.ProfilePair(), railenv.ProfilePair(wheel="S1002_WORN"), wear=0.0)
HOLLOW = railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW)
WEARING = railenv.Bogie(S1002.replace(contact=FAMILY))

LAWS = pytest.mark.parametrize(
    ("model", "number", "low", "high"),
    [(HOLLOW, "conicity", 0.05, 0.4), (WEARING, "wear", 0.0, 1.0)],
    ids=["hollow tread", "family of profiles"],
)


def hunts_from(model, **changes):
    return design.critical_speed(model.replace(**changes)).speed


@LAWS
def test_a_locus_over_a_number_of_the_contact_ends_stability_at_its_critical_speed(
    model, number, low, high
):
    between = 0.5 * (hunts_from(model, **{number: low}) + hunts_from(model, **{number: high}))
    locus = design.parameter_locus(model, number, np.linspace(low, high, 4), speed=between)
    (point,) = locus.critical_points
    assert hunts_from(model, **{number: point.value}) == pytest.approx(between, rel=1e-6)


@LAWS
def test_a_map_over_a_number_of_the_contact_has_the_critical_speeds(model, number, low, high):
    chart = design.stability_map(model, {"radius": [8000.0, math.inf], number: [low, high]})
    found = chart.critical_speed[1]
    expected = [hunts_from(model, **{number: value}) for value in (low, high)]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@LAWS
def test_the_worst_vehicle_of_a_box_is_found(model, number, low, high):
    box = {number: (low, high), "creep_factor": (0.6, 1.4)}
    found = design.robust_critical_speed(model, None, box, samples=2)
    corners = [
        hunts_from(model, **{number: value, "creep_factor": factor})
        for value in (low, high)
        for factor in (0.6, 1.4)
    ]
    assert found.speed <= min(corners) * (1.0 + 1e-6)
    assert hunts_from(model, **found.worst) == pytest.approx(found.speed, rel=1e-4)


@pytest.mark.parametrize(
    ("model", "number", "values"),
    [(HOLLOW, "conicity", [0.1, 0.12]), (WEARING, "wear", [0.99, 1.0])],
    ids=["hollow tread", "family of profiles"],
)
def test_a_hunting_map_over_a_number_of_the_contact_agrees_with_a_branch(model, number, values):
    chart = design.hunting_map(model, number, values)
    branch = design.cycle_branch(model.replace(**{number: values[1]}), points=60)
    assert chart.hopf_speed[1] == pytest.approx(branch.hopf.speed, rel=1e-8)
    assert chart.onset_speed[1] == pytest.approx(branch.nonlinear_critical_speed, rel=1e-4)
    assert chart.onset_speed[1] < chart.hopf_speed[1]


def test_where_hunting_begins_gently_it_persists_from_the_hopf_point():
    chart = design.hunting_map(WEARING, "wear", [0.0])
    assert chart.onset_speed[0] == chart.hopf_speed[0]
    assert chart.onsets[0].rests_on == "Hopf"
    assert design.cycle_branch(WEARING).nonlinear_critical_speed == chart.hopf_speed[0]


def test_a_fixed_pair_of_profiles_has_no_conicity_to_vary():
    with pytest.raises(railenv.UnknownNameError, match="conicity"):
        design.parameter_locus(railenv.Bogie(S1002), "conicity", [0.1, 0.2], speed=80.0)


def test_pictures_say_what_a_number_of_the_contact_is():
    found = [meaning_of(model, name) for model, name in ((HOLLOW, "conicity"), (WEARING, "wear"))]
    assert [each.text.partition(":")[0] for each in found] == ["conicity", "wear"]
    assert [each.unit for each in found] == ["1", "1"]
