"""Vehicles: parameter records, the shipped ones, and assemblies of bodies and force elements."""

from railenv.vehicles.cooperrider import COOPERRIDER, CooperriderParameters
from railenv.vehicles.records import FieldDescription, ParameterRecord, describe, quantity
from railenv.vehicles.vehicle import (
    HIGH_SPEED_COACH,
    HIGH_SPEED_COACH_HOLLOW,
    QUANTITIES,
    TABLE_1,
    TABLE_1_PRINTED_LOADS,
    Vehicle,
    preset,
)

__all__ = [
    "COOPERRIDER",
    "HIGH_SPEED_COACH",
    "HIGH_SPEED_COACH_HOLLOW",
    "QUANTITIES",
    "TABLE_1",
    "TABLE_1_PRINTED_LOADS",
    "CooperriderParameters",
    "FieldDescription",
    "ParameterRecord",
    "Vehicle",
    "describe",
    "preset",
    "quantity",
]
