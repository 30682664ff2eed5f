"""The creep laws on the wheels of a vehicle, for the claims on creep."""

from __future__ import annotations

import math

import numpy as np

from design.reproduction.cases import Case
from design.reproduction.store import Piece
from railenv.contact.creep_comparison import CreepComparison, compare_creep_laws
from railenv.contact.patch import ContactPatch

CROWN_RADIUS = 0.3
"""Crown radius of the head of a new rail, m; the paper has no profiles."""

FLANGE_ANGLE = 70.0
"""Degrees, contact angle on the flange of a usual wheel."""

TREAD, FLANGE = 1, 2
"""Numbers of the spins compared; 0 is none."""

_WHEELS = 4  # of a bogie and of a dual wheelset


def creep_laws(case: Case) -> Piece:
    """Return creep forces by all laws: without spin, and with the spins of the tread and a flange."""
    model, vehicle = case.model, case.vehicle
    bodies = model.equations.assembly.with_numbers(model.parameters).bodies
    carried = sum(b.vertical_load_mass for b in bodies if b.name in model.body_names)
    inputs = {
        "load": carried * model.gravity / _WHEELS,
        "wheel_radius": vehicle.wheel_radius,
        "conicity": vehicle.conicity,
        "friction": vehicle.friction,
    }
    name = f"creep-laws-{case.key}"
    label = f"creep laws, {case.title}"
    return Piece(name, compare, inputs, label, ("railenv/contact/*.py", "railenv/contact/data/*.csv"))


def compare(load: float, wheel_radius: float, conicity: float, friction: float) -> CreepComparison:
    """Compare the creep laws on the Hertzian contact of a wheel with straight profile."""
    patch = ContactPatch.of_wheel(load, wheel_radius, CROWN_RADIUS, friction)
    angles = np.array([0.0, math.atan(conicity), math.radians(FLANGE_ANGLE)])
    return compare_creep_laws(patch, np.sin(angles) / wheel_radius)
