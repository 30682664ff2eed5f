"""Equations of motion of an assembly of bodies and force elements (eq 6, for any vehicle).

What stands in the paper for one bogie is assembled here from what each element and each wheelset does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from railenv.equations.bodies import accelerations, gyroscopic, turning
from railenv.equations.contact import contact, flange_spring, rail_forces
from railenv.equations.coordinates import (
    AT_REST,
    GROUND,
    Motion,
    Rail,
    Running,
    Wrench,
    at_site,
    motions,
    rails,
    total,
)
from railenv.equations.elements import (
    Arm,
    End,
    Relative,
    at_centre,
    lean,
    opposite,
    relative,
    where_moved_to,
)
from railenv.equations.functions import Scalar
from railenv.equations.loads import load

Wrenches = dict[str, list[Wrench]]


def rates(
    vehicle: Any,
    x: Sequence[Scalar],
    u: Sequence[Scalar],
    run: Running,
    further: Mapping[str, Sequence[Wrench]],
) -> list[Scalar]:
    """Time derivatives of the states of an assembly.

    Parameters
    ----------
    vehicle : Assembly
        With numbers in all fields: what ``Assembly.with_numbers`` returns.
    x, u : sequence
        States and inputs, ordered as ``Assembly.state_names`` and ``Assembly.input_names``.
    run : Running
    further : mapping of str to sequence of Wrench
        What else acts on the bodies, about their centres of mass.
    """
    moving = motions(x, vehicle.coordinates)
    acting: Wrenches = {body.name: list(further.get(body.name, ())) for body in vehicle.bodies}
    own_rates = _elements(vehicle, moving, x, u, run, acting)
    for body, rail in zip(vehicle.wheelsets, _rails(vehicle, u), strict=True):
        w, here = moving[body.name], at_site(run, vehicle.sites[body.name])
        acting[body.name] += [contact(w, rail, here, body), gyroscopic(w, here, body)]
    found: list[Scalar] = []
    for body in vehicle.bodies:
        if not vehicle.coordinates[body.name]:
            continue
        here = at_site(run, vehicle.sites[body.name])
        acting[body.name] += [load(body, here, vehicle.gravity), turning(here, body)]
        found += accelerations(total(acting[body.name]), body, vehicle.coordinates[body.name])
    return [*x[len(found) : 2 * len(found)], *found, *own_rates]


def _elements(
    vehicle: Any,
    moving: Mapping[str, Motion],
    x: Sequence[Scalar],
    u: Sequence[Scalar],
    run: Running,
    acting: Wrenches,
) -> list[Scalar]:
    """Add what the force elements do to the bodies; return the derivatives of their own states."""
    own_rates: list[Scalar] = []
    state, command = 2 * sum(map(len, vehicle.coordinates.values())), 0
    for e in vehicle.elements:
        a, b, seen = seen_by(vehicle, e, moving, run)
        q, drive = x[state : state + e.n_states], u[command : command + e.n_inputs]
        state, command = state + e.n_states, command + e.n_inputs
        on_a, rate = e.law(e, seen, q, drive)
        own_rates += rate
        wrenches = (on_a, opposite(on_a))
        if vehicle.shifting_loads:
            further = where_moved_to(a, b, seen, on_a.force_z)
            wrenches = (total([wrenches[0], further[0]]), total([wrenches[1], further[1]]))
        for name, end, wrench in zip(e.between, (a, b), wrenches, strict=True):
            if name != GROUND:
                acting[name].append(at_centre(end.arm, wrench))
    return own_rates


def seen_by(
    vehicle: Any, e: Any, moving: Mapping[str, Motion], run: Running
) -> tuple[End, End, Relative]:
    """Return an element's ends in its two bodies, and how the second moves against the first.

    The ground follows the track: it is the track frame at the place of the other body.
    """
    bodies = [vehicle.body(name) for name in e.between]
    held = [body or other for body, other in zip(bodies, bodies[::-1], strict=True)]
    x = held[0].x if e.x is None else e.x
    y = 0 if e.pair else e.y
    arms = [Arm(x - body.x, y, e.z - body.z) for body in held]
    a, b = (
        End(arm, moving.get(name, AT_REST), at_site(run, vehicle.sites[body.name]))
        for arm, name, body in zip(arms, e.between, held, strict=True)
    )
    height = e.z - vehicle.rail_level
    seen = relative(a, b, height, vehicle.wheelbase_curving)
    return a, b, lean(a, b, seen) if vehicle.shifting_loads else seen


def _rails(vehicle: Any, u: Sequence[Scalar]) -> list[Rail]:
    return rails(u[len(u) - 3 * len(vehicle.wheelsets) :])


def guiding_forces(
    vehicle: Any, x: Sequence[Scalar], u: Sequence[Scalar], run: Running
) -> list[Scalar]:
    """Y and Q (N) of the left and right wheel of each wheelset.

    Y is the guiding force, positive where the rail pushes the wheel towards the track's middle; Q the
    wheel load.
    """
    moving = motions(x, vehicle.coordinates)
    found: list[Scalar] = []
    for body, rail in zip(vehicle.wheelsets, _rails(vehicle, u), strict=True):
        w = moving[body.name]
        for f in rail_forces(w, rail, at_site(run, vehicle.sites[body.name]), body):
            flange = flange_spring(f.side, w.y - rail.align, body)
            found += [flange - f.side * f.force_y, f.force_z]
    return found
