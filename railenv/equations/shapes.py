"""Contact laws: how wheel and rail touch when the wheel is shifted towards its flange.

One wheel, seen so that left and right look alike. ``eta`` (m) is its lateral shift over the rail
towards its own flange, at the level of the contact, in the frame of the wheelset. A law says how far
the wheel then rides up (its height function H), what its rolling radius is, and where on the rail it
touches. All forces of the normal contact are derivatives of one potential of H
(:mod:`railenv.equations.contact`), so they do no work round a closed path, whatever the law.

``c`` has the numbers of the law as attributes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from railenv.equations.functions import Scalar, sqrt, table, where_positive

STEEPEST = 0.99
"""Sine of the contact angle up to which arcs are followed; beyond it they go on straight."""

TABLE_COLUMNS = 4
"""Columns of a table of profiles: those of a :class:`Touch`."""


class Touch(NamedTuple):
    """How a wheel touches its rail."""

    height: Scalar  # H, how far the wheel rides up, m
    slope: Scalar  # H', tangent of the contact angle against the axle
    radius: Scalar  # increase of the rolling radius, m
    place: Scalar = 0  # place on the rail, outwards from where it touches at eta = 0, m


class Law(NamedTuple):
    """A contact law."""

    touch: Callable[[Scalar, Scalar], Touch]
    """Touch of numbers and eta."""

    has_flange: bool = False
    """Whether H has the flange in it, so that there is no spring for it."""

    round_rail: bool = False
    """Whether the rail's head is an arc, round which the contact moves."""


def cone(c: Scalar, eta: Scalar) -> Touch:
    """Return the touch of a straight tread: the paper's cone on a knife edge."""
    rise = c.conicity * eta
    return Touch(rise, c.conicity, rise)


def linear(c: Scalar, eta: Scalar) -> Touch:
    """Return the touch by Wickens' three parameters: conicity, contact angle and its rate."""
    height = eta * (c.contact_angle + 0.5 * c.contact_angle_rate * eta)
    return Touch(height, c.contact_angle + c.contact_angle_rate * eta, c.conicity * eta)


def hollow(c: Scalar, eta: Scalar) -> Touch:
    """Return the touch of a tread that is the more hollow the higher its conicity: linear arcs.

    Of a hollow arc on a round rail both conicity and rate grow with the nearness of the radii
    (:func:`arcs`), so one tells the other.
    """
    rate = (c.conicity / c.contact_angle - 1.0) / c.rail_profile_radius
    height = eta * (c.contact_angle + 0.5 * rate * eta)
    return Touch(height, c.contact_angle + rate * eta, c.conicity * eta)


def arcs(c: Scalar, eta: Scalar) -> Touch:
    """Return the touch of a hollow arc on a round rail, exact in the plane.

    The centres of both arcs keep their distance, the difference of the radii, so the sine of the
    contact angle goes with eta, which is the shift at the level of the rail's centre.
    """
    nearness = 1.0 / (c.wheel_profile_radius - c.rail_profile_radius)
    sine0, cosine0 = direction(c)
    lean = sine0 + nearness * eta
    sine = _held(lean)
    cosine = sqrt(1.0 - sine * sine)
    slope = sine / cosine
    # (cos 0 - cos) / nearness, written so that it holds for straight wheels too
    rise = (sine + sine0) / (cosine + cosine0)
    beyond = (lean - sine) / nearness
    height = eta * rise + beyond * (slope - rise)
    return Touch(height, slope, (1.0 + c.rail_profile_radius * nearness) * height)


def direction(c: Scalar) -> tuple[Scalar, Scalar]:
    """Return sine and cosine of the contact angle at the centre, which laws tell by its tangent."""
    cosine = 1.0 / sqrt(1.0 + c.contact_angle * c.contact_angle)
    return c.contact_angle * cosine, cosine


def _held(sine: Scalar) -> Scalar:
    upper = where_positive(sine - STEEPEST, STEEPEST, sine)
    return where_positive(-STEEPEST - upper, -STEEPEST, upper)


def profiles(c: Scalar, eta: Scalar) -> Touch:
    """Return the touch of a pair of profiles from its table."""
    return _looked_up(c.profiles, eta)


def between(c: Scalar, eta: Scalar) -> Touch:
    """Return the touch between a new pair of profiles (wear 0) and a worn one (wear 1)."""
    new, worn = _looked_up(c.new, eta), _looked_up(c.worn, eta)
    return Touch(*(a + c.wear * (b - a) for a, b in zip(new, worn, strict=True)))


def _looked_up(t: Scalar, eta: Scalar) -> Touch:
    return Touch(*(table(t, eta, 0, column, TABLE_COLUMNS) for column in range(TABLE_COLUMNS)))


CONE = Law(cone)
LINEAR = Law(linear)
HOLLOW = Law(hollow)
ARCS = Law(arcs, round_rail=True)
PROFILES = Law(profiles, has_flange=True)
BETWEEN = Law(between, has_flange=True)
