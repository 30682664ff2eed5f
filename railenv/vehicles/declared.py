"""Bodies declared for a user's own equations, with the states of their motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from railenv import checks
from railenv.equations.coordinates import (
    AT_REST,
    COORDINATES,
    GROUND,
    Motion,
    Running,
    Wrench,
)
from railenv.equations.functions import Scalar
from railenv.errors import ParameterError, shown
from railenv.fields import Number
from railenv.vehicles.elements import GRAVITY
from railenv.vehicles.expressions import evaluate

_GUIDED = ("flange_clearance", "half_gauge", "wheel_radius", "conicity")


@dataclass(frozen=True, kw_only=True)
class MovingBody:
    """A body in your own equations: its states, and the inputs that act on it.

    Numbers may be texts that compute them from the model's parameters (``"clearance"``).

    Attributes
    ----------
    name : str
    y, z, phi, theta, psi : str, optional
        States that are its coordinates.
    dy, dz, dphi, dtheta, dpsi : str, optional
        States that are their rates; ``d`` before the coordinate's name when left out.
    lateral_force, yaw_moment : str, optional
        Inputs that act at its centre of mass (N, N m); actuators need them.
    reacts_on : str
        Body on which these inputs react in the equations; the ground, unless another is named.
    x : float or str
        Place along the vehicle, m.
    flange_clearance, half_gauge, wheel_radius, conicity : float or str, optional
        Of a wheelset (m, m, m, 1), for the measures of hunting in environments. All, or none.

    Raises
    ------
    ParameterError
        If it has no coordinates, or only some of a wheelset's numbers.
    """

    name: str
    y: str | None = None
    z: str | None = None
    phi: str | None = None
    theta: str | None = None
    psi: str | None = None
    dy: str | None = None
    dz: str | None = None
    dphi: str | None = None
    dtheta: str | None = None
    dpsi: str | None = None
    lateral_force: str | None = None
    yaw_moment: str | None = None
    reacts_on: str = GROUND
    x: Number = 0.0
    flange_clearance: Number = None
    half_gauge: Number = None
    wheel_radius: Number = None
    conicity: Number = None

    def __post_init__(self) -> None:
        name: Any = self.name
        if not (isinstance(name, str) and name.isidentifier()):
            raise ParameterError(f"name of a body is {shown(name)}; it must be a word")
        for c in COORDINATES:
            state = getattr(self, c)
            if state is not None and getattr(self, f"d{c}") is None:
                object.__setattr__(self, f"d{c}", f"d{state}")
        if not self.states:
            raise ParameterError(f"body {self.name} has no coordinates; say which states they are")
        given = [n for n in _GUIDED if getattr(self, n) is not None]
        if given and (len(given) < len(_GUIDED) or "y" not in self.states or "psi" not in self.states):
            raise ParameterError(
                f"body {self.name} has {', '.join(given)}; a wheelset needs y, psi and "
                f"{', '.join(_GUIDED)}"
            )

    @property
    def states(self) -> dict[str, str]:
        """State of each coordinate and rate."""
        names = [*COORDINATES, *(f"d{c}" for c in COORDINATES)]
        given = {n: getattr(self, n) for n in names}
        return {n: s for n, s in given.items() if s is not None and getattr(self, n.removeprefix("d"))}

    @property
    def is_wheelset(self) -> bool:
        """Whether the body is guided by rails."""
        return self.flange_clearance is not None

    def number(self, field: str, values: Mapping[str, float]) -> float:
        """Return a number of the body with the model's parameters."""
        value = getattr(self, field)
        if isinstance(value, str):
            value = evaluate(value, values)
        low: dict[str, Any] = {} if field == "x" else {"low": 0.0, "open_low": True}
        return checks.number(f"{field} of {self.name}", value, **low)

    def check(self, states: Sequence[str], inputs: Sequence[str], values: Mapping[str, float]) -> None:
        """Raise unless the states, inputs and parameters that the body names exist."""
        checks.known(f"state of body {self.name}", self.states.values(), states)
        named = [n for n in (self.lateral_force, self.yaw_moment) if n is not None]
        checks.known(f"input of body {self.name}", named, inputs)
        for field in ("x", *(_GUIDED if self.is_wheelset else ())):
            self.number(field, values)


@dataclass(frozen=True)
class DeclaredEquations:
    """A user's own equations with their declared bodies, for equipment.

    Attributes
    ----------
    equations : callable
    states, inputs : tuple of str
    bodies : tuple of MovingBody
    """

    equations: Callable[..., Sequence[Scalar]]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    bodies: tuple[MovingBody, ...]

    def __call__(self, *arguments: Any) -> list[Scalar]:
        """Return the time derivatives of the states."""
        return list(self.equations(*arguments))

    def driven(
        self,
        x: Sequence[Scalar],
        u: Sequence[Scalar],
        run: Running,
        p: Scalar,
        wrenches: Mapping[str, Sequence[Wrench]],
    ) -> list[Scalar]:
        """Return time derivatives of the states, with further wrenches on the bodies."""
        inputs = list(u)
        by_name = {body.name: body for body in self.bodies}
        for name, acting in wrenches.items():
            for wrench in acting:
                body: MovingBody | None = by_name[name]
                while body is not None:  # reactions on another body in the equations are undone there
                    self._add(inputs, body.lateral_force, wrench.force_y)
                    self._add(inputs, body.yaw_moment, wrench.yaw)
                    body = by_name.get(body.reacts_on)
        return list(self.equations(x, inputs, run.speed, run.curvature, run.cant, p))

    def _add(self, inputs: list[Scalar], name: str | None, value: Scalar) -> None:
        if name is not None:
            k = self.inputs.index(name)
            inputs[k] = inputs[k] + value

    def motions(self, x: Sequence[Scalar]) -> dict[str, Motion]:
        """Return the motions of the bodies."""
        value = dict(zip(self.states, x, strict=False))
        return {
            body.name: AT_REST._replace(**{n: value[s] for n, s in body.states.items()})
            for body in self.bodies
        }

    @property
    def site_names(self) -> tuple[str, ...]:
        """No names: a user's own equations know one place of the track."""
        return ()

    def here(self, body: str, run: Running, p: Scalar) -> Running:
        """Return the running conditions at a body's place, which are those of the vehicle."""
        return run

    def gravity(self, p: Scalar) -> Scalar:
        """Return the acceleration due to gravity: the parameter of that name, if there is one."""
        return vars(p).get("gravity", GRAVITY)

    def places(self, p: Scalar) -> dict[str, tuple[Scalar, Scalar]]:
        """Return the place along the vehicle and the height of every body."""
        values = vars(p)
        return {
            b.name: (evaluate(b.x, values) if isinstance(b.x, str) else b.x, 0.0) for b in self.bodies
        }

    def guiding_forces(
        self, x: Sequence[Scalar], u: Sequence[Scalar], run: Running, p: Scalar
    ) -> list[Scalar]:
        """Return no guiding forces of wheels: a user's own equations do not give them."""
        return []
