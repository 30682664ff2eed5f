"""Profiles in closed form, and reference data."""

from pathlib import Path

import numpy as np

from railenv.contact.pair import ProfilePair
from railenv.contact.profiles import Profile

DATA = Path(__file__).parents[2] / "data" / "contact"
TAPE = 0.75
RAIL_RADIUS = 0.08
DEPTH = 0.002


def table(name):
    return np.genfromtxt(DATA / f"{name}.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")


def arc(radius, angle, kind):
    """A circle that has this contact angle at y = 0."""
    theta = np.linspace(-0.6, 0.6, 241)
    y = radius * (np.sin(theta) + np.sin(angle))
    z = radius * (np.cos(theta) - np.cos(angle))
    return Profile.of(np.stack([y, z], axis=1), kind=kind, name="arc")


def on_arc(wheel, angle=0.0, **changes):
    """A wheel on a circular rail that it touches at its tape circle, at the contact angle given."""
    face = RAIL_RADIUS * (np.sin(angle) - np.sin(np.arccos(1.0 - DEPTH / RAIL_RADIUS)))
    given = {"gauge": 2.0 * (TAPE + face), "gauge_depth": DEPTH, "inclination": 0.0, **changes}
    return ProfilePair(wheel, arc(RAIL_RADIUS, angle, "rail"), **given)


def cone(conicity):
    y = np.linspace(-0.06, 0.06, 25)
    return Profile.of(np.stack([y, conicity * y], axis=1), kind="wheel", name="cone")
