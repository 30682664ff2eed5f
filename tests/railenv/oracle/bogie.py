"""The two-axle bogie: two wheelsets and a frame, with half the vehicle body's load (eq 6, 12 DOF)."""

from __future__ import annotations

from collections.abc import Sequence

from railenv.equations.coordinates import Running, rails
from railenv.equations.functions import Scalar
from tests.railenv.oracle import bodies
from tests.railenv.oracle.loads import (
    bogie_frame_load,
    bogie_wheelset_load,
    lateral_load,
    vertical_load,
)
from tests.railenv.oracle.suspension import SuspensionForce, primary, primary_reaction, secondary
from tests.railenv.oracle.wheelset import accelerations


def bogie(
    x: Sequence[Scalar],
    u: Sequence[Scalar],
    speed: Scalar,
    curvature: Scalar,
    cant: Scalar,
    p: Scalar,
) -> list[Scalar]:
    """Time derivative of the 24 states; ``p`` has the fields of a Vehicle as attributes."""
    run = Running(speed, curvature, cant)
    *wheelsets, frame = bodies(x)
    frame_moment = u[2]
    carried = bogie_wheelset_load(p)
    rates = list(x[len(x) // 2 :])
    on_frame = [secondary(frame, p)]
    for s, w, rail, yaw_moment in zip((+1, -1), wheelsets, rails(u[3:]), u[:2], strict=True):
        suspension = primary(s, w, frame, run, p)
        rates += accelerations(w, rail, suspension, yaw_moment, carried, run, p)
        on_frame.append(primary_reaction(s, suspension, p))
        frame_moment = frame_moment - yaw_moment  # the primary actuator reacts on the frame
    total = SuspensionForce(*(sum(parts[1:], parts[0]) for parts in zip(*on_frame, strict=True)))
    load = bogie_frame_load(p)
    rates += [
        (total.force_y + lateral_load(load, run, p)) / p.frame_mass,
        (total.force_z + vertical_load(load, run, p)) / p.frame_mass,
        total.moment_roll / p.frame_roll_inertia,
        (total.moment_yaw + frame_moment) / p.frame_yaw_inertia,
    ]
    return rates
