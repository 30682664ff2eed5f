"""Times the package that is on the path, at request; started by ``benchmarks.against``.

The same text runs with the package of another commit, so it uses nothing but the public interface and
takes environments by whatever version they are registered under. Each line of the standard input is a
case, and each line of the standard output its seconds, as JSON. A case is prepared, which compiles what
it needs, when it is asked for first.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

from benchmarks.timing import Action, repeated

SPEED, RADIUS, CANT = 60.0, 2000.0, 0.0873  # a curve, so that no state decays to zero
STEP = 2e-4  # s
BELOW_CRITICAL = {"Bogie": (60.0, 100.0), "DualWheelset": (20.0, 30.0)}  # m/s
ENDLESS = 1e6  # s
PLACES = 4
_SPACE, _LEAST_SHIFT = 20_000, 16  # bytes


@dataclass(frozen=True)
class Case:
    """Something to time.

    ``make`` returns the action, which does the thing ``calls`` times. The shortest time of the
    repetitions, and of several turns, counts: elapsed for what takes less than a millisecond, else of
    the processor.

    Loads and stores of vectors that cross cache lines cost a tenth of a kernel's time, so that the
    place where a process happens to get its buffers would decide. What depends on it is made at
    several ``places``, of which the fastest counts.
    """

    make: Callable[[], Action]
    calls: int
    repetitions: int
    clock: Literal["elapsed", "processor"] = "elapsed"
    places: int = 1

    def prepared(self) -> list[Action]:
        """Return actions that have run once, with their data at different places."""
        actions, between = [], []
        for k in range(self.places):
            actions.append(self.make())
            actions[-1]()
            between.append(bytearray(_SPACE + _LEAST_SHIFT * k))  # shifts what comes next
        return actions

    def seconds(self, prepared: list[Action]) -> float:
        """Return the time of one call."""
        times = [repeated(action, self.repetitions // self.places) for action in prepared]
        return min(min(getattr(t, self.clock)) for t in times) / self.calls


def design() -> ModuleType:
    """Return the package ``design``, wherever it is."""
    import importlib

    try:
        return importlib.import_module("railenv.design")
    except ModuleNotFoundError:
        return importlib.import_module("design")


def _model() -> Any:
    import railenv

    return railenv.Bogie(railenv.HIGH_SPEED_COACH)


def _state() -> Any:
    import railenv

    return railenv.find_equilibrium(_model(), speed=SPEED, radius=RADIUS, cant=CANT).state + 1e-5


# ------------------------------------------------------------------------------ equations


def _scalar(steps: int) -> Action:
    import numpy as np

    model, start = _model(), _state()
    kernels = model.kernels()
    layout = kernels.LAYOUT
    w = np.zeros(layout.rows)
    w[layout.c : layout.p] = SPEED, 1.0 / RADIUS, CANT
    numbers = list(model.parameters.values())
    w[layout.p : layout.p + len(numbers)] = numbers  # what follows, if anything, is 0

    # kernels of commits without tables do not take them
    tables = (model.rows()[1],) if hasattr(model, "rows") else ()

    def run() -> None:
        w[: layout.u] = start
        kernels.rk4_hold(w, *tables, STEP, steps)

    return run


def _lanes(dtype: str, systems: int, steps: int) -> Action:
    import numpy as np

    from railenv.batch import Batch

    batch = Batch([_model()] * systems, dtype)
    batch.conditions = [SPEED, 1.0 / RADIUS, CANT]
    batch.states = np.outer(np.linspace(0.99, 1.01, systems), _state())
    return partial(batch.integrate, step=STEP, steps=steps, parallel=False)


def _evaluator(method: str, calls: int) -> Action:
    evaluator = _model().evaluator()
    evaluator.set(_state(), SPEED, 1.0 / RADIUS, CANT)
    evaluate = getattr(evaluator, method)

    def run() -> None:
        for _ in range(calls):
            evaluate()

    return run


def _simulation() -> Action:
    import railenv

    return partial(railenv.simulate, _model(), speed=100.0, perturbation={"y_w1": 0.001}, duration=20.0)


# ------------------------------------------------------------------------------ analysis


def _critical_speed() -> Action:
    return partial(design().critical_speed, _model())


def _cycles() -> Action:
    return partial(design().cycle_branch, _model(), parameter_range=(30.0, 120.0), points=8)


# ------------------------------------------------------------------------------ environments


def _registered(name: str) -> str:
    """Return the newest version of an environment."""
    import gymnasium

    import railenv  # noqa: F401 (registers)

    found = [s for s in gymnasium.registry.values() if s.namespace == "railenv" and s.name == name]
    return max(found, key=lambda s: s.version or 0).id


def _made(make: Callable[..., Any], name: str, **settings: Any) -> Any:
    return make(_registered(name), duration=ENDLESS, speed_range=BELOW_CRITICAL[name], **settings)


def _step(name: str, wrapped: bool, calls: int) -> Action:
    import gymnasium
    import numpy as np

    env = _made(gymnasium.make, name, tangent_share=0.0)
    env.reset(seed=0)
    if not wrapped:
        env = env.unwrapped
    action = np.zeros(env.action_space.shape, env.action_space.dtype)

    def run() -> None:
        for _ in range(calls):
            env.step(action)

    return run


def _vector(name: str, environments: int) -> Action:
    import gymnasium
    import numpy as np

    make = partial(gymnasium.make_vec, num_envs=environments, vectorization_mode="vector_entry_point")
    env = _made(make, name)
    env.reset(seed=0)
    return partial(env.step, np.zeros(env.action_space.shape, env.action_space.dtype))


# ------------------------------------------------------------------------------ all of them


def _steps_of(name: str) -> dict[str, Case]:
    return {
        f"env.step of {name}, unwrapped": Case(lambda: _step(name, False, 20), 20, 24, places=PLACES),
        f"env.step of {name}, as made": Case(lambda: _step(name, True, 20), 20, 24, places=PLACES),
    }


def _lane_case(dtype: str, systems: int, steps: int) -> Case:
    return Case(partial(_lanes, dtype, systems, steps), systems * steps, 24, places=PLACES)


CASES = {
    "RK4 step, scalar": Case(partial(_scalar, 1000), 1000, 24, places=PLACES),
    "RK4 step per system, float64 lanes": _lane_case("float64", 64, 40),
    "RK4 step per system, float32 lanes": _lane_case("float32", 64, 80),
    "Evaluator.rhs": Case(partial(_evaluator, "rhs", 200), 200, 24, places=PLACES),
    "Evaluator.jacobian": Case(partial(_evaluator, "jacobian", 200), 200, 24, places=PLACES),
    "railenv.simulate, 20 s": Case(_simulation, 1, 2, "processor"),
    "critical speed": Case(_critical_speed, 1, 4, "processor"),
    "branch of limit cycles, 8 points": Case(_cycles, 1, 1, "processor"),
    **_steps_of("Bogie"),
    **_steps_of("DualWheelset"),
}
VECTOR_CASES = {
    f"vector environment, {n} of Bogie": Case(
        partial(_vector, "Bogie", n), n, repetitions, places=PLACES
    )
    for n, repetitions in ((256, 48), (1024, 20))
}
"""Timed with the package's own choice of threads, and with one."""


def main() -> None:
    """Answer requests until there are no more."""
    answers, sys.stdout = sys.stdout, sys.stderr  # what the package prints is no answer
    import railenv

    def answer(content: object) -> None:
        print(json.dumps(content), file=answers, flush=True)

    answer(str(Path(railenv.__file__).parent.parent))
    cases = CASES | VECTOR_CASES
    prepared: dict[str, list[Action]] = {}
    for line in sys.stdin:
        name = json.loads(line)
        case = cases[name]
        try:
            if name not in prepared:
                prepared[name] = case.prepared()
            seconds = case.seconds(prepared[name])
        except Exception as error:  # the other commit may lack it; the comparison goes on
            answer(f"{type(error).__name__}: {error}")
        else:
            answer(seconds)


if __name__ == "__main__":
    main()
