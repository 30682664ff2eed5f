import dataclasses
import math

import numpy as np
import pytest

from railenv.contact.fastsim import fastsim, stress_field
from railenv.errors import ParameterError
from tests.railenv.contact.reference import COACH_WHEEL, CURVES, SPIN_CASE, rows

PUBLISHED = {int(row["case"]): row for row in rows("fastsim_cases.csv")}
COACH_F = COACH_WHEEL.creep_coefficients


def published(number, cells, bound):
    """Return a published lateral force and ours on as many cells, over mu N."""
    row = PUBLISHED[number]
    assert row["normal_N"] == SPIN_CASE.load
    creepages = row["longitudinal_creepage"], row["lateral_creepage"], 1e3 * row["spin_1_per_mm"]
    found = fastsim(*creepages, SPIN_CASE, strips=cells, cells=cells, bound=bound)
    assert found.longitudinal == pytest.approx(0.0, abs=1e-6)
    return row["fy_over_mu_n"], found.lateral / SPIN_CASE.adhesion


@pytest.mark.parametrize(
    ("number", "cells", "bound", "within"),
    [
        (2, 44, "parabolic", 0.01),
        (3, 44, "elliptic", 0.02),  # far from converged there: rectangular cells, ours are strips
        (5, 220, "parabolic", 0.01),
        (6, 220, "elliptic", 0.001),
    ],
)
def test_published_fastsim_with_spin(number, cells, bound, within):
    theirs, ours = published(number, cells, bound)
    assert ours == pytest.approx(theirs, rel=within)


@pytest.mark.parametrize(("bound", "within"), [("parabolic", 0.06), ("elliptic", 0.025)])
def test_exact_theory_with_spin(bound, within):
    theirs, ours = published(1, 220, bound)
    assert ours == pytest.approx(theirs, rel=within)


def test_turned_round_and_mirrored():
    """Case 8: the other way of rolling is the same case seen from the other side."""
    assert PUBLISHED[8]["fy_over_mu_n"] == PUBLISHED[5]["fy_over_mu_n"]
    x, y, spin = 4e-4, -6e-4, 0.6
    one = fastsim(x, y, spin, SPIN_CASE)
    for signs in ((-1, -1, -1), (1, -1, -1), (-1, 1, 1)):
        other = fastsim(signs[0] * x, signs[1] * y, signs[2] * spin, SPIN_CASE)
        assert other.longitudinal == pytest.approx(signs[0] * one.longitudinal)
        assert other.lateral == pytest.approx(signs[1] * one.lateral)
    opposed = fastsim(x, -y, spin, SPIN_CASE)
    assert abs(opposed.lateral) > 1.2 * abs(one.lateral)


def curve(first, last):
    found = [row for row in rows("creep_force_curves.csv") if first <= row["case"] <= last]
    assert len(found) == last - first + 1
    return (
        np.array([row[name] for row in found]) for name in ("longitudinal_creepage", "fx_over_mu_n")
    )


def test_published_curve_of_fastsim():
    """On 44 cells the slope is 2 % too steep, as it is in the published curve."""
    creepage, force = curve(61, 90)
    found = fastsim(creepage, 0.0, 0.0, CURVES, strips=44, cells=44)
    assert found.longitudinal / CURVES.adhesion == pytest.approx(force, rel=0.01)
    assert found.lateral == pytest.approx(np.zeros(30), abs=1e-6)


def test_curve_of_the_exact_theory():
    """The simplified theory is within 5 % of the adhesion limit."""
    creepage, force = curve(1, 30)
    found = fastsim(creepage, 0.0, 0.0, CURVES, strips=200, cells=200).longitudinal / CURVES.adhesion
    assert np.abs(found - force).max() < 0.05
    assert np.abs(found - force).max() > 0.03


@pytest.mark.parametrize("bound", ["parabolic", "elliptic"])
def test_slopes_are_those_of_the_linear_theory(bound):
    small, cells = 1e-9, 200
    found = fastsim([small, 0, 0], [0, small, 0], [0, 0, small], COACH_WHEEL, cells=cells, bound=bound)
    steep = 1.0 + 1.0 / cells
    assert found.longitudinal[0] == pytest.approx(-steep * COACH_F.longitudinal_creep * small, rel=5e-3)
    assert found.lateral[1] == pytest.approx(-steep * COACH_F.lateral_creep * small, rel=5e-3)
    assert found.lateral[2] == pytest.approx(-COACH_F.lateral_spin_creep * small, rel=2e-2)


def test_large_creepage_slides():
    found = fastsim([0.3, -0.3, 0.18], [0.0, 0.0, 0.24], 0.0, COACH_WHEEL)
    size = np.hypot(*found) / COACH_WHEEL.adhesion
    assert size == pytest.approx(np.ones(3), rel=1e-3)
    # the sliding force of three flexibilities is off the creepage's direction by the ratio of two
    c = COACH_WHEEL.kalker
    assert found.longitudinal[2] / found.lateral[2] == pytest.approx(0.75 * c.c11 / c.c22, rel=1e-2)


def test_many_cases_are_each_by_itself():
    x, spin = np.array([0.0, 1e-3, -2e-3]), np.array([[0.0], [0.5]])
    many = fastsim(x, 1e-3, spin, SPIN_CASE, strips=11, cells=17)
    assert many.longitudinal.shape == many.lateral.shape == (2, 3)
    for i in range(2):
        for j in range(3):
            one = fastsim(x[j], 1e-3, spin[i, 0], SPIN_CASE, strips=11, cells=17)
            assert one.longitudinal == pytest.approx(many.longitudinal[i, j])
            assert one.lateral == pytest.approx(many.lateral[i, j])


def test_stresses_add_up_to_the_force_and_keep_to_the_bound():
    field = stress_field(3e-4, -6.25e-4, 0.625, SPIN_CASE, strips=30, cells=40)
    found = fastsim(3e-4, -6.25e-4, 0.625, SPIN_CASE, strips=30, cells=40)
    assert field.x.shape == field.y.shape == field.slips.shape == (30, 40)
    edge = SPIN_CASE.rolling * np.sqrt(1.0 - (field.y / SPIN_CASE.lateral) ** 2)
    area = 2.0 * edge / 40 * 2.0 * SPIN_CASE.lateral / 30
    assert (field.longitudinal * area).sum() == pytest.approx(found.longitudinal)
    assert (field.lateral * area).sum() == pytest.approx(found.lateral)
    size = np.hypot(field.longitudinal, field.lateral)
    assert size[field.slips] == pytest.approx(field.bound[field.slips])
    assert (size <= field.bound * (1 + 1e-12)).all()
    assert 0.0 < field.slips.mean() < 1.0
    assert field.slips[:, -1].all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"longitudinal_creepage": math.nan}, "longitudinal_creepage is nan; every entry"),
        ({"spin": [0.1, math.inf]}, "spin is .*; every entry must be finite"),
        ({"lateral_creepage": "much"}, "lateral_creepage is 'much'"),
        (
            {"lateral_creepage": [1e-3, 2e-3], "spin": [0.0] * 3},
            r"lateral_creepage \(2,\), spin \(3,\)",
        ),
        ({"cells": 0}, "cells is 0"),
        ({"strips": 1.5}, "strips is 1.5"),
        ({"bound": "round"}, "bound is 'round'; it must be 'parabolic' or 'elliptic'"),
    ],
)
def test_bad_arguments_are_refused(changes, message):
    arguments = {
        "longitudinal_creepage": 1e-3,
        "lateral_creepage": 0.0,
        "spin": 0.0,
        "patch": SPIN_CASE,
    }
    with pytest.raises(ParameterError, match=message):
        fastsim(**{**arguments, **changes})


def test_results_do_not_depend_on_the_size_of_the_patch():
    """With creepages over mu and spin over the size, forces over mu N are the same."""
    f = 2.0
    larger = dataclasses.replace(
        SPIN_CASE,
        rolling=f * SPIN_CASE.rolling,
        lateral=f * SPIN_CASE.lateral,
        load=f * f * SPIN_CASE.load,
    )
    one = fastsim(4e-4, -6e-4, 0.6, SPIN_CASE)
    other = fastsim(4e-4, -6e-4, 0.6 / f, larger)
    assert other.lateral / larger.adhesion == pytest.approx(one.lateral / SPIN_CASE.adhesion)
