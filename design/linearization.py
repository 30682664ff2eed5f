"""Linear models of a vehicle about its running equilibrium, with named signals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import control
import numpy as np
from numpy.typing import ArrayLike

from design.equilibrium import equilibrium
from railenv import checks
from railenv.models import Model


def linearize(
    model: Model,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    state: ArrayLike | None = None,
    outputs: Sequence[str] | None = None,
) -> control.StateSpace:
    """Linearise a model about a state, by its exact Jacobian.

    Parameters
    ----------
    model : Model
    speed : float
        Forward speed, m/s.
    radius : float
        Curve radius, m; ``math.inf`` is tangent track, negative the other hand.
    cant : float
        Cant angle, rad.
    state : array_like, shape (n_states,), optional
        State to linearise about; the running equilibrium when left out.
    outputs : sequence of str, optional
        States to return as outputs; all when left out.

    Returns
    -------
    control.StateSpace
        Deviations from the state; inputs, states and outputs carry the model's names.

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium.
    UnknownNameError
        If an output is not a state.
    """
    names = model.state_names
    chosen = names if outputs is None else tuple(outputs)
    checks.known("output", chosen, names)
    if state is None:
        state = equilibrium(model, speed=speed, radius=radius, cant=cant).states
    A, B = model.jacobian(state, speed=speed, curvature=checks.curvature(radius), cant=cant)
    C = np.eye(len(names))[[names.index(name) for name in chosen]]
    return control.ss(
        A,
        B,
        C,
        np.zeros((len(chosen), model.n_inputs)),
        inputs=list(model.input_names),
        states=list(names),
        outputs=list(chosen),
        name=f"{model.name}_linearized",
    )
