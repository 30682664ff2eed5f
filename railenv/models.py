"""Models: equations of motion with their parameters, compiled kernels and named signals.

:class:`Bogie`, :class:`DualWheelset` and :class:`CooperriderBogie` are the package's own; a
:class:`Model` made from equations of your own is used in the same way everywhere.
"""

from __future__ import annotations

import copy
import hashlib
import keyword
import threading
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.equations import bogie, cooperrider, dual_wheelset
from railenv.equations.contact import Wheel, wheel
from railenv.equations.coordinates import Rail, Running, bodies, rails
from railenv.errors import ParameterError, shown
from railenv.kernels import loader
from railenv.vehicles import COOPERRIDER, QUANTITIES, CooperriderParameters, Vehicle

if TYPE_CHECKING:
    import control

Equations = Callable[..., Sequence[Any]]
Array = NDArray[np.float64]

_RESERVED = {"w", "lane", "L", "real", "math", "range", "rhs", "jacobian", "parameter_jacobian"}
"""Names that the kernels use themselves."""

_CONDITIONS = ("speed", "curvature", "cant")
_MILLIMETRE = 1e-3


class Model:
    """A vehicle on curved track: equations of motion dx/dt = f(x, u, speed, curvature, cant, p).

    Parameters
    ----------
    name : str
        What to call the model.
    states, inputs : sequence of str
        Names of the entries of ``x`` and ``u``; Python identifiers.
    equations : callable
        ``f(x, u, speed, curvature, cant, p)`` returns the time derivatives of the states as a list;
        ``p`` has the parameters as attributes. Written with Python's operators and the functions of
        :mod:`railenv.equations.functions`; no ``if`` on anything that varies.
    parameters : mapping of str to float
        The numbers that the equations read.
    scale : float or sequence of float, default 1.0
        Typical magnitude of each state, by which continuation measures steps.
    guess : float or sequence of float, default 0.0
        States from which the search for the running equilibrium on tangent track starts.

    Raises
    ------
    ParameterError
        If a name is unusable or a parameter is not a finite number.
    EquationError
        If the equations use what cannot be compiled.

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

    _shipped = False
    """Whether the kernels are the package's own, under the model's name."""

    def __init__(
        self,
        name: str,
        states: Sequence[str],
        inputs: Sequence[str],
        equations: Equations,
        parameters: Mapping[str, float],
        scale: float | Sequence[float] = 1.0,
        guess: float | Sequence[float] = 0.0,
    ) -> None:
        from railenv.kernels.source import kernel_source

        _check_names(states, inputs, parameters)
        source = kernel_source(equations, states, inputs, tuple(parameters), name)
        self._assemble(name, states, inputs, equations, parameters, scale, guess, source)

    def _assemble(
        self,
        name: str,
        states: Sequence[str],
        inputs: Sequence[str],
        equations: Equations,
        parameters: Mapping[str, float],
        scale: float | Sequence[float],
        guess: float | Sequence[float],
        source: str,
    ) -> None:
        self.name = name
        self.state_names = tuple(states)
        self.input_names = tuple(inputs)
        self.equations = equations
        self.parameters = {k: checks.number(k, v) for k, v in parameters.items()}
        self.scale = checks.vector("scale", _filled(scale, self.n_states), self.state_names)
        self.guess = checks.vector("guess", _filled(guess, self.n_states), self.state_names)
        if not (self.scale > 0).all():
            raise ParameterError(f"scale is {scale!r}; it must be greater than 0")
        self._source = source

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the text of the package's own kernels, which every process has."""
        state = dict(self.__dict__)
        if self._shipped and self._source == loader.shipped_source(self.name):
            del state["_source"]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if "_source" not in state:
            self._source = loader.shipped_source(self.name)

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
        """Hash of the text of the kernels: another where the equations are others."""
        return hashlib.sha256(self._source.encode()).hexdigest()[:16]

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
        """Time derivatives of the states.

        Parameters
        ----------
        x : array_like, shape (n_states,)
            States, SI units, ordered as ``state_names``.
        u : array_like, shape (n_inputs,), optional
            Inputs, ordered as ``input_names``; zero when left out.
        speed : float
            Forward speed, m/s.
        curvature : float
            1/m; positive where the outer rail is the left one.
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
        """Exact derivatives of :meth:`rhs` (same parameters) with respect to states and inputs.

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
        """Exact derivatives of :meth:`rhs` with respect to speed, curvature and cant.

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
        module = loader.load(self._source, lanes, dtype, program)
        if tuple(self.parameters) != module.PARAMETERS:
            raise RuntimeError(
                f"the kernels of {self.name} were generated for other parameters than the model has; "
                "run `make kernels`"
            )
        return module

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
        """Return what was evaluated at a state, unless that is too far off for numbers."""
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

        The oracle of the kernels: slow, and differentiable by complex step.
        """
        p = SimpleNamespace(**self.parameters)
        return list(self.equations(x, u, speed, curvature, cant, p))

    def to_nlsys(
        self, *, speed: float, radius: float = np.inf, cant: float = 0.0
    ) -> control.NonlinearIOSystem:
        """Return the model at one speed and curve as a python-control nonlinear system.

        Its inputs and states carry the model's names; its outputs are the states. It can be pickled,
        and used by several threads at once.

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
    """Derivatives of a model at one speed and curve, as python-control calls for them."""

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


class Evaluator:
    """Right-hand side and Jacobian of a model through one buffer; not for several threads at once.

    Arguments are not checked; :meth:`Model.rhs` does that.
    """

    def __init__(self, model: Model) -> None:
        self._kernels = model.kernels()
        layout = self._kernels.LAYOUT
        self._w = np.zeros(layout.rows)
        self._w[layout.p : layout.dx] = list(model.parameters.values())
        self._x = self._w[layout.x : layout.u]
        self._u = self._w[layout.u : layout.c]
        self._c = self._w[layout.c : layout.p]
        self._dx = self._w[layout.dx : layout.work]
        self._signals = self._w[layout.o : layout.j]
        cells = np.array(self._kernels.CELLS, dtype=np.int64).reshape(-1, 2).T
        self._rows, self._columns = np.ascontiguousarray(cells)
        self._shape = (model.n_states, model.n_states + model.n_inputs + 3)

    def set(
        self,
        x: ArrayLike,
        speed: float,
        curvature: float = 0.0,
        cant: float = 0.0,
        u: ArrayLike = 0.0,
    ) -> None:
        """Set states, running conditions and inputs."""
        self._x[:] = x
        self._u[:] = u
        self._c[0] = speed
        self._c[1] = curvature
        self._c[2] = cant

    def rhs(self) -> Array:
        """Return the derivatives, shape (n_states,)."""
        self._kernels.rhs(self._w)
        return self._dx.copy()

    def signals(self) -> Array:
        """Return the signals of a model that has them."""
        self._kernels.signals(self._w)
        return self._signals.copy()

    def jacobian(self) -> Array:
        """Return the derivatives with respect to states, inputs, speed, curvature and cant.

        Shape (n_states, n_states + n_inputs + 3).
        """
        out = np.zeros(self._shape)
        self._kernels.dense_jacobian(self._w, self._rows, self._columns, out)
        return out


class _VehicleModel(Model):
    """A model whose parameters are those of a Vehicle."""

    _shipped = True
    _name: str
    _states: tuple[str, ...]
    _inputs: tuple[str, ...]
    _equations: Equations

    def __init__(self, vehicle: Vehicle) -> None:
        if not isinstance(vehicle, Vehicle):
            raise ParameterError(f"vehicle is {vehicle!r}; it must be a railenv.Vehicle")
        self.vehicle = vehicle
        self._assemble(
            self._name,
            self._states,
            self._inputs,
            type(self)._equations,
            vehicle.parameters(),
            _MILLIMETRE,
            [-_MILLIMETRE * (name.startswith("z_")) for name in self._states],  # wheels loaded
            loader.shipped_source(self._name),
        )

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Names of the vehicle's quantities, and ``creep_factor``."""
        return (*QUANTITIES, "creep_factor")

    def replace(self, **changes: Any) -> Self:
        """Return the same model with some fields of its vehicle changed."""
        return type(self)(self.vehicle.replace(**changes))

    def wheels(
        self,
        x: ArrayLike,
        u: ArrayLike | None = None,
        *,
        speed: float,
        curvature: float = 0.0,
        cant: float = 0.0,
    ) -> list[tuple[Wheel, Wheel]]:
        """Return loads and linear creep forces of the left and right wheel of each wheelset.

        Parameters are those of :meth:`rhs`.
        """
        self.check_conditions(speed, curvature, cant)
        state = checks.vector("x", x, self.state_names).tolist()
        inputs = checks.vector("u", u, self.input_names).tolist()
        run, p = Running(speed, curvature, cant), SimpleNamespace(**self.parameters)
        under = rails(inputs[-2 * len(Rail._fields) :])
        return [
            (wheel(+1, motion, rail, run, p), wheel(-1, motion, rail, run, p))
            for motion, rail in zip(bodies(state), under, strict=False)
        ]


class Bogie(_VehicleModel):
    """The two-axle bogie of 12 degrees of freedom (eq 6 of the paper).

    States are y, z, phi, psi of the leading wheelset ``w1``, the trailing wheelset ``w2`` and the
    frame ``b``, then their rates. Inputs are the yaw moments ``M_w1``, ``M_w2`` (primary actuators,
    wheelset against frame) and ``M_b`` (secondary, frame against body) in N m, and the track
    irregularity under each wheelset: ``align`` (lateral, m), ``vert`` (vertical, m), ``cross``
    (cross-level, rad).

    Parameters
    ----------
    vehicle : Vehicle
        For instance ``railenv.HIGH_SPEED_COACH``.
    """

    _name = "bogie"
    _states = bogie.STATES
    _inputs = bogie.INPUTS
    _equations = staticmethod(bogie.bogie)


class DualWheelset(_VehicleModel):
    """Two wheelsets suspended from a frame at rest, 8 degrees of freedom (eq 6 of the paper).

    States and inputs as those of :class:`Bogie`, less the frame's. The two wheelsets are uncoupled, so
    every eigenvalue is double.

    Parameters
    ----------
    vehicle : Vehicle
        For instance ``railenv.TABLE_1``.
    """

    _name = "dual_wheelset"
    _states = dual_wheelset.STATES
    _inputs = dual_wheelset.INPUTS
    _equations = staticmethod(dual_wheelset.dual_wheelset)


class CooperriderBogie(Model):
    """The Cooperrider bogie of 7 degrees of freedom, on tangent track only.

    Parameters
    ----------
    record : CooperriderParameters, optional
        The bogie of the literature when left out.
    """

    _shipped = True

    def __init__(self, record: CooperriderParameters = COOPERRIDER) -> None:
        if not isinstance(record, CooperriderParameters):
            raise ParameterError(f"record is {record!r}; it must be CooperriderParameters")
        self.record = record
        self._assemble(
            "cooperrider",
            cooperrider.STATES,
            cooperrider.INPUTS,
            cooperrider.cooperrider_bogie,
            record.parameters(),
            _MILLIMETRE,
            0.0,
            loader.shipped_source("cooperrider"),
        )

    def replace(self, **changes: float) -> Self:
        """Return the same model with some of its parameters changed."""
        return type(self)(self.record.replace(**changes))

    def check_conditions(self, speed: float, curvature: float, cant: float) -> None:
        """Raise ParameterError for a speed that is not positive, or any track but tangent."""
        super().check_conditions(speed, curvature, cant)
        if curvature != 0.0 or cant != 0.0:
            raise ParameterError(
                f"curvature is {curvature:g} 1/m and cant {cant:g} rad; the Cooperrider bogie is "
                "defined on tangent track only, where both are 0"
            )


def _filled(values: float | Sequence[float], n: int) -> Array:
    array = np.asarray(values, dtype=float)
    return np.full(n, array) if array.ndim == 0 else array


def _check_names(states: Sequence[str], inputs: Sequence[str], parameters: Mapping[str, float]) -> None:
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
