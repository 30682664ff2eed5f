"""Contact of a pair of profiles: closed forms, the rigid search, and CONTACT."""

import dataclasses
import math
import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

import railenv
from railenv.contact.pair import ProfilePair, profile_of
from railenv.contact.profiles import Profile
from railenv.errors import ParameterError, UnknownNameError
from tests.railenv.contact.shapes import RAIL_RADIUS, arc, cone, on_arc, table


@pytest.fixture(scope="module")
def pair():
    return ProfilePair()


@pytest.fixture(scope="module")
def light():
    """Weights as wide as the patches under the benchmark's 10 kN."""
    return ProfilePair(width=5e-6, step=5e-6)


# ------------------------------------------------------------------------------ closed forms


def test_a_cone_on_an_arc_is_the_cone_of_the_paper():
    conicity = 0.1
    made = on_arc(cone(conicity), math.atan(conicity))
    eta = np.linspace(-0.01, 0.01, 41)
    assert_allclose(made.height(eta), conicity * eta, atol=1e-10)
    assert_allclose(made.radius(eta) - made.radius(0.0), conicity * eta, atol=1e-10)
    assert_allclose(np.tan(made.angle(eta)), conicity, atol=1e-8)
    assert_allclose(made.place(eta), 0.0, atol=1e-9)
    assert made.flange_clearance == math.inf
    for method in ("EN 15302", "harmonic"):
        assert made.equivalent_conicity(0.003, method) == pytest.approx(conicity, rel=1e-6)
    linear = made.linear(0.003)
    assert linear.conicity == pytest.approx(conicity, rel=1e-6)
    assert linear.contact_angle == pytest.approx(conicity, rel=1e-7)
    assert linear.contact_angle_rate == pytest.approx(0.0, abs=1e-5)


def test_arcs_follow_their_closed_form():
    wheel_radius, start = 0.1, 0.06
    apart = wheel_radius - RAIL_RADIUS
    eta = np.linspace(-0.004, 0.004, 33)
    angle = np.arcsin(np.sin(start) + eta / apart)
    drop = np.cos(start) - np.cos(angle)
    place = RAIL_RADIUS * (np.sin(start) - np.sin(angle))
    made = on_arc(arc(wheel_radius, start, "wheel"), start, width=1e-6, step=5e-6)
    rigid = made.rigid(eta)
    assert_allclose(rigid.height, apart * drop, atol=1e-9)
    assert_allclose(rigid.angle, angle, atol=1e-5)
    assert_allclose(rigid.radius, made.nominal_radius + wheel_radius * drop, atol=1e-7)
    assert_allclose(rigid.place, place, atol=5e-6)
    assert_allclose(made.height(eta), apart * drop, atol=1e-7)
    assert_allclose(made.angle(eta), angle, atol=2e-5)
    assert_allclose(made.radius(eta) - made.radius(0.0), wheel_radius * drop, atol=1e-6)
    assert_allclose(made.place(eta), place, atol=5e-6)


# ------------------------------------------------------------- against the rigid search, and itself


def test_narrow_weights_find_the_rigid_contact():
    eta = np.array([-8.0, -4.0, -2.0, 2.0, 3.0, 4.0, 6.0, 7.0, 9.0, 12.0, 15.0]) * 1e-3
    width = 1e-6
    made = ProfilePair(width=width, step=5e-6)
    rigid = made.rigid(eta)
    soft = made.height(eta) - made.height(2e-3)
    assert_allclose(soft, rigid.height - rigid.height[3], atol=4 * width)
    assert_allclose(made.angle(eta), rigid.angle, atol=2e-3)
    assert_allclose(made.radius(eta), rigid.radius, atol=2e-5)


def test_contact_angle_is_the_derivative_of_the_lift(pair):
    """Weighted means of the wheel's slope, which no spline has seen, at a grid twice as fine."""
    fine = ProfilePair(step=0.5 * pair.step)
    exact = fine.search.contacts()
    inside = np.abs(exact.eta) < 0.0199
    eta = exact.eta[inside]
    assert_allclose(np.tan(pair.angle(eta)), exact.slope[inside], atol=2e-3)
    assert_allclose(pair.radius(eta), pair.nominal_radius - exact.drop[inside], atol=3e-6)
    work = np.concatenate(
        [[0.0], np.cumsum(0.5 * (exact.slope[1:] + exact.slope[:-1]) * np.diff(exact.eta))]
    )
    assert_allclose(work, exact.height - exact.height[0], atol=1e-7)


def test_a_finer_grid_changes_nothing_that_matters(pair):
    fine = dataclasses.replace(pair, step=0.5 * pair.step)
    amplitude = np.arange(1, 9) * 1e-3
    for method in ("EN 15302", "harmonic"):
        coarse = pair.equivalent_conicity(amplitude, method)
        assert_allclose(coarse, fine.equivalent_conicity(amplitude, method), rtol=1e-4)
    assert pair.flange_clearance == pytest.approx(fine.flange_clearance, abs=1e-6)
    assert pair.flange_angle == pytest.approx(fine.flange_angle, abs=1e-4)


def test_narrower_weights_change_little_where_contact_is_in_one_place(pair):
    narrow = dataclasses.replace(pair, width=0.5 * pair.width, step=0.5 * pair.step)
    eta = np.array([3.0, 4.0, 8.0, 12.0]) * 1e-3
    assert_allclose(pair.angle(eta), narrow.angle(eta), rtol=0.02)
    assert pair.equivalent_conicity(0.003) == pytest.approx(narrow.equivalent_conicity(0.003), rel=0.03)


def test_tables_are_uniform_and_start_from_the_centre(pair):
    eta, *columns = pair.tables
    assert np.ptp(np.diff(eta)) < 1e-12
    zero = np.flatnonzero(eta == 0.0)
    assert zero.size == 1
    for column, read in zip(columns, (pair.height, pair.radius, pair.place), strict=True):
        assert column[zero[0]] == 0.0
        assert_allclose(read(eta) - read(0.0), column, atol=1e-14)
        assert_allclose(CubicSpline(eta, column)(1e-3), read(1e-3) - read(0.0), atol=1e-15)
    assert pair.reach == (-0.02, 0.02)
    with pytest.raises(ValueError, match="read-only"):
        eta[0] = 1.0
    with pytest.raises(ParameterError, match=r"shift is 0\.03 m; the tables go from -0\.02 to 0\.02"):
        pair.height([0.0, 0.03])
    with pytest.raises(ParameterError, match="shift is nan"):
        pair.radius(math.nan)


# ------------------------------------------------------------------------------------ S1002


def test_s1002_on_uic60_has_the_known_figures(pair):
    assert math.degrees(pair.flange_angle) == pytest.approx(70.0, abs=0.05)
    assert pair.flange_clearance == pytest.approx(6.39e-3, abs=5e-5)
    assert pair.equivalent_conicity(0.003) == pytest.approx(0.173, abs=1e-3)
    assert pair.equivalent_conicity(0.003, "harmonic") == pytest.approx(0.1734, abs=1e-3)
    linear = pair.linear(0.003)
    assert linear == pytest.approx((0.1734, 0.0342, 14.3), rel=0.01)
    assert pair.half_contact_distance == pytest.approx(0.7506, abs=1e-3)
    y = np.array([-3e-3, 0.0, 3e-3])
    for difference in (pair.rolling_radius_difference, pair.contact_angle_difference, pair.roll):
        found = difference(y)
        assert_allclose(found, -found[::-1], atol=1e-15)
        assert found[2] > 0.0
    assert pair.place(0.0) == 0.0
    assert str(pair) == "S1002 on UIC60, inclination 1:40, gauge 1435 mm"


def test_it_runs_where_contact_says(light):
    """CONTACT's case A-2.2; y there is to the right, positive roll lowers the right wheel."""
    rows = table("mbench_a22_contact")
    assert len(rows) == 22
    for row in rows:
        outwards = 1.0 if row["wheel"] == "right" else -1.0
        tilt = -row["roll_rad"] * outwards
        eta = 1e-3 * row["y_mm"] * outwards + light.nominal_radius * tilt + 0.75 * tilt**2 / 2
        made = light
        if tilt < -5e-3:  # the other wheel climbs: that much roll moves the place on the crown
            made = dataclasses.replace(light, inclination=light.inclination - tilt)
        expected = abs(row["contact_angle_rad"])
        allowed = 0.005 if expected < 0.2 else 0.02 * expected
        assert abs(made.angle(eta) + tilt - expected) < allowed, row
        rise = made.radius(eta) - made.nominal_radius
        allowed = 0.05e-3 if expected < 0.2 else 0.15e-3
        assert abs(rise - 1e-3 * row["wheel_z_mm"]) < allowed, row


# ------------------------------------------------------------------------------- the record


def test_pairs_are_values(pair, tmp_path):
    assert pair == ProfilePair() == railenv.ProfilePair()
    assert hash(pair) == hash(ProfilePair())
    assert pair != ProfilePair(gauge=1.436)
    assert isinstance(pair.wheel, Profile)
    again = pickle.loads(pickle.dumps(pair))
    assert again == pair
    assert again.height(1e-3) == pair.height(1e-3)
    file = tmp_path / "mine.prw"
    pair.wheel.write(file)
    for wheel in (file, str(file), pair.wheel.points):
        other = ProfilePair(wheel)
        assert_allclose(other.tables.height, pair.tables.height, atol=1e-10)


BAD = [
    ({"gauge": 1.42}, r"is on its flange at the centre .* the gauge is about 2\.\d mm too narrow"),
    ({"gauge": 1.40}, r"about 22 mm too narrow"),
    ({"gauge": 1.7}, r"do not touch: wheel S1002 reaches from 0\.6804 to 0\.81 m"),
    ({"gauge": math.nan}, "gauge is nan m; it must be finite"),
    ({"gauge": "wide"}, "gauge is 'wide'"),
    ({"gauge": 1435.0}, "at most 2.5 m"),
    ({"back_to_back": 1.39}, "on its flange at the centre"),
    ({"inclination": 40.0}, "inclination is 40 rad"),
    ({"gauge_depth": 0.045}, r"reaches 38\.51 mm below its top on the gauge side"),
    ({"width": 0.0}, "width is 0 m"),
    ({"step": math.inf}, "step is inf m"),
    ({"wheel": "UIC60"}, "wheel is UIC60, the profile of a rail"),
    ({"rail": Profile.named("S1002")}, "rail is S1002, the profile of a wheel"),
    ({"wheel": [[0.0, 0.0]] * 9}, "wheel given points has 1 points; it needs at least 5"),
    ({"wheel": 7}, "must be \\(points, 2\\)"),
]


@pytest.mark.parametrize(("changes", "message"), BAD, ids=[str(i) for i in range(len(BAD))])
def test_bad_pairs_say_what_and_by_how_much(changes, message):
    with pytest.raises(ParameterError, match=message):
        ProfilePair(**changes)


def test_unknown_names_are_told_with_the_known_ones(pair):
    with pytest.raises(UnknownNameError, match=r"did you mean 'S1002'.*UIC519_A"):
        ProfilePair("S1003")
    with pytest.raises(ParameterError, match="unknown profile"):
        Profile.named("P8")
    with pytest.raises(FileNotFoundError):
        ProfilePair("nothing.prw")
    with pytest.raises(ParameterError, match="must end in"):
        profile_of("wheel.doc", "wheel")
    with pytest.raises(ParameterError, match="method is 'klingel'"):
        pair.equivalent_conicity(0.003, "klingel")
    with pytest.raises(ParameterError, match=r"amplitude is 0\.021 m"):
        pair.linear(0.021)
    with pytest.raises(ParameterError, match=r"amplitude is -0\.001 m; it must be positive"):
        pair.linear(-0.001)


def test_pictures_show_all(pair):
    figure = pair.plot()
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert titles == [
        "places that touch, every 0.5 mm of shift",
        "rolling-radius difference",
        "contact angle",
        "equivalent conicity",
    ]
    assert all(ax.lines for ax in figure.axes)
    on_arc(cone(0.1), math.atan(0.1)).plot()  # no flange
