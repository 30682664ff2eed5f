"""Equations of actuators, sensors and signals on docs/physics.md."""

from __future__ import annotations

import sympy
from equations_shown import BEYOND, Shown, rows
from equations_vehicles import BOGIE, HERE
from symbols import RAIL, RAIL_FORCE, RUN, P, W, like
from written import latex, traced

from railenv.equations import actuator, contact, motion, sensors

_STATE = actuator.ActuatorState(sympy.Symbol("T"), sympy.Symbol("q"))
_TURN = {sympy.Float(actuator.TWO_PI): sympy.Symbol(r"2 \pi")}


def _clip(x: sympy.Expr, limit: sympy.Expr, text: str) -> dict[sympy.Expr, sympy.Expr]:
    shown = rf"\mathrm{{clip}}\left( {text}, {latex(limit)} \right)"
    return {traced(actuator.clamp, x, limit): sympy.Symbol(shown)}


def _actuator() -> list[str]:
    x, limit, command = (sympy.Symbol(name) for name in ("x", "x_{m}", "u"))
    found = traced(actuator.actuator_rates, _STATE, command, P)
    clips = _clip(command, P.actuator_limit, "u") | _clip(_STATE.rate, P.actuator_rate_limit, "q")
    applied = traced(actuator.applied_moment, _STATE, P)
    return [
        *rows(r"\dot T ; \dot q", found, clips | _TURN),
        *rows("M", [applied], _clip(_STATE.moment, P.actuator_limit, "T")),
        *rows(r"\mathrm{clip}\left( x, x_{m} \right)", [traced(actuator.clamp, x, limit)]),
    ]


def _parallel_damper() -> list[str]:
    rate, speed = sympy.Symbol(r"\Delta\dot\psi"), sympy.Symbol("v")
    moment = traced(actuator.parallel_damper_moment, rate, P)
    return rows("M_{p} ; F_{p}(v)", [moment, traced(actuator.parallel_damper_force, speed, P)])


def _sensors() -> list[str]:
    acceleration = sympy.Symbol(r"\ddot y")
    force = traced(sensors.specific_force, acceleration, W, RUN, P.gravity)
    rate = traced(sensors.inertial_yaw_rate, W, RUN)
    state = sensors.SensorState(sympy.Symbol("A"), sympy.Symbol("G"))
    read = [sympy.Symbol("f_{y}"), sympy.Symbol(r"\omega_{z}")]
    filtered = traced(sensors.sensor_rates, state, *read, P)
    return [
        *rows(r"f_{y} ; \omega_{z}", [force, rate]),
        *rows(r"\dot A ; \dot G", filtered, _TURN),
    ]


def _signals() -> list[str]:
    body, rail = BOGIE.numbers.wheelsets[0], RAIL
    found = traced(motion.guiding_forces, BOGIE.numbers, BOGIE.x, BOGIE.u, RUN)[:4]
    names: dict[sympy.Expr, sympy.Expr] = {}
    w = BOGIE.motions["w1"]
    with sympy.evaluate(False):
        y = w.y - rail.align
    for force, index in zip(traced(contact.rail_forces, w, rail, HERE, body), "LR", strict=True):
        shown = like(contact.RailForce, RAIL_FORCE, index)
        names |= {force.force_y: shown.force_y, force.force_z: shown.force_z}
        spring = traced(contact.flange_spring, force.side, y, body)
        names[spring] = sympy.Symbol(f"T_{{{index}}}(y - y_{{t}})")
    return rows("Y_{L} ; Q_{L} ; Y_{R} ; Q_{R}", found, names)


BLOCKS = {
    "actuator": Shown(
        (actuator.actuator_rates, actuator.applied_moment, actuator.clamp), _actuator, BEYOND
    ),
    "parallel damper": Shown(
        (actuator.parallel_damper_moment, actuator.parallel_damper_force), _parallel_damper, BEYOND
    ),
    "sensors": Shown(
        (sensors.specific_force, sensors.inertial_yaw_rate, sensors.sensor_rates), _sensors, BEYOND
    ),
    "signals": Shown((motion.guiding_forces,), _signals, BEYOND),
}
"""Blocks of the page, by their names."""
