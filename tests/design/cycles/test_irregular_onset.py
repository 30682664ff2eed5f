"""Irregular motion is followed down to where it dies out: the onset of hunting that it can make."""

import math

import numpy as np
import pytest

import design
import railenv
from railenv.equations.functions import sqrt


def _lorenz(x, u, speed, curvature, cant, p):
    """Lorenz's equations about one of their two steady states, with rho as the speed."""
    c = sqrt(p.beta * (speed - 1.0))
    X, Y, Z = x[0] + c, x[1] + c, x[2] + speed - 1.0
    return [p.sigma * (Y - X), X * (speed - Z) - Y, X * Y - p.beta * Z]


@pytest.fixture(scope="module")
def diagram():
    model = railenv.Model(
        "Lorenz about its steady state",
        ["x", "y", "z"],
        [],
        _lorenz,
        {"sigma": 10.0, "beta": 8.0 / 3.0},
    )
    return design.bifurcation_diagram(
        model, speed_range=(15.0, 30.0), speeds=np.array([26.0, 28.0]), depth=0
    )


def test_the_hopf_point_is_where_lorenz_says(diagram):
    """rho = sigma (sigma + beta + 3) / (sigma - beta - 1), and its cycles are unstable."""
    rho = 10.0 * (10.0 + 8.0 / 3.0 + 3.0) / (10.0 - 8.0 / 3.0 - 1.0)
    assert diagram.hopf[0].speed == pytest.approx(rho, rel=1e-6)
    assert not any(cycle.stable for branch in diagram.branches for cycle in branch.cycles)


def test_the_attractor_is_followed_to_where_it_ends(diagram):
    """It lives from 24.06 on beside the stable steady state, and its remains for long below."""
    assert diagram.onset.rests_on == "simulation"
    assert 22.0 < diagram.nonlinear_critical_speed < 24.3
    assert diagram.nonlinear_critical_speed == min(s.speed for s in diagram.irregular)
    assert math.isfinite(diagram.onset.value)
