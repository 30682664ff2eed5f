"""Write the tables and pictures of docs/what-controllers-do.md: ``python docs/make_explained.py``.

Everything is computed anew (a minute or two). The text is edited in the page itself.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from blocks import refilled, table

import agents
import design
from agents.controllers.passive import Passive
from agents.evaluation.equivalent import equivalent_damper
from agents.evaluation.rollout import Case, Rollout, Track
from agents.learning.designs import PROBLEM_DESIGNS
from agents.problems import Problem, problem
from design.style import SERIES, style
from railenv import Equipped

DOCS = Path(__file__).resolve().parent
PAGE, PICTURES = DOCS / "what-controllers-do.md", DOCS / "pictures"
FIRST = "bogie-secondary-v1"
DAMPER = "best passive damper"
WHEELS = {
    "new wheels, poor rails": {"conicity": 0.05, "creep_factor": 0.6},
    "worn wheels, dry rails": {"conicity": 0.4, "creep_factor": 1.4},
}
SPEEDS = (60.0, 90.0, 120.0)
"""m/s, of the table."""
LOCUS = np.linspace(20.0, 160.0, 71)
"""m/s."""
RUN_SPEED, OFFSET, SECONDS = 110.0, 3e-3, 3.0
"""m/s, m, s: of the time histories."""


def shipped(one: Problem) -> dict[str, Any]:
    """Return the controllers that are shipped for a problem, in the order of their designs."""
    kinds = [kind for kind in PROBLEM_DESIGNS[one.name] if kind in agents.shipped_names(one.name)]
    return {kind: agents.shipped(kind, one.name) for kind in kinds if kind != "passive"}


def controllers(one: Problem) -> dict[str, tuple[Equipped, Any]]:
    """Return vehicles and controllers by what they are called; the first is the passive one."""
    damped, model = one.passive(one.damper), one.model()
    found: dict[str, tuple[Equipped, Any]] = {DAMPER: (damped, Passive.design(damped))}
    found |= {kind: (model, law) for kind, law in shipped(one).items()}
    found["adaptive-lqg"] = model, PROBLEM_DESIGNS[one.name]["adaptive-lqg"](model)
    return found


def equivalents() -> str:
    """Return what damper and spring each controller is to the least damped oscillation."""
    one, rows = problem(FIRST), []
    for name, controller in shipped(one).items():
        for wheels, changes in WHEELS.items():
            found = equivalent_damper(one.model().replace(**changes), controller, SPEEDS)
            cells = [
                f"{f:.1f} Hz, {g:+.1f} 1/s: {1e-3 * c:.0f}, {1e-6 * k:.1f}"
                for f, g, c, k in zip(
                    found.frequency, found.growth, found.rate, found.stiffness, strict=True
                )
            ]
            rows.append([name, wheels, *cells])
    head = ["controller", "wheels", *(f"at {v:.0f} m/s" for v in SPEEDS)]
    return table(head, rows, len(head))


def draw_loci(ax: Any, model: Equipped, controller: Any) -> Any:
    """Draw the oscillations of a loop over the speed."""
    locus = design.speed_locus(model, LOCUS, controller=controller)
    values = locus.loci
    hertz = values.imag / (2.0 * np.pi)
    speeds = np.broadcast_to(locus.values[:, None], values.shape)
    shown = (hertz > 0.2) & (hertz < 30.0) & (values.real > -25.0)
    drawn = ax.scatter(
        values.real[shown], hertz[shown], c=speeds[shown], s=7, cmap="viridis", vmin=20.0, vmax=160.0
    )
    ax.axvline(0.0, color="#333333", lw=0.8)
    ax.set(xlim=(-25.0, 15.0), ylim=(0.0, 25.0), xlabel="growth rate (1/s)")
    return drawn


def histories(ax: Any, below: Any, model: Equipped, controller: Any) -> None:
    """Draw how an offset dies out (or does not) and what moment is asked for."""
    moments = model.equipment.mounts[0].state_names[:1]
    for (wheels, changes), color in zip(WHEELS.items(), SERIES, strict=False):
        case = Case(RUN_SPEED, offset=OFFSET, vehicle=changes)
        motion = Rollout(model, controller, [case]).run(SECONDS, ("y_w1", *moments))
        ax.plot(motion.time, 1e3 * motion["y_w1"][:, 0], color=color, lw=1.1, label=wheels)
        limit = model.limits[0]
        moment = np.clip(motion[moments[0]][:, 0], -limit, limit)
        below.plot(motion.time, 1e-3 * moment, color=color, lw=1.0)
    ax.set_ylabel("y_w1 (mm)")
    ax.set_ylim(-8.0, 8.0)
    below.set_ylim(-30.0, 30.0)
    below.set_ylabel("actuator (kN m)")
    below.set_xlabel("time (s)")
    ax.set_title(f"{RUN_SPEED:.0f} m/s, {1e3 * OFFSET:.0f} mm off")
    ax.legend(loc="upper right", fontsize=7)


def draw(name: str, model: Equipped, controller: Any) -> Any:
    """Draw loci with both wheels, of a controller that has them, and time histories."""
    loci = isinstance(controller, design.Feedback)
    with style():
        figure = plt.figure(figsize=(11.0 if loci else 6.0, 3.8), layout="constrained")
        grid = figure.add_gridspec(2, 3 if loci else 1, width_ratios=(1.0, 1.0, 1.25) if loci else None)
        if loci:
            draw_both(figure, [figure.add_subplot(grid[:, k]) for k in (0, 1)], model, controller)
        above = figure.add_subplot(grid[0, -1])
        histories(above, figure.add_subplot(grid[1, -1], sharex=above), model, controller)
        figure.suptitle(name)
        return figure


def draw_both(figure: Any, axes: list[Any], model: Equipped, controller: Any) -> None:
    """Draw the loci with both wheels beside each other."""
    for ax, (wheels, changes) in zip(axes, WHEELS.items(), strict=True):
        ax.set_title(wheels)
        drawn = draw_loci(ax, model.replace(**changes), controller)
    axes[0].set_ylabel("frequency (Hz)")
    figure.colorbar(drawn, ax=axes, label="speed (m/s)", pad=0.01)


def draw_estimate() -> Any:
    """Draw what the adaptive controller takes the conicity for, on an irregular line."""
    one = problem(FIRST)
    model = one.model()
    adaptive = PROBLEM_DESIGNS[FIRST]["adaptive-lqg"](model)
    assert isinstance(adaptive, agents.AdaptiveLQG)
    conicities = (0.05, 0.1, 0.25, 0.4)  # two of them between those of the bank
    cases = [Case(100.0, vehicle={"conicity": c}) for c in conicities]
    rollout = Rollout(model, adaptive, cases, Track("low", noise=True))
    steps = round(4.0 / 0.005)
    told = np.empty((steps, len(cases)))
    for k in range(steps):
        rollout.step()
        told[k] = adaptive.estimate("conicity")
    with style():
        figure, ax = plt.subplots(figsize=(6.8, 3.4), layout="constrained")
        for k, (c, color) in enumerate(zip(conicities, SERIES, strict=False)):
            ax.plot(0.005 * np.arange(steps), told[:, k], color=color, label=f"conicity {c:g}")
            ax.axhline(c, color=color, lw=0.8, ls="--")
        ax.set(xlabel="time (s)", ylabel="estimated conicity", ylim=(0.0, 0.45))
        ax.legend(loc="center right")
        return figure


if __name__ == "__main__":
    mpl.use("Agg")
    text = refilled(PAGE.read_text(encoding="utf-8"), {"equivalents": equivalents})
    PAGE.write_text(text, encoding="utf-8")
    for called, (vehicle, law) in controllers(problem(FIRST)).items():
        picture = f"explained-{called.replace(' ', '-')}.png"
        if picture in text:
            made = draw(called, vehicle, law)
            made.savefig(PICTURES / picture, dpi=110)
            plt.close(made)
    draw_estimate().savefig(PICTURES / "explained-estimate.png", dpi=110)
