"""Batches: many systems in lanes give what each gives alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import railenv
from railenv.batch import THREAD_PAYS_FROM, Batch
from railenv.errors import ParameterError
from railenv.kernels import loader

SYSTEMS = 21  # one block of lanes and some of the next
STEP, STEPS = 2.0**-13, 256


def fleet(model, operations, count=SYSTEMS):
    """Return models of different conicity with an operating point each."""
    rng = np.random.default_rng(1)
    models = [model.replace(conicity=c) for c in rng.uniform(0.02, 0.3, count)]
    return models, operations(model, count, seed=2)


def batch_of(models, points, dtype="float64"):
    batch = Batch(models, dtype)
    batch.states = [o.x for o in points]
    batch.inputs = [o.u for o in points]
    batch.conditions = [[o.speed, o.curvature, o.cant] for o in points]
    return batch


def alone(model, o, steps=STEPS):
    """State after some steps of the scalar kernel."""
    kernels = model.kernels()
    layout = kernels.LAYOUT
    w = np.zeros(layout.j)
    w[layout.p : layout.dx], t = model.rows()
    w[: layout.p] = [*o.x, *o.u, o.speed, o.curvature, o.cant]
    kernels.rk4_hold(w, t, STEP, steps)
    return w[: layout.u]


def simple(x, u, speed, curvature, cant, p):
    return [p.a * x[0] + p.b * u[0], speed * x[1] + curvature - cant]


def simple_model(**parameters):
    return railenv.Model("simple", ["p", "q"], ["v"], simple, {"a": 1.0, "b": 2.0, **parameters})


SIMPLE = simple_model()


@pytest.fixture(params=["coach", "cooperrider"])
def model(request):
    """A model with every kind of operation, and one with few."""
    return request.getfixturevalue(request.param)


# ------------------------------------------------------------------ the same as one by one


def test_lanes_give_the_right_hand_side_of_each_system_to_the_bit(model, operations):
    models, points = fleet(model, operations)
    expected = [m.rhs(o.x, o.u, **o.conditions) for m, o in zip(models, points, strict=True)]
    assert_array_equal(batch_of(models, points).rhs(), expected)


def test_lanes_integrate_each_system_as_the_scalar_kernel_does_to_the_bit(model, operations):
    models, points = fleet(model, operations)
    batch = batch_of(models, points)
    batch.integrate(step=STEP, steps=STEPS)
    expected = np.array([alone(m, o) for m, o in zip(models, points, strict=True)])
    assert (np.abs(expected - [o.x for o in points]).max(axis=1) > 1e-4).all()  # they all moved
    assert_array_equal(batch.states, expected)


def test_simulation_of_one_system_gives_what_the_batch_gives_to_the_bit(coach):
    # motion on the tread over half a second, from the running equilibrium
    radius, cant = 4000.0, 0.05
    start = railenv.find_equilibrium(coach, speed=60.0, radius=radius, cant=cant).state
    start[0] += 1e-3
    batch = Batch([coach] * 3)
    batch.states, batch.conditions = start, [60.0, 1.0 / radius, cant]
    batch.integrate(step=STEP, steps=4096)
    response = railenv.simulate(
        coach,
        speed=60.0,
        radius=radius,
        cant=cant,
        initial_state=start,
        duration=0.5,
        step=STEP,
        output_step=0.5,
    )
    assert_array_equal(batch.states, np.tile(response.states[:, -1], (3, 1)))


def test_float32_lanes_stay_close_to_float64_ones(coach):
    rng = np.random.default_rng(3)
    models = [coach.replace(conicity=c) for c in rng.uniform(0.03, 0.2, 40)]
    start = railenv.find_equilibrium(coach, speed=60.0).state + 2e-4 * rng.uniform(-1.0, 1.0, (40, 24))
    ends = []
    for dtype in ("float64", "float32"):
        batch = Batch(models, dtype)
        batch.states, batch.conditions = start, [60.0, 1e-4, 0.02]
        batch.integrate(step=STEP, steps=2048)
        assert batch.states.dtype == dtype
        ends.append(batch.states.astype(float))
    double, single = ends
    for part in (np.s_[:, :12], np.s_[:, 12:]):  # coordinates, rates
        assert_allclose(single[part], double[part], rtol=0, atol=1e-3 * np.abs(double[part]).max())
    assert (single != double).any()


# ------------------------------------------------ independence of size, place and threads


@pytest.mark.parametrize("dtype", loader.LANES)
def test_results_do_not_depend_on_size_of_the_batch_or_place_in_it_to_the_bit(coach, operations, dtype):
    models, points = fleet(coach, operations, 70)
    whole = batch_of(models, points, dtype)
    whole.integrate(step=STEP, steps=64, parallel=False)
    order = np.random.default_rng(4).permutation(70)
    for size in (1, 2, 15, 33, 70):
        chosen = order[:size]
        part = batch_of([models[i] for i in chosen], [points[i] for i in chosen], dtype)
        part.integrate(step=STEP, steps=64, parallel=False)
        assert_array_equal(part.states, whole.states[chosen])


@pytest.mark.parametrize("dtype", loader.LANES)
def test_threads_change_no_bit(coach, operations, dtype):
    models, points = fleet(coach, operations, 70)
    ends = []
    for parallel in (False, True, None):
        batch = batch_of(models, points, dtype)
        batch.integrate(step=STEP, steps=64, parallel=parallel)
        ends.append(batch.states)
    assert 2 * THREAD_PAYS_FROM <= 70 * 64  # so that threads are used by default too
    assert_array_equal(ends[0], ends[1])
    assert_array_equal(ends[0], ends[2])


def test_integrating_in_parts_changes_no_bit(coach, operations):
    models, points = fleet(coach, operations)
    whole, parts = batch_of(models, points), batch_of(models, points)
    whole.integrate(step=STEP, steps=100)
    for steps in (1, 33, 66):
        parts.integrate(step=STEP, steps=steps)
        parts.rhs()  # looking at the derivatives disturbs nothing
    assert_array_equal(parts.states, whole.states)


def test_a_system_that_diverges_leaves_its_neighbours_alone():
    models = [SIMPLE] * 5
    calm, wild = Batch(models), Batch(models)
    for batch, first in ((calm, 1.0), (wild, 1e300)):
        batch.conditions = [[2.0, 0.0, 0.0]] * 5
        batch.states = [[first, first]] + [[1.0, 1.0]] * 4
        batch.integrate(step=0.5, steps=200)
    assert not np.isfinite(wild.states[0]).all()
    assert np.isfinite(calm.states).all()
    assert_array_equal(wild.states[1:], calm.states[1:])


# ----------------------------------------------------------------------- what it holds


def test_batch_holds_what_it_is_given():
    batch = Batch([simple_model(a=a) for a in (1.0, 2.0, 3.0)])
    batch.states = [[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]]
    batch.inputs = [[0.1], [0.2], [0.3]]
    batch.conditions = [[1.0, 0.5, 0.0], [2.0, 0.0, 0.25], [3.0, 0.0, 0.0]]
    assert batch.states.shape == (3, 2)
    assert batch.inputs.shape == (3, 1)
    assert batch.conditions.shape == (3, 3)
    assert_array_equal(batch.states[1], [2.0, 20.0])
    assert_array_equal(batch.inputs[:, 0], [0.1, 0.2, 0.3])
    assert_array_equal(batch.conditions[:, 0], [1.0, 2.0, 3.0])
    expected = [[1.2, 10.5], [4.4, 39.75], [9.6, 90.0]]
    assert_allclose(batch.rhs(), expected, rtol=1e-15)


def test_one_row_is_for_all_systems_alike():
    batch = Batch([SIMPLE] * 20)
    batch.states, batch.inputs, batch.conditions = [1.0, 2.0], [3.0], [4.0, 0.5, 0.25]
    assert_array_equal(batch.states, np.tile([1.0, 2.0], (20, 1)))
    assert_array_equal(batch.rhs(), np.tile([7.0, 8.25], (20, 1)))


def test_what_is_read_is_a_copy():
    batch = Batch([SIMPLE] * 3)
    batch.states = [1.0, 2.0]
    for read in (batch.states, batch.conditions, batch.inputs, batch.rhs()):
        read[:] = np.nan
    assert_array_equal(batch.states, np.tile([1.0, 2.0], (3, 1)))
    assert np.isfinite(batch.rhs()).all()


def test_fresh_batch_stands_at_zero_on_tangent_track():
    batch = Batch([SIMPLE] * 2)
    assert not batch.states.any()
    assert not batch.inputs.any()
    assert_array_equal(batch.conditions, [[1.0, 0.0, 0.0]] * 2)


# ----------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("models", "options", "message"),
    [
        ([], {}, "models is empty; a batch needs at least one model"),
        ([SIMPLE], {"dtype": "float16"}, "dtype is 'float16'; it must be 'float64' or 'float32'"),
        ([SIMPLE, railenv.CooperriderBogie()], {}, "must share their equations"),
        (
            [railenv.Bogie(railenv.TABLE_1), railenv.DualWheelset(railenv.TABLE_1)],
            {},
            "must share their equations",
        ),
    ],
)
def test_models_that_make_no_batch_are_refused(models, options, message):
    with pytest.raises(ParameterError, match=message):
        Batch(models, **options)


@pytest.mark.parametrize(
    ("what", "value", "message"),
    [
        ("states", [1.0, 2.0, 3.0], r"states has shape \(3,\); it must be \(2, 2\), or \(2,\).*: p, q"),
        ("states", np.zeros((3, 2)), r"states has shape \(3, 2\)"),
        ("states", 1.0, r"states has shape \(\)"),
        ("inputs", np.zeros((2, 2)), r"inputs has shape \(2, 2\); it must be \(2, 1\)"),
        ("conditions", [30.0, 0.0], r"conditions has shape \(2,\).*speed, curvature, cant"),
        ("conditions", [0.0, 0.0, 0.0], "speed is 0 m/s"),
        ("conditions", [[30.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], "speed is -1 m/s"),
        ("conditions", [np.nan, 0.0, 0.0], "speed is nan"),
        ("conditions", [np.inf, 0.0, 0.0], "speed is inf"),
    ],
)
def test_values_of_the_wrong_shape_or_size_are_refused_and_change_nothing(what, value, message):
    batch = Batch([SIMPLE] * 2)
    before = getattr(batch, what)
    with pytest.raises(ParameterError, match=message):
        setattr(batch, what, value)
    assert_array_equal(getattr(batch, what), before)


@pytest.mark.parametrize("step", [0.0, -1e-3, np.nan, np.inf, "short"])
def test_impossible_steps_are_refused(step):
    with pytest.raises(ParameterError, match=r"^step is "):
        Batch([SIMPLE]).integrate(step=step, steps=1)


def _scaled_decay(x, u, speed, curvature, cant, p):
    return [p.a * x[0] - 10.0 * p.b]


def test_models_whose_parameters_stand_in_another_order_are_refused():
    models = [
        railenv.Model("m", ["x"], [], _scaled_decay, parameters)
        for parameters in ({"a": 1.0, "b": 2.0}, {"b": 2.0, "a": 1.0})
    ]
    with pytest.raises(railenv.ParameterError, match="must share their equations"):
        Batch(models)


@pytest.mark.parametrize("conditions", [[50.0, np.nan, 0.0], [50.0, 0.0, 3.0], ["a", 0.0, 0.0]])
def test_impossible_conditions_of_a_batch_are_refused(conditions):
    batch = Batch([railenv.Bogie(railenv.TABLE_1)])
    with pytest.raises(railenv.ParameterError):
        batch.conditions = conditions
