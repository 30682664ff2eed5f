"""Models: compiled right-hand sides and Jacobians against the equations, and models of one's own."""

import copy
import math
import pickle
import sys
from concurrent.futures import ThreadPoolExecutor

import control
import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose, assert_array_equal

import railenv
from railenv.equations.functions import (
    atan,
    cos,
    exp,
    log,
    positive_part,
    sin,
    sqrt,
    tan,
    tanh,
    where_positive,
)
from railenv.errors import EquationError, ParameterError, UnknownNameError

STEP = 1e-30  # of the complex-step derivative, whose only error is rounding


def complex_step(model, x, u, speed, curvature, cant):
    """Derivatives of the plain equations, columns ordered as states, inputs, running conditions."""
    point = [*x, *u, speed, curvature, cant]
    n = model.n_states
    columns = []
    for j in range(len(point)):
        z = [complex(value, STEP * (i == j)) for i, value in enumerate(point)]
        f = model.plain_rhs(z[:n], z[n:-3], *z[-3:])
        columns.append([complex(value).imag / STEP for value in f])
    return np.array(columns).T


def full_jacobian(model, o):
    return np.hstack(
        [*model.jacobian(o.x, o.u, **o.conditions), model.condition_jacobian(o.x, o.u, **o.conditions)]
    )


# ------------------------------------------------- models of one's own, used throughout


def pendulum(x, u, speed, curvature, cant, p):
    angle, rate = x
    return [rate, -p.stiffness * sin(angle) + (speed - p.balance) * rate + u[0] - p.balance * cant]


def everything(x, u, speed, curvature, cant, p):
    """Use every function and operator that equations may be written with."""
    a, b, c = x
    return [
        sin(a) * cos(b) - tan(c / 2.0) / (1.0 + a * a) + p.k * u[0],
        sqrt(1.0 + b**2) * tanh(c) + exp(-a) * log(2.0 + b) - atan(u[1] * c) ** 3 + speed**-2,
        where_positive(a - b, a**2.5, -b / (c * c + 1.0))
        + positive_part(c) * curvature
        - 0.25 * cant**4,
    ]


PENDULUM = railenv.Model(
    "pendulum", ["angle", "rate"], ["M"], pendulum, {"stiffness": 4.0, "balance": 10.0}
)
EVERYTHING = railenv.Model("everything", ["a", "b", "c"], ["v", "q"], everything, {"k": 1.5})
EVERYTHING_POINTS = [([0.7, 0.3, -0.4], [0.2, -1.1]), ([0.2, 1.3, 0.6], [-0.5, 0.4])]


def model_of(equations, states=("x",), inputs=(), parameters=None, **options):
    return railenv.Model("own", states, inputs, equations, parameters or {}, **options)


# ----------------------------------------------------------- right-hand side and Jacobian


def test_operating_points_reach_every_contact_regime(bogie, operations):
    # the sample on which the comparisons below rest
    clearance = bogie.vehicle.flange_clearance
    seen = {"flange": 0, "one wheel lifted": 0, "wheelset lifted": 0, "sliding": 0, "tread": 0}
    for o in operations(bogie, 40, seed=1):
        for w, (left, right) in zip(("w1", "w2"), bogie.wheels(o.x, o.u, **o.conditions), strict=True):
            y = o.x[bogie.state_names.index(f"y_{w}")] - o.u[bogie.input_names.index(f"align_{w}")]
            demand = sum(np.hypot(c.creep_x, c.creep_y) for c in (left, right))
            lifted = (left.normal_z == 0.0) + (right.normal_z == 0.0)
            sliding = demand > 3.0 * bogie.vehicle.friction * (left.normal + right.normal)
            seen["flange"] += abs(y) > clearance
            seen["one wheel lifted"] += lifted == 1
            seen["wheelset lifted"] += lifted == 2
            seen["sliding"] += sliding and lifted < 2
            seen["tread"] += abs(y) < clearance and lifted == 0 and not sliding
    assert min(seen.values()) >= 5, seen


def test_compiled_right_hand_side_equals_the_equations(any_model, operations):
    for o in operations(any_model, 60, seed=2):
        plain = np.array(any_model.plain_rhs(*o.arguments))
        compiled = any_model.rhs(o.x, o.u, **o.conditions)
        # where large forces cancel, their rounding is left, not the result's
        assert_allclose(compiled, plain, rtol=1e-12, atol=1e-13 * np.abs(plain).max())


def test_analytic_jacobian_equals_complex_step_of_the_equations(any_model, operations):
    for o in operations(any_model, 40, seed=3):
        expected = complex_step(any_model, *o.arguments)
        found = full_jacobian(any_model, o)
        # entries of a row have common terms that cancel in the small ones
        noise = 1e-12 * np.abs(expected).max(axis=1, keepdims=True)
        assert np.isfinite(found).all()
        assert (np.abs(found - expected) <= 1e-9 * np.abs(expected) + noise).all()


def test_jacobian_is_that_of_small_differences_too(bogie, operations):
    # the complex step runs through the same equations; differences of the kernel know none of them
    o = operations(bogie, 1, seed=4)[0]
    A, _ = bogie.jacobian(o.x, o.u, **o.conditions)
    h = 1e-7
    for j in range(bogie.n_states):
        shift = h * np.eye(bogie.n_states)[j]
        difference = bogie.rhs(o.x + shift, o.u, **o.conditions) - bogie.rhs(
            o.x - shift, o.u, **o.conditions
        )
        assert_allclose(difference / (2.0 * h), A[:, j], rtol=1e-5, atol=1e-5 * np.abs(A[:, j]).max())


def test_inputs_left_out_are_zero(bogie, operations):
    o = operations(bogie, 1, seed=5)[0]
    zero = np.zeros(bogie.n_inputs)
    assert_array_equal(bogie.rhs(o.x, speed=40.0), bogie.rhs(o.x, zero, speed=40.0))
    for left_out, given in zip(
        bogie.jacobian(o.x, speed=40.0), bogie.jacobian(o.x, zero, speed=40.0), strict=True
    ):
        assert_array_equal(left_out, given)


def test_jacobians_belong_to_the_caller(bogie):
    x = np.full(24, -1e-4)
    first = [*bogie.jacobian(x, speed=40.0), bogie.condition_jacobian(x, speed=40.0)]
    kept = [matrix.copy() for matrix in first]
    for matrix in first:
        matrix[:] = np.nan
    again = [*bogie.jacobian(x, speed=40.0), bogie.condition_jacobian(x, speed=40.0)]
    for a, b in zip(again, kept, strict=True):
        assert_array_equal(a, b)


def test_evaluator_follows_each_new_operating_point(coach, operations):
    evaluator = coach.evaluator()
    for o in operations(coach, 10, seed=6):
        evaluator.set(o.x, o.speed, o.curvature, o.cant, o.u)
        assert_array_equal(evaluator.rhs(), coach.rhs(o.x, o.u, **o.conditions))
        assert_array_equal(evaluator.jacobian(), full_jacobian(coach, o))
        assert_array_equal(evaluator.rhs(), coach.rhs(o.x, o.u, **o.conditions))


def test_irregularity_reaches_the_wheels_that_the_model_reports(bogie):
    x = np.zeros(24)
    x[[1, 5]] = -1e-3
    u = np.zeros(bogie.n_inputs)
    u[bogie.input_names.index("vert_w2")] = -1e-3
    (leading, trailing), names = bogie.wheels(x, u, speed=30.0), bogie.state_names
    assert all(c.normal_z == pytest.approx(62e3) for c in leading)
    assert all(c.normal_z == 0.0 for c in trailing)
    # w1 is the leading one in the state as well: unloaded rails let it fall
    f = bogie.rhs(x, u, speed=30.0)
    assert f[names.index("dz_w2")] < f[names.index("dz_w1")]


# ---------------------------------------------------------------------------- arguments


@pytest.mark.parametrize(
    ("conditions", "message"),
    [
        ({"speed": 0.0}, r"speed is 0 m/s; it must be finite and greater than 0"),
        ({"speed": -3.0}, r"speed is -3 m/s"),
        ({"speed": np.nan}, r"speed is nan"),
        ({"speed": "fast"}, r"speed is 'fast', which is not a number"),
        ({"speed": 30.0, "curvature": np.inf}, r"curvature is inf"),
        ({"speed": 30.0, "cant": 0.6}, r"cant is 0.6 rad; it must be .* at most 0.5"),
    ],
)
@pytest.mark.parametrize("method", ["rhs", "jacobian", "condition_jacobian", "wheels"])
def test_conditions_that_no_model_runs_at_are_refused(bogie, method, conditions, message):
    with pytest.raises(ParameterError, match=message):
        getattr(bogie, method)(np.zeros(24), **conditions)


@pytest.mark.parametrize(
    ("x", "u", "message"),
    [
        (np.zeros(23), None, r"x has shape \(23,\); it must be \(24,\)"),
        (np.zeros((24, 1)), None, r"x has shape \(24, 1\)"),
        (np.zeros(24), np.zeros(8), r"u has shape \(8,\); it must be \(9,\): M_w1, M_w2, M_b"),
        ([*[0.0] * 5, np.nan, *[0.0] * 18], None, r"x entry z_w2 is nan"),
        (np.zeros(24), [0.0, np.inf, *[0.0] * 7], r"u entry M_w2 is inf"),
        ("state", None, r"x is 'state'"),
    ],
)
def test_states_and_inputs_of_the_wrong_kind_are_refused_by_name(bogie, x, u, message):
    with pytest.raises(ParameterError, match=message):
        bogie.rhs(x, u, speed=30.0)


@pytest.mark.parametrize("where", [{"curvature": 1e-3}, {"cant": 0.05}])
def test_cooperrider_bogie_runs_on_tangent_track_only(cooperrider, where):
    with pytest.raises(ParameterError, match="tangent track only"):
        cooperrider.rhs(np.zeros(14), speed=60.0, **where)


def test_models_refuse_records_that_are_not_theirs():
    with pytest.raises(ParameterError, match=r"must be a railenv\.Vehicle"):
        railenv.Bogie(railenv.COOPERRIDER)
    with pytest.raises(ParameterError, match="must be CooperriderParameters"):
        railenv.CooperriderBogie(railenv.TABLE_1)


def test_replace_makes_another_model_and_leaves_the_first_alone(coach):
    x = np.full(24, -1e-3)
    before = coach.rhs(x, speed=50.0)
    other = coach.replace(conicity=0.3)
    assert other.vehicle.conicity == 0.3
    assert not np.array_equal(other.rhs(x, speed=50.0), before)
    assert_array_equal(coach.rhs(x, speed=50.0), before)
    assert_array_equal(railenv.Bogie(other.vehicle).rhs(x, speed=50.0), other.rhs(x, speed=50.0))


def test_replace_with_an_unknown_name_is_refused(any_model):
    with pytest.raises(UnknownNameError, match="'conicty'"):
        any_model.replace(conicty=0.1)
    with pytest.raises(UnknownNameError, match=r"unknown parameter: 'length'.*allowed are stiffness"):
        PENDULUM.replace(length=1.0)


# ---------------------------------------------------------------- models of one's own


def test_own_model_gives_its_right_hand_side():
    f = PENDULUM.rhs([0.3, -0.2], [0.5], speed=8.0, cant=0.01)
    assert_allclose(f, [-0.2, -4.0 * np.sin(0.3) + 2.0 * 0.2 + 0.5 - 0.1], rtol=1e-15)


@pytest.mark.parametrize(("x", "u"), EVERYTHING_POINTS)
def test_own_model_may_use_every_function_and_operator(x, u):
    conditions = {"speed": 1.7, "curvature": 0.02, "cant": 0.3}
    plain = EVERYTHING.plain_rhs(x, u, 1.7, 0.02, 0.3)
    assert_allclose(EVERYTHING.rhs(x, u, **conditions), plain, rtol=1e-14)
    expected = complex_step(EVERYTHING, x, u, 1.7, 0.02, 0.3)
    A, B = EVERYTHING.jacobian(x, u, **conditions)
    assert_allclose(np.hstack([A, B]), expected[:, :-3], rtol=1e-9, atol=1e-14)
    assert_allclose(EVERYTHING.condition_jacobian(x, u, **conditions), expected[:, -3:], rtol=1e-9)
    assert A.shape == (3, 3)
    assert B.shape == (3, 2)


def test_own_model_simulates_and_finds_its_equilibrium():
    # below the balance speed damped: linear in this range, and known in closed form
    equilibrium = railenv.find_equilibrium(PENDULUM, speed=9.0, inputs=[0.4])
    assert equilibrium["angle"] == pytest.approx(np.arcsin(0.1), rel=1e-12)
    response = railenv.simulate(PENDULUM, speed=9.0, perturbation={"angle": 1e-4}, duration=2.0)
    damped = np.sqrt(4.0 - 0.25)
    t = response.time
    expected = 1e-4 * np.exp(-0.5 * t) * (np.cos(damped * t) + 0.5 / damped * np.sin(damped * t))
    assert_allclose(response.outputs[0], expected, atol=1e-9)


def test_own_model_without_inputs_or_parameters_works():
    model = model_of(lambda x, u, speed, curvature, cant, p: [-2.0 * x[0]])
    assert_array_equal(model.rhs([3.0], speed=1.0), [-6.0])
    A, B = model.jacobian([3.0], speed=1.0)
    assert_array_equal(A, [[-2.0]])
    assert B.shape == (1, 0)


def test_replaced_parameters_of_an_own_model_take_effect():
    stiff = PENDULUM.replace(stiffness=9.0)
    assert stiff.rhs([0.1, 0.0], speed=10.0)[1] == pytest.approx(-9.0 * np.sin(0.1), rel=1e-15)
    assert PENDULUM.parameters["stiffness"] == 4.0
    assert stiff.parameters == {"stiffness": 9.0, "balance": 10.0}


@pytest.mark.parametrize("name", ["bogie", "dual", "cooperrider", "own"])
def test_pickled_model_is_the_same_model(name, request):
    model = PENDULUM if name == "own" else request.getfixturevalue(name)
    copy = pickle.loads(pickle.dumps(model))
    x = np.linspace(-1e-3, -2e-3, model.n_states)  # wheels on the rails
    assert_array_equal(copy.rhs(x, speed=20.0), model.rhs(x, speed=20.0))
    assert_array_equal(copy.jacobian(x, speed=20.0)[0], model.jacobian(x, speed=20.0)[0])
    assert type(copy) is type(model)
    assert copy.parameters == model.parameters
    assert copy.equations is model.equations  # so that a Batch takes both
    assert copy.plain_rhs(x.tolist(), [0.0] * model.n_inputs, 20.0)[0] == x[model.n_states // 2]


# ----------------------------------------------------- what models of one's own cannot be


def linear(x, u, speed, curvature, cant, p):
    return [-x[0]]


@pytest.mark.parametrize("count", [0, 2])
def test_equations_must_return_one_derivative_per_state(count):
    with pytest.raises(ParameterError, match=rf"return {count} derivatives for 1 states"):
        model_of(lambda x, u, speed, curvature, cant, p: [x[0]] * count)


@pytest.mark.parametrize(
    "name",
    [
        *("", "1st", "two words", "a-b", "lambda", "_hidden"),
        *("w", "L", "lane", "real", "math", "rhs", "jacobian"),  # the kernels' own
        *("speed", "curvature", "cant"),
    ],
)
@pytest.mark.parametrize("place", ["states", "inputs", "parameters"])
def test_unusable_and_reserved_names_are_refused(place, name):
    names = {"states": ["x"], "inputs": ["v"], "parameters": {"k": 1.0}}
    names[place] = {name: 1.0} if place == "parameters" else [name]
    with pytest.raises(ParameterError, match=r"cannot name a state, input or parameter"):
        model_of(linear, **names)


@pytest.mark.parametrize(
    "names",
    [
        {"states": ["x", "x"]},
        {"states": ["x"], "inputs": ["x"]},
        {"states": ["x"], "parameters": {"x": 1.0}},
        {"states": ["q"], "inputs": ["x"], "parameters": {"x": 1.0}},
    ],
)
def test_duplicate_names_are_refused(names):
    with pytest.raises(ParameterError, match=r"x stands more than once"):
        model_of(linear, **names)


def test_model_without_states_is_refused():
    with pytest.raises(ParameterError, match="at least one state"):
        model_of(linear, states=[])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, "3", None, True, [1.0], 1j])
def test_parameters_that_are_not_finite_numbers_are_refused(value):
    with pytest.raises(ParameterError, match=r"^k is "):
        model_of(linear, parameters={"k": value})
    with pytest.raises(ParameterError, match=r"^stiffness is "):
        PENDULUM.replace(stiffness=value)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"scale": 0.0}, "scale is 0.0; it must be greater than 0"),
        ({"scale": [1.0, 2.0]}, r"scale has shape \(2,\)"),
        ({"guess": [np.nan]}, "guess entry x is nan"),
    ],
)
def test_scale_and_guess_are_checked(option, message):
    with pytest.raises(ParameterError, match=message):
        model_of(linear, **option)


@pytest.mark.parametrize("function", [sympy.erfcinv, sympy.zeta, sympy.asin, sympy.sign, sympy.floor])
def test_functions_that_cannot_be_compiled_are_named(function):
    with pytest.raises(
        EquationError, match=rf"derivative of x contains {function.__name__}\("
    ) as raised:
        model_of(lambda x, u, speed, curvature, cant, p: [function(x[0])])
    assert "railenv.equations.functions" in str(raised.value)


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda x, v, p: x % 2.0, r"contains Mod\("),
        (lambda x, v, p: (x - v) // 2, r"contains floor\("),
        (lambda x, v, p: sympy.Max(x, v), r"contains Max\("),
        (lambda x, v, p: sympy.Piecewise((x, x > 0), (v, True)), r"contains Piecewise\("),
        (lambda x, v, p: x**v, r"contains x\*\*speed, whose exponent varies"),
        (lambda x, v, p: x * math.nan, "contains nan"),
        (lambda x, v, p: x / 0, "contains zoo"),
        (lambda x, v, p: x * 2**2**2**2**2, "contains a number with too many digits"),
        (lambda x, v, p: 1j * x, "contains I"),
        (lambda x, v, p: x * sympy.Symbol("other"), "contains other"),
        (lambda x, v, p: None, "is None; it must be a number or an expression"),
        (lambda x, v, p: "x", "is 'x'; it must be a number or an expression"),
        (lambda x, v, p: x > 0, "is x > 0; it must be a number or an expression"),
    ],
)
def test_what_no_kernel_can_compute_is_named(write, message):
    with pytest.raises(EquationError, match=f"the derivative of x {message}"):
        model_of(lambda x, u, speed, curvature, cant, p: [write(x[0], speed, p)])


def test_a_parameter_that_there_is_not_is_named():
    with pytest.raises(UnknownNameError, match=r"parameter in the equations: 'K'; allowed are k"):
        model_of(lambda x, u, speed, curvature, cant, p: [p.K * x[0]], parameters={"k": 1.0})


def test_absolute_values_and_pi_are_compiled():
    def equations(x, u, speed, curvature, cant, p):
        return [abs(2.0 * (x[0] - speed)) ** 1.5 + sympy.pi * abs(abs(x[0]) - 3.0)]

    model = model_of(equations)
    for x in (-1.0, 2.0, 5.0):
        distance, outer = 2.0 * (x - 4.0), abs(x) - 3.0
        value = abs(distance) ** 1.5 + math.pi * abs(outer)
        slope = 3.0 * math.sqrt(abs(distance)) * np.sign(distance) + math.pi * np.sign(outer * x)
        assert model.rhs([x], speed=4.0)[0] == pytest.approx(value, rel=1e-14)
        assert model.jacobian([x], speed=4.0)[0][0, 0] == pytest.approx(slope, rel=1e-14)


def test_a_branch_on_a_state_is_refused():
    # Python would take one branch for good; where_positive compiles both
    with pytest.raises(EquationError, match="where_positive instead of `if`"):
        model_of(lambda x, u, speed, curvature, cant, p: [x[0] if x[0] > 0.0 else -x[0]])


def test_functions_refuse_what_they_cannot_handle():
    for f in (sqrt, sin, cos, tan, atan, tanh, exp, log):
        with pytest.raises(TypeError, match="floats, complex numbers or SymPy expressions"):
            f("1.0")


# ------------------------------------------------------------------------ python-control


def test_control_system_has_the_models_dynamics_and_names(any_model, operations):
    tangent_only = any_model.name == "cooperrider"
    radius, cant = (np.inf, 0.0) if tangent_only else (-1200.0, -0.08)
    system = any_model.to_nlsys(speed=40.0, radius=radius, cant=cant)
    assert isinstance(system, control.NonlinearIOSystem)
    assert tuple(system.state_labels) == any_model.state_names
    assert tuple(system.output_labels) == any_model.state_names
    assert tuple(system.input_labels) == any_model.input_names
    for o in operations(any_model, 8, seed=7):
        expected = any_model.rhs(o.x, o.u, speed=40.0, curvature=1.0 / radius, cant=cant)
        assert_array_equal(system.dynamics(0.0, o.x, o.u), expected)
        assert_array_equal(system.output(0.0, o.x, o.u), o.x)


def test_control_simulates_what_the_package_simulates(cooperrider):
    start = np.zeros(14)
    start[:4] = 1e-3, 0.0, -5e-4, 1e-4
    times = np.linspace(0.0, 0.3, 61)
    system = cooperrider.to_nlsys(speed=60.0)
    inputs = np.vstack([np.full_like(times, 500.0), np.zeros((2, len(times)))])
    theirs = control.input_output_response(
        system, times, inputs, start, solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-12}
    )
    ours = railenv.simulate(
        cooperrider,
        speed=60.0,
        initial_state=start,
        inputs={"M_w1": 500.0},
        duration=0.3,
        step=1e-4,
    )
    assert_allclose(ours.time, times, atol=1e-12)
    scale = np.abs(theirs.states).max(axis=1, keepdims=True)
    assert (np.abs(ours.states - theirs.states) <= 1e-6 * scale).all()


def test_control_linearises_to_the_analytic_jacobian(coach):
    x = railenv.find_equilibrium(coach, speed=80.0).state
    linear_system = coach.to_nlsys(speed=80.0).linearize(x, np.zeros(coach.n_inputs), eps=1e-8)
    A, B = coach.jacobian(x, speed=80.0)
    for numerical, exact in ((linear_system.A, A), (linear_system.B, B)):
        # one-sided differences, of columns of very different sizes
        assert (np.abs(numerical - exact) <= 1e-4 * np.abs(exact).max(axis=0)).all()


def test_control_system_survives_pickling(coach, operations):
    system = coach.to_nlsys(speed=130.0, radius=3000.0, cant=0.05)
    (o,) = operations(coach, 1, seed=3)
    expected = system.dynamics(0.0, o.x, o.u)  # once called, it holds what cannot be pickled
    for other in (pickle.loads(pickle.dumps(system)), copy.deepcopy(system)):
        assert other.state_labels == system.state_labels
        assert_array_equal(other.dynamics(0.0, o.x, o.u), expected)


def test_control_system_called_by_several_threads_gives_what_one_gives(coach, operations):
    system = coach.to_nlsys(speed=130.0)
    points = operations(coach, 20, seed=4)
    expected = [system.dynamics(0.0, o.x, o.u) for o in points]
    switching = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as executor:
            wrong = sum(executor.map(lambda _: _differing(system, points, expected), range(4)))
    finally:
        sys.setswitchinterval(switching)
    assert wrong == 0


def _differing(system, points, expected, rounds=150):
    wrong = 0
    for _ in range(rounds):
        for o, value in zip(points, expected, strict=True):
            wrong += not np.array_equal(system.dynamics(0.0, o.x, o.u), value)
    return wrong


def test_control_system_of_an_own_model():
    system = PENDULUM.to_nlsys(speed=9.0)
    assert system.name == "pendulum"
    assert_allclose(system.dynamics(0.0, [0.1, 0.2], [0.3]), PENDULUM.rhs([0.1, 0.2], [0.3], speed=9.0))


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ({"speed": 0.0}, "speed is 0 m/s"),
        ({"speed": 30.0, "radius": 0.0}, "radius is 0 m; its magnitude must be at least 1 m"),
        ({"speed": 30.0, "radius": np.nan}, "radius is nan"),
        ({"speed": 30.0, "cant": 2.0}, "cant is 2 rad"),
    ],
)
def test_control_system_refuses_impossible_conditions(bogie, where, message):
    with pytest.raises(ParameterError, match=message):
        bogie.to_nlsys(**where)


def _odd_functions_of_sums(x, u, speed, curvature, cant, p):
    from railenv.equations.functions import atan, cos, sin, tanh

    a, b = x
    return [sin(-a - b) + cos(-a - 0.5), tanh(-2.0 * a - b) + atan(-a - b)]


def test_odd_and_even_functions_of_negated_sums_can_be_compiled():
    model = railenv.Model("odd", ["a", "b"], [], _odd_functions_of_sums, {})
    x = [0.3, 0.4]
    np.testing.assert_allclose(model.rhs(x, speed=1.0), model.plain_rhs(x, [], 1.0), rtol=1e-14)


def test_constant_derivatives_have_a_zero_row_in_the_jacobian():
    model = railenv.Model("drift", ["x", "v"], [], lambda x, u, s, k, c, p: [x[1], 0.0], {})
    A, B = model.jacobian([1.0, 2.0], speed=1.0)
    np.testing.assert_array_equal(A, [[0.0, 1.0], [0.0, 0.0]])
    assert B.shape == (2, 0)
    constant = railenv.Model("constant", ["x"], [], lambda x, u, s, k, c, p: [1.0], {})
    assert constant.jacobian([0.0], speed=1.0)[0] == 0.0
