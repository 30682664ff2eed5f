"""Classical controllers with the best return in a task, each kind searched on the same episodes.

What is found is judged on other episodes. A controller designed for one vehicle is designed for the
task's own, whatever the episodes draw; those that know all are designed anew for each episode.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import cma
import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import agents
from agents.controllers.controller import Controller, sensed_bodies
from agents.controllers.output_feedback import Filters, terms_of
from agents.evaluation.informed import InformedLQR
from agents.evaluation.returns import Returns, episode_returns
from design.linear.regulator import Disturbances, Weights
from railenv import Equipped
from railenv.threads import one_blas_thread

Array = NDArray[np.float64]

TRAINING, TEST = 10_000, 0
"""Seeds of the first training and the first test episode."""

TRAINING_EPISODES, TEST_EPISODES = 32, 64
GENERATIONS, CANDIDATES = 10, 8
"""Of the search for output feedback."""

_GAINS = np.geomspace(1e3, 3e6, 15)  # N m s/rad
_REFINED = 6
_DISPLACEMENTS, _YAWS, _MOMENTS = (9e-3, 2e-3), (2e-3, 0.5e-3), (1.0, 4.0)
_ALIGNMENTS = (1e-4, 1e-3)
_ACCELERATION = 1e3  # N m per m/s^2, to which a step of the search corresponds
_YAW_RATE = 0.3  # of the best constant gain


@dataclass(frozen=True)
class Best:
    """The best of a kind.

    Attributes
    ----------
    returns : Returns
        In the test episodes.
    told : str
        Its numbers.
    tried : int
        Number of designs.
    """

    returns: Returns
    told: str
    tried: int


def vehicle_of(env_id: str) -> Equipped:
    """Return the vehicle of a task, with its equipment."""
    env = gym.make(env_id, disable_env_checker=True)
    model: Equipped = env.unwrapped.settings.equipped  # type: ignore[attr-defined]
    return model


def speeds_of(env_id: str, count: int) -> list[float]:
    """Return speeds (m/s) over the range of a task."""
    env = gym.make(env_id, disable_env_checker=True)
    low, high = env.unwrapped.settings.speed_range  # type: ignore[attr-defined]
    return np.linspace(low, high, count).tolist()


def trained(env_id: str, controller: Controller | None) -> float:
    """Return the mean return in the training episodes."""
    return episode_returns(env_id, controller, episodes=TRAINING_EPISODES, seed=TRAINING).mean


def tested(env_id: str, controller: Controller | None) -> Returns:
    """Return the returns in the test episodes."""
    return episode_returns(env_id, controller, episodes=TEST_EPISODES, seed=TEST)


def constant_gain(env_id: str) -> tuple[Best, float]:
    """Search the gain of yaw-rate feedback; return it, too (N m s/rad)."""
    model = vehicle_of(env_id)

    def earned(gain: float) -> float:
        return trained(env_id, agents.YawRateFeedback.design(model, gain=gain))

    scores = {float(gain): earned(float(gain)) for gain in _GAINS}
    best = max(scores, key=lambda gain: scores[gain])
    for gain in best * np.geomspace(0.7, 1.5, _REFINED):
        scores[float(gain)] = earned(float(gain))
    best = max(scores, key=lambda gain: scores[gain])
    found = tested(env_id, agents.YawRateFeedback.design(model, gain=best))
    return Best(found, f"{best / 1e3:.0f} kN m s/rad", len(scores)), best


def lqg(env_id: str) -> Best:
    """Search weights and disturbances of an LQG that is scheduled over the speeds."""
    model, speeds = vehicle_of(env_id), speeds_of(env_id, 7)
    scored = []
    for weights, alignment in itertools.product(_weights(), _ALIGNMENTS):
        made = agents.LQG.design(
            model, speeds=speeds, weights=weights, disturbances=Disturbances(alignment=alignment)
        )
        scored.append((trained(env_id, made), made, f"{_told(weights)}, {1e3 * alignment:g} mm"))
    _, best, told = max(scored, key=lambda row: row[0])
    return Best(tested(env_id, best), told, len(scored))


def output_feedback(env_id: str, gain: float) -> Best:
    """Search four gains at either end of the speeds, from the best constant gain on (CMA-ES)."""
    model, speeds = vehicle_of(env_id), speeds_of(env_id, 2)
    sizes = np.tile([_ACCELERATION, _ACCELERATION, _YAW_RATE * gain, _YAW_RATE * gain], 2)
    start = np.tile([0.0, 0.0, -gain, 0.0], 2)

    def made(x: Array) -> Controller:
        gains = _of_its_own_body(model, (start + sizes * x).reshape(2, 4))
        return agents.OutputFeedback.design(model, speeds=speeds, gains=gains)

    options = {"seed": 1, "verbose": -9, "popsize": CANDIDATES, "maxiter": GENERATIONS}
    search = cma.CMAEvolutionStrategy(np.zeros(8), 0.5, options)
    best, most, tried = np.zeros(8), trained(env_id, made(np.zeros(8))), 1
    while not search.stop():
        asked = search.ask()
        scores = [trained(env_id, made(x)) for x in asked]
        search.tell(asked, [-score for score in scores])
        tried += len(asked)
        if max(scores) > most:
            best, most = np.asarray(asked[int(np.argmax(scores))]), max(scores)
    gains = (start + sizes * best).reshape(2, 4)
    told = "; ".join(", ".join(f"{k / 1e3:.3g}" for k in row) for row in gains)
    return Best(tested(env_id, made(best)), told, tried)


def _of_its_own_body(model: Equipped, gains: Array) -> Array:
    """Return gains of all commands, each on the readings of the body that it damps, shape (k, m, t)."""
    terms = terms_of(model, Filters())
    spread = np.zeros((len(gains), len(model.command_names), len(terms)))
    for k, body in enumerate(sensed_bodies(model, "output feedback")):
        own = [t for t, term in enumerate(terms) if term.signal in (f"accel_{body}", f"gyro_{body}")]
        spread[:, k, own] = gains
    return spread


def knowing_all(env_id: str) -> tuple[Best, list[Returns]]:
    """Search weights of the LQR that knows all; return what every choice earned in the tests, too."""
    tests, scored = [], []
    for weights in _weights():
        score = episode_returns(
            env_id,
            lambda fleet, w=weights: InformedLQR(fleet, w),
            episodes=TRAINING_EPISODES,
            seed=TRAINING,
        )
        found = episode_returns(
            env_id, lambda fleet, w=weights: InformedLQR(fleet, w), episodes=TEST_EPISODES, seed=TEST
        )
        tests.append(found)
        scored.append((score.mean, found, _told(weights)))
    _, found, told = max(scored, key=lambda row: row[0])
    return Best(found, told, len(scored)), tests


def _weights() -> Iterator[Weights]:
    for displacement, yaw, moment in itertools.product(_DISPLACEMENTS, _YAWS, _MOMENTS):
        yield Weights(displacement=displacement, yaw=yaw, moment=moment)


def _told(weights: Weights) -> str:
    return f"{1e3 * weights.displacement:g} mm, {1e3 * weights.yaw:g} mrad, {weights.moment:g}"


@dataclass(frozen=True)
class Row:
    """What is earned in a task: mean returns in the test episodes, and shares that derailed.

    Attributes
    ----------
    steps : int
        Of an episode: the largest return there could be.
    means, derailed : dict of str to float
        By controller.
    bound : float
        Mean over the episodes of the best that any of them earned in it.
    told : dict of str to str
        Numbers of the controllers found.
    tried : dict of str to int
    """

    steps: int
    means: dict[str, float]
    derailed: dict[str, float]
    bound: float
    told: dict[str, str]
    tried: dict[str, int]


def row(env_id: str) -> Row:
    """Search and judge all kinds in a task."""
    with one_blas_thread():
        idle = Best(tested(env_id, None), "", 1)
        constant, gain = constant_gain(env_id)
        informed, every = knowing_all(env_id)
        kinds = {
            "idle": idle,
            "constant gain": constant,
            "LQR": informed,
            "LQG": lqg(env_id),
            "output feedback": output_feedback(env_id, gain),
        }
    values = [best.returns.values for best in kinds.values()] + [found.values for found in every]
    return Row(
        steps=idle.returns.steps,
        means={name: round(best.returns.mean, 1) for name, best in kinds.items()},
        derailed={name: float(best.returns.derailed.mean()) for name, best in kinds.items()},
        bound=round(float(np.max(values, axis=0).mean()), 1),
        told={name: best.told for name, best in kinds.items() if best.told},
        tried={name: best.tried for name, best in kinds.items()},
    )
