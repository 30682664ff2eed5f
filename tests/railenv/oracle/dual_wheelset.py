"""The dual wheelset: two wheelsets suspended from a frame at rest (eq 6 without the frame, 8 DOF)."""

from __future__ import annotations

from collections.abc import Sequence

from railenv.equations.coordinates import AT_REST, Running, rails
from railenv.equations.functions import Scalar
from tests.railenv.oracle import bodies
from tests.railenv.oracle.loads import dual_wheelset_load
from tests.railenv.oracle.suspension import primary
from tests.railenv.oracle.wheelset import accelerations


def dual_wheelset(
    x: Sequence[Scalar],
    u: Sequence[Scalar],
    speed: Scalar,
    curvature: Scalar,
    cant: Scalar,
    p: Scalar,
) -> list[Scalar]:
    """Time derivative of the 16 states; ``p`` has the fields of a Vehicle as attributes."""
    run = Running(speed, curvature, cant)
    carried = dual_wheelset_load(p)
    rates = list(x[len(x) // 2 :])
    for s, w, rail, yaw_moment in zip((+1, -1), bodies(x), rails(u[2:]), u[:2], strict=True):
        suspension = primary(s, w, AT_REST, run, p)
        rates += accelerations(w, rail, suspension, yaw_moment, carried, run, p)
    return rates
