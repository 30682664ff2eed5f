"""Contact laws: what profiles cost against the paper's cone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

import design
import railenv
from benchmarks.plant import STEP, buffer, curving_state
from benchmarks.table import Row, with_unit
from benchmarks.timing import Action, processor_times, shortest
from railenv.batch import Batch

Array = NDArray[np.float64]

VEHICLES = {
    "S1002 on UIC 60": railenv.HIGH_SPEED_COACH_S1002,
    "hollow tread": railenv.HIGH_SPEED_COACH_HOLLOW,
}
REPETITIONS = 300
SCALAR_STEPS = 1000
LANES = {"float64": 40, "float32": 80}  # steps of 64 systems: fractions of a millisecond
SYSTEMS = 64
MOST = 1.5


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    cone = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    models = {name: railenv.Bogie(vehicle) for name, vehicle in VEHICLES.items()}
    states = {model.vehicle_name: curving_state(model) for model in (cone, *models.values())}
    yield from _compared(
        "RK4 step, scalar kernel",
        SCALAR_STEPS,
        {name: _scalar(m, states[m.vehicle_name]) for name, m in {"cone": cone, **models}.items()},
    )
    for dtype, steps in LANES.items():
        actions = {
            name: _lanes(m, states[m.vehicle_name], dtype, steps)
            for name, m in {"cone": cone, **models}.items()
        }
        yield from _compared(f"RK4 step per system, {dtype} lanes", SYSTEMS * steps, actions)
    yield from _analysis(models["S1002 on UIC 60"])


def _compared(what: str, times: int, actions: dict[str, Action]) -> Iterator[Row]:
    cone, *others = (each / times for each in shortest(list(actions.values()), REPETITIONS))
    for name, each in zip(list(actions)[1:], others, strict=True):
        yield Row(
            f"{what}: {name}",
            each * 1e6,
            "µs",
            f"shortest of {REPETITIONS}",
            f"cone, {with_unit(cone, 'µs')}",
            each / cone,
            f"at most {MOST} times the cone's",
            each / cone <= MOST,
        )


def _scalar(model: railenv.Bogie, state: Array) -> Action:
    kernels, (w, t), start = model.kernels(), buffer(model, state), state.tolist()

    def action() -> None:
        w[: len(start)] = start
        kernels.rk4_hold(w, t, STEP, SCALAR_STEPS)

    return action


def _lanes(model: railenv.Bogie, state: Array, dtype: str, steps: int) -> Action:
    batch = Batch([model] * SYSTEMS, dtype)
    batch.conditions = [60.0, 1.0 / 2000.0, 0.0873]
    batch.states = np.outer(np.linspace(0.99, 1.01, SYSTEMS), state)

    def action() -> None:
        batch.integrate(step=STEP, steps=steps, parallel=False)

    return action


def _analysis(model: railenv.Bogie) -> Iterator[Row]:
    def pair() -> None:
        railenv.ProfilePair().table("profiles")

    def critical() -> None:
        design.critical_speed(model)

    times = processor_times([pair, critical], 15)
    bounds = (
        ("a pair of profiles, from points to tables", 300.0),
        ("critical speed on profiles", 15.0),
    )
    for (what, most), (processor, elapsed) in zip(bounds, times, strict=True):
        yield Row(
            what,
            processor * 1e3,
            "ms",
            f"shortest processor time of 15; elapsed {with_unit(elapsed, 'ms')}",
            required=f"at most {most:g} ms",
            holds=processor * 1e3 <= most,
        )
