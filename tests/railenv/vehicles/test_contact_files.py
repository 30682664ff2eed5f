"""Contact laws of vehicles and in their files: what is written reads back, what is wrong is told."""

import dataclasses
import math

import pytest

import railenv
from railenv.contact.given import LAWS, contact_law
from railenv.errors import ParameterError, UnknownNameError
from tests.railenv.contacts import laws, on_round_rail, straight

COACH = railenv.HIGH_SPEED_COACH
OWN = on_round_rail(straight(0.1), math.atan(0.1), 0.05, gauge_depth=0.0004)
GIVEN = {
    **laws(),
    "points": OWN,
    "narrow": railenv.ProfilePair(gauge=1.434, inclination=0.05, rail_yield=0.0, grid=1e-4),
    "family of points": railenv.ProfileFamily(OWN, dataclasses.replace(OWN, width=2e-5), 0.25),
}


def test_every_law_is_among_those_given():
    assert {type(law) for law in GIVEN.values()} == set(LAWS)


@pytest.mark.parametrize("law", GIVEN)
def test_a_law_as_plain_values_is_the_law(law):
    plain = GIVEN[law].to_mapping()
    again = contact_law(plain)
    assert again == GIVEN[law]
    assert hash(again) == hash(GIVEN[law])
    assert again.to_mapping() == plain


@pytest.mark.parametrize("law", GIVEN)
def test_a_vehicle_with_its_contact_reads_back_equal(law, tmp_path):
    vehicle = COACH.replace(contact=GIVEN[law])
    text = vehicle.to_toml(tmp_path / "v.toml")
    again = railenv.Vehicle.from_toml(tmp_path / "v.toml")
    assert again == vehicle
    assert again.to_toml() == text
    assert ("[contact]" in text) == (not isinstance(vehicle.contact, railenv.Cone))
    assert again.contact == GIVEN[law]


@pytest.mark.parametrize("law", GIVEN)
def test_an_assembly_with_its_contact_reads_back_equal(law, tmp_path):
    model = railenv.DualWheelset(COACH.replace(contact=GIVEN[law]))
    model.assembly.to_toml(tmp_path / "v.toml")
    again = railenv.Assembly.from_toml(tmp_path / "v.toml")
    assert again == model.assembly
    assert railenv.Assembled(again).structure == model.structure
    assert again.contact_law("w2") == GIVEN[law]


def test_profiles_are_told_by_name_or_by_points_or_from_a_file(tmp_path):
    assert railenv.ProfilePair().to_mapping()["wheel"] == "S1002"
    assert set(OWN.to_mapping()["wheel"]) == {"name", "source", "points"}
    text = """
base = "HIGH_SPEED_COACH_S1002"
name = "mine"
[contact]
law = "profiles"
wheel = "S1002"
rail = "UIC60"
inclination = 0.05
"""
    (tmp_path / "v.toml").write_text(text, encoding="utf-8")
    found = railenv.Vehicle.from_toml(tmp_path / "v.toml")
    assert found.contact == railenv.ProfilePair(inclination=0.05)
    wheel = railenv.ProfilePair().wheel.points.tolist()
    (tmp_path / "v.toml").write_text(
        text.replace('"S1002"\nrail', f"{{points = {wheel}}}\nrail"), encoding="utf-8"
    )
    by_points = railenv.Vehicle.from_toml(tmp_path / "v.toml").contact
    assert by_points.table("profiles") == found.contact.table("profiles")


def test_wheels_of_their_own_read_back_equal(tmp_path):
    assembly = railenv.DualWheelset(COACH).assembly
    first = dataclasses.replace(
        assembly.bodies[0],
        right_contact=railenv.LinearProfile(0.2, 0.03, 13.6),
        radius_difference=1e-3,
    )
    made = dataclasses.replace(assembly, bodies=(first, *assembly.bodies[1:]))
    made.to_toml(tmp_path / "v.toml")
    again = railenv.Assembly.from_toml(tmp_path / "v.toml")
    assert again == made
    assert again.values["w1_right_contact_angle"] == 0.03
    changed = again.replace(w1_right_conicity=0.3, w1_radius_difference=2e-3)
    assert changed.bodies[0].right_contact.conicity == 0.3
    assert changed.bodies[0].contact == again.bodies[0].contact


# ------------------------------------------------------------------------------ refusals

BAD = [
    ({"law": "wickens"}, "unknown contact law: 'wickens'.* allowed are cone, linear"),
    ({"conicity": 0.1}, "it must be a contact law such as railenv.Cone, or a mapping with 'law'"),
    (5, "contact is 5; it must be a contact law"),
    ("cone", "contact is 'cone'; it must be a contact law"),
    ({"law": "cone"}, "contact law 'cone' lacks conicity"),
    ({"law": "linear", "conicity": 0.1}, "'linear' lacks contact_angle, contact_angle_rate"),
    ({"law": "cone", "conicty": 0.1}, r"unknown field of Cone: 'conicty' \(did you mean 'conicity'"),
    ({"law": "cone", "conicity": math.nan}, "conicity of Cone is nan; it must be finite"),
    ({"law": "cone", "conicity": 0.0}, "conicity of Cone is 0"),
    ({"law": "cone", "conicity": True}, "conicity of Cone is True, which is not a number"),
    ({"law": "cone", "conicity": "steep"}, "conicity of Cone is 'steep', which is not a number"),
    (
        {"law": "linear", "conicity": 0.1, "contact_angle": -0.01, "contact_angle_rate": 1.0},
        "contact_angle of LinearProfile is -0.01",
    ),
    (
        {"law": "linear", "conicity": 0.1, "contact_angle": 0.01, "contact_angle_rate": math.inf},
        "contact_angle_rate of LinearProfile is inf",
    ),
    (
        {"law": "arcs", "contact_angle": 0.05, "wheel_profile_radius": 0.3, "rail_profile_radius": 0.3},
        "the hollow of the wheel must be wider than the rail head",
    ),
    (
        {"law": "arcs", "contact_angle": 0.0, "wheel_profile_radius": 0.5, "rail_profile_radius": 0.3},
        "contact_angle of ArcProfile is 0; it must be finite and greater than 0",
    ),
    (
        {"law": "hollow", "conicity": 0.02, "contact_angle": 0.03, "rail_profile_radius": 0.3},
        "has at least that conicity",
    ),
    (
        {"law": "hollow", "conicity": math.nan, "contact_angle": 0.03, "rail_profile_radius": 0.3},
        "conicity of HollowTread is nan",
    ),
    ({"law": "profiles", "wheel": "S1003"}, "profile of a wheel: 'S1003'.*did you mean 'S1002'"),
    ({"law": "profiles", "gauge": 1.40}, "on its flange at the centre"),
    ({"law": "profiles", "rail_yield": -1.0}, "rail_yield is -1 m"),
    ({"law": "profiles", "grid": math.nan}, "grid is nan m"),
    ({"law": "profiles", "wheel": {"pts": [[0.0, 0.0]]}}, "unknown field of wheel: 'pts'"),
    ({"law": "profiles", "wheel": {"name": "mine"}}, "wheel lacks points"),
    ({"law": "family", "new": {"law": "profiles"}}, "contact law 'family' lacks worn, wear"),
    (
        {"law": "family", "new": {}, "worn": {}, "wear": 1.5},
        "wear of ProfileFamily is 1.5; it must be finite and at least 0 and at most 1",
    ),
    ({"law": "family", "new": 1, "worn": {}, "wear": 0.5}, "new of ProfileFamily is 1; it must be"),
]


@pytest.mark.parametrize(("contact", "message"), BAD, ids=[str(i) for i in range(len(BAD))])
def test_contacts_that_cannot_be_are_told_by_what_is_wrong(contact, message):
    with pytest.raises(ParameterError, match=message):
        COACH.replace(contact=contact)


def test_conicity_and_contact_may_agree_but_not_contradict():
    vehicle = dataclasses.replace(COACH, conicity=0.1, contact=railenv.Cone(0.1))
    assert vehicle == COACH.replace(conicity=0.1) == COACH.replace(contact=railenv.Cone(0.1))
    with pytest.raises(ParameterError, match=r"conicity of .* is 0\.2 and its contact a Cone of 0\.1"):
        dataclasses.replace(COACH, conicity=0.2, contact=railenv.Cone(0.1))
    pair = railenv.ProfilePair()
    with pytest.raises(ParameterError, match="and its contact ProfilePair, which has none"):
        dataclasses.replace(COACH, conicity=0.2, contact=pair)
    with pytest.raises(ParameterError, match="lacks contact; give a contact law, or conicity"):
        dataclasses.replace(COACH, conicity=None, contact=None)


def test_numbers_of_the_law_change_by_their_own_names():
    hollow = railenv.HIGH_SPEED_COACH_HOLLOW
    changed = hollow.replace(conicity=0.3, contact_angle=0.02, body_mass=3e4)
    assert changed.contact == railenv.HollowTread(0.3, 0.02, 0.3)
    assert (changed.conicity, changed.body_mass) == (0.3, 3e4)
    assert COACH.replace(contact=railenv.LinearProfile(0.2, 0.03, 13.6), conicity=0.25).contact == (
        railenv.LinearProfile(0.25, 0.03, 13.6)
    )
    on_profiles = railenv.HIGH_SPEED_COACH_S1002
    assert on_profiles.conicity is None
    with pytest.raises(ParameterError, match=r"which has no such number; give contact=railenv\.Cone"):
        on_profiles.replace(conicity=0.2)
    with pytest.raises(UnknownNameError, match="unknown field: 'contact_angle'"):
        COACH.replace(contact_angle=0.03)
    with pytest.raises(ParameterError, match="at least that conicity"):
        hollow.replace(conicity=0.01)
    family = railenv.ProfileFamily(on_profiles.contact, on_profiles.contact, 0.5)
    assert on_profiles.replace(contact=family).replace(wear=0.7).contact.wear == 0.7


def test_laws_are_checked_and_frozen():
    law = railenv.Cone(0.1)
    with pytest.raises(dataclasses.FrozenInstanceError):
        law.conicity = 0.2
    with pytest.raises(UnknownNameError, match="unknown field of Cone: 'slope'"):
        law.replace(slope=0.1)
    assert law.replace(conicity=0.2) == railenv.Cone(0.2)
    with pytest.raises(ParameterError, match="conicity of Cone is 1"):
        law.replace(conicity=1.0)
