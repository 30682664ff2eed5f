"""Models of one's own that several tests use, and their derivatives by the complex step."""

import numpy as np

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
