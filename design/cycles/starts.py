"""Starts of branches of limit cycles: the motions that leave a Hopf point or another branch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from design.cycles.cycle import CycleError, SpecialPoint
from design.cycles.multipliers import direction_of
from design.cycles.shooting import Shooting
from design.stability.loss import CriticalSpeed
from design.stability.mode_shape import displacement_rows

Array = NDArray[np.float64]

_SAME_MODE = 1e-3  # of an eigenvalue: those of tables jump a little where their cells meet
_MOVES = 1e-9  # of the largest part of a mode: less does not count as motion
_DOUBLED = 1e-3  # of the distance along the direction: least difference of the motions of two periods


@dataclass(frozen=True)
class Start:
    """A motion, or an equilibrium, and the direction in which a branch leaves it.

    Attributes
    ----------
    motion : ndarray, shape (steps + 1, n_states)
        The motion over a period of the branch.
    direction : ndarray, shape (steps + 1, n_states)
        Its change along the branch, with the first row about 1 in units of the model's scale; only that
        row has to be exact.
    period : float
        s.
    value : float
        Value of the parameter.
    kind : str
        Kind of the point that it leaves.
    """

    motion: Array
    direction: Array
    period: float
    value: float
    kind: str

    def left_by(self, states: Array) -> bool:
        """Return whether a motion found belongs to the new branch, not to the one that it leaves."""
        if self.kind == "period doubling":
            half = (len(states) - 1) // 2
            gap = np.abs(states[half] - states[0]).max()
            return bool(gap > _DOUBLED * np.abs(self.direction[0]).max())
        return True


def hopf_start(shooting: Shooting, hopf: CriticalSpeed) -> Start:
    """Return the equilibrium of a Hopf point, and its mode."""
    assert hopf.speed is not None
    assert hopf.state is not None
    assert hopf.frequency is not None
    mode = -1j * hopf_mode(shooting, hopf)  # so that it starts at zero displacements, off the flange
    turn = np.exp(2j * np.pi * np.linspace(0.0, 1.0, shooting.steps + 1))
    motion = np.tile(hopf.state, (shooting.steps + 1, 1))
    return Start(motion, (turn[:, None] * mode).real, 1.0 / hopf.frequency, hopf.speed, "Hopf")


def switch_start(shooting: Shooting, point: SpecialPoint) -> Start:
    """Return the motion of a branch point, and the direction in which the other branch leaves it.

    Parameters
    ----------
    shooting : Shooting
        Shooting with the steps of a period of the original branch.
    point : SpecialPoint
        A period doubling, symmetry breaking or branch point.

    Raises
    ------
    CycleError
        If no branch of periodic motions leaves such a point.
    """
    if point.kind not in ("period doubling", "symmetry breaking", "branch point"):
        raise CycleError(
            f"start is a {point.kind} at {point.value:.6g}; branches of periodic motions leave Hopf "
            "points, period doublings, symmetry breakings and branch points"
        )
    cycle = point.cycle
    direction = direction_of(shooting, cycle, point.multiplier).real
    scale = shooting.setting.model.scale
    shape = direction / scale
    direction = direction / shape[np.argmax(np.abs(shape))]
    times = 2 if point.kind == "period doubling" else 1
    motion = np.concatenate([cycle.states[:-1]] * times + [cycle.states[-1:]])
    sign = np.repeat([(-1.0) ** k for k in range(times)], len(cycle.states) - 1)
    along = np.append(sign, 1.0)[:, None] * direction
    return Start(motion, along, times * cycle.period, cycle.value, point.kind)


def hopf_mode(shooting: Shooting, hopf: CriticalSpeed) -> NDArray[np.complex128]:
    """Return the critical mode, its largest displacement 1 in units of the model's scale.

    Where the model has uncoupled, identical parts (the two wheelsets of the dual wheelset), the
    eigenvalue is multiple and its modes are not unique: all such parts then move in phase with equal
    amplitude.
    """
    assert hopf.mode is not None
    assert hopf.state is not None
    assert hopf.eigenvalue is not None
    model = shooting.setting.model
    A, _ = model.jacobian(
        hopf.state,
        shooting.setting.inputs,
        speed=float(hopf.speed or 0.0),
        curvature=shooting.setting.curvature,
        cant=shooting.setting.cant,
    )
    mode = np.zeros(model.n_states, dtype=complex)
    everything = np.tile(np.arange(model.n_states, dtype=float), (2, 1))
    everything[1] += model.scale  # every part moves
    rows = displacement_rows(model)
    for part in shooting.parts(everything):
        values, vectors = np.linalg.eig(A[np.ix_(part, part)])
        k = int(np.argmin(np.abs(values - hopf.eigenvalue)))
        if abs(values[k] - hopf.eigenvalue) > _SAME_MODE * abs(hopf.eigenvalue):
            continue
        shape = vectors[:, k] / model.scale[part]
        displacements = shape[np.isin(part, rows)]
        moves = np.abs(displacements).max(initial=0.0) > _MOVES * np.abs(shape).max()
        moving = displacements if moves else shape
        mode[part] = vectors[:, k] / moving[np.argmax(np.abs(moving))]
    return mode
