"""LQG control from two sensors on the frame, and how it fails when wheels wear.

A Kalman filter from lateral acceleration and yaw rate takes the place of the measured state. It knows
the vehicle that it was designed for. ``python -m examples.lqg_and_conicity --figure lqg.png``
"""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np

import agents
import design
import railenv
from design.style import NEUTRAL, SERIES, style
from examples.recipe import LIMITS, command_line, critical, save, table, written

SPEED = 130.0  # m/s, of the designs
DESIGNS = (0.05, 0.1, 0.2)  # conicities of the designs
CONICITIES = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
BOX = {"conicity": (0.05, 0.3)}  # of the wear to be survived, the contact angle going along

VEHICLE = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))


@dataclass(frozen=True)
class Result:
    """Critical speeds (m/s) by design (None is no control) and conicity; robust one of the first."""

    speeds: dict[float | None, dict[float, float]]
    robust: design.RobustCriticalSpeed

    def markdown(self):
        rows = []
        for made_for, over in self.speeds.items():
            rows.append([name_of(made_for), *(written(over[conicity]) for conicity in CONICITIES)])
        low, high = BOX["conicity"]
        headings = ["critical speed, m/s, at conicity", *(f"{c:g}" for c in CONICITIES)]
        sentence = (
            f"For every conicity from {low:g} to {high:g}, {name_of(DESIGNS[0])} is stable up to "
            f"{self.robust.speed:.1f} m/s; the worst is {self.robust.worst['conicity']:.2g}."
        )
        return f"{table(headings, rows)}\n\n{sentence}"

    def plot(self):
        with style():
            figure, ax = plt.subplots(figsize=(7.2, 4.6))
            for (made_for, over), colour in zip(self.speeds.items(), (NEUTRAL, *SERIES), strict=False):
                conicities = np.array(sorted(over))
                found = np.array([min(over[c], LIMITS[1]) for c in conicities.tolist()])
                ax.plot(conicities, found, color=colour, label=name_of(made_for))
                if made_for is not None:
                    ax.plot(made_for, min(over[made_for], LIMITS[1]), "o", color=colour)
            ax.axvspan(*BOX["conicity"], color=NEUTRAL, alpha=0.1, lw=0)
            ax.set(
                title="Dots: the conicity of the design. At 0: unstable at 20 m/s already",
                xlabel="conicity",
                ylabel="critical speed (m/s)",
                ylim=(-5.0, 345.0),
            )
            ax.legend(loc="upper right")
        return figure


def name_of(made_for):
    return "no control" if made_for is None else f"LQG for {made_for:g}"


def main(fast=False, figure=None):
    """Compare LQG controllers that were designed for different conicities."""
    controllers = {None: None} | {
        c: agents.LQG.design(VEHICLE.replace(conicity=c), speed=SPEED) for c in DESIGNS
    }
    conicities = CONICITIES if fast else np.union1d(CONICITIES, np.linspace(0.04, 0.4, 37)).tolist()
    result = Result(
        {
            made_for: {c: critical(VEHICLE.replace(conicity=c), controller) for c in conicities}
            for made_for, controller in controllers.items()
        },
        design.robust_critical_speed(
            VEHICLE, controllers[DESIGNS[0]], BOX, samples=4, speed_range=LIMITS
        ),
    )
    print(result.markdown())
    if figure:
        save(result.plot(), figure)
    return result


if __name__ == "__main__":
    command_line(main)
