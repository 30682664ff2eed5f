"""The explicit equations of the paper (with the corrections), written out body by body.

What the package assembles from elements is held against them
(``tests/railenv/vehicles/test_oracle.py``), on conical wheels.
"""

from __future__ import annotations

from railenv.equations.coordinates import Motion


def bodies(x):
    """Split a state vector (all coordinates, then all rates) into the motions of its bodies."""
    n = len(x) // 2
    return [Motion(*x[i : i + 4], *x[n + i : n + i + 4]) for i in range(0, n, 4)]
