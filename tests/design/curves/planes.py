"""Systems whose curves of bifurcations have exact answers; one parameter is b = speed - 10."""

import railenv
from railenv.equations.functions import sqrt

ZERO = 10.0


def _ring(x, u, speed, curvature, cant, p):
    """Folds of cycles that meet in a cusp: r' = r (b1 + b2 (r - 1) - (r - 1)^3), with company."""
    a, b, c, d = x
    r = sqrt(a * a + b * b + 1e-12)
    cos, sin = a / r, b / r
    growth = p.b1 + p.b2 * (r - 1.0) - (r - 1.0) ** 3
    own = p.sigma + r - 1.0
    return [
        growth * a - p.omega * b,
        p.omega * a + growth * b,
        own * c - p.nu * d + p.twist * (cos * c + sin * d) - c * c * c,
        p.nu * c + own * d + p.twist * (sin * c - cos * d) - d * d * d,
    ]


RING = railenv.Model(
    "ring",
    ["a", "b", "c", "d"],
    [],
    _ring,
    {"b1": 0.0, "b2": 0.5, "omega": 4.0, "sigma": -3.0, "nu": 1.0, "twist": 0.0},
)


def _two(x, u, speed, curvature, cant, p):
    """Two oscillators that hunt from b = k and b = -2 k on, and a fold of equilibria at m = 0."""
    a, b, c, d, z = x
    first, second = speed - ZERO - p.k + p.on * z, (speed - ZERO) / 2.0 + p.k
    r2 = a * a + b * b + c * c + d * d
    return [
        (first - r2) * a - 2.0 * b,
        2.0 * a + (first - r2) * b,
        (second - r2) * c - 5.0 * d,
        5.0 * c + (second - r2) * d,
        p.m - z * z,
    ]


TWO = railenv.Model(
    "two oscillators", ["a", "b", "c", "d", "z"], [], _two, {"k": -1.0, "m": 1.0, "on": 0.0}, guess=1.0
)


def _takens(x, u, speed, curvature, cant, p):
    """The normal form of Bogdanov and Takens."""
    a, b = x
    return [b, speed - ZERO + p.b2 * a + a * a + a * b]


TAKENS = railenv.Model("takens", ["a", "b"], [], _takens, {"b2": -2.0}, guess=-1.0)


def _cusp(x, u, speed, curvature, cant, p):
    """Two folds of equilibria that meet in a cusp."""
    (a,) = x
    return [speed - ZERO + p.b2 * a - a * a * a]


CUSP = railenv.Model("cusp", ["a"], [], _cusp, {"b2": 1.0}, guess=-1.5)
