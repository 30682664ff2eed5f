"""What the shipped vehicles do: their critical speeds on tangent track, as numbers."""

import math

import pytest

import railenv
from tests.railenv.contacts import assert_hunts_from, critical_speed

BOGIES = {
    "TABLE_1": (12.46, 0.7628),
    "TABLE_1_PRINTED_LOADS": (12.79, 0.7825),
    "HIGH_SPEED_COACH": (116.47, 3.1135),
    "HIGH_SPEED_COACH_HOLLOW": (114.29, 4.690),
    "HIGH_SPEED_COACH_S1002": (88.18, 6.838),
    "HIGH_SPEED_COACH_S1002_WORN": (89.14, 6.812),
    "MANCHESTER_1": (72.42, 5.9151),
}


@pytest.mark.parametrize(
    "vehicle", [v for v in railenv.PRESETS if v.name != "CRH380A"], ids=lambda v: v.name
)
def test_bogie_hunts_from_its_critical_speed_on(vehicle):
    assert_hunts_from(railenv.Bogie(vehicle), *BOGIES[vehicle.name])


def test_dual_wheelset_of_the_paper_hunts_from_its_critical_speed_on():
    assert_hunts_from(railenv.DualWheelset(railenv.TABLE_1), 34.18, 1.8682)
    assert_hunts_from(railenv.DualWheelset(railenv.TABLE_1_PRINTED_LOADS), 34.41, 1.8802)


def tangent(pair):
    """Return the linear profile that touches a pair's tables at the centre."""
    made = pair.table("profiles")
    return railenv.LinearProfile(made(0.0, 1, 2), made(0.0, 0, 1), made(0.0, 1, 1))


@pytest.mark.parametrize("wheel", ["S1002", "S1002_WORN"])
def test_profiles_hunt_as_their_linear_part_at_the_centre(wheel):
    coach, pair = railenv.HIGH_SPEED_COACH_S1002, railenv.ProfilePair(wheel=wheel)
    speed, _ = BOGIES["HIGH_SPEED_COACH_S1002" + "_WORN" * (wheel == "S1002_WORN")]
    linear = critical_speed(railenv.Bogie(coach.replace(contact=tangent(pair))), speed)
    assert linear == pytest.approx(
        critical_speed(railenv.Bogie(coach.replace(contact=pair)), speed), rel=1e-4
    )


def test_a_rail_gives_way_to_flanges_and_not_to_treads():
    coach = railenv.HIGH_SPEED_COACH_S1002
    firm, yielding = railenv.ProfilePair(rail_yield=0.0), railenv.ProfilePair()
    rigid, soft = tangent(firm), tangent(yielding)
    assert soft.conicity == pytest.approx(rigid.conicity, rel=5e-3)
    assert soft.contact_angle == pytest.approx(rigid.contact_angle, rel=5e-3)
    assert_hunts_from(railenv.Bogie(coach.replace(contact=firm)), 88.10, 6.843)
    # on the flange: slope over shift is the load over the rail's lateral stiffness
    table = yielding.table("profiles")
    assert table(0.011, 0, 1) < 0.9 * table(0.016, 0, 1)
    assert table(0.010, 1, 1) * yielding.rail_yield == pytest.approx(1.0, rel=0.05)


def test_conicity_of_the_profiles_is_told_with_them():
    worn = railenv.HIGH_SPEED_COACH_S1002_WORN.contact
    assert "equivalent conicity 0.34 at 3 mm" in railenv.HIGH_SPEED_COACH_S1002_WORN.provenance
    assert worn.equivalent_conicity(3e-3) == pytest.approx(0.34, abs=0.005)
    new = railenv.HIGH_SPEED_COACH_S1002
    assert new.contact.equivalent_conicity(3e-3) == pytest.approx(0.173, abs=0.001)
    assert new.half_gauge == pytest.approx(new.contact.half_contact_distance, abs=1e-3)
    assert new.wheel_radius == new.contact.nominal_radius
    assert new.klingel_wavelength == pytest.approx(
        2.0 * math.pi * math.sqrt(0.75 * 0.46 / 0.173), rel=0.01
    )
