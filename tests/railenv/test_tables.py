"""Characteristics as tables: exact in value and derivatives, the same in every kernel."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import CubicSpline

import railenv
from railenv.batch import Batch
from railenv.equations.functions import table
from railenv.errors import ParameterError
from railenv.kernels import loader
from railenv.tables import ALIGNED, WIDE, Table, names_of, pack, width
from tests.railenv.own_models import complex_step, full_jacobian
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
        ([0.0, 0.1], [0.0, 1.0, 2.0], "they must be equal in number"),
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
    a, b = starts[0][0], starts[0][4]
    for table_, start in ((first, a), (other, b)):
        assert start % ALIGNED == 0  # a float32 holds it then
        numbers = table_.packed()
        assert_array_equal(packed[int(start) : int(start) + len(numbers)], numbers)
    lengths = [len(table_.packed()) for table_ in (first, other)]
    assert len(packed) < sum(lengths) + 3 * ALIGNED
    assert starts[0][1:4] == list(first.grid)
    assert pack([{}, {}]) == (None, [[], []])


# ----------------------------------------------------------------------- several columns


def waves(seed=0):
    """Three functions on one grid, the first with its slope: four columns, and their splines."""
    x = np.linspace(-0.3, 0.4, 36)
    k = 1.0 + 0.1 * seed
    columns = np.sin(3.0 * k * x), np.cos(2.0 * x) + k, np.exp(k * x)
    made = Table.spline(x, *columns).with_slope(0)
    splines = [CubicSpline(x, column) for column in columns]
    return made, [splines[0], splines[0].derivative(), *splines[1:]]


def beyond(spline, x, ends, *, level=False):
    """Value and slope of what goes on straight beyond the ends, or level."""
    held = np.clip(x, *ends)
    if held == x:
        return float(spline(x)), float(spline(x, 1))
    slope = 0.0 if level else float(spline(held, 1))
    return float(spline(held)) + slope * (x - held), slope


def test_columns_are_splines_each_and_a_slope_is_that_of_its_column():
    made, splines = waves()
    for x in np.random.default_rng(1).uniform(-0.6, 0.8, 200):
        for column, spline in enumerate(splines):
            expected = beyond(spline, x, (-0.3, 0.4), level=column == 1)
            found = made(x, 0, column), made(x, 1, column)
            assert_allclose(found, expected, rtol=1e-10, atol=1e-10)
        # so that what derives from the first column is exact wherever it is read
        assert made(x, 1, 0) == pytest.approx(made(x, 0, 1), rel=1e-12, abs=1e-12)


def test_slopes_keep_their_columns_when_more_are_added():
    made, _ = waves()
    more = made.with_slope(2).with_slope(0)
    assert more.level == (2, 4, 1)
    assert made.level == (1,)
    for x in (-0.5, 0.1, 0.7):
        assert more(x, 0, 1) == more(x, 0, 2) == made(x, 0, 1)
        assert more(x, 0, 4) == pytest.approx(made(x, 1, 2), rel=1e-12)
    assert made != dataclasses.replace(made, level=())


def test_packed_numbers_are_cells_with_straight_ones_at_both_ends():
    made, _ = waves()
    cells = made.packed().reshape(-1, 4, WIDE)
    assert len(cells) == 35 + 2
    first, per, furthest = made.grid
    last = int(furthest)
    assert last == len(cells) - 1 < furthest
    assert first == pytest.approx(made.x[0] - 1.0 / per)
    assert_array_equal(cells[1:-1].transpose(0, 2, 1).reshape(35, -1), made.coefficients)
    for cell, number, x in ((cells[0], 0.0, -0.31), (cells[-1], last, 0.62)):
        assert not cell[2:].any()
        t = (x - first) * per - number
        assert_allclose(cell[0] + t * cell[1], [made(x, 0, c) for c in range(4)], rtol=1e-10)
    two = Table.spline(made.x, np.sin(made.x), made.x).packed().reshape(-1, 4, WIDE)
    assert not two[:, :, 2:].any()  # filled up
    assert (width(1), width(2), width(4)) == (1, WIDE, WIDE)
    assert names_of("flange") == ("flange", "flange__first", "flange__per", "flange__last")


@pytest.mark.parametrize("y", [[0.0, 1.0, np.nan, 2.0], [0.0, 1.0, 2.0]])
def test_columns_that_make_no_table_are_refused(y):
    with pytest.raises(ParameterError):
        Table.spline([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 4.0, 9.0], y)
    with pytest.raises(ParameterError, match="uniform grid of at least four"):
        Table.spline([0.0, 1.0, 2.0, 4.0], [0.0, 1.0, 4.0, 9.0])


# ----------------------------------------------------------------------------- kernels


def lookup(x, u, speed, curvature, cant, p):
    return [table(p.first, x[0]) + table(p.second, x[0]) * x[1], table(p.first, x[1])]


def with_tables(name, equations, parameters, tables):
    """A model of two states that reads tables, as assemblies do."""
    places = {n: 0.0 for made in tables for n in names_of(made)}
    model = railenv.Model(name, ["a", "b"], [], equations, {**parameters, **places})
    model.parameters, model.tables = parameters, tables
    return model


def kernel_model(first, second):
    return with_tables("lookup", lookup, {}, {"first": first, "second": second})


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
        assert_allclose(found, [made(a) + knee(a) * b, made(b)], rtol=1e-9, atol=1e-9)
        A, _ = model.jacobian(x, speed=1.0)
        expected = [[made(a, 1) + knee(a, 1) * b, knee(a)], [0.0, made(b, 1)]]
        assert_allclose(A, expected, rtol=1e-9, atol=1e-7)


@pytest.mark.parametrize("x", [np.nan, np.inf, -np.inf, 1e300])
def test_states_that_are_no_numbers_do_no_harm(x):
    model = kernel_model(smooth()[0], Table.through(*KNEE, odd=True))
    evaluator = model.evaluator()
    evaluator.set([x, 0.1], 1.0)
    rates = evaluator.rhs()
    assert np.isnan(x) <= np.isnan(rates[0])
    assert np.isfinite(rates[1])
    evaluator.jacobian()


def nested(x, u, speed, curvature, cant, p):
    """Lookups of several columns, in arguments of further lookups, scaled by parameters."""
    a, b = x
    height, slope = (table(p.waves, a, 0, c, 4) for c in (0, 1))
    further = table(p.waves, a + p.k * slope, 0, 2, 4)
    single = table(p.knee, b + 0.1 * further)
    last = table(p.waves, 1e-5 * single - p.k * b, 0, 3, 4)
    return [height * b + p.k * single, further - slope * last + p.k * p.k * b]


def nested_model(seed=0, k=0.07):
    tables = {"waves": waves(seed)[0], "knee": Table.through(*KNEE, odd=True)}
    return with_tables("nested", nested, {"k": k}, tables)


NESTED_STATES = np.random.default_rng(8).uniform(-0.7, 0.7, (70, 2))  # beyond all ends as well


def test_a_lookup_may_depend_on_another():
    model = nested_model()
    p = SimpleNamespace(**model.parameters, **model.tables)
    for x in NESTED_STATES:
        expected = nested(x.tolist(), [], 1.0, 0.0, 0.0, p)
        assert_allclose(model.rhs(x, speed=1.0), expected, rtol=1e-9, atol=1e-10)
        columns = []
        for j in range(2):
            z = [complex(v, STEP * (i == j)) for i, v in enumerate(x)]
            columns.append(np.imag(nested(z, [], 1.0, 0.0, 0.0, p)) / STEP)
        A, _ = model.jacobian(x, speed=1.0)
        expected = np.array(columns).T
        assert_allclose(A, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("cells", [35, 36, 37, 38])
@pytest.mark.parametrize("columns", [1, 3])
def test_kernels_go_on_straight_beyond_the_ends_of_any_number_of_cells(cells, columns):
    # that number is a number, so all of them share their kernels
    x = np.linspace(0.0, 1.0, cells + 1)
    made = Table.spline(x, *[np.sin(3.0 * x + c) for c in range(columns)])

    def equations(s, u, speed, curvature, cant, p):
        return [table(p.made, s[0], 0, columns - 1, columns), s[1]]

    model = with_tables("ends", equations, {}, {"made": made})
    for x0 in (-3.0, -1e-9, 0.0, 1.0, 1.0 + 1e-9, 1.02, 4.0, 1e4):
        expected = [made(x0, order, columns - 1) for order in (0, 1)]
        found = [model.rhs([x0, 0.0], speed=1.0)[0], model.jacobian([x0, 0.0], speed=1.0)[0][0, 0]]
        assert_allclose(found, expected, rtol=1e-9, atol=1e-15)


def parameter_slopes(model, x, run=(1.0, 0.0, 0.0), u=()):
    """Derivatives of the rates by the parameters: of the kernels, and by complex step."""
    kernels = model.kernels()
    layout = kernels.LAYOUT
    w = np.zeros(layout.all_rows)
    w[: layout.p] = [*x, *u, *run]
    w[layout.p : layout.dx], t = model.rows()
    rows, columns = (np.ascontiguousarray(c) for c in np.array(kernels.PARAMETER_CELLS).T)
    found = np.zeros((model.n_states, layout.n_parameters))
    kernels.dense_parameter_jacobian(w, t, rows, columns, found)
    expected = []
    for name, value in model.parameters.items():
        p = SimpleNamespace(**{**model.parameters, **model.tables, name: complex(value, STEP)})
        rates = model.equations([complex(v) for v in x], list(u), *run, p)
        expected.append(np.imag(rates) / STEP)
    return found[:, : len(expected)], np.array(expected).T


def test_derivatives_by_parameters_go_through_nested_lookups():
    model = nested_model()
    for x in NESTED_STATES[:20]:
        found, expected = parameter_slopes(model, x)
        assert np.abs(expected).max() > 1.0
        assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("dtype", loader.LANES)
def test_lanes_of_nested_lookups_equal_scalar_ones_to_the_bit(dtype):
    models = [nested_model(seed, 0.05 + 1e-3 * seed) for seed in range(7)]
    fleet = [models[i % 7] for i in range(len(NESTED_STATES))]
    batch = Batch(fleet, dtype)
    batch.states = NESTED_STATES
    assert_array_equal(
        batch.rhs(), [single(m, x, dtype) for m, x in zip(fleet, NESTED_STATES, strict=True)]
    )


def single(model, x, dtype="float64", run=(1.0, 0.0, 0.0)):
    """Rates by the kernel of one lane of a precision."""
    kernels = model.kernels(loader.SCALAR, dtype)
    layout = kernels.LAYOUT
    w = np.zeros(layout.rows, dtype)
    w[layout.p : layout.dx], t = model.rows()
    w[layout.x : layout.u] = x
    w[layout.c : layout.p] = run
    kernels.rhs(w, t.astype(dtype))
    return w[layout.dx : layout.work].copy()


@pytest.fixture(scope="module")
def on_profiles():
    """Vehicles of one structure on different profiles, of different track and wheel."""
    pairs = [
        railenv.ProfilePair(),
        railenv.ProfilePair(wheel="S1002_WORN"),
        railenv.ProfilePair(inclination=1.0 / 20.0),
        railenv.ProfilePair(gauge=1.437, grid=8e-5),
    ]
    coach = railenv.HIGH_SPEED_COACH_S1002
    return [railenv.DualWheelset(coach.replace(contact=pair, friction=0.3)) for pair in pairs]


@pytest.mark.parametrize("dtype", loader.LANES)
def test_lanes_on_different_profiles_equal_scalar_ones_to_the_bit(on_profiles, operations, dtype):
    assert len({m.structure for m in on_profiles}) == 1
    fleet = [on_profiles[i % 4] for i in range(37)]
    states = np.array([o.x for o in operations(fleet[0], 37, seed=5)])
    states[::5, 0] += 0.03  # beyond the ends of the tables
    run = (60.0, 1e-3, 0.03)
    batch = Batch(fleet, dtype)
    batch.states, batch.conditions = states, list(run)
    found = batch.rhs()
    assert_array_equal(found, [single(m, x, dtype, run) for m, x in zip(fleet, states, strict=True)])
    if dtype == "float64":
        evaluator = [m.evaluator() for m in on_profiles]
        for i in range(8):
            evaluator[i % 4].set(states[i], *run)
            assert_array_equal(found[i], evaluator[i % 4].rhs())
    unlike = Batch([on_profiles[0]] * 37, dtype)
    unlike.states, unlike.conditions = states, list(run)
    assert (np.abs(unlike.rhs() - found)[1] > 0.0).any()


def test_profiles_in_kernels_are_the_equations_with_their_derivatives(on_profiles, operations):
    model = on_profiles[1]
    for o in operations(model, 15, seed=6):
        plain = np.array(model.plain_rhs(*o.arguments))
        assert_allclose(
            model.rhs(o.x, o.u, **o.conditions), plain, rtol=1e-11, atol=1e-11 * np.abs(plain).max()
        )
        expected = complex_step(model, *o.arguments)
        noise = 1e-10 * np.abs(expected).max(axis=1, keepdims=True)
        found = full_jacobian(model, o)
        assert (np.abs(found - expected) <= 1e-8 * np.abs(expected) + noise).all()


def test_a_family_of_profiles_knows_how_rates_change_with_the_wear(operations):
    new, worn = railenv.ProfilePair(), railenv.ProfilePair(wheel="S1002_WORN")
    coach = railenv.HIGH_SPEED_COACH_S1002
    model = railenv.DualWheelset(coach.replace(contact=railenv.ProfileFamily(new, worn, 0.4)))
    at = list(model.parameters).index("wear")
    for o in operations(model, 10, seed=7):
        run = (o.speed, o.curvature, o.cant)
        found, expected = parameter_slopes(model, o.x, run, o.u)
        assert_allclose(
            found[:, at], expected[:, at], rtol=1e-8, atol=1e-9 * np.abs(expected[:, at]).max()
        )
        h = 1e-5
        up, down = (model.replace(wear=0.4 + s * h).rhs(o.x, o.u, **o.conditions) for s in (1, -1))
        slope = found[:, at]
        assert_allclose((up - down) / (2 * h), slope, rtol=1e-4, atol=1e-4 * np.abs(slope).max() + 1e-5)
    for wear, pair in ((0.0, new), (1.0, worn)):
        end = railenv.DualWheelset(coach.replace(contact=pair))
        o = operations(model, 1, seed=8)[0]
        rates = [m.plain_rhs(*o.arguments) for m in (model.replace(wear=wear), end)]
        assert_allclose(*rates, rtol=1e-12, atol=1e-9)


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
