"""The assembled bogie and dual wheelset are the explicit equations of the paper, corrected."""

from types import SimpleNamespace

import numpy as np
import pytest

import railenv
from tests.railenv.oracle.bogie import bogie
from tests.railenv.oracle.dual_wheelset import dual_wheelset

MODELS = {railenv.Bogie: bogie, railenv.DualWheelset: dual_wheelset}

SECONDARY = {
    "secondary_longitudinal_stiffness": 0.15e6,
    "secondary_lateral_stiffness": 0.16e6,
    "secondary_vertical_stiffness": 0.40e6,
    "secondary_longitudinal_damping": 2e5,
    "secondary_lateral_damping": 60e3,
    "secondary_vertical_damping": 80e3,
    "secondary_arm": 0.95,
}
WITHOUT_SECONDARY = {name: 0.0 for name in SECONDARY if name != "secondary_arm"}
DAMPER = {f"yaw_damper_c{k}": getattr(railenv.TABLE_1, f"yaw_damper_c{k}") for k in (1, 2, 3, 4)}
WITHOUT_DAMPER = dict.fromkeys(DAMPER, 0.0)

CONICAL = [v for v in railenv.PRESETS if isinstance(v.contact, railenv.Cone)]

VEHICLES = [
    pytest.param(
        preset.replace(
            wheelbase_curving=curving,
            load_bookkeeping=loads,
            **(SECONDARY if secondary else WITHOUT_SECONDARY),
            **(DAMPER if damper else WITHOUT_DAMPER),
        ),
        id=f"{preset.name}-curving={curving}-{loads}-secondary={secondary}-damper={damper}",
    )
    for preset in CONICAL
    for curving in (False, True)
    for loads in ("once", "printed")
    for secondary in (False, True)
    for damper in (False, True)
]

POLACH = {"saturation": "polach", "polach_adhesion": 0.8, "polach_slip": 0.3}
CREEP = [
    {**law, **of, **load}
    for law in ({}, POLACH)
    for of in ({}, {"saturation_of": "wheel"})
    for load in ({}, {"load_dependent_creep": True})
]
VEHICLES += [
    pytest.param(
        railenv.HIGH_SPEED_COACH.replace(conicity=0.3, **options),
        id="-".join(["steep", *map(str, options.values())]),
    )
    for options in CREEP
]


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("vehicle", VEHICLES)
def test_assembly_is_the_explicit_equations(kind, vehicle, operations):
    model = kind(vehicle)
    options = ("saturation", "saturation_of", "load_dependent_creep")
    p = SimpleNamespace(**vehicle.parameters(), **{name: getattr(vehicle, name) for name in options})
    for o in operations(model, 10, seed=11):
        expected = np.array(MODELS[kind](*o.arguments, p))
        largest = np.abs(expected).max()
        for found in (model.plain_rhs(*o.arguments), model.rhs(o.x, o.u, **o.conditions)):
            assert np.abs(found - expected).max() <= 1e-12 * largest, o.regime


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("vehicle", railenv.PRESETS, ids=lambda v: v.name)
def test_assembly_of_a_shipped_vehicle_is_its_model(kind, vehicle, operations):
    model = kind(vehicle)
    assembled = railenv.Assembled(model.assembly)
    assert assembled.state_names == model.state_names
    for o in operations(model, 5, seed=1):
        here, there = (m.plain_rhs(*o.arguments) for m in (model, assembled))
        assert here == there
