"""A model: equations of motion with their parameters, compiled kernels and named signals."""

from __future__ import annotations

import copy
import hashlib
import keyword
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.equations.coordinates import GROUND
from railenv.errors import ParameterError, shown
from railenv.evaluator import Evaluator
from railenv.kernels import loader, store
from railenv.tables import Table, names_of, pack
from railenv.vehicles.declared import DeclaredEquations, MovingBody
from railenv.vehicles.elements import GRAVITY
from railenv.vehicles.guided import Guided

if TYPE_CHECKING:
    import control

Equations = Callable[..., Sequence[Any]]
Array = NDArray[np.float64]

_RESERVED = {"w", "t", "lane", "L", "real", "math", "range", "rhs", "jacobian", "parameter_jacobian"}
"""Names that the kernels use themselves."""

_CONDITIONS = ("speed", "curvature", "cant")


class Model:
    """A vehicle on curved track: equations of motion dx/dt = f(x, u, speed, curvature, cant, p).

    Parameters
    ----------
    name : str
        Name of the model.
    states, inputs : sequence of str
        Names of the entries of ``x`` and ``u``; Python identifiers.
    equations : callable
        ``f(x, u, speed, curvature, cant, p)`` returns the time derivatives of the states as a list;
        ``p`` has the parameters as attributes. Written with Python's operators and the functions of
        :mod:`railenv.equations.functions`; no ``if`` on anything that varies.
    parameters : mapping of str to float
        Numbers that the equations read.
    scale : float or sequence of float, default 1.0
        Typical magnitude of each state, the unit of steps in continuation.
    guess : float or sequence of float, default 0.0
        States from which the search for the running equilibrium on tangent track starts.
    bodies : sequence of MovingBody, optional
        The bodies to which the states belong; :class:`railenv.Equipped` and the environments need them.

    Raises
    ------
    ParameterError
        If a name is unusable or a parameter is not a finite number.
    EquationError
        If the equations use something that cannot be compiled.

    Examples
    --------
    >>> import railenv
    >>> def pendulum(x, u, speed, curvature, cant, p):
    ...     angle, rate = x
    ...     return [rate, -p.stiffness * angle + (speed - 10.0) * rate + u[0]]
    >>> model = railenv.Model("pendulum", ["angle", "rate"], ["M"], pendulum, {"stiffness": 4.0})
    >>> model.rhs([0.1, 0.0], [0.0], speed=8.0)
    array([ 0. , -0.4])
    """

    def __init__(
        self,
        name: str,
        states: Sequence[str],
        inputs: Sequence[str],
        equations: Equations,
        parameters: Mapping[str, float],
        scale: float | Sequence[float] = 1.0,
        guess: float | Sequence[float] = 0.0,
        bodies: Sequence[MovingBody] = (),
    ) -> None:
        check_names(states, inputs, parameters)
        given = _bodies(bodies)
        declared = DeclaredEquations(equations, tuple(states), tuple(inputs), given)
        self._set(name, states, inputs, declared, parameters, scale, guess)
        for body in given:
            body.check(self.state_names, self.input_names, self.parameters)
        self._text = self._write()  # now, so that code that cannot be compiled is reported at once

    def _set(
        self,
        name: str,
        states: Sequence[str],
        inputs: Sequence[str],
        equations: Any,
        parameters: Mapping[str, float],
        scale: float | Sequence[float],
        guess: float | Sequence[float],
        tables: Mapping[str, Table] | None = None,
    ) -> None:
        self.name = name
        self.state_names = tuple(states)
        self.input_names = tuple(inputs)
        self.equations = equations
        self.parameters = {k: checks.number(k, v) for k, v in parameters.items()}
        self.tables = dict(tables or {})
        self.scale = checks.vector("scale", _filled(scale, self.n_states), self.state_names)
        self.guess = checks.vector("guess", _filled(guess, self.n_states), self.state_names)
        if not (self.scale > 0).all():
            raise ParameterError(f"scale is {scale!r}; it must be greater than 0")

    def _write(self) -> str:
        """Trace the equations and return the text of the kernels; takes a second or two."""
        from railenv.kernels.source import kernel_source

        names = (*self.parameters, *(n for table in self.tables for n in names_of(table)))
        return kernel_source(
            self.equations,
            self.state_names,
            self.input_names,
            names,
            self.name,
            self._signals,
            self._constants,
            self.site_names,
        )

    @property
    def site_names(self) -> tuple[str, ...]:
        """Names of the differences of the track at each body's place from that at the origin."""
        names: tuple[str, ...] = self.equations.site_names
        return names

    @property
    def _signals(self) -> Callable[..., Sequence[Any]] | None:
        """Further results of the equations, for models that have them."""
        return None

    @property
    def _constants(self) -> dict[str, Any]:
        """Further names that the text of the kernels defines."""
        return {}

    @property
    def structure(self) -> str:
        """The structure without the numbers: models of one structure share their kernels."""
        text = hashlib.sha256(self._text.encode()).hexdigest()
        return f"equations {text} {self.equations.bodies}"  # equipment is mounted on the bodies

    @property
    def _source(self) -> str:
        """Text of the kernels."""
        return self._text

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name!r}: {self.n_states} states>"

    @property
    def n_states(self) -> int:
        """Number of states."""
        return len(self.state_names)

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.input_names)

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Names of the quantities that :meth:`replace` changes."""
        return tuple(self.parameters)

    @property
    def equations_hash(self) -> str:
        """Hash of the structure and of the package's equations, which changes with either."""
        return store.Recipe(self.structure, self._write).key[:16]

    def replace(self, **changes: float) -> Self:
        """Return the same model with some parameters changed; kernels are shared.

        Raises
        ------
        UnknownNameError
            If a name is not a parameter.
        """
        checks.known("parameter", changes, list(self.parameters))
        model = copy.copy(self)
        values = {k: checks.number(k, v) for k, v in changes.items()}
        model.parameters = {**self.parameters, **values}
        return model

    def check_conditions(self, speed: float, curvature: float, cant: float) -> None:
        """Raise ParameterError unless the model runs at this speed (m/s), curvature (1/m), cant."""
        checks.speed(speed)
        checks.number("curvature", curvature, unit="1/m")
        checks.cant(cant)

    def rhs(
        self,
        x: ArrayLike,
        u: ArrayLike | None = None,
        *,
        speed: float,
        curvature: float = 0.0,
        cant: float = 0.0,
    ) -> Array:
        """Return the time derivatives of the states.

        Parameters
        ----------
        x : array_like, shape (n_states,)
            States, SI units, ordered as ``state_names``.
        u : array_like, shape (n_inputs,), optional
            Inputs, ordered as ``input_names``; zero when left out.
        speed : float
            Forward speed, m/s.
        curvature : float
            Curvature, 1/m; positive if the outer rail is the left one.
        cant : float
            Cant angle, rad; positive raises the left rail.

        Returns
        -------
        ndarray, shape (n_states,)

        Raises
        ------
        ParameterError
            If an argument is not allowed, or a derivative is not finite.
        """
        return self._finite(self._evaluator_at(x, u, speed, curvature, cant).rhs(), x)

    def jacobian(
        self,
        x: ArrayLike,
        u: ArrayLike | None = None,
        *,
        speed: float,
        curvature: float = 0.0,
        cant: float = 0.0,
    ) -> tuple[Array, Array]:
        """Return the exact derivatives of :meth:`rhs` (same parameters) by states and inputs.

        Returns
        -------
        A : ndarray, shape (n_states, n_states)
        B : ndarray, shape (n_states, n_inputs)
        """
        full = self._finite(self._evaluator_at(x, u, speed, curvature, cant).jacobian(), x)
        n, m = self.n_states, self.n_inputs
        return full[:, :n].copy(), full[:, n : n + m].copy()

    def condition_jacobian(
        self,
        x: ArrayLike,
        u: ArrayLike | None = None,
        *,
        speed: float,
        curvature: float = 0.0,
        cant: float = 0.0,
    ) -> Array:
        """Return the exact derivatives of :meth:`rhs` with respect to speed, curvature and cant.

        Returns
        -------
        ndarray, shape (n_states, 3)
        """
        full = self._finite(self._evaluator_at(x, u, speed, curvature, cant).jacobian(), x)
        return full[:, self.n_states + self.n_inputs :].copy()

    def kernels(
        self,
        lanes: int = loader.SCALAR,
        dtype: str = "float64",
        program: loader.Program = "integrate",
    ) -> ModuleType:
        """Return the compiled kernels; see ``railenv.kernels.loader``."""
        return loader.load(self._source, lanes, dtype, program)

    def rows(self) -> tuple[list[float], Array | None]:
        """Return the content of a buffer's parameter rows, and the tables they point to, if any."""
        packed, (starts,) = pack([self.tables])
        return [*self.parameters.values(), *starts, *[0.0] * len(self.site_names)], packed

    @property
    def vehicle_name(self) -> str:
        """Name of the vehicle."""
        return self.name

    @property
    def gravity(self) -> float:
        """Acceleration due to gravity, m/s^2: the parameter of that name, if there is one."""
        return self.parameters.get("gravity", GRAVITY)

    @property
    def axle_load(self) -> float:
        """Load (N) of one wheelset on the rails at rest; 0 if the model does not give it."""
        return 0.0

    @property
    def lateral_states(self) -> tuple[str, ...]:
        """States that are lateral displacements of bodies."""
        return tuple(body.y for body in self.equations.bodies if body.y is not None)

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of the bodies that move."""
        return tuple(self.body_states)

    @property
    def body_states(self) -> dict[str, dict[str, str]]:
        """State of each coordinate and rate (``y``, ``dpsi``) of each body that moves."""
        return {body.name: body.states for body in self.equations.bodies}

    @property
    def body_places(self) -> dict[str, float]:
        """Place (m) along the vehicle of each body that moves."""
        return {name: x for name, (x, _) in self._body_centres().items()}

    @property
    def body_heights(self) -> dict[str, float]:
        """Height (m) of the centre of each body that moves; 0 if the equations do not give it."""
        return {name: z for name, (_, z) in self._body_centres().items()}

    def _body_centres(self) -> dict[str, tuple[float, float]]:
        places = self.equations.places(SimpleNamespace(**self.parameters, **self.tables))
        return {name: (float(places[name][0]), float(places[name][1])) for name in self.body_names}

    @property
    def body_inertias(self) -> dict[str, dict[str, float]]:
        """Mass (kg) or moment of inertia (kg m^2) of each coordinate of each body that moves.

        Empty if the model does not give them: a user's own equations contain them implicitly.
        """
        return {}

    @property
    def sites(self) -> dict[str, float]:
        """Place (m) along the vehicle of each body whose track may differ from that at the origin."""
        return {}

    @property
    def guided(self) -> tuple[Guided, ...]:
        """The wheelsets."""
        found = []
        for body in self.equations.bodies:
            if body.is_wheelset:
                fields = ("x", "flange_clearance", "half_gauge", "wheel_radius", "conicity")
                x, delta, a, r, cone = (body.number(f, self.parameters) for f in fields)
                own = body.states
                states = (own["y"], own["psi"], own["dy"])
                found.append(Guided(body.name, x, delta, a, r, cone, *states, rails=()))
        return tuple(found)

    @property
    def flange_clearance(self) -> float | None:
        """Lateral clearance (m) of the first wheelset up to its flange; None without wheelsets."""
        return next((wheelset.clearance for wheelset in self.guided), None)

    def evaluator(self) -> Evaluator:
        """Return a reusable evaluator with its own buffer, for loops that call it often."""
        return Evaluator(self)

    def _evaluator_at(
        self, x: ArrayLike, u: ArrayLike | None, speed: float, curvature: float, cant: float
    ) -> Evaluator:
        self.check_conditions(speed, curvature, cant)
        evaluator = Evaluator(self)
        evaluator.set(
            checks.vector("x", x, self.state_names),
            speed,
            curvature,
            cant,
            checks.vector("u", u, self.input_names),
        )
        return evaluator

    def _finite(self, result: Array, x: ArrayLike) -> Array:
        """Return the values at a state; raise if they are not finite."""
        if not np.isfinite(result).all():
            raise ParameterError(
                f"x is {shown(x)}; derivatives of {self.name} are not finite there, with these inputs, "
                "speed and curve"
            )
        return result

    def plain_rhs(
        self,
        x: Sequence[Any],
        u: Sequence[Any],
        speed: Any,
        curvature: Any = 0.0,
        cant: Any = 0.0,
    ) -> list[Any]:
        """Run the equations themselves, in plain Python, on floats or complex numbers.

        This is the reference for the kernels: slow, and differentiable by complex step.
        """
        p = SimpleNamespace(**self.parameters, **self.tables)
        return list(self.equations(x, u, speed, curvature, cant, p))

    def to_nlsys(
        self, *, speed: float, radius: float = np.inf, cant: float = 0.0
    ) -> control.NonlinearIOSystem:
        """Return the model at one speed and curve as a python-control nonlinear system.

        Its inputs and states have the model's names; its outputs are the states. It can be pickled,
        and several threads can use it at once.

        Parameters
        ----------
        speed : float
            Forward speed, m/s.
        radius : float
            Curve radius, m; ``math.inf`` is tangent track, negative the other hand.
        cant : float
            Cant angle, rad.
        """
        import control

        curvature = checks.curvature(radius)
        self.check_conditions(speed, curvature, cant)
        return control.nlsys(
            _Update(self, speed, curvature, cant),
            None,
            inputs=list(self.input_names),
            states=list(self.state_names),
            outputs=list(self.state_names),
            name=self.name,
        )


class _Update:
    """Derivatives of a model at one speed and curve, in the form that python-control calls."""

    def __init__(self, model: Model, speed: float, curvature: float, cant: float) -> None:
        self._model = model
        self._conditions = (speed, curvature, cant)
        self._own = threading.local()  # an evaluator of each thread

    def __call__(self, t: float, x: Array, u: Array, params: Any) -> Array:
        try:
            evaluator = self._own.evaluator
        except AttributeError:
            evaluator = self._own.evaluator = self._model.evaluator()
        evaluator.set(x, *self._conditions, u)
        return evaluator.rhs()

    def __reduce__(self) -> Any:
        return _Update, (self._model, *self._conditions)


def _filled(values: float | Sequence[float], n: int) -> Array:
    array = np.asarray(values, dtype=float)
    return np.full(n, array) if array.ndim == 0 else array


def _bodies(given: Sequence[MovingBody]) -> tuple[MovingBody, ...]:
    """Return the bodies declared for a user's own equations."""
    bodies = tuple(given)
    every: tuple[Any, ...] = bodies
    wrong = [body for body in every if not isinstance(body, MovingBody)]
    if wrong:
        raise ParameterError(f"bodies has {shown(wrong[0])}, which is not a railenv.MovingBody")
    names = [body.name for body in bodies]
    if len(set(names)) < len(names):
        raise ParameterError(f"bodies are named {', '.join(names)}; names must differ")
    by_name = dict(zip(names, bodies, strict=True))
    for body in bodies:
        _check_reactions(body, by_name)
    return bodies


def check_names(states: Sequence[str], inputs: Sequence[str], parameters: Iterable[str]) -> None:
    """Raise ParameterError unless names are usable in kernels and differ."""
    names = [*states, *inputs, *parameters]
    if not states:
        raise ParameterError("states is empty; a model needs at least one state")
    for name in names:
        usable = str(name).isidentifier() and not keyword.iskeyword(name)
        if not usable or name.startswith("_") or name in _RESERVED or name in _CONDITIONS:
            raise ParameterError(
                f"{name!r} cannot name a state, input or parameter; use a Python identifier that "
                f"does not start with an underscore and is none of "
                f"{', '.join(sorted(_RESERVED | set(_CONDITIONS)))}"
            )
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise ParameterError(
            f"{', '.join(repeated)} stands more than once among states, inputs and parameters; "
            "names must differ"
        )


def _check_reactions(body: MovingBody, by_name: Mapping[str, MovingBody]) -> None:
    """Raise unless the reactions of a body's inputs lead to the ground."""
    chain = [body.name]
    while (on := by_name[chain[-1]].reacts_on) != GROUND:
        checks.known(f"body that the inputs of {chain[-1]} react on", [on], [*by_name, GROUND])
        if on in chain:
            raise ParameterError(f"inputs of {', '.join(chain)} react on each other in a circle")
        chain.append(on)
