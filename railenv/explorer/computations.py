"""Results of the page from its state: the package's own analyses, each in one function."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import control
import numpy as np
from numpy.typing import NDArray

import design
import railenv
from agents.evaluation.diagram import closed_loop_diagram
from agents.evaluation.rollout import Case, Rollout
from design.cycles.branch import ABOVE_HOPF
from design.loop.feedback import Feedback
from design.stability.critical_speed import SPEED_RANGE
from design.stability.mode_shape import ModeShape
from railenv import Equipped, Model, ProfileFamily, ProfilePair
from railenv.contact.laws import ContactLaw, LinearContact
from railenv.contact.pair_picture import PairPicture, furthest_shift, picture
from railenv.errors import ParameterError, SimulationError
from railenv.explorer.steps import DIAGRAM_OFFSETS, PIECE, POINTS, SPEEDS, diagram_speeds

if TYPE_CHECKING:
    from design.stability.modes import Modes
    from railenv.explorer.state import State

Array = NDArray[np.float64]

AMPLITUDE = 3e-3
"""Amplitude (m) of the equivalent conicity in standards."""

_SHIFTS = 241  # of contact curves
_AMPLITUDES = np.linspace(5e-4, 8e-3, 31)  # m
_WIDEST = 0.010  # m, of the shifts of laws without profiles
_PICTURE_POINTS = 400  # of each profile
_SETTLED = 1.0  # s at the end, over which the amplitude is taken


@dataclass(frozen=True)
class Stability:
    """Eigenvalues over speed, and the end of steady running.

    Attributes
    ----------
    model : Model
    locus : SpeedLocus
    """

    model: Model
    locus: design.SpeedLocus

    @property
    def critical(self) -> design.CriticalSpeed:
        """Speed and kind of the loss of stability."""
        return self.locus.critical


@dataclass(frozen=True)
class Present:
    """Modes at the present speed.

    Attributes
    ----------
    speed : float
        m/s.
    modes : Modes
    shape : ModeShape
        The least damped one.
    """

    speed: float
    modes: Modes
    shape: ModeShape


@dataclass(frozen=True)
class Motion:
    """The motion from a lateral offset of all bodies.

    Attributes
    ----------
    response : control.TimeResponseData
    spectrum : Spectrum or None
        Spectrum of the leading wheelset; None if the motion is too short for one.
    wheelsets : tuple of str
        Lateral displacements of the wheelsets, the leading one first.
    clearance : float or None
        Clearance up to the flange, m.
    amplitude : float
        Amplitude of the leading wheelset in the last second, m.
    note : str
        Notable event during the motion; empty if none.
    """

    response: control.TimeResponseData
    spectrum: design.Spectrum | None
    wheelsets: tuple[str, ...]
    clearance: float | None
    amplitude: float
    note: str

    def __getitem__(self, name: str) -> Array:
        """Return one state over time."""
        return np.asarray(self.response.outputs)[list(self.response.output_labels).index(name)]


@dataclass(frozen=True)
class ContactCurves:
    """Contact of the wheels with the rails.

    Attributes
    ----------
    title : str
    shift : ndarray
        Shift of the wheelset to the left, m.
    radius_difference : ndarray
        Left minus right rolling radius, m.
    angles : ndarray, shape (2, n)
        rad, contact angle of the left and of the right wheel against the axle.
    amplitude, conicity, harmonic : ndarray
        m; equivalent conicity by EN 15302 and by harmonic linearisation.
    linear : LinearContact
        At 3 mm.
    clearance : float
        Clearance up to the flange, m; infinite if there is no flange.
    picture : PairPicture or None
        Of profiles.
    """

    title: str
    shift: Array
    radius_difference: Array
    angles: Array
    amplitude: Array
    conicity: Array
    harmonic: Array
    linear: LinearContact
    clearance: float
    picture: PairPicture | None

    @property
    def at_bound(self) -> float:
        """Equivalent conicity at the amplitude of the standards."""
        return float(np.interp(AMPLITUDE, self.amplitude, self.conicity))


def stability(state: State) -> Stability:
    """Return eigenvalues over the range of speed and the critical speed.

    Raises
    ------
    RailenvError
        If there is no running equilibrium at the lowest speeds, or the vehicle is impossible.
    """
    model, controller = state.model(), _feedback(state)
    low, high = state.speed_range
    speeds = np.linspace(low, high, SPEEDS)
    locus = design.speed_locus(
        model, speeds, radius=state.radius, cant=state.cant, controller=controller
    )
    return Stability(model, locus)


def present(state: State, found: Stability) -> Present:
    """Return the modes at the present speed.

    Raises
    ------
    ParameterError
        If there is no longer a running equilibrium at that speed.
    """
    locus = found.locus
    last = float(locus.speeds[-1])
    if locus.ended is not None and state.speed > last:
        raise ParameterError(
            f"there is no running equilibrium at {state.speed:g} m/s; it was found up to {last:.4g} m/s"
        )
    modes = locus.at(state.speed)
    k = modes.least_damped
    where = f"speed = {locus.written(state.speed)}"
    shape = ModeShape.of(found.model, modes.vectors[:, k], complex(modes.eigenvalues[k]), where)
    return Present(state.speed, modes, shape)


def motion(state: State) -> Motion:
    """Return the motion from the lateral offset, and its spectrum.

    Raises
    ------
    RailenvError
        If there is no running equilibrium to start from.
    """
    model = state.model()
    response, note = _controlled(state, model) if state.controller else _alone(state, model)
    guided = sorted(model.guided, key=lambda w: -w.x)
    names = tuple(w.y for w in guided) or model.state_names[:1]
    leading = np.asarray(response.outputs)[list(response.output_labels).index(names[0])]
    last = np.asarray(response.time) >= response.time[-1] - _SETTLED
    found = None if len(leading) < 50 else design.spectrum(response, names[0])
    amplitude = float(np.ptp(leading[last])) / 2.0
    return Motion(response, found, names, model.flange_clearance, amplitude, note)


def _alone(state: State, model: Model) -> tuple[control.TimeResponseData, str]:
    try:
        response = railenv.simulate(
            model,
            speed=state.speed,
            radius=state.radius,
            cant=state.cant,
            duration=state.duration,
            perturbation=dict.fromkeys(model.lateral_states, state.offset),
        )
    except SimulationError as error:
        response = error.response
        if response is None or len(response.time) < 2:
            raise
        return response, f"the motion diverges after {response.time[-1]:.2f} s"
    return response, ""


def _controlled(state: State, model: Model) -> tuple[control.TimeResponseData, str]:
    """Return the motion under the controller, with ideal readings, on a smooth track."""
    assert isinstance(model, Equipped)
    case = Case(state.speed, radius=state.radius, cant=state.cant, offset=state.offset)
    moved = Rollout(model, state.feedback(), [case]).run(state.duration, model.state_names)
    response = control.TimeResponseData(
        moved.time, moved.states[:, 0].T, output_labels=list(moved.names), issiso=False
    )
    return response, "a wheel derails on the way" if moved.derailed[0] else ""


def contact(state: State) -> ContactCurves | None:
    """Return the contact of the wheels with the rails; None if the parts of an assembly define it."""
    law = state.law
    if law is None:
        return None
    clearance = law.flange_clearance
    if clearance is None:
        clearance = state.vehicle_shown.flange_clearance  # type: ignore[union-attr]
    return _curves(law, float(clearance))


def _curves(law: ContactLaw, clearance: float) -> ContactCurves:
    shown = None
    if isinstance(law, ProfilePair):
        furthest = furthest_shift(law)
        shown = picture(law, furthest, _PICTURE_POINTS)
        title = str(law)
    elif isinstance(law, ProfileFamily):
        furthest = min(furthest_shift(law.new), furthest_shift(law.worn))
        nearest = law.new if law.at < 0.5 else law.worn
        shown = picture(nearest, furthest_shift(nearest), _PICTURE_POINTS)
        title = f"{law.new}, wear {law.at:g}; drawn is the {'new' if law.at < 0.5 else 'worn'} wheel"
    else:
        furthest = min(_WIDEST, clearance)
        values = (f"{n.replace('_', ' ')} {getattr(law, n):g}" for n in law.number_fields())
        title = f"{law.called}, {', '.join(values)}"
    shift = np.linspace(-furthest, furthest, _SHIFTS)
    radius, slope = _touch(law, shift)
    difference = radius - radius[::-1]
    amplitude = _AMPLITUDES[furthest >= _AMPLITUDES]
    angles = np.arctan(np.stack([slope, slope[::-1]]))
    en = railenv.equivalent_conicity(shift, difference, amplitude)
    harmonic = railenv.equivalent_conicity(shift, difference, amplitude, "harmonic")
    linear = law.linear(AMPLITUDE)
    return ContactCurves(
        title, shift, difference, angles, amplitude, en, harmonic, linear, clearance, shown
    )


def _touch(law: ContactLaw, shift: Array) -> tuple[Array, Array]:
    """Return rolling radius (m) and tangent of the contact angle over the shift of a wheel (m)."""
    if isinstance(law, ProfilePair):
        return law.radius(shift), np.tan(law.angle(shift))
    if isinstance(law, ProfileFamily):
        (r0, s0), (r1, s1) = _touch(law.new, shift), _touch(law.worn, shift)
        return r0 + law.at * (r1 - r0), s0 + law.at * (s1 - s0)
    touches = [law.law.touch(law, eta) for eta in shift.tolist()]
    return np.array([t.radius for t in touches]), np.array([t.slope for t in touches], dtype=float)


# ------------------------------------------------------------------------- limit cycles


@dataclass(frozen=True)
class Diagram:
    """Limit cycles so far.

    Attributes
    ----------
    state : State
    branch : CycleBranch or None
        Of a vehicle without controller.
    simulated : tuple of ClosedLoopDiagram
        Of a closed loop: one for each speed.
    share : float
        Share of the largest amount of work that is done.
    said : str
    """

    state: State
    branch: design.CycleBranch | None
    simulated: tuple[Any, ...]
    share: float
    said: str


def diagram(state: State, found: Stability | None = None) -> Iterator[Diagram]:
    """Yield the bifurcation diagram as it grows.

    Without a controller this is the branch of limit cycles from the Hopf point, through its fold; for
    a closed loop, the final amplitudes of simulations.

    Raises
    ------
    RailenvError
        If there is no Hopf point, or no motion near it.
    """
    if state.controller is not None:
        yield from _simulated(state)
        return
    found = stability(state) if found is None else found
    critical = found.critical
    limits = (SPEED_RANGE[0], ABOVE_HOPF * (critical.speed or SPEED_RANGE[1]))
    where: Any = {"radius": state.radius, "cant": state.cant}
    branch = design.cycle_branch(
        found.model, start=critical, points=PIECE, parameter_range=limits, **where
    )
    yield _followed(state, branch)
    while branch.goes_on and len(branch) < POINTS:
        branch = design.cycle_branch(resume=branch, points=len(branch) + PIECE, parameter_range=limits)
        yield _followed(state, branch)


def same_diagram(one: State, other: State) -> bool:
    """Return whether two states have the same diagram: speed and motion do not affect it."""
    fixed: dict[str, Any] = {"offset": 0.0, "duration": 1.0}
    speeds = one.speed_range
    return replace(one, speed=speeds[0], **fixed) == replace(
        other.with_speed_range(*speeds), speed=speeds[0], **fixed
    ) and (one.controller is None or one.speed_range == other.speed_range)


def _followed(state: State, branch: design.CycleBranch) -> Diagram:
    """Return the diagram with the present part of a branch."""
    going = branch.goes_on and len(branch) < POINTS
    last = branch.cycles[-1]
    at = f"{len(branch)} limit cycles, now at {last.speed:.1f} m/s"
    said = at if going else f"{branch}; {branch.ended}"
    return Diagram(state, branch, (), len(branch) / POINTS if going else 1.0, said)


def _simulated(state: State) -> Iterator[Diagram]:
    """Yield the final amplitudes of simulations of the closed loop, speed by speed."""
    model, controller = state.model(), state.feedback()
    assert controller is not None
    parts: list[Any] = []
    speeds = diagram_speeds(state)
    for k, speed in enumerate(speeds, 1):
        parts.append(
            closed_loop_diagram(
                controller,
                model,
                [speed],
                offsets=DIAGRAM_OFFSETS,
                radius=state.radius,
                cant=state.cant,
            )
        )
        said = f"simulated at {k} of {len(speeds)} speeds"
        yield Diagram(state, None, tuple(parts), k / len(speeds), said)


def _feedback(state: State) -> Any:
    controller = state.feedback()
    if controller is not None and not isinstance(controller, Feedback):
        raise ParameterError(f"controller {state.controller!r} has no linearisation")
    return controller
