"""The content of a stability map's cells, and its dependencies."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import railenv
from design.cycles.places import Place
from design.loop.dynamics import dynamics
from design.loop.feedback import ScaledFeedback, age_of, as_feedback
from design.stability.critical_speed import critical_speed
from design.studies.store import Record
from railenv import checks
from railenv.equilibrium import Point, follow_speeds
from railenv.equipment import Equipped
from railenv.errors import EquilibriumError
from railenv.models import Model
from railenv.threads import one_blas_thread

Quantity = Literal["critical_speed", "damping", "growth"]
Cell = tuple[float, ...]
"""A value of each varied parameter, in their order."""

_PROBES = 6  # signals at which the settings of a study sample a controller
_DIGITS = 9  # of its answers; further ones depend on the machine
_COMMAND = 1e3  # N m, size of past commands in probes


@dataclass(frozen=True)
class CellFunction:
    """The function of the study behind a stability map, which computes batches of cells.

    Attributes
    ----------
    place : Place
        Model, radius (m) and cant (rad), unless they are varied.
    names : tuple of str
        Names of the entries of a cell.
    quantity : {"critical_speed", "damping", "growth"}
    speed : float or None
        Speed, m/s, if it is neither varied nor searched.
    speed_range : (float, float)
        Range of the search for critical speeds, m/s.
    controller : array_like, control.StateSpace or Feedback, optional
    period : float, optional
        s.
    longest_step : float, optional
        Longest step between sampled speeds, as in :func:`design.critical_speed`.
    """

    place: Place
    names: tuple[str, ...]
    quantity: Quantity
    speed: float | None
    speed_range: tuple[float, float]
    controller: Any | None
    period: float | None
    longest_step: float | None = None

    def __call__(self, cells: Sequence[Cell]) -> list[Record]:
        """Return the records of some cells."""
        if self.quantity == "critical_speed":
            return [self._critical(cell) for cell in cells]
        with one_blas_thread():
            return self._dampings(cells)

    def place_of(self, cell: Cell) -> Place:
        """Return model and curve of a cell."""
        values = dict(zip(self.names, cell, strict=True))
        own = {n: v for n, v in values.items() if n not in self._of_loop}
        return self.place.replace(**own)

    @property
    def _of_loop(self) -> tuple[str, ...]:
        return ("speed",) if self.controller is None else ("speed", "gain")

    def _loop(self, cell: Cell, model: Model) -> tuple[Any, float | None]:
        """Return controller and period of a cell."""
        if self.controller is None or "gain" not in self.names:
            return self.controller, self.period
        feedback = as_feedback(self.controller, model, self.period)
        return ScaledFeedback(feedback, cell[self.names.index("gain")]), None

    def _critical(self, cell: Cell) -> Record:
        place = self.place_of(cell)
        controller, period = self._loop(cell, place.model)
        try:
            found = critical_speed(
                place.model,
                radius=place.radius,
                cant=place.cant,
                speed_range=self.speed_range,
                controller=controller,
                period=period,
                longest_step=self.longest_step,
            )
        except (EquilibriumError, np.linalg.LinAlgError) as error:
            return {"loss": "", "critical_speed": None, "frequency": None, "note": _reason(error)}
        return {
            "loss": found.loss,
            "critical_speed": found.speed,
            "frequency": found.frequency,
            "note": "",
        }

    def _dampings(self, cells: Sequence[Cell]) -> list[Record]:
        """Return records of cells, following the equilibrium once for all speeds of a vehicle."""
        records: list[Record | None] = [None] * len(cells)
        kept = [k for k, name in enumerate(self.names) if name not in self._of_loop]

        def key(i: int) -> tuple[float, ...]:
            return tuple(cells[i][k] for k in kept)

        for _, group in groupby(
            sorted(range(len(cells)), key=lambda i: (key(i), self._speed(cells[i]))), key
        ):
            members = list(group)
            place = self.place_of(cells[members[0]])
            speeds = sorted({self._speed(cells[i]) for i in members})
            points = dict(zip(speeds, _points(place, speeds), strict=True))
            for i in members:
                records[i] = self._spectrum(cells[i], place, points[self._speed(cells[i])])
        return [record for record in records if record is not None]

    def _speed(self, cell: Cell) -> float:
        if "speed" in self.names:
            return cell[self.names.index("speed")]
        assert self.speed is not None
        return self.speed

    def _spectrum(self, cell: Cell, place: Place, point: Point | str) -> Record:
        """Return growth rate, damping ratio and frequency of the mode for the quantity."""
        nothing = {"damping": None, "growth": None, "frequency": None}
        if isinstance(point, str):
            return {**nothing, "note": point}
        conditions = (self._speed(cell), checks.curvature(place.radius), place.cant)
        try:
            judged_by = dynamics(place.model, *self._loop(cell, place.model))
            values = judged_by.eigenvalues(point, conditions)
        except (EquilibriumError, np.linalg.LinAlgError) as error:
            return {**nothing, "note": _reason(error)}
        magnitude = np.abs(values)
        ratio = -values.real / np.where(magnitude > 0.0, magnitude, 1.0)
        k = int(np.argmin(ratio) if self.quantity == "damping" else np.argmax(values.real))
        return {
            "damping": float(ratio[k]),
            "growth": float(values.real[k]),
            "frequency": float(abs(values.imag[k])) / (2.0 * math.pi),
            "note": "",
        }

    def settings(self, axes: dict[str, NDArray[np.float64]]) -> dict[str, Any]:
        """Return everything on which the cells of a map depend, as plain data."""
        feedback = (
            None
            if self.controller is None
            else as_feedback(self.controller, self.place.model, self.period)
        )
        return {
            "railenv": railenv.__version__,
            "quantity": self.quantity,
            "order": list(axes),
            "axes": {name: values.tolist() for name, values in axes.items()},
            "radius": self.place.radius,
            "cant": self.place.cant,
            "speed": self.speed,
            "speed_range": list(self.speed_range),
            "longest_step": self.longest_step,
            "model": model_settings(self.place.model),
            "controller": None if feedback is None else _probed(feedback, self.place.model),
        }


def _points(place: Place, speeds: Sequence[float]) -> Iterator[Point | str]:
    """Yield the equilibrium at increasing speeds, or the reason why it has ended."""
    following = follow_speeds(place.model, speeds, radius=place.radius, cant=place.cant)
    reason: str | None = None
    for _ in speeds:
        try:
            yield reason if reason is not None else next(following)
        except EquilibriumError as error:
            reason = _reason(error)
            yield reason


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__


def model_settings(model: Model) -> dict[str, Any]:
    """Return everything that defines a model, as plain data."""
    settings: dict[str, Any] = {
        "name": model.name,
        "states": list(model.state_names),
        "inputs": list(model.input_names),
        "equations": model.equations_hash,
        "parameters": dict(model.parameters),
        "scale": model.scale.tolist(),
        "guess": model.guess.tolist(),
    }
    if isinstance(model, Equipped):
        settings["actuators"] = {g: dataclasses.asdict(a) for g, a in model.groups.items()}
        settings["sensors"] = dataclasses.asdict(model.sensors)
    return settings


def _probed(feedback: Any, model: Model) -> dict[str, Any]:
    """Describe a controller by its signals, its period and a hash of its answers to some signals.

    A controller's behaviour identifies it better than its code: the same function may be defined anew
    by every run of a script.
    """
    generator = np.random.default_rng(0)
    conditions = {"speed": 60.0, "curvature": 1e-3, "cant": 0.05, "cant_deficiency": 0.05}
    scale = model.parameters | dict(zip(model.state_names, model.scale.tolist(), strict=True))
    scale |= conditions
    sizes = np.array([_COMMAND if age_of(n) else scale[n] for n in feedback.input_labels])
    answers: list[Any] = []
    for _ in range(_PROBES):
        draw = np.array(
            [
                generator.uniform(0.3, 1.5) if name == "speed" else generator.uniform(-1.0, 1.0)
                for name in feedback.input_labels
            ]
        )
        signals = sizes * draw
        linear = feedback.linearize(signals)
        parts = (feedback.steady(signals), linear.A, linear.B, linear.C, linear.D)
        answers.append([[f"{v + 0.0:.{_DIGITS}g}" for v in np.ravel(part)] for part in parts])
    return {
        "signals": list(feedback.input_labels),
        "commands": list(feedback.output_labels),
        "period": feedback.period,
        "behaviour": hashlib.sha256(json.dumps(answers).encode()).hexdigest()[:16],
    }
