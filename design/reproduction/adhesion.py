"""The speed at which a curve uses up all adhesion."""

from __future__ import annotations

import math
from types import SimpleNamespace

from design.reproduction.cases import Case
from railenv.equations.loads import bogie_frame_load, bogie_wheelset_load, dual_wheelset_load


def adhesion_limit(case: Case, radius: float, cant: float) -> float:
    """Return the speed (m/s) at which the lateral load of a curve equals the friction of all wheels.

    V = sqrt(R (mu N / m + g cant)), with the vertical load N and the mass m that is pushed sideways
    summed over all bodies of the model. Beyond it no creep force holds a wheelset on the tread.
    """
    p = SimpleNamespace(**case.model.parameters)
    if case.kind == "bogie":
        carried = [bogie_wheelset_load(p), bogie_wheelset_load(p), bogie_frame_load(p)]
    else:
        carried = [dual_wheelset_load(p), dual_wheelset_load(p)]
    ratio = sum(c.vertical for c in carried) / sum(c.lateral for c in carried)
    return math.sqrt(radius * p.gravity * (p.friction * ratio + cant))
