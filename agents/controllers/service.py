"""What varies of wheels and rails in service: what controllers are tuned for and compared over."""

from __future__ import annotations

from railenv import Model

CONICITY = (0.05, 0.4)
"""From new wheels to worn ones, over which the hollow tread of the default vehicle takes its contact
angle along."""

CREEP_FACTOR = (0.6, 1.4)
"""On the creep coefficients of Table 1, which are 0.7 of Kalker's for the coach's wheels: from wet or
dirty rails to clean and dry ones."""

WEAR = (0.0, 1.0)
"""From the new pair of a family of profiles to the worn one."""


def varied(model: Model, ranges: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Return those ranges whose quantities a model has."""
    return {name: ends for name, ends in ranges.items() if name in model.variable_names}
