"""What the page shows as a record, and what it gives away: Python and TOML."""

import dataclasses
import math
import shlex

import numpy as np
import pytest
from typer.testing import CliRunner

import design
import railenv
from agents.problems import PrimaryDamper, YawDamper
from railenv import cli
from railenv.errors import ParameterError
from railenv.explorer import computations
from railenv.explorer.script import expression
from railenv.explorer.state import State, Wearing, YawRate, controller_names
from railenv.vehicles.lookup import named

CONE = State(vehicle=railenv.HIGH_SPEED_COACH)
WHEEL = railenv.Profile.named("S1002")
OWN = railenv.ProfilePair(
    wheel=railenv.Profile.of(WHEEL.points + np.array([0.0, 1e-6]), kind="wheel", name='my "wheel"'),
    gauge=1.434,
)
"""A pair whose wheel is no shipped one."""

MINE = railenv.MANCHESTER_1.replace(
    name="MINE", frame_mass=2500.0, lateral_stop_force=((0.02, 0.03), (0.0, 1e4)), contact=OWN
)
PARTS = railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(name="parts")).assembly

STATES = {
    "as it opens": State(),
    "on a curve, other numbers": dataclasses.replace(
        State(), radius=4000.0, cant=0.06, speed=61.5, offset=1e-3, duration=2.0
    )
    .with_number("conicity", 0.21)
    .with_number("friction", 0.3)
    .with_number("creep_factor", 0.8),
    "a cone": CONE.with_contact(railenv.Cone(0.13)),
    "profiles": dataclasses.replace(
        State().with_contact(railenv.ProfilePair("S1002_WORN")), speed=70.0
    ),
    "a primary damper": dataclasses.replace(
        State(vehicle=railenv.TABLE_1, speed=10.0, speed_range=(3.0, 40.0)), damper=PrimaryDamper(2e4)
    ),
    "no dampers": dataclasses.replace(
        State(vehicle=railenv.TABLE_1, speed=10.0, speed_range=(3.0, 40.0)), damper="none"
    ),
    "parts": State(vehicle=PARTS, speed=90.0),
    "feedback": State(controller=YawRate(1e5), speed_range=(20.0, 200.0), duration=1.0),
    "shipped controller": State(controller="lqr", speed_range=(20.0, 120.0), duration=1.0),
}


@pytest.mark.parametrize("state", STATES.values(), ids=STATES)
def test_python_gives_exactly_what_is_shown(state, capsys):
    found = computations.stability(state)
    present = computations.present(state, found)
    moved = computations.motion(state)
    namespace = {}
    exec(compile(state.to_python(), "shown", "exec"), namespace)
    locus, response = namespace["locus"], namespace["response"]
    np.testing.assert_array_equal(locus.eigenvalues, found.locus.eigenvalues)
    np.testing.assert_array_equal(locus.states, found.locus.states)
    assert locus.critical.speed == found.critical.speed
    assert str(locus.critical) == str(found.critical)
    mode = locus.mode(state.speed)
    np.testing.assert_array_equal(mode.displacements, present.shape.displacements)
    assert (mode.name, mode.eigenvalue) == (present.shape.name, present.shape.eigenvalue)
    np.testing.assert_array_equal(response.outputs, moved.response.outputs)
    np.testing.assert_array_equal(response.time, moved.response.time)
    printed = capsys.readouterr().out.splitlines()
    assert printed == [str(found.critical), str(mode), str(moved.spectrum)]


@pytest.mark.parametrize("state", STATES.values(), ids=STATES)
def test_toml_gives_the_vehicle_that_is_shown(state, tmp_path):
    file = tmp_path / "shown.toml"
    file.write_text(state.to_toml(), encoding="utf-8")
    assert named(str(file)) == state.vehicle_shown


def test_toml_tells_the_command_that_goes_on_with_it(tmp_path):
    state = STATES["on a curve, other numbers"]
    file = tmp_path / "shown.toml"
    file.write_text(state.to_toml(), encoding="utf-8")
    head = file.read_text(encoding="utf-8").splitlines()[:2]
    assert head[0] == (
        "# Shown by railenv explore at 61.5 m/s on R = 4000 m, cant 0.06 rad, with no controller:"
    )
    words = shlex.split(head[1].removeprefix("# railenv ").replace("FILE.toml", str(file)))
    said = CliRunner().invoke(cli.app, words).output
    assert said == f"bogie: {design.critical_speed(state.model(), radius=4000.0, cant=0.06)}\n"


@pytest.mark.parametrize(
    "vehicle",
    [*railenv.PRESETS, MINE],
    ids=lambda v: v.name,
)
def test_python_of_a_vehicle_makes_its_equal(vehicle):
    namespace = {}
    text = State(vehicle=vehicle).to_python().split("\nmodel =")[0]
    exec(text, namespace)
    assert namespace["vehicle"] == vehicle


@pytest.mark.parametrize(
    "contact",
    [
        railenv.Cone(0.1),
        railenv.LinearProfile(0.2, 0.03, 13.6),
        railenv.ArcProfile(0.05, 0.5, 0.3),
        OWN,
        Wearing(railenv.ProfilePair(gauge=1.433), depth=2e-4),
    ],
    ids=lambda c: type(c).__name__,
)
def test_python_of_a_contact_makes_its_equal(contact):
    state = State().with_contact(contact)
    namespace = {}
    exec(state.to_python().split("\nmodel =")[0], namespace)
    assert namespace["vehicle"] == state.vehicle_shown


def test_profiles_bring_the_distance_of_their_contacts():
    shown = State().with_contact(OWN).vehicle_shown
    assert shown.half_gauge == OWN.half_contact_distance
    assert shown.wheel_radius == OWN.nominal_radius
    assert State().with_contact(OWN).with_contact(None).vehicle_shown == State().vehicle


def test_expressions_are_python():
    for value in (
        1e6,
        None,
        True,
        "a'b",
        ((0.0, 1.0), (2.0, 3.0)),
        railenv.HollowTread(0.1, 0.03, 0.3),
    ):
        assert eval(expression(value), {"railenv": railenv}) == value


def test_a_damper_takes_the_place_of_the_vehicles_own():
    state = dataclasses.replace(State(vehicle=railenv.CRH380A), damper=YawDamper(1e5, 5e6))
    assert state.vehicle_shown.secondary_yaw_damper_stiffness == 5e6
    bare = dataclasses.replace(state, damper="none").vehicle_shown
    assert bare.secondary_yaw_damper_stiffness is None
    assert dataclasses.replace(state, damper="own").vehicle_shown == railenv.CRH380A


def test_wear_goes_from_the_new_pair_to_the_worn_one():
    pair = railenv.ProfilePair()
    worn = State().with_contact(Wearing(pair))
    assert worn.law.new == pair
    assert worn.law.wear == 0.0
    assert worn.with_number("wear", 0.25).law.wear == 0.25
    assert dict(worn.with_number("wear", 0.25).with_contact(None).numbers) == {}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed": 250.0}, "speed is 250"),
        ({"radius": 0.0}, "radius"),
        ({"offset": 1.0}, "offset is 1"),
        ({"duration": 0.0}, "duration is 0"),
        ({"kind": "tram"}, "kind is 'tram'"),
        ({"speed_range": (50.0, 20.0)}, "speed_range"),
    ],
)
def test_what_cannot_be_is_refused(changes, message):
    with pytest.raises(ParameterError, match=message):
        dataclasses.replace(State(), **changes)


def test_parts_have_their_own_contact_and_dampers():
    for changed in (
        State(vehicle=PARTS).with_contact(railenv.Cone(0.1)),
        State(vehicle=PARTS, damper="none"),
    ):
        with pytest.raises(ParameterError, match="made of parts"):
            changed.model()


def test_another_range_takes_the_speed_along():
    assert State().with_speed_range(5.0, 60.0).speed == 60.0
    assert State().with_speed_range(120.0, 160.0).speed == 120.0


def test_controllers_are_those_whose_loop_has_eigenvalues():
    assert "lqg" in controller_names("bogie")
    assert "output-feedback" in controller_names("dual-wheelset")
    assert "adaptive-lqg" not in controller_names("coach")
    assert math.isinf(State().radius)
