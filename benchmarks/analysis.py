"""Stability analysis: critical speeds, and the sweep of them over curve radius of Fig 5."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

import railenv
from benchmarks.table import Row, with_unit
from benchmarks.timing import Action, medians
from design.critical_speed import critical_speed

CANT = 0.0873  # rad
RADII = tuple(float(radius) for radius in np.geomspace(250.0, 10_000.0, 25))  # m


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    yield from _tangent()
    yield from _sweep()


def sweep(model: railenv.Model) -> None:
    """Find the critical speeds of one model over all radii."""
    for radius in RADII:
        critical_speed(model, radius=radius, cant=CANT)


def _tangent() -> Iterator[Row]:
    models = {
        "bogie, coach": railenv.Bogie(railenv.HIGH_SPEED_COACH),
        "bogie, Table 1": railenv.Bogie(railenv.TABLE_1),
        "dual wheelset, Table 1": railenv.DualWheelset(railenv.TABLE_1),
        "Cooperrider bogie": railenv.CooperriderBogie(),
    }
    limit, repetitions = 0.015, 25  # s
    actions: list[Action] = [partial(critical_speed, model) for model in models.values()]
    for name, (processor, elapsed) in zip(models, medians(actions, repetitions), strict=True):
        yield Row(
            f"critical speed on tangent track, {name}",
            processor * 1e3,
            "ms",
            f"median of {repetitions}, processor time",
            f"{with_unit(elapsed, 'ms')} elapsed",
            required=f"at most {with_unit(limit, 'ms')}",
            holds=processor <= limit,
        )


def _sweep() -> Iterator[Row]:
    models = [
        kind(vehicle)
        for kind in (railenv.Bogie, railenv.DualWheelset)
        for vehicle in (railenv.TABLE_1, railenv.HIGH_SPEED_COACH)
    ]
    limit, repetitions = 2.0, 5  # s
    times = medians([partial(sweep, model) for model in models], repetitions)
    processor, elapsed = (sum(column) for column in zip(*times, strict=True))
    each = processor / (len(models) * len(RADII))
    yield Row(
        f"sweep of Fig 5: 2 models x 2 vehicles x {len(RADII)} radii",
        processor,
        "s",
        f"sum of medians of {repetitions}, processor time",
        f"{with_unit(elapsed, 's')} elapsed; {with_unit(each, 'ms')} a point",
        required=f"at most {limit:g} s",
        holds=processor <= limit,
    )
