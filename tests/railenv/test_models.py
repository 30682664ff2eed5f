"""Models: compiled right-hand sides and Jacobians against the equations, and their arguments."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import railenv
from railenv.errors import ParameterError, UnknownNameError
from tests.railenv.own_models import PENDULUM, complex_step, full_jacobian

# ----------------------------------------------------------- right-hand side and Jacobian


def test_operating_points_reach_every_contact_regime(bogie, operations):
    # the sample on which the comparisons below rest
    clearance = bogie.vehicle.flange_clearance
    seen = {"flange": 0, "one wheel lifted": 0, "wheelset lifted": 0, "sliding": 0, "tread": 0}
    for o in operations(bogie, 40, seed=1):
        for w, (left, right) in zip(("w1", "w2"), bogie.wheels(o.x, o.u, **o.conditions), strict=True):
            y = o.x[bogie.state_names.index(f"y_{w}")] - o.u[bogie.input_names.index(f"align_{w}")]
            demand = sum(np.hypot(c.creep_x, c.creep_y) for c in (left, right))
            lifted = (left.normal.vertical == 0.0) + (right.normal.vertical == 0.0)
            load = left.normal.magnitude + right.normal.magnitude
            sliding = demand > 3.0 * bogie.vehicle.friction * load
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
    assert all(c.normal.vertical == pytest.approx(62e3) for c in leading)
    assert all(c.normal.vertical == 0.0 for c in trailing)
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
