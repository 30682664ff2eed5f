"""Drawings of learning, in the style of :mod:`design.style`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import control
import numpy as np
from numpy.typing import NDArray

from design.style import SERIES, STABLE, UNSTABLE, axes_or_new, drawn_on, style
from railenv.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from agents.learning.training import Training


def plot_training(training: Training, ax: Axes | None = None) -> control.ControlPlot:
    """Draw return and critical speed at the evaluations over the steps, and mark the best policy.

    Raises
    ------
    ParameterError
        If nothing was evaluated.
    """
    found = training.evaluations
    if not found:
        raise ParameterError("the training was not evaluated; evaluation.every must be above 0")
    robust = training.recipe.evaluation.criterion == "robust_critical_speed"
    best = training.policy.about
    with style():
        ax = axes_or_new(ax)
        steps = [e.timesteps / 1e3 for e in found]
        at = best["timesteps"] / 1e3
        ax.plot(steps, [e.mean_return for e in found], color=STABLE, marker=".", label="mean return")
        ax.plot([at], [best["mean_return"]], "o", color=UNSTABLE, label="best policy")
        ax.set_xlabel("environment steps (thousands)")
        ax.set_ylabel("mean return of an episode")
        right = ax.twinx()
        right.plot(steps, [e.critical_speed for e in found], ".-", lw=0.8, color=SERIES[1])
        right.plot([at], [best["critical_speed"]], "o", color=UNSTABLE)
        right.set_ylabel(f"{'lowest ' * robust}linear critical speed (m/s)", color=SERIES[1])
        ax.set_title(f"{training.recipe.algorithm.upper()} in {training.recipe.env_id}")
        ax.legend(loc="lower right")
        return drawn_on(ax)


def plot_search(
    means: NDArray[np.float64], judged: NDArray[np.float64], ax: Axes | None = None
) -> control.ControlPlot:
    """Draw a policy search: mean score of each generation, and robust critical speed on the right."""
    with style():
        ax = axes_or_new(ax)
        generations = np.arange(1, len(means) + 1)
        ax.plot(generations, means, color=STABLE, lw=0.8, label="mean score of a generation")
        ax.plot(judged[:, 0], judged[:, 2], "o", ms=4, color=STABLE, label="score of the mean policy")
        low = min(0.0, float(np.quantile(means, 0.1)) if len(means) else 0.0, judged[:, 2].min())
        ax.set_ylim(1.1 * low - 0.5, 1.1 * max(judged[:, 2].max(), 0.0) + 1.0)
        ax.set_xlabel("generation")
        ax.set_ylabel("score")
        right = ax.twinx()
        right.plot(judged[:, 0], judged[:, 1], "s-", ms=4, lw=0.8, color=SERIES[1])
        right.set_ylabel("robust critical speed (m/s)", color=SERIES[1])
        ax.set_title("policy search")
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
        return drawn_on(ax)


def plot_descent(
    costs: NDArray[np.float64], judged: NDArray[np.float64], ax: Axes | None = None
) -> control.ControlPlot:
    """Draw a training through the simulator: cost, and robust critical speed on the right."""
    with style():
        ax = axes_or_new(ax)
        ax.semilogy(np.arange(1, len(costs) + 1), costs, color=STABLE, lw=0.8)
        ax.set_xlabel("evaluation")
        ax.set_ylabel("cost (1/s)", color=STABLE)
        right = ax.twinx()
        right.plot(judged[:, 0], judged[:, 2], "s-", ms=4, lw=0.8, color=SERIES[1])
        right.set_ylabel("robust critical speed (m/s)", color=SERIES[1])
        ax.set_title("training through the simulator")
        return drawn_on(ax)
