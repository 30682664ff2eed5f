"""A linear-quadratic regulator at one speed, and what its cost x'Px promises.

``python -m examples.lqr_at_one_speed --figure lqr.png``
"""

from dataclasses import dataclass

import control
import matplotlib.pyplot as plt
import numpy as np

import agents
import design
import railenv
from design.style import STABLE, UNSTABLE, style
from examples.recipe import command_line, save, table

SPEED = 160.0  # m/s; the vehicle alone hunts from 116 m/s
OFFSETS = (1e-5, 1e-4, 1e-3, 3e-3)  # m, of all bodies at the start
DURATION = 4.0  # s

VEHICLE = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))


def quadratic_cost(regulator, x, u):
    """Sum of x'Qx + u'Ru over all periods; rows of x and u are periods."""
    Q, R = regulator.state_weight, regulator.command_weight
    return float(np.einsum("ki,ij,kj->", x, Q, x) + np.einsum("ki,ij,kj->", u, R, u))


def linear_cost(regulator, start):
    """Cost of the gain on the sampled linear plant, from a start, by running it."""
    plant, K = regulator.system, regulator.gain
    loop = control.ss(plant.A - plant.B @ K, plant.B, np.eye(plant.nstates), 0, plant.dt)
    time = np.arange(round(2.0 * DURATION / plant.dt)) * plant.dt
    x = control.initial_response(loop, time, initial_state=start).states.T
    return quadratic_cost(regulator, x, -x @ K.T)


def displaced(regulator, offset):
    """State with all bodies displaced sideways (m), nothing on its way."""
    return np.array([offset * name.startswith("y_") for name in regulator.system.state_labels])


@dataclass(frozen=True)
class Run:
    """Time (s), states of the regulator's model and moments (N m) of a run in the environment."""

    time: np.ndarray
    states: np.ndarray
    moments: np.ndarray


def nonlinear_run(regulator, controller, offset):
    """Run the controller in the environment, on the nonlinear vehicle."""
    rollout = agents.Rollout(VEHICLE, controller, [agents.Case(SPEED, offset=offset)])
    labels, names = regulator.system.state_labels, rollout.fleet.model.state_names
    own = [names.index(label) for label in labels if label in names]
    past = np.zeros(len(labels) - len(own))  # commands on their way, the latest first
    states, moments = [], []
    for _ in range(round(DURATION / rollout.period)):
        share = controller.act(rollout.fleet.observations)
        states.append(np.append(rollout.fleet.all_states()[0, own], past))
        moments.append(share[0] * VEHICLE.actuator.limit)
        past = np.append(moments[-1], past)[: len(past)]
        rollout.step()
    time = np.arange(len(states)) * rollout.period
    return Run(time, np.array(states), np.array(moments))


@dataclass(frozen=True)
class Result:
    """Costs by offset: promised by x'Px, on the linear and on the nonlinear plant."""

    regulator: design.Regulator
    costs: dict[float, tuple[float, float, float]]
    runs: dict[float, Run]
    free: agents.Motion

    def markdown(self):
        rows = []
        for offset, (promised, linear, nonlinear) in self.costs.items():
            peak = np.abs(self.runs[offset].moments).max() / 1e3
            cells = [f"{1e3 * offset:g}", f"{promised:.4g}", f"{linear:.4g}", f"{nonlinear:.4g}"]
            rows.append([*cells, f"{abs(nonlinear / promised - 1.0):.2%}", f"{peak:.2f}"])
        return table(
            [
                "offset, mm",
                "x'Px",
                "linear plant",
                "nonlinear plant",
                "difference",
                "largest moment, kN m",
            ],
            rows,
        )

    def plot(self):
        offset = OFFSETS[-1]
        run = self.runs[offset]
        lateral = self.regulator.system.state_labels.index("y_w1")
        with style():
            figure, (upper, lower) = plt.subplots(2, 1, figsize=(7.0, 5.2), sharex=True)
            free = 1e3 * self.free["y_w1"][:, 0]
            upper.plot(self.free.time, free, color=UNSTABLE, label="no control")
            upper.plot(run.time, 1e3 * run.states[:, lateral], color=STABLE, label="LQR")
            upper.set(title=f"{SPEED:g} m/s, {1e3 * offset:g} mm off at the start")
            upper.set(ylabel="leading wheelset (mm)", xlim=(0.0, 2.0))
            upper.legend(loc="upper left", ncols=2)
            upper.set_ylim(-16.0, 22.0)
            lower.plot(run.time, run.moments[:, 0] / 1e3, color=STABLE)
            lower.set(xlabel="time (s)", ylabel="commanded moment (kN m)")
        return figure


def main(fast=False, figure=None):
    """Design an LQR and compare its cost with what it promises."""
    regulator = design.lqr(VEHICLE, speed=SPEED)
    controller = agents.LQR.design(VEHICLE, speed=SPEED)
    costs, runs = {}, {}
    for offset in OFFSETS:
        start = displaced(regulator, offset)
        run = nonlinear_run(regulator, controller, offset)
        nonlinear = quadratic_cost(regulator, run.states, run.moments)
        costs[offset] = (
            float(start @ regulator.cost @ start),
            linear_cost(regulator, start),
            nonlinear,
        )
        runs[offset] = run
    case = agents.Case(SPEED, offset=OFFSETS[-1])
    free = agents.Rollout(VEHICLE, None, [case]).run(0.5 if fast else 2.0)
    result = Result(regulator, costs, runs, free)
    print(result.markdown())
    if figure:
        save(result.plot(), figure)
    return result


if __name__ == "__main__":
    command_line(main)
