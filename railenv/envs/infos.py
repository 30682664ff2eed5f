"""The ``info`` of the environments: the same names and types at every reset and step.

All values are single finite NumPy numbers, so that code that stacks, compares, logs or averages infos
can use them directly: terms of the reward, the reason of a derailment, conditions of the episode, and
its metrics, which are 0 until its end. TorchRL reads the dtype of every value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railenv.envs.episodes import Episode, condition_names
from railenv.envs.metrics import METRICS
from railenv.envs.settings import Settings
from railenv.errors import ParameterError

REWARD_TERMS = ("hunting", "excursion", "ride", "effort", "command", "change")
"""Terms of the reward, each between 0 and 1."""

SAFETY = ("cost", "nadal", "unloading", "instability")
"""For learning under constraints: the largest of three shares of limits, and those shares.

Y/Q over 2 m of Nadal's limit (that of the setting ``nadal_limit``); the static load that a wheel has
lost, as a mean over 2 m, of 90 % of it (EN 14067-6); the running rms of an axle's sum of guiding forces
over 100 m of EN 14363's limit of instability. All are the worst of the vehicle, from 0 to 10.
"""

DERAILMENT = 1 + len(REWARD_TERMS)
"""Column of the kernel's terms, after the reward and its terms, that is 1 after a derailment."""

TERM_NAMES = (*REWARD_TERMS, "derailment", *SAFETY)
"""Values that describe a step: terms of the reward, whether it derailed, shares of limits.

They are 0 at a reset.
"""

DERAILED_NAME = "derailed"
"""Number of the reason in :data:`railenv.envs.DERAILED`, 0 for none."""

INFO_NAMES = (*TERM_NAMES, DERAILED_NAME, *METRICS, *condition_names(()))
"""Names in every info, whatever the vehicle."""

Bools = NDArray[np.bool_]


def check_names(settings: Settings) -> None:
    """Raise ParameterError if a varying number would replace another one in the infos."""
    taken = sorted(set(settings.variable) & set(INFO_NAMES))
    if taken:
        raise ParameterError(
            f"randomize has {', '.join(taken)}, which an info has for something else; rename what "
            f"varies ({', '.join(INFO_NAMES)} are taken)"
        )


def of_start(episode: Episode) -> dict[str, Any]:
    """Return the info of a new episode: its drawn conditions; terms and metrics are still 0."""
    none = np.float64(0.0)
    return {
        **dict.fromkeys(TERM_NAMES, none),
        DERAILED_NAME: np.int64(0),
        **_numbers(episode.conditions()),
        **dict.fromkeys(METRICS, none),
    }


def of_end(metrics: Mapping[str, float], reason: float) -> dict[str, Any]:
    """Return the additional values of the last info of an episode."""
    return {DERAILED_NAME: np.int64(reason), **_numbers(metrics)}


def _numbers(values: Mapping[str, float]) -> dict[str, np.float64]:
    return {name: np.float64(value) for name, value in values.items()}


class Columns:
    """Infos of environments side by side, an array for each name.

    Parameters
    ----------
    settings : Settings
    n : int
        Number of environments.
    """

    def __init__(self, settings: Settings, n: int) -> None:
        conditions = condition_names(settings.variable)
        self._names = (*TERM_NAMES, *conditions, *METRICS)
        self._masks = tuple(f"_{name}" for name in (*self._names, DERAILED_NAME))
        ends = np.cumsum([len(TERM_NAMES), len(conditions), len(METRICS)]).tolist()
        self._values = np.zeros((ends[-1], n))
        self._terms, self._conditions, self._metrics, _ = np.split(self._values, ends)
        self._derailed = np.zeros(n, dtype=np.int64)

    def start(self, row: int, episode: Episode) -> None:
        """Put the info of a new episode into a row."""
        self._values[:, row] = 0.0
        self._conditions[:, row] = list(episode.conditions().values())
        self._derailed[row] = 0

    def step(self, terms: NDArray[np.float64], terminated: Bools) -> None:
        """Put the terms of a step into all rows, and the reasons of derailments."""
        self._terms[:] = terms[:, 1 : 1 + len(TERM_NAMES)].T
        if terminated.any():
            self._derailed[terminated] = terms[terminated, -1]

    def end(self, row: int, metrics: dict[str, float]) -> None:
        """Put the metrics of an ended episode into a row."""
        self._metrics[:, row] = list(metrics.values())

    def infos(self, rows: Sequence[int] | NDArray[np.int_] | None = None) -> dict[str, Any]:
        """Return the infos of some rows, or all: for each name an array, and a mask of the rows.

        Entries of other rows are 0, as in Gymnasium.
        """
        values, derailed = self._values.copy(), self._derailed.copy()  # at once: a copy each is slow
        mask = np.ones(len(derailed), dtype=bool)
        if rows is not None:
            mask[:] = False
            mask[rows] = True
            values[:, ~mask], derailed[~mask] = 0.0, 0
        found: dict[str, Any] = dict(zip(self._names, values, strict=True))
        found[DERAILED_NAME] = derailed
        found.update(dict.fromkeys(self._masks, mask))
        return found
