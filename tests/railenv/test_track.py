"""Track plans."""

import math

import numpy as np
import pytest

import railenv
from railenv.errors import ParameterError


def test_clothoid_has_curvature_and_cant_linear_in_distance():
    track = railenv.Track.into_curve(radius=-800.0, cant=-0.06, straight=100.0, transition=80.0)
    distance = np.array([0.0, 100.0, 120.0, 140.0, 180.0, 1e5])
    share = np.array([0.0, 0.0, 0.25, 0.5, 1.0, 1.0])
    np.testing.assert_allclose(track.curvature_at(distance), share / -800.0)
    np.testing.assert_allclose(track.cant_at(distance), share * -0.06)


def test_curve_of_finite_length_leads_back_to_a_straight():
    track = railenv.Track.into_curve(
        radius=800.0, cant=0.06, straight=10.0, transition=20.0, curve=100.0
    )
    assert float(track.curvature_at(130.0)) == pytest.approx(1 / 800.0)
    assert float(track.curvature_at(140.0)) == pytest.approx(0.5 / 800.0)
    assert float(track.curvature_at(150.0)) == 0.0
    assert float(track.cant_at(1e6)) == 0.0


def test_circular_track_is_the_same_everywhere():
    track = railenv.Track.circular(500.0, 0.05)
    np.testing.assert_array_equal(track.curvature_at([-1.0, 0.0, 1e4]), [1 / 500.0] * 3)
    assert float(railenv.Track.circular().curvature_at(7.0)) == 0.0


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: railenv.Track((), (), ()), "at least one"),
        (lambda: railenv.Track((0.0, 1.0), (0.0,), (0.0, 0.0)), "as many curvatures"),
        (lambda: railenv.Track((0.0, 0.0), (0.0, 0.1), (0.0, 0.0)), "must increase"),
        (lambda: railenv.Track((0.0,), (math.nan,), (0.0,)), "curvature is nan"),
        (lambda: railenv.Track((0.0,), (0.0,), (0.9,)), "cant is 0.9 rad"),
        (
            lambda: railenv.Track.into_curve(radius=500.0, cant=0.0, straight=0.0, transition=0.0),
            "transition is 0 m",
        ),
        (lambda: railenv.Track.circular(0.0), "radius is 0 m"),
    ],
)
def test_impossible_track_is_refused(build, message):
    with pytest.raises(ParameterError, match=message):
        build()
