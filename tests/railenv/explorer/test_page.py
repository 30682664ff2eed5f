"""The page without a browser: its controls are moved, and what it shows is read."""

import dataclasses
import html
import math
import re

import numpy as np
import pytest

pytest.importorskip("panel", reason="needs the extra explore")

import design
import railenv
from agents.problems import YawDamper
from railenv.errors import EquilibriumError
from railenv.explorer import computations as compute
from railenv.explorer.page import Page
from railenv.explorer.state import State, Wearing, YawRate
from railenv.explorer.tasks import Done, Missing
from railenv.explorer.worker import AtOnce

MINE = b'base = "HIGH_SPEED_COACH"\nname = "MINE"\nconicity = 0.2\n'


def opened(state=None):
    return Page(state, lambda deliver, failed: AtOnce(deliver))


@pytest.fixture
def page():
    return opened()


def words(page):
    """What stands above the page, as plain text."""
    return html.unescape(re.sub(r"<[^>]+>", " ", page._answer.object))


def expected(page):
    return design.critical_speed(
        page.state.model(), radius=page.state.radius, cant=page.state.cant, speed_range=(3.0, 200.0)
    )


def test_it_opens_with_everything_computed(page):
    assert str(expected(page)) in words(page)
    assert "at 100 m/s (360 km/h) stable: least damped is bogie hunting" in words(page)
    locus = page.stability.locus
    np.testing.assert_array_equal(page._locus.least.data["x"], locus.loci[:, locus.least_damped].real)
    np.testing.assert_array_equal(page._history.lines["leading"].data["y"], 1e3 * page.motion["y_w1"])
    assert page._damping.lost[0].location == page.stability.critical.speed
    assert page.curves.linear.conicity == 0.1
    assert page.code.value == page.state.to_python()
    assert page.message == ""
    assert page._work.styles["opacity"] == "0"


def test_the_speed_moves_what_depends_on_it_and_nothing_else(page):
    before = page.stability
    page.controls.speed.value = 130.0
    assert page.stability is before
    assert page.present.speed == 130.0
    assert page.present.shape.damping < 0.0
    assert page._locus.worst.data["y"][0] == pytest.approx(2.0 * math.pi * page.present.shape.frequency)
    assert "unstable" in words(page)
    assert 4e-3 < page.motion.amplitude < 0.02
    assert page._damping.now[0].location == 130.0


@pytest.mark.parametrize(
    ("name", "value"), [("conicity", 0.2), ("friction", 0.4), ("creep_factor", 0.6)]
)
def test_numbers_of_the_contact_move_the_critical_speed(page, name, value):
    page.controls.numbers[name].value = value
    assert dict(page.state.numbers) == {name: value}
    assert str(expected(page)) in words(page)
    assert getattr(page.state.vehicle_shown, name, value) == value


def test_curve_offset_and_duration(page):
    page.controls.radius.value = 4000.0
    page.controls.cant.value = 0.06
    page.controls.offset.value = 1.0
    page.controls.duration.value = 2.0
    state = page.state
    assert (state.radius, state.cant, state.offset, state.duration) == (4000.0, 0.06, 1e-3, 2.0)
    assert page.motion.response.time[-1] == 2.0
    assert "R = 4000 m, cant 0.06 rad, uncompensated lateral acceleration 1.91 m/s²" in words(page)
    page.controls.other_radius.value = "-5500"
    assert page.state.radius == -5500.0
    assert page.controls.radius.value == -5500.0


def test_contact_of_ones_choice(page):
    page.controls.contact.value = "profiles"
    assert page.state.law == railenv.ProfilePair()
    assert page._contact.profiles.visible
    page.controls.wheel.value = "S1002_WORN"
    page.controls.gauge.value = 1434.0
    assert page.state.law == railenv.ProfilePair("S1002_WORN", gauge=1.434)
    page.controls.contact.value = "as the vehicle has it"
    assert page.state.law == railenv.HIGH_SPEED_COACH_HOLLOW.contact
    assert not page._contact.profiles.visible


def test_wear_has_a_slider(page):
    page.change(lambda s: s.with_contact(Wearing(railenv.ProfilePair(), depth=2e-4)))
    page.controls.numbers["wear"].value = 0.7
    assert page.state.law.wear == 0.7
    assert page.controls.contact.value == "profiles, new to worn"
    page.controls.gauge.value = 1433.0
    assert page.state.contact.new.gauge == 1.433
    assert page.state.law.wear == 0.7


def test_dampers(page):
    page.controls.damper.value = "yaw"
    page.controls.rate.value = 200.0
    assert page.state.damper == YawDamper(2e5, 1e7)
    assert page.stability.critical.speed is None or page.stability.critical.speed > 150.0
    page.controls.damper.value = "own"
    assert page.state.damper == "own"
    assert not page.controls._damper_box.visible


def test_controllers():
    page = opened(State(duration=1.0))
    page.controls.controller.value = "yaw rate, gain below"
    assert page.state.controller == YawRate(1e5)
    assert page.state.speed_range == (20.0, 200.0)
    assert page.stability.critical.speed == pytest.approx(147.9775, abs=1e-3)
    page.controls.gain.value = 0.0
    assert page.stability.critical.speed == pytest.approx(114.2856, abs=1e-2)
    page.controls.controller.value = "none"
    assert page.state.controller is None


# -------------------------------------------------------------------------------- files


def test_a_dropped_vehicle_is_shown(page):
    page.controls._opened("mine.toml", MINE, page.controls.open_vehicle)
    assert page.state.vehicle == railenv.HIGH_SPEED_COACH.replace(name="MINE", conicity=0.2)
    assert page.controls.vehicle.value == "MINE (mine.toml)"
    assert str(expected(page)) in words(page)
    page.controls.vehicle.value = "HIGH_SPEED_COACH"
    page.controls.vehicle.value = "MINE (mine.toml)"
    assert page.state.vehicle.conicity == 0.2
    assert page.save.filename == "mine.toml"


def test_dropped_parts_are_a_vehicle(page):
    parts = railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(name="parts")).assembly
    page.controls._opened("parts.toml", parts.to_toml().encode(), page.controls.open_vehicle)
    assert page.state.vehicle == parts
    assert "hunting from 116.4739 m/s at 3.1135 Hz" in words(page)
    assert not page.controls.kind.visible
    page.controls.numbers["conicity"].value = 0.1
    assert "hunting from 110.7167 m/s at 4.3803 Hz" in words(page)  # as the README says


def test_a_dropped_profile_runs_on_the_rail(page):
    wheel = railenv.Profile.named("S1002_WORN")
    text = "y_mm,z_mm\n" + "".join(f"{1e3 * y!r},{1e3 * z!r}\n" for y, z in wheel.points.tolist())
    page.controls._opened("worn.csv", text.encode(), page.controls.open_wheel)
    assert page.state.law.wheel.name == "worn"
    assert page.controls.wheel.value == "worn"
    np.testing.assert_allclose(page.state.law.wheel.points, wheel.points, atol=1e-15)
    own = railenv.ProfilePair("S1002_WORN").equivalent_conicity(3e-3)
    assert page.curves.at_bound == pytest.approx(own, rel=1e-2)


def test_what_a_browser_sends_as_a_profile_is_no_path(page, tmp_path):
    file = tmp_path / "wheel.csv"
    railenv.Profile.named("S1002").write(file)

    def sent(state):
        return page.controls._pair_changed(wheel=str(file))(state)

    page.change(sent)
    assert "unknown profile of a wheel" in page.message
    assert page.state == State()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("mine.toml", b"no toml", "mine.toml is not a TOML file"),
        ("mine.toml", b'base = "HIGH_SPEED_COACH"\nmass = 3\n', "unknown field in mine.toml: 'mass'"),
        ("<b>.toml", b'base = "HIGH_SPEED_COACH"\nfriction = -1\n', "<b>.toml: friction is -1"),
    ],
)
def test_a_bad_file_is_told_and_nothing_is_lost(page, name, content, message):
    page.controls.speed.value = 90.0
    before, shown = page.state, words(page)
    page.controls._opened(name, content, page.controls.open_vehicle)
    assert message in page.message
    assert page._alert.visible
    assert 'role="alert"' in page._alert.object
    assert "<b>" not in page._alert.object
    assert page.state == before
    assert words(page) == shown
    page.controls.speed.value = 95.0
    assert page.message == ""
    assert not page._alert.visible


# ------------------------------------------------------------------------ what cannot be


def test_what_cannot_be_leaves_the_state_before(page):
    page.controls.vehicle.value = "TABLE_1"
    page.controls.kind.value = "coach"  # Table 1 has no body that moves
    assert "body" in page.message
    assert page.state.kind == "bogie"
    assert page.controls.kind.value == "bogie"
    page.controls.other_radius.value = "sharp"
    assert "radius is 'sharp'" in page.message
    page.controls.speed.value = 1e4
    assert "speed is 10000" in page.message
    assert page.controls.speed.value == page.state.speed


def test_a_missing_equilibrium_is_told_and_the_page_goes_on(page, monkeypatch):
    def missing(_):
        raise EquilibriumError("there is none", residual=1.0, reached=0.0)

    monkeypatch.setattr(compute, "stability", missing)
    page.controls.numbers["conicity"].value = 0.3
    assert "there is none" in words(page)
    assert len(page._locus.least.data["x"]) == 0
    assert page.stability is None
    assert page.motion is not None
    monkeypatch.undo()
    page.controls.numbers["conicity"].value = 0.31
    assert "hunting from" in words(page)


def test_the_end_of_the_equilibrium_is_shown():
    page = opened(State(vehicle=railenv.HIGH_SPEED_COACH, radius=2500.0, cant=0.0873))
    assert "ends in a fold at 65.5820 m/s" in words(page)
    assert "no running equilibrium at 100 m/s" in words(page)
    assert page.present is None


def test_unexpected_failures_are_told(page):
    page._failed(ZeroDivisionError("by <zero>"))
    assert page.message == "ZeroDivisionError: by <zero>"
    assert "&lt;zero&gt;" in page._alert.object


# ----------------------------------------------------------------------- moving vehicle


def test_the_vehicle_moves_in_time_and_in_its_mode(page):
    frames = page._vehicle.frames.data
    count = len(frames["time"])
    assert count == 250
    assert frames["time"][-1] == 5.0
    axle = frames["plan_axle_y"]
    assert axle.shape[0] == count
    factor = float(page._vehicle.plan.title.text.split("×")[1])
    at_start = page.motion["y_w1"][0] * factor
    assert np.nanmean(axle[0, :2]) == pytest.approx(at_start, rel=1e-3)
    page.moves.value = "least damped mode"
    frames = page._vehicle.frames.data
    assert len(frames["time"]) == 40
    assert "bogie hunting" in page._vehicle.plan.title.text
    np.testing.assert_allclose(
        frames["plan_axle_y"][0, :2] + frames["plan_axle_y"][20, :2],
        [-2 * 0.7176, 2 * 0.7176],
        atol=1e-4,
    )


def test_frames_hang_on_their_springs_without_being_drawn_lower(page):
    """A loaded frame sinks by centimetres; pictures have bodies where they are at rest."""
    front = page._vehicle.frames.data["front_frame_y"]
    height = railenv.HIGH_SPEED_COACH_HOLLOW.frame_height
    assert np.nanmax(np.abs(front - height)) < 0.2


# ------------------------------------------------------------------- bifurcation diagram


@pytest.fixture(scope="module")
def branch():
    state = State(vehicle=railenv.HIGH_SPEED_COACH)
    return next(compute.diagram(state))


def test_the_diagram_is_shown_as_it_grows(page, branch, monkeypatch):
    steps = [branch, dataclasses.replace(branch, share=1.0, said="all of it")]
    monkeypatch.setattr(
        compute, "diagram", lambda state: (dataclasses.replace(s, state=state) for s in steps)
    )
    page.follow()
    assert page.diagram.said == "all of it"
    assert page._diagram_note.object == "all of it"
    assert not page._follow.disabled
    assert page._cancel.disabled
    assert page._diagram.figure.visible
    shown = {item.label.value for item in page._diagram.legend.items if item.visible}
    assert shown == {"stable", "unstable", "Hopf point", "fold"}
    assert page._diagram.hopf.data["x"][0] == pytest.approx(116.4739, abs=1e-3)
    assert "design.cycle_branch" in page.code.value
    page.controls.numbers["friction"].value = 0.4
    assert "follow it anew" in page._diagram_note.object
    assert "design.cycle_branch" not in page.code.value


def test_a_diagram_that_cannot_be_says_why(page, monkeypatch):
    page.apply_diagram(Missing("diagram", "no Hopf point"))
    assert page._diagram_note.object == "no Hopf point"
    page.give_up()
    assert "given up" in page._diagram_note.object
    page.apply_diagram(Done())
    assert not page._follow.disabled


def test_saved_toml_is_the_vehicle_that_is_shown(page):
    page.controls.numbers["conicity"].value = 0.2
    assert page._toml().getvalue() == page.state.to_toml()
