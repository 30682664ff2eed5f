"""Results of the page against the analyses they come from, and against physics of their own."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

import design
import railenv
from railenv.errors import ParameterError
from railenv.explorer import computations as compute
from railenv.explorer.state import State, Wearing

CONE = State(vehicle=railenv.HIGH_SPEED_COACH)


@pytest.fixture(scope="module")
def found():
    return compute.stability(CONE)


def test_critical_speed_is_that_of_the_package(found):
    alone = design.critical_speed(railenv.Bogie(railenv.HIGH_SPEED_COACH))
    assert found.critical.speed == pytest.approx(alone.speed, rel=1e-9)
    assert found.critical.loss == "hunting"


def test_present_mode_is_that_of_the_locus(found):
    now = compute.present(CONE, found)
    mode = found.locus.mode(CONE.speed)
    np.testing.assert_array_equal(now.shape.displacements, mode.displacements)
    assert now.shape.name == mode.name == "bogie hunting"


def test_a_small_motion_dies_out_as_the_eigenvalue_says(found):
    """The logarithmic decrement of the time history, with no linearisation in it."""
    state = dataclasses.replace(CONE, offset=1e-5, speed=105.0, duration=8.0)
    now = compute.present(state, found)
    moved = compute.motion(state)
    time, y = np.asarray(moved.response.time), moved["y_w1"]
    peaks = [i for i in range(1, len(y) - 1) if y[i - 1] < y[i] >= y[i + 1] and time[i] > 3.0]
    rate = np.polyfit(time[peaks], np.log(y[peaks]), 1)[0]
    assert rate == pytest.approx(now.shape.eigenvalue.real, rel=0.02)
    assert moved.spectrum.main_frequency == pytest.approx(now.shape.frequency, rel=0.02)
    assert (len(peaks) - 1) / (time[peaks[-1]] - time[peaks[0]]) == pytest.approx(
        now.shape.frequency, rel=0.01
    )


def test_motion_above_the_critical_speed_stays():
    moved = compute.motion(dataclasses.replace(CONE, speed=130.0, duration=8.0))
    assert 5e-3 < moved.amplitude < 0.02
    assert moved.wheelsets == ("y_w1", "y_w2")
    assert moved.clearance == pytest.approx(railenv.HIGH_SPEED_COACH.flange_clearance)


def test_beyond_the_end_of_the_equilibrium_there_are_no_modes():
    state = dataclasses.replace(CONE, radius=2500.0, cant=0.0873, speed=90.0)
    with pytest.warns(UserWarning, match="ends early"):
        ended = compute.stability(state)
    assert ended.critical.loss == "fold"
    with pytest.raises(ParameterError, match="no running equilibrium at 90 m/s"):
        compute.present(state, ended)


# ------------------------------------------------------------------------------ contact


@pytest.mark.parametrize(
    ("law", "conicity"),
    [
        (railenv.Cone(0.07), 0.07),
        (railenv.LinearProfile(0.2, 0.03, 13.6), 0.2),
        (railenv.HollowTread(0.15, 0.034, 0.3), 0.15),
    ],
)
def test_conicity_of_linear_laws_is_their_number_at_every_amplitude(law, conicity):
    curves = compute.contact(State().with_contact(law))
    np.testing.assert_allclose(curves.conicity, conicity, rtol=1e-3)
    np.testing.assert_allclose(curves.harmonic, conicity, rtol=1e-3)
    np.testing.assert_allclose(curves.radius_difference, 2.0 * conicity * curves.shift, atol=1e-12)
    _, angle, rate = law.linear()
    np.testing.assert_allclose(np.tan(curves.angles[0]), angle + rate * curves.shift, atol=1e-12)
    np.testing.assert_allclose(np.tan(curves.angles[1]), angle - rate * curves.shift, atol=1e-12)
    assert curves.at_bound == pytest.approx(law.linear(3e-3).conicity, rel=1e-3)
    assert curves.picture is None


def test_arcs_have_the_conicity_of_their_formula():
    law = railenv.ArcProfile(0.05, 0.5, 0.3)
    curves = compute.contact(State().with_contact(law))
    assert curves.conicity[0] == pytest.approx(0.5 / (0.5 - 0.3) * 0.05, rel=0.02)


def test_curves_of_a_pair_are_its_own():
    pair = railenv.ProfilePair()
    curves = compute.contact(State().with_contact(pair))
    assert curves.at_bound == pytest.approx(pair.equivalent_conicity(3e-3), rel=5e-3)
    difference = pair.rolling_radius_difference(curves.shift)
    np.testing.assert_allclose(curves.radius_difference, difference, atol=1e-12)
    np.testing.assert_allclose(curves.angles[1], pair.angle(-curves.shift), atol=1e-12)
    assert curves.clearance == pair.flange_clearance
    across, up = curves.picture.contacts
    assert across.shape == (2, up.shape[1])
    middle = up.shape[1] // 2
    assert up[0, middle] - up[1, middle] == pytest.approx(0.006)  # by which the wheel is lifted


def test_wear_moves_the_conicity_between_those_of_both_pairs():
    new = State().with_contact(Wearing(railenv.ProfilePair(), depth=2e-4))
    ends = [compute.contact(new.with_number("wear", w)).linear.conicity for w in (0.0, 0.5, 1.0)]
    assert ends[1] == pytest.approx(0.5 * (ends[0] + ends[2]), rel=1e-9)
    law = new.law
    assert ends[0] == pytest.approx(law.new.linear(3e-3).conicity)
    assert ends[2] == pytest.approx(law.worn.linear(3e-3).conicity)


def test_parts_tell_their_contact_themselves():
    parts = railenv.Bogie(railenv.HIGH_SPEED_COACH).assembly
    assert compute.contact(State(vehicle=parts)) is None


# ------------------------------------------------------------------------------ diagram


def test_a_branch_grows_piece_by_piece_into_the_one_followed_at_once(found):
    parts = list(itertools.islice(compute.diagram(CONE), 3))
    assert [len(p.branch) for p in parts] == [5, 10, 15]
    assert all("15 limit cycles, now at" in p.said or len(p.branch) < 15 for p in parts)
    critical = found.critical
    whole = design.cycle_branch(
        found.model, start=critical, points=15, parameter_range=(3.0, 1.2 * critical.speed)
    )
    np.testing.assert_allclose(parts[-1].branch.value, whole.value, rtol=1e-6)
    assert parts[-1].branch.goes_on
    assert 0.0 < parts[0].share < parts[-1].share < 1.0


def test_speed_and_motion_leave_a_diagram_as_it_is():
    assert compute.same_diagram(CONE, dataclasses.replace(CONE, speed=60.0, offset=5e-3))
    assert not compute.same_diagram(CONE, CONE.with_number("friction", 0.5))
    assert not compute.same_diagram(CONE, dataclasses.replace(CONE, radius=5000.0))
    assert math.isinf(CONE.radius)
