"""Variations of wheels and rails in service, for which controllers are tuned and compared."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from railenv import Model

CONICITY = (0.05, 0.4)
"""Conicity from new wheels to worn ones; on the hollow tread of the default vehicle the contact angle
changes with it."""

CREEP_FACTOR = (0.6, 1.4)
"""Factor on the creep coefficients of Table 1, which are 0.7 of Kalker's for the coach's wheels: from
wet or dirty rails to clean and dry ones."""

WEAR = (0.0, 1.0)
"""Wear from the new pair of a family of profiles to the worn one."""


CONICITIES = (0.05, 0.1, 0.2, 0.3, 0.4)
WEARS = (0.0, 0.25, 0.5, 0.75, 1.0)
CREEP_FACTORS = (0.6, 1.0, 1.4)
"""Creep factors of the vehicles for which controllers are tuned."""


def vehicles_of_service(
    model: Model,
    conicities: Sequence[float] = CONICITIES,
    creep_factors: Sequence[float] = CREEP_FACTORS,
    wears: Sequence[float] = WEARS,
) -> tuple[Mapping[str, float], ...]:
    """Return every conicity (or wear) with every creep factor, as changes of a model that has them."""
    ranges = {"conicity": conicities, "wear": wears, "creep_factor": creep_factors}
    given = {name: values for name, values in ranges.items() if name in model.variable_names}
    return tuple(dict(zip(given, one, strict=True)) for one in itertools.product(*given.values()))


def varied(model: Model, ranges: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Return the ranges of those quantities that a model has."""
    return {name: ends for name, ends in ranges.items() if name in model.variable_names}


def ranges_of_service(model: Model) -> dict[str, tuple[float, float]]:
    """Return the ranges of conicity, wear and creep coefficients, if a model has them."""
    return varied(model, {"conicity": CONICITY, "wear": WEAR, "creep_factor": CREEP_FACTOR})
