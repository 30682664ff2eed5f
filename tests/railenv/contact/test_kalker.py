import math

import numpy as np
import pytest

from railenv import TABLE_1
from railenv.contact.hertz import wheel_ellipse
from railenv.contact.kalker import CreepCoefficients, creep_coefficients, kalker_coefficients
from railenv.contact.patch import ContactPatch
from railenv.errors import ParameterError
from tests.railenv.contact.reference import COACH_WHEEL

PUBLISHED = [
    (0.1, 0.25, (3.31, 2.52, 0.473, 8.28)),
    (0.5, 0.5, (4.83, 3.14, 1.07, 2.22)),
    (1.0, 0.25, (4.12, 3.67, 1.47, 1.19)),
    (2.0, 0.0, (4.37, 4.37, 2.35, 0.958)),
    (10.0, 0.25, (11.7, 12.8, 14.6, 0.526)),
]


@pytest.mark.parametrize(("ratio", "nu", "published"), PUBLISHED)
def test_entries_of_kalkers_table(ratio, nu, published):
    assert kalker_coefficients(ratio, nu) == pytest.approx(published)


def no_slip(ratio, nu, n):
    """Solve steady rolling without slip by squares of constant stress, for G = a b = 1.

    The stresses of a half-space (Boussinesq and Cerruti) that make the surfaces roll on each other
    with a given creepage: what Kalker's coefficients are, from nothing but elasticity.
    """
    a = math.sqrt(ratio)
    b = 1.0 / a
    dx, dy = 2 * a / n, 2 * b / n
    x, y = np.meshgrid((np.arange(n) + 0.5) * dx - a, (np.arange(n) + 0.5) * dy - b, indexing="ij")
    inside = (x / a) ** 2 + (y / b) ** 2 < 1.0
    x, y = x[inside], y[inside]

    def influence(u, v):
        total = np.zeros((3, *u.shape))
        for i in (1, -1):
            for j in (1, -1):
                s, t = u + i * dx / 2, v + j * dy / 2
                r = np.hypot(s, t)
                along, across = s * np.log(t + r), t * np.log(s + r)
                both = (1 - nu) * (along + across)
                total += i * j * np.stack([both + nu * across, both + nu * along, -nu * r])
        return total / math.pi

    u, v = x[:, None] - x + 1e-13, y[:, None] - y + 1e-13
    xx, yy, xy = influence(u, v) - influence(u + dx, v)
    right = np.zeros((2, x.size, 3))
    right[0, :, 0] = right[1, :, 1] = -dx
    right[0, :, 2], right[1, :, 2] = y * dx, -(x + dx / 2) * dx
    stress = np.linalg.solve(np.block([[xx, xy], [xy, yy]]), right.reshape(-1, 3)).reshape(2, -1, 3)
    force = stress.sum(axis=1) * dx * dy
    moment = (x[:, None] * stress[1] - y[:, None] * stress[0]).sum(axis=0) * dx * dy
    return np.array([-force[0, 0], -force[1, 1], 0.5 * (moment[1] - force[1, 2]), -moment[2]])


@pytest.mark.parametrize("ratio", [0.2, 1.0, 5.0])
@pytest.mark.parametrize("nu", [0.0, 0.28, 0.5])
def test_all_four_are_those_of_an_elastic_half_space(ratio, nu):
    """C33, of another source than the rest, is as right as they are; squares are too stiff by 2 %."""
    found = no_slip(ratio, nu, 28) / np.array(kalker_coefficients(ratio, nu))
    assert found == pytest.approx(np.full(4, 1.02), abs=0.03)


@pytest.mark.parametrize("end", [0.1, 10.0])
@pytest.mark.parametrize("nu", [0.0, 0.25, 0.28, 0.5])
def test_slender_ellipses_go_on_from_the_table(end, nu):
    inside, beyond = (kalker_coefficients(end * math.exp(d), nu) for d in (1e-9, -1e-9))
    assert inside == pytest.approx(beyond, rel=1e-6)


def test_slender_ellipses_reach_the_asymptotes():
    found = kalker_coefficients(1e-3, 0.25)
    assert found.c11 == pytest.approx(math.pi**2 / 3.0, rel=1e-3)
    assert found.c22 == pytest.approx(math.pi**2 / 4.0, rel=1e-3)
    assert found.c33 == pytest.approx(math.pi**2 / (12.0 * 1e-3), rel=2e-3)
    long = math.log(16e6)
    found = kalker_coefficients(1e3, 0.25)
    assert found.c23 == pytest.approx(2 * math.pi / 3 * 1e3**1.5 / (0.75 * long - 1.0), rel=1e-3)
    assert found.c33 == pytest.approx(
        math.pi / 4 * (1 - 0.25 * (long - 2) / (0.75 * long - 1.0)), rel=1e-3
    )


def test_coefficients_of_the_coachs_wheel():
    found = COACH_WHEEL.creep_coefficients
    assert found.longitudinal_creep == pytest.approx(9.83e6, rel=2e-3)
    assert found.lateral_creep == pytest.approx(8.94e6, rel=2e-3)
    assert found.lateral_spin_creep == pytest.approx(20_700, rel=5e-3)
    assert found.spin_creep == pytest.approx(56.7, rel=5e-3)


def test_names_are_those_of_the_vehicle():
    vehicle = TABLE_1.replace(**COACH_WHEEL.creep_coefficients._asdict())
    assert vehicle.lateral_spin_creep == COACH_WHEEL.creep_coefficients.lateral_spin_creep
    assert CreepCoefficients._fields == tuple(COACH_WHEEL.creep_coefficients._asdict())


def test_coefficients_grow_with_the_load():
    def at(load):
        found = wheel_ellipse(load, 0.4575, 0.3)
        return np.array(creep_coefficients(found.rolling, found.lateral))

    powers = np.log(at(80e3) / at(40e3)) / math.log(2.0)
    assert powers == pytest.approx(np.array([2 / 3, 2 / 3, 1.0, 4 / 3]))


@pytest.mark.parametrize("ratio", [1e-4, 1e4, -1.0, math.nan])
def test_ratio_out_of_range_is_refused(ratio):
    with pytest.raises(ParameterError, match=r"ratio of the semi-axes a/b is .*; it must be .* 0.001"):
        kalker_coefficients(ratio, 0.25)


def test_poissons_ratio_out_of_range_is_refused():
    with pytest.raises(ParameterError, match=r"poissons_ratio is 0\.51"):
        kalker_coefficients(1.0, 0.51)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((0.0, 4e-3, 1e4, 0.3), "rolling semi-axis is 0 m"),
        ((8e-3, math.nan, 1e4, 0.3), "lateral semi-axis is nan"),
        ((8e-3, 4e-3, -1e4, 0.3), "load is -10000 N"),
        ((8e-3, 4e-3, 1e4, 0.0), "friction is 0"),
        ((1.0, 1e-4, 1e4, 0.3), "rolling over lateral semi-axis is 10000"),
    ],
)
def test_patch_out_of_range_is_refused(values, message):
    with pytest.raises(ParameterError, match=message):
        ContactPatch(*values)
