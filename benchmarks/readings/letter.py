"""The print to the letter: how soon its motion leaves the track."""

from __future__ import annotations

import numpy as np

from benchmarks.readings.axes import AXES, Reading, model_of
from benchmarks.readings.judged import DURATION
from design.reproduction import paper
from railenv.batch import Batch

STEP = 2.5e-4
"""s; fine, since what is looked at grows without bound."""

_STRIDE = 40  # steps from one look to the next
_GONE = 10.0  # flange clearances

AS_PRINTED = {
    "loads": 2,
    "lever": 1,
    "wheelset lever": 1,
    "height": 1,
    "leading damper": 1,
    "psi_wb": 0,
    "damper sign": 1,
    "damper reaction": 1,
    "creepage": 1,
    "pitch inertia": 0,
    "cant": 0,
    "contact": 1,
}
"""The option of every axis that is the print's own; psi_wb, which it does not define, is psi_b."""


def to_the_letter() -> Reading:
    """Return the reading that corrects nothing."""
    return Reading(tuple(AS_PRINTED[axis.name] for axis in AXES))


def leaves_after() -> dict[str, float | None]:
    """Return after what time (s) the bogie's wheelset is ten clearances off, from zero, by speed."""
    model = model_of(to_the_letter(), "bogie")
    found: dict[str, float | None] = {}
    for speed in (paper.BOGIE.hunting / 3.6, paper.BOGIE.hunting):
        batch = Batch([model])
        batch.conditions = [speed, 1.0 / paper.RADIUS, paper.CANT]
        found[f"{speed:.1f} m/s"] = None
        for look in range(1, round(DURATION / STEP / _STRIDE) + 1):
            batch.integrate(step=STEP, steps=_STRIDE)
            y = float(batch.states[0, 0])
            if not np.isfinite(y) or abs(y) > _GONE * model.parameters["flange_clearance"]:
                found[f"{speed:.1f} m/s"] = round(look * _STRIDE * STEP, 2)
                break
    return found
