"""Wear by the rule: what it makes, and that the shipped worn wheel is made by it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from railenv import Profile, ProfilePair, worn
from railenv.errors import ParameterError


@pytest.fixture(scope="module")
def new():
    return ProfilePair()


def test_the_shipped_worn_wheel_is_made_by_the_rule(new):
    made = worn(new, depth=5e-4, spread=2.5e-3).wheel
    shipped = Profile.named("S1002_WORN")
    assert_allclose(made.points, shipped.points, atol=1e-8)
    assert made.source.startswith("S1002 worn 0.5 mm deep on UIC60")


def test_it_has_a_conicity_as_measured_on_worn_wheels(new):
    amplitude = np.array([2e-3, 3e-3, 4e-3])
    found = ProfilePair("S1002_WORN").equivalent_conicity(amplitude)
    assert_allclose(found, [0.304, 0.345, 0.361], atol=2e-3)
    assert (found > new.equivalent_conicity(amplitude) + 0.1).all()


def test_material_goes_where_the_wheel_runs(new):
    depth = 3e-4
    made = worn(new, depth=depth, spread=2e-3)
    y = np.linspace(-0.055, 0.055, 400)
    before, after = new.wheel.curve()(y).z, made.wheel.curve()(y).z
    lost = after - before
    lost -= lost[-1]  # nothing is lost at the outer end; heights count from the tape circle
    assert lost.min() > -1e-6  # another grid of points
    assert lost.max() == pytest.approx(depth, rel=1e-3)
    assert abs(y[np.argmax(lost)]) < 0.015
    assert lost[y < -0.045].max() < 1e-6
    narrow = worn(new, depth=depth, spread=1e-3)
    assert narrow.equivalent_conicity(0.002) > made.equivalent_conicity(0.002)
    assert made.rail == new.rail


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"depth": 0.0, "spread": 2e-3}, "depth is 0 m; it must be finite and greater than 0 m"),
        ({"depth": 5e-4, "spread": 0.0}, "spread is 0 m"),
        ({"depth": 5e-4, "spread": 2e-3, "patch": 1.0}, "patch is 1 m"),
        ({"depth": float("nan"), "spread": 2e-3}, "depth is nan"),
    ],
)
def test_bad_numbers_are_told(new, given, message):
    with pytest.raises(ParameterError, match=message):
        worn(new, **given)
