"""Drawings of runs of several controllers."""

from __future__ import annotations

import math
from collections.abc import Mapping

import control
import matplotlib.pyplot as plt
import numpy as np

from agents.controllers.controller import Controller, equipped
from agents.evaluation.colors import colors
from agents.evaluation.nonlinear import OFFSET
from agents.evaluation.rollout import Case, Rollout, leading
from design.style import style
from railenv import Model


def plot_histories(
    controllers: Mapping[str, Controller | None],
    model: Model,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    offset: float = OFFSET,
    duration: float = 5.0,
) -> control.ControlPlot:
    """Draw the motion of the leading wheelset and the first actuator's moment, with some controllers.

    Parameters
    ----------
    controllers : mapping of str to (Controller or None)
        None for the vehicle alone.
    model : Model
    speed, radius, cant : float
        m/s, m, rad.
    offset : float
        Lateral displacement of all bodies at the start, m.
    duration : float
        s.
    """
    vehicle = equipped(model)
    mount, limit, first = vehicle.equipment.mounts[0], vehicle.limits[0], leading(vehicle)
    moment = mount.state_names[0]
    chosen = colors(controllers)
    with style():
        figure, (above, below) = plt.subplots(2, 1, figsize=(7.0, 5.0), sharex=True)
        for name, controller in controllers.items():
            rollout = Rollout(vehicle, controller, [Case(speed, radius, cant, offset)])
            motion = rollout.run(duration, (first, moment))
            color = chosen[name]
            above.plot(motion.time, 1e3 * motion[first][:, 0], color=color, label=name, lw=1.4)
            limited = np.clip(motion[moment][:, 0], -limit, limit)
            below.plot(motion.time, 1e-3 * limited, color=color, lw=1.2)
        above.set_ylabel(f"{first} (mm)")
        below.set_ylabel("moment (kN m)" if mount.acts == "yaw" else "force (kN)")
        below.set_xlabel("time (s)")
        above.set_title(f"{vehicle.vehicle_name} at {speed:g} m/s from {1e3 * offset:g} mm off")
        above.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        axes = np.array([above, below], dtype=object)
        return control.ControlPlot(np.array([*above.lines, *below.lines], dtype=object), axes, figure)
