"""Stability analysis: critical speeds, and the sweep of them over curve radius of Fig 5."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

import design
import railenv
from benchmarks.table import Row, with_unit
from benchmarks.timing import Action, processor_times

CANT = 0.0873  # rad
RADII = np.geomspace(250.0, 10_000.0, 25)  # m


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    yield from _tangent()
    yield from _sweep()


def _tangent() -> Iterator[Row]:
    models = {
        "bogie, coach": (railenv.Bogie(railenv.HIGH_SPEED_COACH), 0.015),
        "bogie, Table 1": (railenv.Bogie(railenv.TABLE_1), 0.015),
        "dual wheelset, Table 1": (railenv.DualWheelset(railenv.TABLE_1), 0.015),
        "Cooperrider bogie": (railenv.CooperriderBogie(), 0.015),
        "whole coach": (railenv.Coach(railenv.HIGH_SPEED_COACH), 0.1),
        "whole coach, Manchester on profiles": (railenv.Coach(railenv.MANCHESTER_1), 0.1),
    }
    repetitions = 25
    actions: list[Action] = [partial(design.critical_speed, model) for model, _ in models.values()]
    times = processor_times(actions, repetitions)
    limits = [limit for _, limit in models.values()]  # s
    for name, limit, (processor, elapsed) in zip(models, limits, times, strict=True):
        yield Row(
            f"critical speed on tangent track, {name}",
            processor * 1e3,
            "ms",
            f"shortest processor time of {repetitions}",
            f"median elapsed, {with_unit(elapsed, 'ms')}",
            required=f"at most {with_unit(limit, 'ms')}",
            holds=processor <= limit,
        )


def _sweep() -> Iterator[Row]:
    models = [
        kind(vehicle)
        for kind in (railenv.Bogie, railenv.DualWheelset)
        for vehicle in (railenv.TABLE_1, railenv.HIGH_SPEED_COACH)
    ]
    limit, repetitions = 2.0, 7  # s
    actions: list[Action] = [partial(design.curve_sweep, m, RADII, cant=CANT) for m in models]
    times = processor_times(actions, repetitions)
    processor, elapsed = (sum(column) for column in zip(*times, strict=True))
    each = processor / (len(models) * len(RADII))
    yield Row(
        f"sweep of Fig 5: 2 models x 2 vehicles x {len(RADII)} radii",
        processor,
        "s",
        f"shortest processor time of {repetitions}",
        f"median elapsed, {with_unit(elapsed, 's')}; {with_unit(each, 'ms')} a radius",
        required=f"at most {limit:g} s",
        holds=processor <= limit,
    )
