"""Models that compile once per session, and random operating points that reach every contact regime."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

import railenv

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Operation:
    """A state of a model with its inputs and running conditions."""

    x: Array
    u: Array
    speed: float
    curvature: float
    cant: float
    regime: str

    @property
    def conditions(self) -> dict[str, float]:
        """Running conditions as the keyword arguments of ``Model.rhs``."""
        return {"speed": self.speed, "curvature": self.curvature, "cant": self.cant}

    @property
    def arguments(self) -> tuple[list[float], list[float], float, float, float]:
        """Plain numbers for ``Model.plain_rhs``."""
        return self.x.tolist(), self.u.tolist(), self.speed, self.curvature, self.cant


REGIMES = ("tread", "flange", "one wheel lifted", "wheelset lifted", "sliding")

_DISPLACEMENT = {"y": 3e-3, "z": 2e-4, "phi": 5e-4, "psi": 1e-3}
_RATE = {"y": 2e-2, "z": 1e-2, "phi": 1e-2, "psi": 1e-2}
_INPUT = {"M": 1e4, "align": 1e-3, "vert": 2e-4, "cross": 5e-4}


def draw_operations(model: railenv.Model, count: int, seed: int) -> list[Operation]:
    """Draw random operating points of one of the package's models, one regime after the other.

    Vertical displacements scatter about 1 mm of compression of the rail, near which a loaded wheel is.
    """
    rng = np.random.default_rng(seed)
    flat = isinstance(model, railenv.CooperriderBogie)
    regimes = [r for r in REGIMES if not (flat and "lifted" in r)]
    points = []
    for k in range(count):
        regime = regimes[k % len(regimes)]
        x = np.empty(model.n_states)
        for i, name in enumerate(model.state_names):
            kind, body = name.split("_")
            table = _RATE if kind.startswith("d") else _DISPLACEMENT
            x[i] = table[kind.removeprefix("d")] * rng.uniform(-1.0, 1.0)
            x[i] -= 1e-3 * (kind == "z")
            if body == "b":
                continue
            sign = rng.choice([-1.0, 1.0])
            if regime == "flange" and kind == "y":
                x[i] = sign * rng.uniform(8.5e-3, 13e-3)
            elif regime == "one wheel lifted" and kind == "phi":
                x[i] = sign * rng.uniform(5e-3, 10e-3)
            elif regime == "wheelset lifted" and kind == "z":
                x[i] = rng.uniform(3e-3, 8e-3)
            elif regime == "sliding" and kind in ("dy", "dpsi"):
                x[i] = sign * rng.uniform(0.5, 3.0)
        u = np.array([_INPUT[n.split("_")[0]] * rng.uniform(-1.0, 1.0) for n in model.input_names])
        curvature, cant = (0.0, 0.0) if flat else (rng.uniform(-2e-3, 2e-3), rng.uniform(-0.15, 0.15))
        points.append(Operation(x, u, rng.uniform(3.0, 150.0), curvature, cant, regime))
    return points


@pytest.fixture(scope="session")
def operations() -> Callable[..., list[Operation]]:
    """Return :func:`draw_operations`."""
    return draw_operations


_MODELS = {
    "bogie-TABLE_1": lambda: railenv.Bogie(railenv.TABLE_1),
    "bogie-HIGH_SPEED_COACH": lambda: railenv.Bogie(
        railenv.HIGH_SPEED_COACH.replace(wheelbase_curving=True, secondary_longitudinal_damping=2e5)
    ),
    "dual_wheelset": lambda: railenv.DualWheelset(railenv.TABLE_1),
    "cooperrider": lambda: railenv.CooperriderBogie(),
}


@pytest.fixture(scope="session", params=_MODELS.values(), ids=_MODELS)
def any_model(request: pytest.FixtureRequest) -> railenv.Model:
    """Each of the package's models in turn."""
    return request.param()


@pytest.fixture(scope="session")
def bogie() -> railenv.Bogie:
    """Return the bogie of Table 1."""
    return railenv.Bogie(railenv.TABLE_1)


@pytest.fixture(scope="session")
def coach() -> railenv.Bogie:
    """Return the bogie of the high-speed coach."""
    return railenv.Bogie(railenv.HIGH_SPEED_COACH)


@pytest.fixture(scope="session")
def dual() -> railenv.DualWheelset:
    """Return the dual wheelset of Table 1."""
    return railenv.DualWheelset(railenv.TABLE_1)


@pytest.fixture(scope="session")
def cooperrider() -> railenv.CooperriderBogie:
    """Return the Cooperrider bogie."""
    return railenv.CooperriderBogie()
