"""How runs of several controllers are drawn."""

from __future__ import annotations

import math
from collections.abc import Mapping

import control
import matplotlib.pyplot as plt
import numpy as np

from agents.controllers.controller import Controller, equipped
from agents.evaluation.colors import colors
from agents.evaluation.nonlinear import OFFSET
from agents.evaluation.rollout import Case, Rollout
from design.style import style
from railenv import Bogie, DualWheelset, Equipped


def plot_histories(
    controllers: Mapping[str, Controller | None],
    model: Bogie | DualWheelset | Equipped,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    offset: float = OFFSET,
    duration: float = 5.0,
) -> control.ControlPlot:
    """Draw the motion of the leading wheelset and the moment, with each of some controllers.

    Parameters
    ----------
    controllers : mapping of str to (Controller or None)
        None is the vehicle alone.
    model : Bogie, DualWheelset or Equipped
    speed, radius, cant : float
        m/s, m, rad.
    offset : float
        m, lateral, of all bodies at the start.
    duration : float
        s.
    """
    vehicle = equipped(model)
    moment = next(name for name in vehicle.state_names if name.startswith("T_"))
    chosen = colors(controllers)
    with style():
        figure, (above, below) = plt.subplots(2, 1, figsize=(7.0, 5.0), sharex=True)
        for name, controller in controllers.items():
            rollout = Rollout(vehicle, controller, [Case(speed, radius, cant, offset)])
            motion = rollout.run(duration, ("y_w1", moment))
            color = chosen[name]
            above.plot(motion.time, 1e3 * motion["y_w1"][:, 0], color=color, label=name, lw=1.4)
            limited = np.clip(motion[moment][:, 0], -vehicle.actuator.limit, vehicle.actuator.limit)
            below.plot(motion.time, 1e-3 * limited, color=color, lw=1.2)
        above.set_ylabel("y_w1 (mm)")
        below.set_ylabel("moment (kN m)")
        below.set_xlabel("time (s)")
        above.set_title(f"{vehicle.plant.vehicle.name} at {speed:g} m/s from {1e3 * offset:g} mm off")
        above.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        axes = np.array([above, below], dtype=object)
        return control.ControlPlot(np.array([*above.lines, *below.lines], dtype=object), axes, figure)
