"""How strong a passive yaw damper must be: root locus over its rate, and critical speed against it.

A yaw damper is feedback of the frame's yaw rate to a moment on the frame, so its rate is the gain of a
root locus. ``python -m examples.damper_sizing --figure damper.png``
"""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np

import design
import railenv
from design.style import NEUTRAL, SERIES, style
from examples.recipe import command_line, save, table

RATES = np.array([0.0, 50e3, 100e3, 150e3, 200e3, 300e3, 400e3])  # N m s/rad
CASES = (  # and the speed that the damper is to allow, m/s
    ("Cooperrider bogie", railenv.CooperriderBogie(), 90.0),
    ("high-speed coach", railenv.Bogie(railenv.HIGH_SPEED_COACH), 140.0),
)


def damped(model, rate):
    """The bogie with a yaw damper of this rate, N m s/rad."""
    if isinstance(model, railenv.CooperriderBogie):
        return model.replace(yaw_damping=rate)
    arm = model.vehicle.secondary_arm  # two longitudinal dampers, one on each side
    return model.replace(secondary_longitudinal_damping=rate / (2.0 * arm**2))


def root_locus(model, speed, rates):
    """Poles over the rate (kN m s/rad): feedback from the yaw rate of the frame to a moment on it."""
    plant = design.linearize(model, speed=speed, inputs=["M_b"], outputs=["dpsi_b"])
    return design.gain_locus(1e3 * plant, rates)


@dataclass(frozen=True)
class Sizing:
    """One bogie.

    Attributes
    ----------
    name : str
    target : float
        m/s.
    locus : design.GainLocus
        At the target speed.
    needed : float
        Smallest rate that is stable there, N m s/rad.
    reached : float
        Critical speed of the nonlinear model with that damper, m/s.
    rates, speeds : ndarray
        Rates (N m s/rad) and critical speeds (m/s).
    """

    name: str
    target: float
    locus: design.GainLocus
    needed: float
    reached: float
    rates: np.ndarray
    speeds: np.ndarray

    def at(self, rate):
        """Critical speed at one of the rates, m/s."""
        return float(self.speeds[np.flatnonzero(self.rates == rate)[0]])


@dataclass(frozen=True)
class Result:
    sizings: tuple[Sizing, ...]

    def markdown(self):
        headings = ["rate, kN m s/rad", *(f"{r / 1e3:.0f}" for r in RATES)]
        rows = [[f"{s.name}, m/s", *(f"{s.at(r):.1f}" for r in RATES)] for s in self.sizings]
        sentences = [
            f"By the root locus the {s.name} needs {s.needed / 1e3:.1f} kN m s/rad to run at "
            f"{s.target:g} m/s; with that damper its critical speed is {s.reached:.2f} m/s."
            for s in self.sizings
        ]
        return "\n".join([table(headings, rows), "", *sentences])

    def plot(self):
        with style():
            figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.4))
            shown = self.sizings[-1]
            shown.locus.plot(left)
            left.set(xlim=(-1.6, 2.2), ylim=(14.0, 23.0))
            left.set_title(f"Root locus of the {shown.name} at {shown.target:g} m/s")
            for s, colour in zip(self.sizings, SERIES, strict=False):
                right.plot(s.rates / 1e3, s.speeds, color=colour, label=s.name)
                right.plot(s.needed / 1e3, s.target, "o", color=colour)
            right.plot([], [], "o", color=NEUTRAL, label="sized by the root locus")
            right.set(
                title="Critical speed",
                xlabel="rate of the yaw damper (kN m s/rad)",
                ylabel="critical speed (m/s)",
                xlim=(0.0, None),
            )
            right.legend(loc="upper left")
        return figure


def sizing(name, model, target, fast):
    locus = root_locus(model, target, np.linspace(0.0, RATES[-1] / 1e3, 81))
    (crossing,) = locus.critical_points
    rates = RATES if fast else np.union1d(RATES, np.linspace(0.0, RATES[-1], 41))
    speeds = [design.critical_speed(damped(model, rate)).speed for rate in rates.tolist()]
    needed = 1e3 * crossing.value
    reached = design.critical_speed(damped(model, needed)).speed
    return Sizing(name, target, locus, needed, reached, rates, np.array(speeds))


def main(fast=False, figure=None):
    """Size yaw dampers for two bogies."""
    result = Result(tuple(sizing(*case, fast) for case in CASES))
    print(result.markdown())
    if figure:
        save(result.plot(), figure)
    return result


if __name__ == "__main__":
    command_line(main)
