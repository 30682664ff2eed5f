"""Creep saturation: which share of Kalker's linear creep force a contact transmits.

Each law is a function of beta, the linear creep force over the adhesion limit mu N. Its value alpha
multiplies all creep forces and moments (eqs 2, 3 and 10 of the paper).
"""

from __future__ import annotations

from math import pi

from railenv.equations.functions import Scalar, atan, where_positive


def heuristic(beta: Scalar) -> Scalar:
    """Return the share by the paper's heuristic law (eq 2), the cubic of Vermeulen and Johnson.

    The cubic meets 1/beta at beta = 3 with a continuous derivative, so no blend is needed there.
    """
    excess = beta - 3.0
    return where_positive(
        excess,
        1.0 / where_positive(excess, beta, 3.0),
        1.0 - beta / 3.0 + beta * beta / 27.0,
    )


def polach(beta: Scalar, k_adhesion: Scalar, k_slip: Scalar) -> Scalar:
    """Return the share by Polach's law (Wear 258 (2005) 992-1000) with constant friction.

    ``k_adhesion`` and ``k_slip`` reduce Kalker's stiffness in the areas of adhesion and slip, for wet
    or dirty rails; with both 1 the slope at zero is Kalker's own. Spin enters through the linear force,
    as in the heuristic law.
    """
    gradient = beta * (pi / 4.0)  # Polach's epsilon
    adhesion, slip = k_adhesion * gradient, k_slip * gradient
    # both shares over beta, finite at beta = 0
    return 0.5 * k_adhesion / (1.0 + adhesion * adhesion) + (2.0 / pi) * atan(slip) / beta
