"""C printed from a graph gives the numbers of the kernel."""

import numpy as np
import pytest

import railenv
from benchmarks import c_build
from railenv.equations import functions

pytestmark = pytest.mark.skipif(not c_build.available(), reason="there is no gcc")


@pytest.mark.parametrize("lanes", [1, 16])
def test_bogie_in_c_is_the_kernel(lanes):
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    text = c_build.c_source(c_build.graph_of(model), model.kernels(lanes).LAYOUT, lanes)
    blocks = c_build.blocks_of(model, lanes, 32)
    fused, same = c_build.compiled(text), c_build.compiled(text, c_build.UNFUSED)
    assert c_build.disagreement(model, fused, lanes, blocks) <= c_build.TOLERANCE
    assert c_build.disagreement(model, same, lanes, blocks) == 0.0


def everything(x, u, speed, curvature, cant, p):
    a, b, c = x
    return [
        functions.sin(a) * functions.cos(3 * b) + functions.tan(c / 2) - abs(a * b),
        functions.sqrt(1 + b**2) + functions.exp(-c) / (2 + a) ** 3 + functions.tanh(u[0]),
        functions.where_positive(a - b, functions.atan(a), (3 + b) ** p.unused**0) + (2 + c) ** 1.5,
    ]


def test_every_function_is_printed():
    model = railenv.Model("everything", ["a", "b", "c"], ["u"], everything, {"unused": 1.0})
    layout = model.kernels(4).LAYOUT
    c = c_build.compiled(c_build.c_source(c_build.graph_of(model), layout, 4))
    values = np.zeros((layout.j, 4))
    values[: layout.dx] = np.random.default_rng(0).uniform(-1.5, 1.5, (layout.dx, 4))
    values[layout.p] = 1.0
    w = values.reshape(1, -1).copy()
    c.rhs_blocks(w)
    for lane, (x, u, conditions) in enumerate(
        zip(values[:3].T, values[3:4].T, values[layout.c : layout.p].T, strict=True)
    ):
        expected = model.plain_rhs(x.tolist(), u.tolist(), *conditions.tolist())
        found = w.reshape(-1, 4)[layout.dx : layout.work, lane]
        np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_wrong_result_is_noticed():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    text = c_build.c_source(c_build.graph_of(model), model.kernels().LAYOUT, 1)
    wrong = c_build.compiled(text.replace("0.5 * h", "0.50001 * h"))
    blocks = c_build.blocks_of(model, 1, 2)
    assert c_build.disagreement(model, wrong, 1, blocks) > c_build.TOLERANCE
