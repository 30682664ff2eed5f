"""Gain scheduling over speed with python-control, and what it saves against a fixed gain.

``control.create_statefbk_iosystem`` interpolates between gains; the vehicle's speed joins its states as
one that does not change, by which they are scheduled.
``python -m examples.gain_scheduling --figure scheduling.png``
"""

from dataclasses import dataclass

import control
import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import block_diag

import agents
import design
import railenv
from design.style import SERIES, style
from examples.recipe import command_line, save, table

NODES = (60.0, 240.0)  # m/s, at which gains are designed
FIXED = 120.0  # m/s, of the fixed gain
SPEEDS = (60.0, 90.0, 120.0, 150.0, 200.0, 240.0)  # m/s, at which they are compared

VEHICLE = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))
OFFSET = 1e-3  # m, of all bodies at the start


def scheduled_feedback(regulators):
    """python-control's controller, whose inputs are desired states and inputs, then the states."""
    plant = regulators[0].system
    n = plant.nstates
    names = [*plant.state_labels, "speed"]
    with_speed = control.ss(
        block_diag(plant.A, 1.0),
        np.vstack([plant.B, np.zeros((1, plant.ninputs))]),
        np.eye(n + 1),
        np.zeros((n + 1, plant.ninputs)),
        None,  # python-control leaves no other timebase to a scheduled controller
        states=names,
        inputs=plant.input_labels,
        outputs=names,
    )
    gains = [np.append(r.gain, np.zeros((len(r.gain), 1)), axis=1) for r in regulators]
    nodes = [[r.speed] for r in regulators]
    controller, _ = control.create_statefbk_iosystem(
        with_speed, (gains, nodes), gainsched_indices=["speed"], gainsched_method="linear"
    )
    return controller


def as_feedback(controller, labels):
    """The same controller for the analysis of the vehicle's sampled closed loop."""
    n = len(labels)
    desired = np.zeros(controller.ninputs - n - 1)

    def commands(signals):
        speed = np.clip(signals[n:], NODES[0], NODES[-1])  # beyond, interpolation raises
        return controller.output(0.0, np.zeros(0), np.concatenate([desired, signals[:n], speed]))

    def jacobian(signals):  # commands are linear in the states
        columns = [commands(np.append(unit, signals[n:])) for unit in np.eye(n)]
        return np.append(np.transpose(columns), np.zeros((controller.noutputs, 1)), axis=1)

    return design.StaticFeedback(commands, jacobian, [*labels, "speed"], list(VEHICLE.command_names))


def cost(regulator, gain, start):
    """Sum of the regulator's quadratic cost under any gain on its plant, by a Lyapunov equation."""
    plant = regulator.system
    loop = plant.A - plant.B @ gain
    weight = regulator.state_weight + gain.T @ regulator.command_weight @ gain
    scale = np.abs(np.diag(regulator.cost)) ** -0.5  # entries of like magnitude
    scaled = loop * scale / scale[:, None]
    P = control.dlyap(scaled.T, weight * scale * scale[:, None], method="scipy")
    z = start / scale
    return float(z @ P @ z)


@dataclass(frozen=True)
class Comparison:
    """At a speed: the least cost, and the costs of a fixed and of the scheduled gain."""

    least: float
    fixed: float
    scheduled: float


@dataclass(frozen=True)
class Result:
    """Comparisons by speed; largest difference between both schedules, as a share of the command."""

    feedback: design.StaticFeedback
    controller: agents.LQR
    difference: float
    comparisons: dict[float, Comparison]

    def markdown(self):
        found = {v: self.comparisons[v] for v in SPEEDS}
        rows = [
            [name, *(f"{abs(getattr(c, key) / c.least - 1.0):.1%}" for c in found.values())]
            for name, key in (
                (f"gain for {FIXED:g} m/s", "fixed"),
                ("scheduled gain", "scheduled"),
            )
        ]
        nodes = " and ".join(f"{v:g}" for v in NODES)
        return (
            table(["cost above the least possible, at m/s", *(f"{v:g}" for v in SPEEDS)], rows)
            + f"\n\nThe schedule has gains for {nodes} m/s; in between it is linear."
        )

    def plot(self):
        speeds = np.array(sorted(self.comparisons))
        found = [self.comparisons[v] for v in speeds.tolist()]
        with style():
            figure, ax = plt.subplots(figsize=(6.8, 4.2))
            for key, label, colour in (
                ("fixed", f"gain for {FIXED:g} m/s", SERIES[1]),
                ("scheduled", "scheduled gain", SERIES[0]),
            ):
                excess = [100.0 * (getattr(c, key) / c.least - 1.0) for c in found]
                ax.plot(speeds, excess, color=colour, label=label)
            ax.plot(NODES, [0.0] * len(NODES), "o", color=SERIES[0], label="speeds of the schedule")
            ax.set(
                title="Price of a gain that was designed for another speed",
                xlabel="speed (m/s)",
                ylabel="cost above the least possible (%)",
            )
            ax.legend()
        return figure


def difference(feedback, controller, labels):
    """Largest difference of the two schedules' gains over speed, as a share of the largest gain."""
    columns = [controller.input_labels.index(label) for label in labels]
    worst = 0.0
    for speed in np.linspace(NODES[0], NODES[-1], 13):
        own = feedback.linearize(np.append(np.zeros(len(labels)), speed)).D[:, : len(labels)]
        signals = np.zeros(len(controller.input_labels))
        signals[controller.input_labels.index("speed")] = speed
        other = controller.linearize(signals).D[:, columns]
        worst = max(worst, float(np.abs((own - other) / np.abs(other).max()).max()))
    return worst


def main(fast=False, figure=None):
    """Schedule regulators over speed with python-control, and compare with agents.LQR."""
    regulators = [design.lqr(VEHICLE, speed=speed) for speed in NODES]
    labels = list(regulators[0].system.state_labels)
    feedback = as_feedback(scheduled_feedback(regulators), labels)
    controller = agents.LQR.design(VEHICLE, speeds=NODES)
    fixed = design.lqr(VEHICLE, speed=FIXED).gain
    start = np.array([OFFSET * label.startswith("y_") for label in labels])
    comparisons = {}
    for speed in SPEEDS if fast else np.union1d(SPEEDS, np.linspace(60.0, 240.0, 37)).tolist():
        best = design.lqr(VEHICLE, speed=speed)
        now = -feedback.linearize(np.append(np.zeros(len(labels)), speed)).D[:, : len(labels)]
        least = float(start @ best.cost @ start)
        comparisons[speed] = Comparison(least, cost(best, fixed, start), cost(best, now, start))
    result = Result(feedback, controller, difference(feedback, controller, labels), comparisons)
    print(result.markdown())
    if figure:
        save(result.plot(), figure)
    return result


if __name__ == "__main__":
    command_line(main)
