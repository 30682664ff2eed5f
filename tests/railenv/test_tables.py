"""Characteristics as tables: exact in value and derivatives, the same in every kernel."""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import CubicSpline

import railenv
from railenv.batch import Batch
from railenv.equations.functions import table
from railenv.errors import ParameterError
from railenv.tables import Table, pack
from tests.railenv.vehicles.assemblies import everything, random_state

KNEE = ([0.0, 0.02, 0.025, 0.03, 0.045], [0.0, 0.0, 696.0, 2107.0, 30096.0])
STEP = 1e-30


def smooth():
    """Samples of a smooth function on a uniform grid, and their spline."""
    x = np.linspace(-0.5, 0.7, 301)
    y = 1e3 * np.tanh(4.0 * x) + 50.0 * x**2
    return Table.spline(x, y), CubicSpline(x, y)


# -------------------------------------------------------------------------- against SciPy


@pytest.mark.parametrize("order", [0, 1, 2])
def test_spline_is_scipys_with_its_derivatives(order):
    made, expected = smooth()
    xs = np.random.default_rng(1).uniform(-0.5, 0.7, 500)
    found = [made(x, order) for x in xs]
    assert_allclose(found, expected(xs, order), rtol=1e-9, atol=1e-7 * np.abs(found).max())


def test_table_is_straight_between_its_points_and_passes_through_them():
    x, y = np.array([0.0, 0.1, 0.3, 0.6, 1.0]), np.array([0.0, 4e3, 6e3, 6.5e3, 9e3])
    made = Table.through(x, y, odd=True)
    assert_allclose([made(v) for v in x], y, rtol=1e-12, atol=1e-9)
    rounded = 0.1 / 4  # a quarter of the closest distance, to either side of a point
    xs = np.linspace(0.0, 1.0, 2001)
    away = np.abs(xs[:, None] - x).min(axis=1) >= rounded
    assert_allclose(
        [made(v) for v in xs[away]], np.interp(xs[away], x, y), rtol=1e-12, err_msg="between points"
    )
    assert_allclose([made(-v) for v in xs], [-made(v) for v in xs], rtol=1e-12, atol=1e-9)
    slopes = np.array([made(v, 1) for v in xs])
    assert np.abs(np.diff(slopes)).max() < 0.1 * np.ptp(slopes)  # no corner is left


def test_knee_of_a_blow_off_damper_stands_where_the_data_sheet_has_it():
    made = Table.through([0.0, 0.004, 1.0], [0.0, 9810.0, 59560.2], odd=True)
    assert made(0.002) == pytest.approx(4905.0, rel=1e-9)
    assert made(0.004) == pytest.approx(9810.0, rel=1e-9)
    assert made(0.5) == pytest.approx(9810.0 + 0.496 * 49950.0, rel=1e-6)


def test_curve_of_monotone_points_never_turns_back():
    made = Table.through(*KNEE, odd=True)
    xs = np.linspace(-0.06, 0.06, 40_001)
    assert (np.diff([made(x) for x in xs]) >= 0.0).all()
    assert min(made(x, 1) for x in xs) >= 0.0


@pytest.mark.parametrize("end", [-0.5, 0.7])
def test_table_is_linear_beyond_its_ends(end):
    made, spline = smooth()
    slope = float(spline(end, 1))
    for beyond in (1e-3, 0.1, 10.0):
        x = end + np.sign(end) * beyond
        assert made(x) == pytest.approx(float(spline(end)) + slope * (x - end), rel=1e-12)
        assert made(x, 1) == pytest.approx(slope, rel=1e-12)
        assert made(x, 2) == 0.0


def test_derivatives_are_those_of_the_value_by_complex_step():
    for made in (smooth()[0], Table.through(*KNEE, odd=True)):
        for x in np.random.default_rng(2).uniform(1.3 * made.x[0], 1.3 * made.x[-1], 200):
            for order in (0, 1):
                derivative = made(complex(x, STEP), order)
                assert np.imag(derivative) / STEP == pytest.approx(
                    made(x, order + 1), rel=1e-9, abs=1e-6
                )


def test_inverse_gives_back_what_went_in():
    made = Table.through([0.0, 0.01, 0.1, 0.3], [0.0, 3e3, 8e3, 11e3], odd=True)
    back = made.inverse()
    for x in (-0.3, -0.1, -0.01, 0.0, 0.01, 0.1, 0.3):
        assert back(made(x)) == pytest.approx(x, rel=3e-3, abs=1e-12)  # knees within cells
    with pytest.raises(ParameterError, match="must rise everywhere"):
        Table.through(*KNEE, odd=True).inverse()


@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        ([0.0, 0.1, 0.1], [0.0, 1.0, 2.0], "must rise from point to point"),
        ([0.0, 0.1], [0.0, np.nan], "no entry may be NaN"),
        ([0.0, 0.1], [0.0, 1.0, 2.0], "they must be as many"),
        ([0.0, 0.1], [1.0, 2.0], r"given from \(0, 0\) on"),
        ([0.0, 1e-9, 1.0], [0.0, 1.0, 2.0], "the closest may be"),
    ],
)
def test_points_that_make_no_table_are_refused(x, y, message):
    with pytest.raises(ParameterError, match=message):
        Table.through(x, y, odd=True)


def test_equal_tables_are_packed_once():
    first, second = (Table.through(*KNEE, odd=True) for _ in range(2))
    other = smooth()[0]
    packed, starts = pack([{"a": first, "b": other}, {"a": second, "b": other}])
    assert first == second
    assert starts[0] == starts[1]
    assert len(packed) == 1 + len(first.packed()) + len(other.packed())


# ----------------------------------------------------------------------------- kernels


def lookup(x, u, speed, curvature, cant, p):
    return [table(p.first, x[0]) + table(p.second, x[0]) * x[1], table(p.first, x[1])]


def kernel_model(first, second):
    """A model that reads two tables, as assemblies do."""
    model = railenv.Model("lookup", ["a", "b"], [], lookup, {"first": 0.0, "second": 0.0})
    model.parameters = {}
    model.tables = {"first": first, "second": second}
    return model


@pytest.fixture(scope="module")
def vehicles():
    """Vehicles of one structure, each with its own tables."""
    return [railenv.Assembled(everything(seed)) for seed in range(19)]


def test_kernels_give_value_and_derivative_of_the_table():
    made, knee = smooth()[0], Table.through(*KNEE, odd=True)
    model = kernel_model(made, knee)
    for x in np.random.default_rng(3).uniform(-1.0, 1.0, (200, 2)):
        a, b = x
        found = model.rhs(x, speed=1.0)
        assert_allclose(found, [made(a) + knee(a) * b, made(b)], rtol=1e-11, atol=1e-9)
        A, _ = model.jacobian(x, speed=1.0)
        expected = [[made(a, 1) + knee(a, 1) * b, knee(a)], [0.0, made(b, 1)]]
        assert_allclose(A, expected, rtol=1e-10, atol=1e-7)


@pytest.mark.parametrize("x", [np.nan, np.inf, -np.inf, 1e300])
def test_states_that_are_no_numbers_do_no_harm(x):
    model = kernel_model(smooth()[0], Table.through(*KNEE, odd=True))
    evaluator = model.evaluator()
    evaluator.set([x, 0.1], 1.0)
    rates = evaluator.rhs()
    assert np.isnan(x) <= np.isnan(rates[0])
    assert np.isfinite(rates[1])
    evaluator.jacobian()


def test_lanes_with_different_tables_give_what_each_gives_alone_to_the_bit(vehicles):
    rng = np.random.default_rng(4)
    assert len({m.structure for m in vehicles}) == 1
    assert len({m.tables["bump_force"] for m in vehicles}) == len(vehicles)
    states = [random_state(m.assembly, rng, 2.0) for m in vehicles]
    batch = Batch(vehicles)
    batch.states, batch.conditions = states, [40.0, 1e-3, 0.02]
    run = {"speed": 40.0, "curvature": 1e-3, "cant": 0.02}
    alone = [m.rhs(x, **run) for m, x in zip(vehicles, states, strict=True)]
    assert_array_equal(batch.rhs(), alone)


def test_lanes_with_different_tables_integrate_as_the_scalar_kernel_to_the_bit(vehicles):
    rng = np.random.default_rng(5)
    states = [random_state(m.assembly, rng) for m in vehicles]
    batch = Batch(vehicles)
    batch.states, batch.conditions = states, [40.0, 0.0, 0.0]
    batch.integrate(step=2.0**-15, steps=32)
    for model, x, found in zip(vehicles, states, batch.states, strict=True):
        kernels = model.kernels()
        layout = kernels.LAYOUT
        w = np.zeros(layout.j)
        w[layout.p : layout.dx], t = model.rows()
        w[: layout.u], w[layout.c] = x, 40.0
        kernels.rk4_hold(w, t, 2.0**-15, 32)
        assert_array_equal(found, w[: layout.u])
        assert np.isfinite(found).all()


def test_a_lane_that_is_no_number_leaves_its_neighbours_alone(vehicles):
    rng = np.random.default_rng(6)
    states = np.array([random_state(m.assembly, rng) for m in vehicles])
    batch = Batch(vehicles)
    batch.states, batch.conditions = states, [40.0, 0.0, 0.0]
    expected = batch.rhs()
    batch._blocks.reshape(len(batch._blocks), -1, 16)[0, : states.shape[1], 3] = np.nan
    found = batch.rhs()
    others = np.arange(len(vehicles)) != 3
    assert np.isnan(found[3]).any()
    assert_array_equal(found[others], expected[others])


def test_another_table_is_another_number_of_the_same_structure():
    assembly = everything(0)
    stop = next(e for e in assembly.elements if e.name == "bump")
    x, y = stop.force
    stiffer = dataclasses.replace(stop, force=(x, tuple(2.0 * v for v in y)))
    elements = tuple(stiffer if e is stop else e for e in assembly.elements)
    other = dataclasses.replace(assembly, elements=elements)
    assert other.structure == assembly.structure
    assert railenv.Assembled(other).tables != railenv.Assembled(assembly).tables
