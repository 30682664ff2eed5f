"""Equations of motion: kernels against plain Python, lanes against scalars, Jacobian against rhs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

import railenv
from benchmarks.table import Row, with_unit
from benchmarks.timing import Action, processor_times, shortest
from railenv.batch import Batch
from railenv.threads import usable_threads

Array = NDArray[np.float64]

SPEED, RADIUS, CANT = 60.0, 2000.0, 0.0873  # a curve, so that no state decays to zero
STEP = 2e-4  # s
REPETITIONS = 300
SCALAR_STEPS = 1000  # this and the next: fractions of a millisecond
LANE_CASES = (  # systems, dtype, parallel, steps
    (64, "float64", False, 40),
    (64, "float32", False, 80),
    (1024, "float64", True, 4),
    (1024, "float32", True, 8),
)


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    state = curving_state(model)
    yield from _steps(model, state)
    yield from _jacobian_kernel(model, state)
    yield from _evaluator(model, state)
    yield from _simulation(model)


def curving_state(model: railenv.Model) -> Array:
    """Return a state near the equilibrium on the curve, where everything moves."""
    state = railenv.find_equilibrium(model, speed=SPEED, radius=RADIUS, cant=CANT).state
    return state + np.where(np.arange(model.n_states) < model.n_states // 2, 1e-4, 0.0)


def buffer(model: railenv.Model, state: Array) -> tuple[Array, Array | None]:
    """Return a scalar kernel's buffer of a model in a state, on the curve, and the model's tables."""
    layout = model.kernels().LAYOUT
    w = np.zeros(layout.rows)
    w[: layout.u] = state
    w[layout.c : layout.p] = SPEED, 1.0 / RADIUS, CANT
    w[layout.p : layout.dx], t = model.rows()
    return w, t


def plain_rk4(model: railenv.Model, state: list[float], steps: int) -> list[float]:
    """Integrate a model's equations in plain Python, as the kernel does."""
    inputs = [0.0] * model.n_inputs

    def f(x: list[float]) -> list[float]:
        return model.plain_rhs(x, inputs, SPEED, 1.0 / RADIUS, CANT)

    x, h = state, STEP
    for _ in range(steps):
        k1 = f(x)
        k2 = f([a + 0.5 * h * b for a, b in zip(x, k1, strict=True)])
        k3 = f([a + 0.5 * h * b for a, b in zip(x, k2, strict=True)])
        k4 = f([a + h * b for a, b in zip(x, k3, strict=True)])
        x = [
            a + h / 6.0 * (b + 2.0 * c + 2.0 * d + e)
            for a, b, c, d, e in zip(x, k1, k2, k3, k4, strict=True)
        ]
    return x


def _steps(model: railenv.Model, state: Array) -> Iterator[Row]:
    kernels = model.kernels()
    (w, t), start = buffer(model, state), state.tolist()

    def scalar() -> None:
        w[: len(start)] = start
        kernels.rk4_hold(w, t, STEP, SCALAR_STEPS)

    def plain() -> None:
        plain_rk4(model, start, 1)

    lanes = [_lane_action(model, state, *case) for case in LANE_CASES]
    seconds, python, *in_lanes = shortest([scalar, plain, *lanes], REPETITIONS)
    one = seconds / SCALAR_STEPS
    statistic = f"shortest of {REPETITIONS}"
    yield Row(
        "RK4 step of the bogie, scalar kernel, one thread",
        one * 1e6,
        "µs",
        statistic,
        f"plain Python, {with_unit(python, 'µs')}",
        python / one,
        "at least 40 times faster",
        python / one >= 40.0,
    )
    for (n, dtype, parallel, steps), seconds in zip(LANE_CASES, in_lanes, strict=True):
        each = seconds / (n * steps)
        judged = dtype == "float64" and not parallel
        threads = f"{usable_threads()} threads" if parallel else "one thread"
        yield Row(
            f"RK4 step per system, {dtype} lanes, {n} systems, {threads}",
            each * 1e6,
            "µs",
            statistic,
            f"scalar kernel, {with_unit(one, 'µs')}",
            one / each,
            "at least 2.5 times faster" if judged else "",
            one / each >= 2.5 if judged else None,
        )


def _lane_action(
    model: railenv.Model, state: Array, n: int, dtype: str, parallel: bool, steps: int
) -> Action:
    batch = Batch([model] * n, dtype)
    batch.conditions = [SPEED, 1.0 / RADIUS, CANT]
    batch.states = np.outer(np.linspace(0.99, 1.01, n), state)

    def action() -> None:
        batch.integrate(step=STEP, steps=steps, parallel=parallel)

    return action


def _compiled_loop() -> Callable[[Any, Array, Array | None, int], None]:
    """Return a compiled loop that calls a kernel on several buffers in turn.

    It leaves the cost of calls from Python out; several buffers keep the compiler from moving work
    that would repeat out of the loop.
    """
    import numba

    @numba.njit
    def loop(kernel: Any, buffers: Array, t: Array | None, rounds: int) -> None:
        for _ in range(rounds):
            for i in range(buffers.shape[0]):
                kernel(buffers[i], t)

    return loop


def _jacobian_kernel(model: railenv.Model, state: Array) -> Iterator[Row]:
    kernels, loop, rounds = model.kernels(), _compiled_loop(), 100
    buffers = np.stack([buffer(model, f * state)[0] for f in np.linspace(0.99, 1.01, 8)])
    t = model.rows()[1]
    seconds = shortest(
        [
            lambda: loop(kernels.rhs, buffers, t, rounds),
            lambda: loop(kernels.jacobian, buffers, t, rounds),
        ],
        REPETITIONS,
    )
    rhs, jacobian = (s / (rounds * len(buffers)) for s in seconds)
    yield Row(
        "Jacobian kernel of the bogie, in a compiled loop",
        jacobian * 1e6,
        "µs",
        f"shortest of {REPETITIONS}",
        f"right-hand-side kernel, same loop and buffers, {with_unit(rhs, 'µs')}",
        jacobian / rhs,
        "at most 6 right-hand sides",
        jacobian / rhs <= 6.0,
    )


def _evaluator(model: railenv.Model, state: Array) -> Iterator[Row]:
    evaluator, calls = model.evaluator(), 200
    evaluator.set(state, SPEED, 1.0 / RADIUS, CANT)

    def rhs() -> None:
        for _ in range(calls):
            evaluator.rhs()

    def jacobian() -> None:
        for _ in range(calls):
            evaluator.jacobian()

    short, long = (s / calls for s in shortest([rhs, jacobian], REPETITIONS))
    yield Row(
        "Evaluator.jacobian of the bogie, called from Python",
        long * 1e6,
        "µs",
        f"shortest of {REPETITIONS}",
        f"Evaluator.rhs, {with_unit(short, 'µs')}",
        long / short,
    )


def _simulation(model: railenv.Model) -> Iterator[Row]:
    duration, repetitions = 20.0, 15

    def run() -> None:
        railenv.simulate(model, speed=100.0, perturbation={"y_w1": 0.001}, duration=duration)

    [(processor, elapsed)] = processor_times([run], repetitions)
    yield Row(
        f"railenv.simulate, {duration:g} s of the bogie, RK4",
        processor * 1e3,
        "ms",
        f"shortest processor time of {repetitions}",
        f"simulated time; median elapsed, {with_unit(elapsed, 'ms')}",
        duration / processor,
    )
