"""Models of one's own: what they can be, and what they cannot."""

import math
import pickle

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
    sin,
    sqrt,
    tan,
    tanh,
)
from railenv.errors import EquationError, ParameterError, UnknownNameError
from tests.railenv.own_models import EVERYTHING, EVERYTHING_POINTS, PENDULUM, complex_step, model_of


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
    assert copy.structure == model.structure  # so that a Batch takes both
    assert copy.plain_rhs(x.tolist(), [0.0] * model.n_inputs, 20.0)[0] == x[model.n_states // 2]


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
