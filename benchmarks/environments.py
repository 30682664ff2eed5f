"""Environments: steps, resets, frames and memory, beside Gymnasium's CartPole through the same APIs.

Actions are zero and speeds lie below the critical speed of tangent track, so that derailments do not
dominate; on tight curves some episodes hunt nevertheless.
"""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from benchmarks.table import Row, number, with_unit
from benchmarks.threads import threads as on_threads
from benchmarks.timing import Action, processor_times, shortest
from railenv.batch import Batch
from railenv.threads import usable_threads

_ROOT = Path(__file__).resolve().parent.parent

SPEEDS = {  # m/s
    "railenv/Bogie-v1": (60.0, 100.0),
    "railenv/DualWheelset-v1": (20.0, 30.0),
    "railenv/Coach-v1": (60.0, 90.0),
}
CARTPOLE = "CartPole-v1"
ENDLESS = 1e6  # s
LARGEST_STEPS = {"railenv/Coach-v1": 45e-6}  # s
LARGEST_STEP = 20e-6  # s, of the others
STEP_CALLS = 20  # with the next, less than a millisecond
STEP_REPETITIONS = 500
ENVIRONMENTS, SYNCHRONOUS = 1024, 16
VECTOR_REPETITIONS = 300
SMALLEST_SHARE = 0.6  # of the bare kernel's rate
SMALLEST_GAIN = 8.0  # over SyncVectorEnv
RESETS, RESET_REPETITIONS = 20, 15
FRAME_REPETITIONS = 40
CHART_STEPS = 900  # of 5 ms, that the strip chart of 4 s is full
SMALLEST_FRAME_RATE = 250.0  # steps with a frame of each, a second
MEMORY_STEPS, MEMORY_DURATION = 1000, 2.0  # steps of all environments; s, so that episodes end twice
LARGEST_GROWTH = 4.0  # MiB
EQUIPPED: dict[str, Any] = {"observation": "sensors", "history": 3, "track": "curve"}
CONTACTS = {  # vehicles that differ in the contact only
    "a cone": "HIGH_SPEED_COACH",
    "a hollow tread": "HIGH_SPEED_COACH_HOLLOW",
    "profiles": "HIGH_SPEED_COACH_S1002",
}
CONTACT_SPEEDS = (60.0, 80.0)  # m/s; the coach on profiles hunts from 85 m/s
LARGEST_RATIO = 1.2  # of a step on profiles to one on cones
RANDOM = {"conicity": (0.05, 0.1), "friction": (0.2, 0.4), "body_mass": (30e3, 38e3)}


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    yield from _steps()
    yield from _vectors()
    yield from _contacts()
    yield from _resets()
    yield from _frames()
    yield from _memory()


def _single(name: str, **keywords: Any) -> gymnasium.Env[Any, Any]:
    if name in SPEEDS:
        keywords = {"duration": ENDLESS, "speed_range": SPEEDS[name], **keywords}
    return gymnasium.make(name, **keywords)


def _vector(name: str, n: int, mode: str = "vector_entry_point", **keywords: Any) -> Any:
    if name in SPEEDS:
        keywords = {"duration": ENDLESS, "speed_range": SPEEDS[name], **keywords}
    return gymnasium.make_vec(name, n, vectorization_mode=mode, **keywords)


def _zeros(env: Any) -> Any:
    return np.zeros(env.action_space.shape, env.action_space.dtype)


# ------------------------------------------------------------------------------ one environment


def _steps() -> Iterator[Row]:
    cases = [_single_case(name) for name in SPEEDS]
    actions = [action for case in cases for action in case]
    *times, cartpole = shortest([*actions, _cartpole_steps()], STEP_REPETITIONS)
    cartpole /= STEP_CALLS
    for name, step, bare in zip(SPEEDS, times[::2], times[1::2], strict=True):
        each = step / STEP_CALLS
        largest = LARGEST_STEPS.get(name, LARGEST_STEP)
        yield Row(
            f"env.step of {name}, 5 ms",
            each * 1e6,
            "µs",
            f"shortest of {STEP_REPETITIONS}",
            f"{CARTPOLE}, {with_unit(cartpole, 'µs')}; its 5 steps of RK4 alone, "
            f"{with_unit(bare / STEP_CALLS, 'µs')}",
            each / cartpole,
            f"at most {with_unit(largest, 'µs')}",
            each <= largest,
        )


def _single_case(name: str, **keywords: Any) -> list[Action]:
    """Return the steps of an environment, and the integration that they contain."""
    env = _single(name, tangent_share=0.0, **keywords)  # on a curve no state decays to zero
    env.reset(seed=0)
    action = _zeros(env)
    fleet = env.unwrapped.fleet  # type: ignore[attr-defined]
    kernels = fleet.model.kernels()
    layout = kernels.LAYOUT
    w = np.zeros(layout.rows)
    w[: layout.u] = start = fleet.state(0)
    w[layout.c : layout.p] = fleet.conditions(0)
    w[layout.p : layout.dx], t = fleet.model.rows()

    def steps() -> None:
        for _ in range(STEP_CALLS):
            env.step(action)

    def bare() -> None:
        w[: layout.u] = start
        kernels.rk4_hold(w, t, 1e-3, 5 * STEP_CALLS)

    return [steps, bare]


def _cartpole_steps() -> Action:
    env = _single(CARTPOLE)
    env.reset(seed=0)
    cart = env.unwrapped

    def steps() -> None:
        cart.state = np.zeros(4)  # type: ignore[attr-defined] # pushed to and fro, it does not fall
        for k in range(STEP_CALLS):
            env.step(k % 2)

    return steps


# ------------------------------------------------------------------------------ many environments


def _vectors() -> Iterator[Row]:
    actions: list[Action] = []
    for name in SPEEDS:
        env, sync = _vector(name, ENVIRONMENTS), _vector(name, SYNCHRONOUS, "sync")
        env.reset(seed=0)
        sync.reset(seed=0)
        step, bare = partial(env.step, _zeros(env)), _bare_lanes(env)
        actions += [step, bare, _on_one_thread(step), _on_one_thread(bare)]
        actions.append(partial(sync.step, _zeros(sync)))
    cartpoles = _vector(CARTPOLE, ENVIRONMENTS)
    cartpoles.reset(seed=0)
    equipped = _vector("railenv/Bogie-v1", ENVIRONMENTS, **EQUIPPED)
    equipped.reset(seed=0)
    actions += [partial(equipped.step, _zeros(equipped)), _to_and_fro(cartpoles)]
    *times, with_sensors, cartpole = shortest(actions, VECTOR_REPETITIONS)
    for i, name in enumerate(SPEEDS):
        yield from _vector_rows(name, times[5 * i : 5 * i + 5], cartpole)
    rate, plain = _million(with_sensors), _million(times[0])
    yield Row(
        "vector environment of railenv/Bogie-v1, sensors, history of 3, track that changes",
        rate,
        "million steps/s",
        f"shortest of {VECTOR_REPETITIONS}",
        f"without these, {number(plain)}",
        rate / plain,
    )


def _vector_rows(name: str, times: list[float], cartpole: float) -> Iterator[Row]:
    step, bare, step_1, bare_1, sync = times
    unit, statistic = "million steps/s", f"shortest of {VECTOR_REPETITIONS}"
    what = f"vector environment of {name}, {ENVIRONMENTS} environments"
    threads = f"{usable_threads()} threads"
    for where, rate, alone in (
        (threads, _million(step), _million(bare)),
        ("one thread", _million(step_1), _million(bare_1)),
    ):
        yield Row(
            f"{what}, {where}",
            rate,
            unit,
            statistic,
            f"its 5 steps of RK4 in lanes alone, {number(alone)}",
            rate / alone,
            f"at least {SMALLEST_SHARE:.0%}",
            rate / alone >= SMALLEST_SHARE,
        )
    rate, synchronous = _million(step), _million(sync, SYNCHRONOUS)
    yield Row(
        f"{what}, {threads}",
        rate,
        unit,
        statistic,
        f"SyncVectorEnv of {SYNCHRONOUS}, {number(synchronous)}",
        rate / synchronous,
        f"at least {SMALLEST_GAIN:g} times",
        rate / synchronous >= SMALLEST_GAIN,
    )
    yield Row(
        f"{what}, {threads}",
        rate,
        unit,
        statistic,
        f"CartPoleVectorEnv of {ENVIRONMENTS}, {number(_million(cartpole))}",
        rate / _million(cartpole),
    )


def _contacts() -> Iterator[Row]:
    """Steps on each kind of contact beside those on cones, measured in turn."""
    name = "railenv/Bogie-v1"
    of_contact = [{"vehicle": v, "speed_range": CONTACT_SPEEDS} for v in CONTACTS.values()]
    singles = [_single_case(name, **keywords)[0] for keywords in of_contact]
    vectors = []
    for keywords in of_contact:
        env = _vector(name, ENVIRONMENTS, **keywords)
        env.reset(seed=0)
        vectors.append(partial(env.step, _zeros(env)))
    single = shortest(singles, STEP_REPETITIONS)
    vector = shortest(vectors, VECTOR_REPETITIONS)
    for kind, alone, many in zip(CONTACTS, single, vector, strict=True):
        if kind == "a cone":
            continue
        yield Row(
            f"env.step of {name} on {kind}",
            alone / STEP_CALLS * 1e6,
            "µs",
            f"shortest of {STEP_REPETITIONS}",
            f"on a cone, {with_unit(single[0] / STEP_CALLS, 'µs')}",
            alone / single[0],
            f"at most {LARGEST_RATIO:g}",
            alone <= LARGEST_RATIO * single[0],
        )
        yield Row(
            f"vector environment of {name} on {kind}, {ENVIRONMENTS} environments, "
            f"{usable_threads()} threads",
            _million(many),
            "million steps/s",
            f"shortest of {VECTOR_REPETITIONS}",
            f"on a cone, {number(_million(vector[0]))}; the ratio is that of the times",
            many / vector[0],
        )


def _million(seconds: float, n: int = ENVIRONMENTS) -> float:
    """Return environment steps per second, in millions, of one step of n environments."""
    return 1e-6 * n / seconds


def _on_one_thread(action: Action) -> Action:
    def alone() -> None:
        with on_threads(1):
            action()

    return alone


def _bare_lanes(env: Any) -> Action:
    """Return the integration that a step of a vector environment contains, in the same conditions."""
    fleet, n = env.unwrapped.fleet, env.num_envs
    batch = Batch([fleet.model] * n)
    batch.conditions = np.array([fleet.conditions(i) for i in range(n)])
    batch.states = np.array([fleet.state(i) for i in range(n)])
    return partial(batch.integrate, step=1e-3, steps=5, parallel=True)


def _to_and_fro(env: Any) -> Action:
    pushes = [np.full(env.num_envs, side) for side in (0, 1)]
    calls = 0

    def step() -> None:
        nonlocal calls
        env.step(pushes[calls % 2])
        calls += 1

    return step


# ------------------------------------------------------------------------------ resets and frames


def _resets() -> Iterator[Row]:
    cases: list[tuple[str, dict[str, Any]]] = [(name, {}) for name in SPEEDS]
    cases.append(("railenv/Bogie-v1", {"randomize": RANDOM}))
    actions = [_reset_action(name, keywords) for name, keywords in [*cases, (CARTPOLE, {})]]
    *times, (cartpole, _) = processor_times(actions, RESET_REPETITIONS)
    for (name, keywords), (processor, elapsed) in zip(cases, times, strict=True):
        yield Row(
            f"reset of {name}{', random vehicle' if keywords else ''}, mean of {RESETS}",
            processor / RESETS * 1e3,
            "ms",
            f"shortest processor time of {RESET_REPETITIONS}",
            f"{CARTPOLE}, {with_unit(cartpole / RESETS, 'µs')}; median elapsed, "
            f"{with_unit(elapsed / RESETS, 'ms')}",
            processor / cartpole,
        )


def _reset_action(name: str, keywords: dict[str, Any]) -> Action:
    env = _single(name, **keywords)

    def resets() -> None:
        for seed in range(RESETS):  # always the same episodes
            env.reset(seed=seed)

    return resets


def _frames() -> Iterator[Row]:
    try:
        import pygame  # noqa: F401
    except ImportError:
        yield Row("frame of the renderer", "pygame is not installed", "", "")
        return
    yield from _steps_with_frames()
    names = [*SPEEDS, CARTPOLE]
    times = processor_times([_frame_action(name) for name in names], FRAME_REPETITIONS)
    cartpole = times.pop()[0]
    for name, (processor, elapsed) in zip(SPEEDS, times, strict=True):
        yield Row(
            f"frame of {name}, rgb_array",
            processor * 1e3,
            "ms",
            f"shortest processor time of {FRAME_REPETITIONS}",
            f"{CARTPOLE}, {with_unit(cartpole, 'ms')}; median elapsed, {with_unit(elapsed, 'ms')}",
            processor / cartpole,
        )


def _steps_with_frames() -> Iterator[Row]:
    """Steps with random actions, each with a frame whose strip chart is full."""
    cases = [_framed_step(name) for name in SPEEDS]
    times = processor_times([action for case in cases for action in case], FRAME_REPETITIONS)
    for name, (processor, elapsed), (step, _) in zip(SPEEDS, times[::2], times[1::2], strict=True):
        yield Row(
            f"steps of {name} with a frame of each, rgb_array",
            1.0 / processor,
            "1/s",
            f"shortest processor time of {FRAME_REPETITIONS}",
            f"the step alone, {with_unit(step, 'µs')}; median elapsed, {with_unit(elapsed, 'ms')}",
            processor / step,
            f"at least {SMALLEST_FRAME_RATE:g}",
            processor * SMALLEST_FRAME_RATE <= 1.0,
        )


def _framed_step(name: str) -> list[Action]:
    """Return a step with its frame, and the step alone."""
    env = _single(name, render_mode="rgb_array")
    env.action_space.seed(0)
    env.reset(seed=0)
    actions = itertools.cycle([env.action_space.sample() / 3.0 for _ in range(FRAME_REPETITIONS)])

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(next(actions))
        if terminated or truncated:
            env.reset()

    def step_and_render() -> None:
        step()
        env.render()

    for _ in range(CHART_STEPS):
        step()
    return [step_and_render, step]


def _frame_action(name: str) -> Action:
    env = _single(name, render_mode="rgb_array")
    env.reset(seed=0)
    step: Callable[[], object]
    step = _pushed_cart(env) if name == CARTPOLE else partial(env.step, _zeros(env))

    def frame() -> None:
        step()
        env.render()

    return frame


def _pushed_cart(env: gymnasium.Env[Any, Any]) -> Action:
    def step() -> None:
        env.reset()
        env.step(0)

    return step


# ------------------------------------------------------------------------------ memory


def _memory() -> Iterator[Row]:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.environments"],
        cwd=_ROOT,
        env=dict(os.environ),
        check=True,
        capture_output=True,
        text=True,
    )
    found = json.loads(done.stdout)
    yield Row(
        f"growth of peak memory, {ENVIRONMENTS} of railenv/Bogie-v1, {MEMORY_STEPS} steps each",
        found["growth"],
        "MiB",
        "one run, after as many steps",
        f"peak before, {number(found['before'])} MiB; episodes ended, {found['ended']:.0f}, derailed, "
        f"{found['derailed']:.0f}",
        required=f"at most {LARGEST_GROWTH:g} MiB",
        holds=found["growth"] <= LARGEST_GROWTH,
    )


def _peak() -> float:
    """Largest memory that this process has held, MiB."""
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0 * 1024.0 if sys.platform == "darwin" else 1024.0)


def main() -> None:
    """Run a vector environment for long, twice; print how memory grew in the second run as JSON."""
    env = _vector("railenv/Bogie-v1", ENVIRONMENTS, duration=MEMORY_DURATION)
    env.reset(seed=0)
    actions = _zeros(env)
    found = {"before": 0.0, "growth": 0.0, "ended": 0.0, "derailed": 0.0}
    for warm in (False, True):
        for _ in range(MEMORY_STEPS):
            _, _, terminated, truncated, _ = env.step(actions)
            if warm:
                found["ended"] += float(np.sum(terminated | truncated))
                found["derailed"] += float(np.sum(terminated))
        if not warm:
            found["before"] = _peak()
    found["growth"] = _peak() - found["before"]
    print(json.dumps(found))


if __name__ == "__main__":
    main()
