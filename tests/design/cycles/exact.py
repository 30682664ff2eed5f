"""Systems whose limit cycles have exact answers; the parameter is mu = speed - 10."""

import railenv
from railenv.equations.functions import sqrt

MU = 10.0
TERMS = ("1", "x", "y", "mx", "my", "xx", "xy", "yy", "xxx", "xxy", "xyy", "yyy")


def _planar(state, u, speed, curvature, cant, p):
    """Write a general cubic system, and the fifth-order normal form of a Hopf point."""
    x, y = state
    mu, r2 = speed - MU, x * x + y * y
    radial = p.l1 * r2 + p.l2 * r2 * r2
    values = (
        1.0,
        x,
        y,
        mu * x,
        mu * y,
        x * x,
        x * y,
        y * y,
        x * x * x,
        x * x * y,
        x * y * y,
        y * y * y,
    )
    dx, dy = radial * x - p.twist * r2 * y, radial * y + p.twist * r2 * x
    for term, value in zip(TERMS, values, strict=True):
        dx = dx + getattr(p, f"f_{term}") * value
        dy = dy + getattr(p, f"g_{term}") * value
    return [dx, dy]


_ZERO = {f"{side}_{term}": 0.0 for side in "fg" for term in TERMS} | dict.fromkeys(
    ("l1", "l2", "twist"), 0.0
)
_PLANAR = railenv.Model("planar", ["x", "y"], [], _planar, _ZERO)


def planar(**coefficients):
    return _PLANAR.replace(**coefficients)


def hopf_normal_form(omega=2.0, **coefficients):
    """r' = r (mu + l1 r^2 + l2 r^4), theta' = omega + twist r^2."""
    return planar(f_mx=1.0, g_my=1.0, f_y=-omega, g_x=omega, **coefficients)


def _company(x, u, speed, curvature, cant, p):
    """Add two coordinates to an oscillator, whose Floquet multipliers are known."""
    a, b, c, d = x
    mu, r2 = speed - MU, a * a + b * b
    size = sqrt(r2 + 1e-12)
    cos, sin = a / size, b / size
    sigma = p.sigma + p.slope * mu
    return [
        mu * a - p.omega * b - a * r2,
        p.omega * a + mu * b - b * r2,
        sigma * c - p.nu * d + p.twist * (cos * c + sin * d) - p.cube * c * c * c,
        p.nu * c + (sigma - p.extra) * d + p.twist * (sin * c - cos * d) - p.cube * d * d * d,
    ]


_COMPANY = railenv.Model(
    "oscillator with company",
    ["a", "b", "c", "d"],
    [],
    _company,
    {"omega": 3.0, "sigma": -1.0, "slope": 1.0, "nu": 0.0, "twist": 0.0, "extra": 0.0, "cube": 1.0},
)


def company(**parameters):
    return _COMPANY.replace(**parameters)
