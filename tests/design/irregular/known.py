"""Systems whose irregular motion is known."""

import railenv
from railenv.equations.functions import where_positive


def _lorenz(x, u, speed, curvature, cant, p):
    a, b, c = x
    return [p.sigma * (b - a), a * (p.rho - c) - b, a * b - p.beta * c]


def _rossler(x, u, speed, curvature, cant, p):
    a, b, c = x
    return [-b - c, a + p.a * b, p.b + c * (a - p.c)]


def _linear(x, u, speed, curvature, cant, p):
    a, b, c = x
    return [p.slow * a - p.omega * b, p.omega * a + p.slow * b, p.fast * c]


def _relay(x, u, speed, curvature, cant, p):
    """Drive an oscillator by a force that jumps with the sign of its velocity."""
    a, b = x
    return [b, -a - 2.0 * p.damping * b + where_positive(b, p.force, -p.force)]


LORENZ = railenv.Model(
    "Lorenz", ["x", "y", "z"], [], _lorenz, {"sigma": 10.0, "rho": 28.0, "beta": 8.0 / 3.0}
)
ROSSLER = railenv.Model("Rossler", ["x", "y", "z"], [], _rossler, {"a": 0.2, "b": 0.2, "c": 5.7})
LINEAR = railenv.Model(
    "linear", ["a", "b", "c"], [], _linear, {"slow": -0.3, "omega": 2.0, "fast": -1.1}
)
RELAY = railenv.Model("relay", ["a", "b"], [], _relay, {"damping": 0.05, "force": 1.0})

LORENZ_START = {"x": 1.0, "y": 1.0, "z": 20.0}
ROSSLER_START = {"x": 1.0, "y": 1.0}
