"""Yaw-rate feedback through a real actuator: which gains are stable, and with which margins.

The same feedback as a yaw damper, but sampled, delayed by 10 ms and lagged at 20 Hz.
``python -m examples.yaw_rate_feedback --figure feedback.png``
"""

import math
from dataclasses import dataclass

import control
import matplotlib.pyplot as plt
import numpy as np

import design
import railenv
from design.style import STABLE, UNSTABLE, style
from examples.recipe import command_line, critical, save, table, written

GAINS = (100e3, 150e3, 200e3, 300e3, 400e3)  # N m s/rad
SPEED = 150.0  # m/s, of the margins; the vehicle alone hunts from 116 m/s
WINDOW_SPEEDS = (20.0, 100.0, 150.0, 200.0, 250.0)  # m/s
UNIT = 100e3  # N m s/rad, gain 1 of the root locus

VEHICLE = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))


def damper(gain):
    """Sampled feedback of the gyro on the frame."""
    return control.ss([], [], [], [[-gain]], 0.005, inputs=["gyro_b"], outputs=["command_b"])


def root_locus(speed):
    """Poles of the sampled loop over the gain in units of UNIT."""
    loop = design.open_loop(VEHICLE, damper(UNIT), speed=speed)
    return design.gain_locus(loop, np.linspace(0.0, 10.0, 201))


def window(speed):
    """Smallest and largest gain (N m s/rad) that are stable at a speed."""
    points = root_locus(speed).critical_points
    gained = [point.value for point in points if point.stability == "gained"]
    (lost,) = (point.value for point in points if point.stability == "lost")
    return UNIT * (gained[0] if gained else 0.0), UNIT * lost


@dataclass(frozen=True)
class Result:
    """Critical speeds and margins by gain, and windows of stable gains by speed."""

    speeds: dict[float, float]
    margins: dict[float, design.Margins]
    windows: dict[float, tuple[float, float]]

    def markdown(self):
        rows = []
        for gain in GAINS:
            cells = [f"{gain / 1e3:.0f}", written(self.speeds[gain])]
            found = self.margins[gain]
            if found.stable:
                c = found["command_b"]
                cells += [f"{c.gain_reduction:.2f} to {c.gain_margin:.2f}"]
                cells += [f"{math.degrees(c.phase_margin):.1f}", f"{c.disk_margin:.2f}"]
                cells += [f"{1e3 * found.delay_margin:.1f}"]
            else:
                cells += ["unstable", "", "", ""]
            rows.append(cells)
        margins = table(
            [
                "gain, kN m s/rad",
                "critical speed, m/s",
                f"gain factor at {SPEED:g} m/s",
                "phase margin, °",
                "disk margin",
                "delay margin, ms",
            ],
            rows,
        )
        windows = table(
            ["speed, m/s", *(f"{v:g}" for v in WINDOW_SPEEDS)],
            [
                [f"{name}, kN m s/rad", *(f"{self.windows[v][k] / 1e3:.0f}" for v in WINDOW_SPEEDS)]
                for k, name in enumerate(("smallest stable gain", "largest stable gain"))
            ],
        )
        return f"{margins}\n\n{windows}"

    def plot(self):
        with style():
            figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.6))
            root_locus(SPEED).plot(left)
            left.set(xlim=(0.55, 1.1), ylim=(-0.02, 0.55))
            left.set_title(f"Root locus at {SPEED:g} m/s; gain 1 is {UNIT / 1e3:g} kN m s/rad")
            speeds = np.array(sorted(self.windows))
            low, high = np.array([self.windows[v] for v in speeds]).T / 1e3
            right.fill_between(speeds, low, high, color=STABLE, alpha=0.15, lw=0)
            right.plot(speeds, high, color=UNSTABLE, label="largest stable gain")
            right.plot(speeds, low, color=STABLE, label="smallest stable gain")
            right.set(
                title="Stable gains",
                xlabel="speed (m/s)",
                ylabel="gain (kN m s/rad)",
                xlim=(speeds[0], speeds[-1]),
                ylim=(0.0, 1.25 * np.nanmax(high)),
            )
            right.legend(loc="upper left")
        return figure


def main(fast=False, figure=None):
    """Choose the gain of a yaw-rate feedback."""
    speeds = WINDOW_SPEEDS if fast else np.union1d(WINDOW_SPEEDS, np.arange(20.0, 251.0, 10.0)).tolist()
    result = Result(
        {gain: critical(VEHICLE, damper(gain)) for gain in GAINS},
        {gain: design.margins(VEHICLE, damper(gain), speed=SPEED) for gain in GAINS},
        {speed: window(speed) for speed in speeds},
    )
    print(result.markdown())
    if figure:
        save(result.plot(), figure)
    return result


if __name__ == "__main__":
    command_line(main)
