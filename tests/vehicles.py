"""Vehicles of all kinds with actuators of all kinds, for tests of what takes any of them."""

from functools import cache

import numpy as np

import railenv
from railenv.equations.functions import tanh


def wheelset(x, u, speed, curvature, cant, p):
    """Equations of a sprung wheelset with saturating creep, as the README has them."""
    y, psi, dy, dpsi = x
    lateral = p.adhesion * tanh(2 * p.creep * (dy / speed - psi) / p.adhesion)
    steering = 2 * p.creep * p.a * (p.a * dpsi / speed + p.conicity * y / p.r0)
    return [dy, dpsi, (-p.k * y - lateral) / p.m, (-p.kpsi * psi - steering + u[0]) / p.I]


NUMBERS = {
    "m": 1250.0,
    "I": 760.0,
    "a": 0.75,
    "r0": 0.45,
    "conicity": 0.05,
    "creep": 10e6,
    "adhesion": 40e3,
    "k": 0.2e6,
    "kpsi": 2.5e6,
}


@cache
def sprung_wheelset():
    """Return equations of one's own that say what their body is."""
    body = railenv.MovingBody(
        name="w",
        y="y",
        psi="psi",
        yaw_moment="M",
        flange_clearance=8e-3,
        half_gauge="a",
        wheel_radius="r0",
        conicity="conicity",
    )
    states = ["y", "psi", "dy", "dpsi"]
    return railenv.Model("sprung_wheelset", states, ["M"], wheelset, NUMBERS, scale=1e-3, bodies=[body])


@cache
def both():
    """Return the coach with primary and secondary yaw actuators: three of two kinds."""
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH), "both")


@cache
def own():
    """Return equations of one's own with a yaw actuator."""
    return railenv.Equipped(sprung_wheelset(), "primary")


@cache
def lateral():
    """Return an assembly with lateral actuators of two kinds, and sensors on the wheelsets."""
    plant = railenv.Assembled(railenv.DualWheelset(railenv.TABLE_1).assembly)
    kind = railenv.Actuator.secondary()
    return railenv.Equipped(
        plant,
        actuators=[
            railenv.LateralActuator(between=("w1", "ground"), actuator=kind.replace(limit=20e3)),
            railenv.LateralActuator(between=("w2", "ground"), actuator=kind.replace(limit=10e3), x=-1),
        ],
    )


EQUIPPED = {"both": both, "own": own, "lateral": lateral}


def mirrored(model, x):
    """Return a state (or its rates) of an assembled vehicle in the mirror image of track and vehicle.

    What is lateral, roll or yaw changes its sign; dampers on the left and right change places.
    """
    names, axes = (
        list(model.state_names),
        {e.name: getattr(e, "axis", "") for e in model.assembly.elements},
    )
    image = np.empty(len(names))
    for i, name in enumerate(names):
        kind, _, owner = name.partition("_")
        partner, even = name, kind.removeprefix("d") in ("z", "theta")
        for side, other in (("_left", "_right"), ("_right", "_left")):
            if name.endswith(side):
                partner = name.removesuffix(side) + other
                owner = owner.removesuffix(side)
        if owner in axes:
            even = axes[owner] != "y"
        image[names.index(partner)] = x[i] if even else -x[i]
    return image
