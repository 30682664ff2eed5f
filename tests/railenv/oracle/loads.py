"""Which body carries which weight, and the load that weight is on a canted curve.

The print's W_ext is the load of one bogie, yet it stands on each wheelset and again on the frame.
``load_bookkeeping = "once"`` carries it once; ``"printed"`` keeps the print's own, for comparison.
In the equations the choice is the number ``p.printed_loads``, 0 or 1, so that one kernel serves both.
"""

from __future__ import annotations

from typing import NamedTuple

from railenv.equations.coordinates import Running
from railenv.equations.functions import Scalar


class CarriedMass(NamedTuple):
    """Mass (kg) whose lateral and vertical load a body carries, its own included."""

    lateral: Scalar
    vertical: Scalar


def bogie_load_mass(p: Scalar) -> Scalar:
    """Mass (kg) of frame and half the vehicle body, which one bogie's wheelsets carry: W_ext / g."""
    return p.frame_mass + p.body_mass / 2.0


def bogie_frame_load(p: Scalar) -> CarriedMass:
    """Mass carried by the frame of the bogie model."""
    total = bogie_load_mass(p)
    # Printed: the body's half acts on the frame laterally only.
    return CarriedMass(total, total - p.printed_loads * p.body_mass / 2.0)


def bogie_wheelset_load(p: Scalar) -> CarriedMass:
    """Mass carried by each wheelset of the bogie model."""
    own = p.wheelset_mass + p.printed_loads * bogie_load_mass(p)
    return CarriedMass(own, own)


def dual_wheelset_load(p: Scalar) -> CarriedMass:
    """Mass carried by each wheelset of the dual-wheelset model: half a bogie's load (printed: all)."""
    share = (1.0 + p.printed_loads) / 2.0
    own = p.wheelset_mass + share * bogie_load_mass(p)
    return CarriedMass(own, own)


def lateral_load(carried: CarriedMass, run: Running, p: Scalar) -> Scalar:
    """Centrifugal force less the pull of the cant (N); positive towards the outer rail."""
    return carried.lateral * (run.speed * run.speed * run.curvature - p.gravity * run.cant)


def vertical_load(carried: CarriedMass, run: Running, p: Scalar) -> Scalar:
    """Weight, and the centrifugal force's share across the canted plane (N); negative is down."""
    return -carried.vertical * (p.gravity + run.speed * run.speed * run.curvature * run.cant)
