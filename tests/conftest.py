"""The package's models, and random operating points of theirs that reach every contact regime."""

from dataclasses import dataclass

import numpy as np
import pytest

import railenv


@dataclass(frozen=True)
class Operation:
    """A state of a model with its inputs and running conditions."""

    x: np.ndarray
    u: np.ndarray
    speed: float
    curvature: float
    cant: float
    regime: str

    @property
    def conditions(self):
        """Running conditions as the keyword arguments of ``Model.rhs``."""
        return {"speed": self.speed, "curvature": self.curvature, "cant": self.cant}

    @property
    def arguments(self):
        """Plain numbers for ``Model.plain_rhs``."""
        return self.x.tolist(), self.u.tolist(), self.speed, self.curvature, self.cant


REGIMES = ("tread", "flange", "one wheel lifted", "wheelset lifted", "sliding")

_DISPLACEMENT = {"s": 1e-3, "y": 3e-3, "z": 2e-4, "phi": 5e-4, "psi": 1e-3}
_RATE = {"y": 2e-2, "z": 1e-2, "phi": 1e-2, "psi": 1e-2}
_INPUT = {"M": 1e4, "align": 1e-3, "vert": 2e-4, "cross": 5e-4}


def draw_operations(model, count, seed):
    """Draw operating points of one of the package's own models, one regime after the other.

    Vertical displacements scatter about 1 mm of compression of the rail, near that of a loaded wheel.
    """
    rng = np.random.default_rng(seed)
    tangent_only = isinstance(model, railenv.CooperriderBogie)
    regimes = [r for r in REGIMES if not (tangent_only and "lifted" in r)]
    points = []
    for k in range(count):
        regime = regimes[k % len(regimes)]
        x = np.empty(model.n_states)
        for i, name in enumerate(model.state_names):
            kind, _, body = name.partition("_")
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
            elif regime == "sliding" and kind == "dy":
                x[i] = sign * rng.uniform(0.5, 3.0)
            elif regime == "sliding" and kind == "dpsi":  # as fast as the yaw damper's law is given
                x[i] = sign * rng.uniform(0.1, 0.4)
        u = np.array([_INPUT[n.split("_")[0]] * rng.uniform(-1.0, 1.0) for n in model.input_names])
        curvature, cant = rng.uniform(-2e-3, 2e-3), rng.uniform(-0.15, 0.15)
        if tangent_only:
            curvature = cant = 0.0
        points.append(Operation(x, u, rng.uniform(3.0, 150.0), curvature, cant, regime))
    return points


@pytest.fixture(scope="session")
def operations():
    return draw_operations


_MODELS = {
    "bogie-TABLE_1": lambda: railenv.Bogie(railenv.TABLE_1),
    # with what no shipped vehicle has switched on
    "bogie-coach": lambda: railenv.Bogie(
        railenv.HIGH_SPEED_COACH.replace(wheelbase_curving=True, secondary_longitudinal_damping=2e5)
    ),
    "dual_wheelset": lambda: railenv.DualWheelset(railenv.TABLE_1),
    "cooperrider": railenv.CooperriderBogie,
}


@pytest.fixture(scope="session", params=_MODELS.values(), ids=_MODELS)
def any_model(request):
    """Each of the package's models in turn."""
    return request.param()


@pytest.fixture(scope="session")
def bogie():
    return railenv.Bogie(railenv.TABLE_1)


@pytest.fixture(scope="session")
def coach():
    return railenv.Bogie(railenv.HIGH_SPEED_COACH)


@pytest.fixture(scope="session")
def dual():
    return railenv.DualWheelset(railenv.TABLE_1)


@pytest.fixture(scope="session")
def cooperrider():
    return railenv.CooperriderBogie()
