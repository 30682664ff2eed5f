"""Animated pictures of the environments."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from environment_cases import Case
from PIL import Image

FRAMES_PER_SECOND = 20
PICTURE = (640, 400)
COLOURS = 40
QUIET = 1.8  # s without action


def frames(case: Case, quiet: float = QUIET, controlled: float = 1.0) -> list[np.ndarray[Any, Any]]:
    """Return frames of a run that hunts without action and is controlled afterwards.

    Parameters
    ----------
    case : Case
    quiet, controlled : float
        s without and with control.
    """
    env = case.make(
        render_mode="rgb_array",
        duration=quiet + controlled,
        critical_speed=case.critical_speed,
    )
    env.reset(
        seed=0,
        options={"speed": case.speed, "radius": case.radius, "cant": case.cant, "offset": 0.003},
    )
    fleet = env.fleet
    model = fleet.model
    names = [f"{case.against}_{body}" for body in model.equipment.actuated]
    yaw = [model.plant.state_names.index(name) for name in names]
    every = round(1.0 / (FRAMES_PER_SECOND * env.settings.control_period))
    pictures = []
    for k in range(env.settings.steps):
        if k % every == 0:
            pictures.append(np.asarray(env.render()))
        turn = fleet.state(0)[yaw] - fleet.equilibrium(0)[yaw]
        action = -case.gain * turn * (k * env.settings.control_period >= quiet)
        env.step(np.clip(action, -1.0, 1.0))
    env.close()
    return pictures


def write_picture(pictures: Sequence[np.ndarray[Any, Any]], path: Path) -> None:
    """Write frames as an animated WebP with one palette for all, which loses nothing of it."""
    images = [Image.fromarray(p).resize(PICTURE, Image.Resampling.LANCZOS) for p in pictures]
    sample = Image.new("RGB", (PICTURE[0], 3 * PICTURE[1]))
    for row, k in enumerate((0, len(images) // 2, len(images) - 1)):
        sample.paste(images[k], (0, row * PICTURE[1]))
    palette = sample.quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    quantized = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    reduced = [image.convert("RGB") for image in quantized]
    reduced[0].save(
        path,
        save_all=True,
        append_images=reduced[1:],
        duration=math.floor(1000 / FRAMES_PER_SECOND),
        loop=0,
        lossless=True,
        method=6,
    )
