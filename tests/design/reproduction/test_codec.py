"""What is stored comes back equal, and nothing but known classes is made."""

import dataclasses
import json
import math

import numpy as np
import pytest

import design
import railenv
from design.reproduction import codec
from railenv.errors import ParameterError


def stored(value):
    """Return a value after a passage through JSON."""
    tree, arrays = codec.encode(value)
    return codec.decode(json.loads(json.dumps(tree, allow_nan=False)), arrays)


def same(a, b):
    """Compare records, arrays and models by value."""
    if dataclasses.is_dataclass(a):
        return type(a) is type(b) and all(
            same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a)
        )
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=True)
    if isinstance(a, (list, tuple)):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, railenv.Model):
        return type(a) is type(b) and a.vehicle == b.vehicle
    return a == b or str(a) == str(b)  # not a number equals nothing


@pytest.mark.parametrize(
    "value",
    [
        None,
        True,
        3,
        -0.1,
        math.inf,
        -math.inf,
        math.nan,
        1 + 2j,
        complex(math.nan, 0),
        "text",
        (1, [2.0, ()]),
        {"a": {"b": np.arange(6.0).reshape(2, 3)}, "c": np.array([1 + 1j])},
        railenv.HIGH_SPEED_COACH.replace(conicity=0.07),
    ],
    ids=repr,
)
def test_plain_values_come_back_equal(value):
    assert same(stored(value), value)


def test_results_come_back_equal(coach):
    sweep = design.curve_sweep(coach, [1000.0, 6250.0], cant=0.0873)
    assert same(stored(sweep), sweep)


def test_limit_cycles_come_back_as_a_branch_that_can_be_drawn(cooperrider):
    branch = design.cycle_branch(railenv.Bogie(railenv.HIGH_SPEED_COACH), points=4)
    again = stored(branch)
    assert same(again, branch)
    assert again.plot().axes.size == 1
    with pytest.raises(ParameterError, match="cannot be stored"):
        codec.encode(cooperrider)


def test_time_response_keeps_time_outputs_and_labels(coach):
    response = railenv.simulate(coach, speed=100.0, duration=0.1, perturbation={"y_w1": 1e-3})
    again = stored(response)
    assert np.array_equal(again.time, response.time)
    assert np.array_equal(again.outputs, response.outputs)
    assert list(again.output_labels) == list(response.output_labels)


@pytest.mark.parametrize("value", [object(), {1: 2}, {"$record": "x"}, np.array([object()]), {1, 2}])
def test_what_cannot_be_stored_is_refused(value):
    with pytest.raises(ParameterError):
        codec.encode(value)


@pytest.mark.parametrize("tree", [{"$record": "Path", "fields": {}}, {"$model": "Model", "vehicle": 0}])
def test_unknown_classes_are_not_made(tree):
    with pytest.raises(KeyError):
        codec.decode(tree, [])


def test_plain_form_is_strict_json():
    value = {"a": math.nan, "b": np.array([[1.0, math.inf]]), "c": railenv.Bogie(railenv.TABLE_1)}
    assert codec.plain(value) == {
        "a": None,
        "b": [[1.0, None]],
        "c": {"model": "Bogie", "vehicle": "TABLE_1"},
    }
