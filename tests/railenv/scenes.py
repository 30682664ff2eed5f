"""Scenes for the tests of rendering."""

import numpy as np

from railenv.envs.rendering import History, Scene

DELTA = 0.00923


def make_history(seconds=2.0, actuators=1, amplitude=4e-3, dt=0.005):
    time = dt * np.arange(round(seconds / dt) + 1)
    phase = 2.0 * np.pi * 3.0 * time
    y = amplitude * np.column_stack([np.sin(phase), np.sin(phase - 1.0)])
    action = np.column_stack(
        [np.sin(phase + k) for k in range(actuators)] or [np.zeros((len(time), 0))]
    )
    return History(time, y, action)


def make_bodies(y=(0.0, 0.0), yaw=(0.0, 0.0), frame=True):
    bodies = np.zeros((3 if frame else 2, 4))
    bodies[:2, 0], bodies[:2, 3] = y, yaw
    if frame:
        bodies[2, 0] = np.mean(y)
    return bodies


def make_scene(**changes):
    values = {
        "time": 12.0,
        "speed": 85.0,
        "curvature": 0.0,
        "cant": 0.0,
        "critical_speed": None,
        "bodies": make_bodies(),
        "rail": np.zeros(2),
        "half_gauge": 0.7176,
        "half_wheelbase": 1.2,
        "wheel_radius": 0.4575,
        "flange_clearance": DELTA,
        "history": make_history(),
        "derailed": None,
    }
    values.update(changes)
    values.setdefault("equilibrium", np.zeros(np.shape(values["bodies"])))
    return Scene(**values)
