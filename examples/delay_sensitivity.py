"""What the transport delay of the actuator costs, for a simple and for an optimal controller.

``python -m examples.delay_sensitivity --figure delay.png``
"""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np

import agents
import design
import railenv
from design.style import SERIES, style
from examples.recipe import LIMITS, command_line, critical, save, table, written
from examples.yaw_rate_feedback import damper

SPEED = 150.0  # m/s
GAIN = 200e3  # N m s/rad
DELAYS = (0.0, 0.01, 0.02, 0.03, 0.05)  # s
MAP_DELAYS = np.linspace(0.0, 0.1, 41)  # s
MAP_GAINS = np.linspace(0.0, 4.5, 37)  # times GAIN

VEHICLE = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))


def optimal(delay):
    """The LQR for a vehicle with this delay (s)."""
    return agents.LQR.design(VEHICLE.replace(delay=delay), speed=SPEED)


@dataclass(frozen=True)
class Result:
    """Critical speeds (m/s) by controller and delay, margins by controller, and a map of damping."""

    speeds: dict[str, dict[float, float]]
    margins: dict[str, design.Margins]
    chart: design.StabilityMap

    def longest(self, name):
        """Total delay (s) at which a controller loses stability at SPEED."""
        return VEHICLE.actuator.delay + self.margins[name].delay_margin

    def markdown(self):
        rows = [
            [name, *(written(speed) for speed in over.values())] for name, over in self.speeds.items()
        ]
        sentences = [
            f"At {SPEED:g} m/s the {name} is stable up to a delay of {1e3 * self.longest(name):.1f} ms."
            for name in self.margins
        ]
        headings = ["critical speed, m/s, with a delay of", *(f"{1e3 * d:g} ms" for d in DELAYS)]
        return "\n".join([table(headings, rows), "", *sentences])

    def plot(self):
        with style():
            figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.6))
            for (name, over), colour in zip(self.speeds.items(), SERIES, strict=False):
                delays = 1e3 * np.array(list(over))
                found = np.minimum(list(over.values()), LIMITS[1])
                left.plot(delays, found, "o-", color=colour, label=name)
            left.set(
                title="Critical speed (searched up to 400 m/s)",
                xlabel="transport delay (ms)",
                ylabel="critical speed (m/s)",
                ylim=(0.0, 560.0),
            )
            left.legend(loc="upper right")
            self.chart.plot(right)
            right.set(title=f"Yaw-rate feedback at {SPEED:g} m/s")
            right.set(ylabel=f"gain ({GAIN / 1e3:g} kN m s/rad)")
        return figure


def main(fast=False, figure=None):
    """See how much delay two controllers bear."""
    feedback, regulator = damper(GAIN), optimal(VEHICLE.actuator.delay)
    vehicles = {delay: VEHICLE.replace(delay=delay) for delay in DELAYS}
    speeds = {
        "yaw-rate feedback": {d: critical(v, feedback) for d, v in vehicles.items()},
        "LQR for 10 ms": {d: critical(v, regulator) for d, v in vehicles.items()},
        "LQR for the delay": {d: critical(v, optimal(d)) for d, v in vehicles.items()},
    }
    margins = {
        "yaw-rate feedback": design.margins(VEHICLE, feedback, speed=SPEED),
        "LQR for 10 ms": design.margins(VEHICLE, regulator, speed=SPEED),
    }
    every = 10 if fast else 1
    chart = design.stability_map(
        VEHICLE,
        {"delay": MAP_DELAYS[::every], "gain": MAP_GAINS[::every]},
        quantity="damping",
        speed=SPEED,
        controller=feedback,
        n_jobs=1,
    )
    result = Result(speeds, margins, chart)
    print(result.markdown())
    if figure:
        save(result.plot(), figure)
    return result


if __name__ == "__main__":
    command_line(main)
