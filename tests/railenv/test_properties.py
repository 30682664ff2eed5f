"""Properties of the models for vehicles, tracks and states that nobody chose."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import railenv
from benchmarks.reliability.values import LENGTHS
from railenv.errors import RailenvError
from railenv.vehicles import QUANTITIES, Vehicle
from tests.vehicles import mirrored

_METADATA = {row.name: row.metadata for row in Vehicle.__dataclass_fields__.values()}


@st.composite
def vehicles(draw):
    """Draw a vehicle up to an order of magnitude about a shipped one, lengths up to a factor of two."""
    base = draw(st.sampled_from(railenv.PRESETS))
    changes = {}
    for name in draw(st.sets(st.sampled_from(QUANTITIES))):
        decades = 0.3 if name in LENGTHS else 1.0
        value = getattr(base, name) * 10.0 ** draw(st.floats(-decades, decades))
        changes[name] = min(value, _METADATA[name]["bounds"].get("high", math.inf))
    if base.conicity is not None and draw(st.booleans()):
        lowest = getattr(base.contact, "contact_angle", 0.005)
        changes["conicity"] = max(lowest, min(0.7, base.conicity * 10.0 ** draw(st.floats(-1.0, 1.0))))
    zero = st.sets(
        st.sampled_from([n for n in QUANTITIES if n.startswith(("primary_l", "secondary_l"))])
    )
    changes.update(dict.fromkeys(draw(zero), 0.0))
    return base.replace(
        wheelbase_curving=draw(st.booleans()),
        load_bookkeeping=draw(st.sampled_from(["once", "printed"])),
        **changes,
    )


@st.composite
def conditions(draw):
    """Draw speed, curvature and cant: tangent track or curves of both hands, canted either way."""
    radius = draw(st.one_of(st.just(math.inf), st.floats(150.0, 20e3), st.floats(-20e3, -150.0)))
    return {
        "speed": draw(st.floats(1.0, 150.0)),
        "curvature": 1.0 / radius,
        "cant": draw(st.floats(-0.16, 0.16)),
    }


kinds = st.sampled_from([railenv.Bogie, railenv.DualWheelset])
seeds = st.integers(0, 2**32 - 1)


def random_point(model, seed):
    """Draw a state and inputs, anywhere from the tread to a derailment."""
    rng = np.random.default_rng(seed)
    n = model.n_states // 2
    size = 10.0 ** rng.uniform(-6.0, 0.0)
    x = np.concatenate([0.05 * size * rng.uniform(-1.0, 1.0, n), size * rng.uniform(-1.0, 1.0, n)])
    x -= 1e-3 * np.array([name.startswith("z_") for name in model.state_names])
    u = np.array([1e4 if name.startswith("M") else 5e-3 for name in model.input_names])
    return x, u * rng.uniform(-1.0, 1.0, model.n_inputs)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(kind=kinds, vehicle=vehicles(), where=conditions(), seed=seeds)
def test_any_vehicle_anywhere_has_finite_derivatives_that_are_those_of_the_equations(
    kind, vehicle, where, seed
):
    model = kind(vehicle)
    x, u = random_point(model, seed)
    f = model.rhs(x, u, **where)
    A, B = model.jacobian(x, u, **where)
    assert np.isfinite(f).all()
    for matrix in (A, B, model.condition_jacobian(x, u, **where)):
        assert np.isfinite(matrix).all()
    plain = np.array(model.plain_rhs(x.tolist(), u.tolist(), *where.values()))
    assert_allclose(f, plain, rtol=1e-11, atol=1e-12 * np.abs(plain).max())


@settings(max_examples=60, deadline=None, derandomize=True)
@given(kind=kinds, vehicle=vehicles(), where=conditions(), seed=seeds)
def test_jacobian_predicts_a_small_step_of_any_vehicle(kind, vehicle, where, seed):
    # in a random direction of states, inputs and conditions at once
    model = kind(vehicle)
    x, u = random_point(model, seed)
    rng = np.random.default_rng(seed)
    z = np.concatenate([x, u, list(where.values())])
    direction = rng.uniform(-1.0, 1.0, len(z)) * np.maximum(np.abs(z), 1e-3)
    step = 1e-25
    at = (z + 1j * step * direction).tolist()
    n = model.n_states
    expected = [complex(d).imag / step for d in model.plain_rhs(at[:n], at[n:-3], *at[-3:])]
    full = np.hstack([*model.jacobian(x, u, **where), model.condition_jacobian(x, u, **where)])
    scale = (np.abs(full) * np.abs(direction)).sum(axis=1)
    assert (np.abs(full @ direction - expected) <= 1e-10 * scale).all()


@settings(max_examples=40, deadline=None, derandomize=True)
@given(kind=kinds, vehicle=vehicles(), where=conditions(), seed=seeds)
def test_curve_of_the_other_hand_is_the_mirror_image_for_any_vehicle(kind, vehicle, where, seed):
    model = kind(vehicle)
    x, u = random_point(model, seed)
    mirror_u = np.array([1.0 if n.startswith("vert") else -1.0 for n in model.input_names])
    other = {"speed": where["speed"], "curvature": -where["curvature"], "cant": -where["cant"]}
    here = model.rhs(x, u, **where)
    there = model.rhs(mirrored(model, x), mirror_u * u, **other)
    assert_allclose(there, mirrored(model, here), rtol=1e-10, atol=1e-11 * np.abs(here).max())


@settings(max_examples=40, deadline=None, derandomize=True)
@given(kind=kinds, vehicle=vehicles(), where=conditions())
def test_any_vehicle_has_an_equilibrium_or_the_package_says_that_it_found_none(kind, vehicle, where):
    model = kind(vehicle)
    curvature, cant, speed = where["curvature"], where["cant"], where["speed"]
    radius = 1.0 / curvature if curvature else math.inf
    try:
        found = railenv.find_equilibrium(model, speed=speed, radius=radius, cant=cant)
    except RailenvError:
        return
    derivative = model.rhs(found.state, speed=speed, curvature=1.0 / radius, cant=cant)
    assert np.abs(derivative).max() < 1e-6
    assert found.residual < 1e-6
