"""Weight and centrifugal force on a canted curve, in the track frame."""

from __future__ import annotations

from railenv.equations.coordinates import Running, Wrench
from railenv.equations.functions import Scalar


def lateral_load(mass: Scalar, run: Running, gravity: Scalar) -> Scalar:
    """Centrifugal force less the pull of the cant on a mass (N); positive towards the outer rail."""
    return mass * (run.speed * run.speed * run.curvature - gravity * run.cant)


def vertical_load(mass: Scalar, run: Running, gravity: Scalar) -> Scalar:
    """Weight of a mass, and the centrifugal force's share across the canted plane (N); down is < 0."""
    return -mass * (gravity + run.speed * run.speed * run.curvature * run.cant)


def load(p: Scalar, run: Running, gravity: Scalar) -> Wrench:
    """Load of the masses that a body carries, ``p.lateral_load_mass`` and ``p.vertical_load_mass``.

    With ``p.load_height`` the lateral load of what is not its own acts there, and rolls the body.
    """
    lateral = lateral_load(p.lateral_load_mass, run, gravity)
    roll = 0
    if p.load_height is not None:
        further = lateral_load(p.lateral_load_mass - p.mass, run, gravity)
        roll = -(p.load_height - p.z) * further
    return Wrench(force_y=lateral, force_z=vertical_load(p.vertical_load_mass, run, gravity), roll=roll)
