"""Readings of a vehicle's instruments during a run: wheel forces, accelerations of bodies."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from railenv import checks, mounting
from railenv.equations.coordinates import AT_REST, Running, Site, at_site, site_names
from railenv.equations.sensors import specific_force
from railenv.equilibrium import find_equilibrium
from railenv.equipment import Equipped
from railenv.errors import ParameterError
from railenv.model import Model

if TYPE_CHECKING:
    import control

Array = NDArray[np.float64]

FARTHEST = 0.03
"""A wheelset further than this (m) from the middle of its track has left it."""

_CREEPING = 5.0  # m/s, at which the static wheel loads are read
_CONDITIONS = ("speed", "curvature", "cant")


@dataclass(frozen=True)
class Place:
    """The place of an accelerometer on a body, from its centre of mass (m forward, m up)."""

    body: str
    where: str
    x: float
    z: float


class Readings:
    """A run as its instruments saw it.

    Parameters
    ----------
    model : Model
        What was simulated.
    response : control.TimeResponseData
        What :func:`railenv.simulate` returned for it.

    Attributes
    ----------
    period : float
        s between samples.
    distance, speed, curvature, cant : ndarray, shape (samples,)
        m, m/s, 1/m, rad.
    wheelsets : tuple of str
        Wheelsets whose forces the equations give.
    Y, Q : ndarray, shape (wheelsets, 2, samples)
        Guiding force and load (N) of the left and right wheel.

    Raises
    ------
    ParameterError
        If the response is not one of the model, or its motion left the track.
    """

    def __init__(self, model: Model, response: control.TimeResponseData) -> None:
        self.model = model
        self.plant = model.plant if isinstance(model, Equipped) else model
        _check_names(model, response)
        self.time = np.asarray(response.time, dtype=float)
        self.period = _period(self.time)
        self._x = np.asarray(response.states, dtype=float)
        rows = dict(zip(response.input_labels, np.asarray(response.inputs, dtype=float), strict=True))
        self._u = np.array([rows[name] for name in model.input_names])
        self._u = self._u.reshape(model.n_inputs, len(self.time))
        self.speed, self.curvature, self.cant = (rows[name] for name in _CONDITIONS)
        # only a run on a varying track gives its course at the bodies' places
        still = np.zeros(len(self.time))
        self._sites = {name: rows.get(name, still) for name in self.plant.site_names}
        steps = np.diff(self.time) * (self.speed[1:] + self.speed[:-1]) / 2.0
        self.distance = np.concatenate([[0.0], np.cumsum(steps)])
        self._check_on_track(rows)
        self.wheelsets = mounting.wheelsets_with_forces(self.plant)
        forces, self._rates = self._evaluated()
        self.Y, self.Q = forces[:, :, 0], forces[:, :, 1]

    def _check_on_track(self, rows: dict[str, Array]) -> None:
        """Raise unless the motion stays finite and the wheelsets stay on their track."""
        finite = np.isfinite(self._x).all(axis=0)
        if not finite.all():
            at = float(self.time[np.argmin(finite)])
            raise ParameterError(f"states of the response are not finite from {at:g} s on; it diverged")
        for wheelset in self.model.guided:
            y = self._x[self.model.state_names.index(wheelset.y)]
            if wheelset.rails:
                y = y - rows[wheelset.rails[0]]
            off = np.flatnonzero(np.abs(y) > FARTHEST)
            if off.size:
                raise ParameterError(
                    f"{wheelset.name} is {1e3 * y[off[0]]:.3g} mm off the middle of the track at "
                    f"{self.distance[off[0]]:.4g} m; beyond {1e3 * FARTHEST:g} mm the vehicle has "
                    "derailed or the motion diverged, and there is nothing to assess"
                )

    def _evaluated(self) -> tuple[Array, Array]:
        """Return forces of the wheels and rates of the states at all samples."""
        samples = len(self.time)
        forces = np.zeros((len(self.wheelsets), 2, 2, samples))
        rates = np.empty((self.model.n_states, samples))
        evaluator = self.model.evaluator()
        carrier = self._carrier().evaluator() if self.wheelsets else None
        first = len(self.model.sensed) if isinstance(self.model, Equipped) else 0
        sites = np.array([*self._sites.values()]).reshape(len(self._sites), samples)
        for k in range(samples):
            conditions = (self.speed[k], self.curvature[k], self.cant[k])
            at = (self._x[:, k], *conditions, self._u[:, k], sites[:, k] if self._sites else 0.0)
            evaluator.set(*at)
            rates[:, k] = evaluator.rhs()
            if carrier is not None:
                carrier.set(*at)
                forces[..., k] = carrier.signals()[first:].reshape(-1, 2, 2)
        if not (np.isfinite(forces).all() and np.isfinite(rates).all()):
            raise ParameterError("forces of the response are not finite; the motion diverged")
        return forces, rates

    def _carrier(self) -> Equipped:
        """Return the model with the forces of its wheels among its signals."""
        if isinstance(self.model, Equipped):
            return self.model
        return Equipped(self.model, "none", sensed=())

    # ------------------------------------------------------------------------ loads

    def static_loads(self) -> Array:
        """Return the load (N) of each wheel at rest, shape (wheelsets, 2)."""
        carrier = self._carrier()
        state = find_equilibrium(self.plant, speed=_CREEPING).state
        whole = carrier.steady_state(state, speed=_CREEPING, curvature=0.0, cant=0.0)
        forces = carrier.signals(whole, speed=_CREEPING)[len(carrier.sensed) :]
        return np.asarray(forces.reshape(-1, 2, 2)[:, :, 1])

    def bogie_mass(self, frame: str) -> float | None:
        """Return the mass (kg) of a frame and its wheelsets; None if the equations do not give it."""
        assembly = mounting.assembly_of(self.plant)
        if assembly is None:
            return None
        vehicle = assembly.with_numbers({**self.plant.parameters, **self.plant.tables})
        own = [frame, *mounting.joined(self.plant, frame, self.plant_wheelsets)]
        return float(sum(vehicle.body(name).mass for name in own))

    # ---------------------------------------------------------------- accelerations

    @property
    def plant_wheelsets(self) -> tuple[str, ...]:
        """All wheelsets."""
        return tuple(wheelset.name for wheelset in self.model.guided)

    def on_frames(self) -> list[Place]:
        """Return the places above the axle boxes, on the frames at the height of their centres.

        In a user's own equations it is the middle of each body that is not a wheelset.
        """
        at = self._places()
        found = []
        for frame in mounting.frames(self.plant):
            below = mounting.joined(self.plant, frame, self.plant_wheelsets)
            found += [Place(frame, f"{frame} above {w}", at[w][0] - at[frame][0], 0.0) for w in below]
            if not below:  # a user's own equations do not say which wheelsets it stands on
                found.append(Place(frame, frame, 0.0, 0.0))
        return [place for place in found if "dy" in self.model.body_states[place.body]]

    def on_bodies(self, floor_height: float | None) -> list[Place]:
        """Return the places on the floor of bodies above frames: above each frame, and in the middle.

        ``floor_height`` (m) is from the axles; that of the body's centre of mass when left out.
        """
        frames, at = mounting.frames(self.plant), self._places()
        found = []
        for body in self.plant.body_names:
            below = mounting.joined(self.plant, body, frames)
            if not below or body in frames or body in self.plant_wheelsets:
                continue
            x, height = at[body]
            z = 0.0 if floor_height is None else floor_height - height
            found += [Place(body, f"{body} above {frame}", at[frame][0] - x, z) for frame in below]
            middle = sum(at[frame][0] for frame in below) / len(below)
            if len(below) > 1:
                found.append(Place(body, f"{body} in the middle", middle - x, z))
        return found

    def _places(self) -> dict[str, tuple[float, float]]:
        equations: Any = self.plant.equations
        values = SimpleNamespace(**self.plant.parameters, **self.plant.tables)
        return {name: (float(x), float(z)) for name, (x, z) in equations.places(values).items()}

    def lateral(self, place: Place) -> Array:
        """Return the reading (m/s^2) of a lateral accelerometer, with its share of gravity."""
        rates, body = self._rate, place.body
        run = self._running(body)
        # the track turns ever faster into a curve, and the coordinate is measured from it
        turned = rates(body, "dpsi") - self.speed**2 * run.curvature_slope
        moved = rates(body, "dy") + place.x * turned - place.z * rates(body, "dphi")
        rolled = AT_REST._replace(phi=self._state(body, "phi"))
        return np.asarray(specific_force(moved, rolled, run, self.plant.gravity))

    def vertical(self, place: Place) -> Array:
        """Return the vertical acceleration (m/s^2) of a place in space, without gravity."""
        run = self._running(place.body)
        frame = self.speed**2 * run.curvature * run.cant  # of the canted track itself
        return frame + self._rate(place.body, "dz") - place.x * self._rate(place.body, "dtheta")

    def _running(self, body: str) -> Running:
        """Return the running conditions at a body's own place, at all samples."""
        run = Running(self.speed, self.curvature, self.cant)
        own = site_names([body])
        if not set(own) <= set(self._sites):
            return run
        return at_site(run, Site(*(self._sites[name] for name in own)))

    def _rate(self, body: str, name: str) -> Array:
        state = self.model.body_states[body].get(name)
        return np.zeros(len(self.time)) if state is None else self._rates[self._row(state)]

    def _state(self, body: str, name: str) -> Array:
        state = self.model.body_states[body].get(name)
        return np.zeros(len(self.time)) if state is None else self._x[self._row(state)]

    def _row(self, state: str) -> int:
        return self.model.state_names.index(state)


def _check_names(model: Model, response: control.TimeResponseData) -> None:
    """Raise unless a response has the states, inputs and conditions of a model."""
    if not isinstance(model, Model):
        raise ParameterError(f"model is {model!r}; it must be a railenv.Model")
    states, inputs = (getattr(response, f"{kind}_labels", None) for kind in ("state", "input"))
    if states is None or inputs is None or list(states) != list(model.state_names):
        raise ParameterError(
            f"response has not the states of {model.name}; it must be what railenv.simulate returns "
            "for this model"
        )
    if np.ndim(response.states) != 2 or np.ndim(response.inputs) != 2:
        raise ParameterError("response has several traces; it must be what railenv.simulate returns")
    checks.known("input of the model in response", [*model.input_names, *_CONDITIONS], list(inputs))


def _period(time: Array) -> float:
    """Return the interval (s) of samples, which must be uniform."""
    if len(time) < 2:
        raise ParameterError(f"response has {len(time)} samples; there must be some seconds of them")
    period = float((time[-1] - time[0]) / (len(time) - 1))
    if np.abs(np.diff(time) - period).max() > 1e-6 * period:
        raise ParameterError("samples of the response are not at equal intervals; filters need that")
    return period
