import math

import pytest

from railenv.contact.hertz import STEEL, Material, contact_ellipse, wheel_ellipse
from railenv.errors import ParameterError

LOAD = 55.9e3


def test_steel_is_the_usual_one():
    assert STEEL.youngs_modulus == pytest.approx(210e9, rel=1e-3)
    assert STEEL.shear_modulus == pytest.approx(82e9)


def test_sphere_on_plane_is_the_closed_form():
    radius, modulus = 0.25, STEEL.contact_modulus
    found = contact_ellipse(LOAD, 1.0 / radius, 1.0 / radius)
    a = math.cbrt(3.0 * LOAD * radius / (4.0 * modulus))
    assert found.rolling == pytest.approx(a, rel=1e-12)
    assert found.lateral == pytest.approx(a, rel=1e-12)
    assert found.approach == pytest.approx(a * a / radius, rel=1e-12)
    assert found.maximum_pressure == pytest.approx(1.5 * LOAD / (math.pi * a * a), rel=1e-12)


@pytest.mark.parametrize(
    ("theta", "m", "n"),
    [
        (30, 2.731, 0.493),
        (50, 1.754, 0.641),
        (60, 1.486, 0.717),
        (70, 1.284, 0.802),
        (80, 1.128, 0.893),
    ],
)
def test_ellipses_of_the_published_table(theta, m, n):
    """Hertz's coefficients m and n over cos theta = (B - A) / (B + A), in all textbooks."""
    cosine, total = math.cos(math.radians(theta)), 4.0
    small, large = total * (1.0 - cosine) / 2.0, total * (1.0 + cosine) / 2.0
    found = contact_ellipse(LOAD, small, large)
    size = math.cbrt(1.5 * LOAD / (STEEL.contact_modulus * total))
    assert found.rolling == pytest.approx(m * size, rel=3e-3)
    assert found.lateral == pytest.approx(n * size, rel=3e-3)


def test_wheel_of_the_coach():
    found = wheel_ellipse(LOAD, 0.4575, 0.3)
    assert 1e3 * found.rolling == pytest.approx(5.9, abs=0.05)
    assert 1e3 * found.lateral == pytest.approx(4.5, abs=0.05)
    mean = 2.0 * LOAD / (math.pi * found.rolling * found.lateral) / 2.0
    assert found.maximum_pressure == pytest.approx(1.5 * mean)


def test_turned_by_a_right_angle_the_axes_change_places():
    one, other = contact_ellipse(LOAD, 2.0, 5.0), contact_ellipse(LOAD, 5.0, 2.0)
    assert (one.rolling, one.lateral) == pytest.approx((other.lateral, other.rolling))
    assert one.approach == pytest.approx(other.approach)


def test_size_grows_with_the_cube_root_of_the_load():
    one, eight = wheel_ellipse(LOAD, 0.46, 0.3), wheel_ellipse(8 * LOAD, 0.46, 0.3)
    assert eight.rolling == pytest.approx(2 * one.rolling)
    assert eight.maximum_pressure == pytest.approx(2 * one.maximum_pressure)
    assert eight.approach == pytest.approx(4 * one.approach)


def test_hollow_wheel_touches_on_a_wider_patch():
    flat, hollow = wheel_ellipse(LOAD, 0.46, 0.3), wheel_ellipse(LOAD, 0.46, 0.3, -0.5)
    convex = wheel_ellipse(LOAD, 0.46, 0.3, 0.5)
    assert convex.lateral < flat.lateral < hollow.lateral


def test_material_by_either_modulus():
    material = Material.from_shear_modulus(80e9, 0.3)
    assert material.youngs_modulus == pytest.approx(208e9)
    assert material.shear_modulus == pytest.approx(80e9)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((-1.0, 0.46, 0.3), "load is -1 N"),
        ((math.nan, 0.46, 0.3), "load is nan N"),
        ((LOAD, 0.0, 0.3), "rolling_radius is 0 m"),
        ((LOAD, 0.46, math.inf), "crown_radius is inf m"),
        ((LOAD, 0.46, 0.3, -0.3), r"profile_radius is -0.3 m; it must be .* below .* -0.3 m"),
        ((LOAD, 0.46, 0.3, 0.0), "profile_radius is 0 m"),
        ((LOAD, 0.46, 0.3, math.nan), "profile_radius is nan"),
        ((LOAD, 1e-6, 10.0), "rolling_curvature over lateral_curvature is 1e.07; it must be from"),
    ],
)
def test_what_is_no_contact_is_refused(arguments, message):
    with pytest.raises(ParameterError, match=message):
        wheel_ellipse(*arguments)


def test_material_out_of_range_is_refused():
    with pytest.raises(ParameterError, match=r"poissons_ratio is 0\.6; it must be"):
        Material(210e9, 0.6)
    with pytest.raises(ParameterError, match="shear_modulus is 0 Pa"):
        Material.from_shear_modulus(0.0, 0.3)
