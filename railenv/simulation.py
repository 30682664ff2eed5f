"""Simulation in time: a vehicle along a track, from its running equilibrium or any other state."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.equilibrium import find_equilibrium
from railenv.errors import ParameterError, SimulationError, shown
from railenv.irregularity import FADE, Kind, Level, Line
from railenv.irregularity import given as line_given
from railenv.model import Model
from railenv.track import Track

if TYPE_CHECKING:
    import control

Array = NDArray[np.float64]
Signal = float | Callable[[Array], ArrayLike]
"""A constant, or a function of time (array of s) that returns as many values."""

STEP_PER_MODE = 0.25
"""Time step of RK4 in units of 1/|eigenvalue| of the fastest mode (its limit of stability is 2.8)."""

_OUTPUT_STEP = 0.005  # s
_CHUNK = 20_000  # steps whose drive is held in memory at a time
_MOST_SAMPLES = 10**7  # some gigabytes
_MOST_STEPS = 10**9  # some minutes
_STIFFEST = 10**15  # more steps than floats can count in a duration
_EXPLICIT, _IMPLICIT = ("RK23", "RK45", "DOP853"), ("Radau", "BDF", "LSODA")  # of scipy.integrate
_CONDITIONS = ("speed", "curvature", "cant")


def simulate(
    model: Model,
    *,
    speed: Signal,
    radius: float = math.inf,
    cant: float = 0.0,
    track: Track | None = None,
    duration: float,
    perturbation: Mapping[str, float] | None = None,
    initial_state: ArrayLike | None = None,
    inputs: Mapping[str, Signal] | None = None,
    irregularity: Level | Line | None = None,
    irregularity_factor: float = 1.0,
    step: float | None = None,
    output_step: float = _OUTPUT_STEP,
    method: str = "RK4",
    rtol: float = 1e-8,
    atol: float = 1e-10,
) -> control.TimeResponseData:
    """Simulate a model in time.

    Parameters
    ----------
    model : Model
    speed : float or callable
        Forward speed, m/s, or a function of time that returns it. The equations hold for constant
        speed; a varying one is taken as quasi-steady.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track, negative the other hand) and cant (rad).
    track : Track, optional
        Curvature and cant along the line from distance 0, instead of ``radius`` and ``cant``. Each
        body runs on those of its own place.
    duration : float
        s.
    perturbation : mapping of str to float, optional
        Additions to the initial state, by state name: ``{"y_w1": 0.005}``.
    initial_state : array_like, shape (n_states,), optional
        State at the start; the running equilibrium at the start of the track when left out.
    inputs : mapping of str to (float or callable), optional
        Inputs by name, constant or functions of time; the others are zero.
    irregularity : {"low", "high"} or Line, optional
        Displacement of the rails under all wheelsets, each at its own place along the line: a level of
        ERRI B176 or a :class:`railenv.irregularity.Line`, from its start. It grows from 0 over
        the first 20 m of the run.
    irregularity_factor : float, default 1.0
        Factor on it.
    step : float, optional
        Time step of RK4, s; chosen from the fastest mode when left out.
    output_step : float, default 0.005
        Interval of the returned samples, s (shortened so that it divides the duration).
    method : str, default "RK4"
        "RK4" is the classical Runge-Kutta method in the compiled kernel; "RK23", "RK45", "DOP853",
        "Radau", "BDF" and "LSODA" are the solvers of ``scipy.integrate``.
    rtol, atol : float
        Tolerances of those solvers; RK4 does not use them.

    Returns
    -------
    control.TimeResponseData
        Outputs and states are the model's states; inputs are the model's inputs, then speed,
        curvature and cant at the origin of the vehicle, and on a varying track the differences at
        the place of each body (``curvature_at_w1`` and so on, see :attr:`railenv.Model.site_names`).

    Raises
    ------
    ParameterError
        If an argument is not allowed, or both ``irregularity`` and ``inputs`` displace the rails.
    SimulationError
        If a state does not stay finite; the error's ``response`` holds the results up to then.
    EquilibriumError
        If there is no running equilibrium to start from (then give ``initial_state``).

    Examples
    --------
    >>> import railenv
    >>> model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    >>> response = railenv.simulate(
    ...     model, speed=100.0, perturbation={"y_w1": 0.001, "y_w2": 0.001}, duration=5.0
    ... )
    >>> bool(abs(response.outputs[0, -1]) < 1e-4)
    True
    """
    line = _line(track, radius, cant)
    duration = checks.number("duration", duration, low=0.0, open_low=True, unit="s")
    output_step = checks.number("output_step", output_step, low=0.0, open_low=True, unit="s")
    rails = _Rails.of(model, irregularity, irregularity_factor)
    run = _Run(model, speed, line, checks.mapping("inputs", inputs), duration, rails)
    start = run.initial_state(initial_state, checks.mapping("perturbation", perturbation))
    rows = _count("output_step", output_step, duration, _MOST_SAMPLES)
    times = np.linspace(0.0, duration, rows + 1)
    checks.choice("method", method, ["RK4", *_EXPLICIT, *_IMPLICIT])
    if method == "RK4":
        states = _runge_kutta(run, start, times, step)
    else:
        states = _by_scipy(run, start, times, method, rtol, atol)
    response = _response(run, times[: len(states)], states)
    if len(states) < len(times):
        raise SimulationError(
            f"the state of {model.name} is no longer finite after {times[len(states) - 1]:.4g} s: the "
            "motion diverges, or the step is too long for it; the `response` of this error holds "
            "what was computed until then",
            response,
        )
    return response


def _line(track: Track | None, radius: float, cant: float) -> Track:
    """Return the given track, or else the circular one."""
    if track is not None and not isinstance(track, Track):
        raise ParameterError(f"track is {shown(track)}; it must be a railenv.Track")
    curvature, cant = checks.curvature(radius), checks.cant(cant)
    if track is None:
        return Track.circular(radius, cant)
    if curvature or cant:
        raise ParameterError(
            f"radius is {radius:g} m and cant {cant:g} rad; give either them or a track, not both"
        )
    return track


def _count(name: str, step: float, whole: float, most: int) -> int:
    """Return the number of steps (s) in a duration (s), at least 1."""
    ratio = whole / step
    if not ratio <= most:
        raise ParameterError(
            f"{name} is {step:g} s in a duration of {whole:g} s; it must be at least "
            f"{whole / most:g} s, for at most {most} steps"
        )
    return max(1, math.ceil(ratio - 1e-9))


@dataclass(frozen=True)
class _Rails:
    """Displacement of the rails under the wheelsets of a model: a line, and the factor on it."""

    model: Model
    line: Line
    factor: float

    @classmethod
    def of(cls, model: Model, irregularity: Level | Line | None, factor: float) -> _Rails | None:
        """Return the displacement for the arguments of :func:`simulate`."""
        factor = checks.number("irregularity_factor", factor, low=0.0)
        line = line_given(irregularity)
        if line is None:
            return None
        if not any(wheelset.rails for wheelset in model.guided):
            raise ParameterError(
                f"irregularity is given, but {model.name} has no inputs that displace its rails"
            )
        return cls(model, line, factor)

    def columns(self, distance: Array) -> dict[str, Array]:
        """Return align, vert and cross of each wheelset at distances of the vehicle (m), by input."""
        grown = self.factor * np.clip(distance / FADE, 0.0, 1.0)
        return {
            name: grown * self.line.at(kind, distance + wheelset.x)
            for wheelset in self.model.guided
            for kind, name in zip(get_args(Kind), wheelset.rails, strict=False)
        }


@dataclass
class _Run:
    """The drive of a simulation: speed, track and inputs as functions of time."""

    model: Model
    speed: Signal
    track: Track
    inputs: dict[str, Signal]
    duration: float
    rails: _Rails | None = None

    def __post_init__(self) -> None:
        checks.known("input", self.inputs, self.model.input_names)
        twice = set(self.inputs) & set(self.rails.columns(np.zeros(1)) if self.rails else ())
        if twice:
            raise ParameterError(
                f"inputs has {', '.join(sorted(twice))}, and irregularity displaces the same rails; "
                "give either irregularity or these inputs"
            )
        times = np.linspace(0.0, self.duration, 1001)
        self._sampled = self._signal("speed", self.speed, times)
        if not (self._sampled > 0.0).all():
            i = int(np.argmin(self._sampled))
            checks.speed(self._sampled[i], f"speed at {times[i]:g} s")
        for k, c in zip(self.track.curvature, self.track.cant, strict=True):
            self.model.check_conditions(float(self._sampled[0]), k, c)

    @property
    def constant(self) -> bool:
        """Whether nothing varies, so that the kernel can hold everything constant."""
        signals = [self.speed, *self.inputs.values()]
        varying = self.rails is not None or any(callable(s) for s in signals)
        return len(self.track.distance) == 1 and not varying

    @property
    def slowest(self) -> float:
        """Lowest speed of the run (m/s), where modes are fastest."""
        return float(self._sampled.min())

    def _signal(self, name: str, signal: Signal, times: Array) -> Array:
        if callable(signal) and not isinstance(signal, type):  # a class is no function of time
            returned = signal(times)
            try:
                values = np.broadcast_to(np.asarray(returned, dtype=float), times.shape)
            except (OverflowError, TypeError, ValueError):
                raise ParameterError(
                    f"{name} as a function of {times.size} times returns {shown(returned)}; it must be "
                    "as many numbers, or one"
                ) from None
        else:
            values = np.full(times.shape, checks.number(name, signal))
        if not np.isfinite(values).all():
            i = int(np.flatnonzero(~np.isfinite(values))[0])
            raise ParameterError(f"{name} at {times[i]:g} s is {values[i]}; it must be finite")
        return values

    def drive(self, times: Array, distance: float) -> tuple[Array, float]:
        """Return inputs and conditions at uniform times, and the distance (m) reached at the last.

        Shape (len(times), n_inputs + 3). The speed is integrated by the trapezoidal rule.
        """
        speeds = self._signal("speed", self.speed, times)
        steps = np.diff(times) * (speeds[1:] + speeds[:-1]) / 2.0
        distances = distance + np.concatenate([[0.0], np.cumsum(steps)])
        rails = self.rails.columns(distances) if self.rails else {}
        columns = [
            rails[n] if n in rails else self._signal(n, self.inputs.get(n, 0.0), times)
            for n in self.model.input_names
        ]
        columns += [speeds, self.track.curvature_at(distances), self.track.cant_at(distances)]
        columns += self._sites(distances)
        return np.ascontiguousarray(np.stack(columns, axis=1)), float(distances[-1])

    @property
    def site_names(self) -> tuple[str, ...]:
        """Names of the track's differences at the bodies' places; none if the track does not vary."""
        return self.model.site_names if len(self.track.distance) > 1 else ()

    def _sites(self, distances: Array) -> list[Array]:
        """Return the track's differences at the bodies' places from the origin, if it varies."""
        if not self.site_names:
            return []
        track, columns = self.track, []
        for place in self.model.sites.values():
            there = distances + place
            columns += [
                track.curvature_at(there) - track.curvature_at(distances),
                track.curvature_slope_at(there),
                track.cant_at(there) - track.cant_at(distances),
                track.cant_slope_at(there),
            ]
        return columns

    def initial_state(self, given: ArrayLike | None, perturbation: dict[str, float]) -> Array:
        """Return the initial state."""
        names = self.model.state_names
        checks.known("state in perturbation", perturbation, names)
        if given is not None:
            state = checks.vector("initial_state", given, names)
        else:
            curvature = float(self.track.curvature_at(0.0))
            state = find_equilibrium(
                self.model,
                speed=float(self._sampled[0]),
                radius=1.0 / curvature if curvature else math.inf,
                cant=float(self.track.cant_at(0.0)),
                inputs=self.drive(np.zeros(1), 0.0)[0][0, : self.model.n_inputs],
            ).state.copy()
        for name, value in perturbation.items():
            state[names.index(name)] += checks.number(f"perturbation {name}", value)
        return state

    def natural_step(self, start: Array, most: int = _MOST_STEPS) -> float:
        """Return the RK4 time step (s) that the fastest mode about the initial state requires.

        Raises
        ------
        ParameterError
            If forces are not finite there, or the duration has more than ``most`` such steps.
        """
        n = self.model.n_inputs
        curvature, cant = self.drive(np.zeros(1), 0.0)[0][0, n + 1 : n + 3]
        step = natural_step(self.model, start, speed=self.slowest, curvature=curvature, cant=cant)
        _count("the step that the fastest mode asks for", step, self.duration, most)
        return step


def natural_step(model: Model, state: Array, *, speed: float, curvature: float, cant: float) -> float:
    """Return the RK4 time step (s) that the fastest mode about a state requires.

    Raises
    ------
    ParameterError
        If the forces or their derivatives are not finite there.
    """
    evaluator = model.evaluator()
    evaluator.set(state, speed, curvature, cant)
    jacobian = evaluator.jacobian()[:, : model.n_states]
    if not (np.isfinite(jacobian).all() and np.isfinite(evaluator.rhs()).all()):
        raise ParameterError(f"state is {shown(state)}; forces of {model.name} are not finite there")
    fastest = np.abs(np.linalg.eigvals(jacobian)).max()
    return STEP_PER_MODE / max(float(fastest), 1e-6)


def _runge_kutta(run: _Run, start: Array, times: Array, step: float | None) -> Array:
    """Return the states at the times that the kernel's RK4 reaches."""
    if step is None:
        step = run.natural_step(start)
    else:
        step = checks.number("step", step, low=0.0, open_low=True, unit="s")
        _count("step", step, run.duration, _MOST_STEPS)
    interval = float(times[1] - times[0])
    stride = _count("step", step, interval, _MOST_STEPS)
    h = interval / stride
    model = run.model
    kernels = model.kernels()
    layout = kernels.LAYOUT
    w = np.zeros(layout.j)
    w[layout.p : layout.dx], t = model.rows()
    w[: layout.u] = start
    if not run.constant:
        return np.concatenate([start[None, :], *_driven(run, w, t, times, h, stride)])
    w[layout.u : layout.p] = run.drive(np.zeros(1), 0.0)[0][0]
    out = np.empty((len(times), model.n_states))
    return out[: kernels.rk4_record(w, t, h, stride, out)]


def _driven(
    run: _Run, w: Array, t: Array | None, times: Array, h: float, stride: int
) -> Iterator[Array]:
    """Yield the states after the first, in blocks of rows, while they are finite.

    ``w`` and ``t`` are the buffers of the kernel, ``stride`` the steps h from one row to the next.
    """
    row, last, distance = 0, len(times) - 1, 0.0
    while row < last:
        rows = min(last - row, max(1, _CHUNK // stride))
        halves = times[row] + 0.5 * h * np.arange(2 * rows * stride + 1)
        drive, distance = run.drive(halves, distance)
        out = np.empty((rows + 1, run.model.n_states))
        good = run.model.kernels().rk4_driven(w, t, h, stride, drive, out)
        yield out[1:good]
        if good < rows + 1:
            return
        row += rows


def _by_scipy(run: _Run, start: Array, times: Array, method: str, rtol: float, atol: float) -> Array:
    from scipy import integrate

    model, m = run.model, run.model.n_inputs
    rtol = checks.number("rtol", rtol, low=0.0, open_low=True)
    atol = checks.number("atol", atol, low=0.0, open_low=True)
    # without these checks solvers may not end: forces may be infinite, or modes too fast to follow
    run.natural_step(start, _MOST_STEPS if method in _EXPLICIT else _STIFFEST)
    evaluator = model.evaluator()
    grid = np.linspace(0.0, times[-1], max(2001, 20 * len(times)))
    distance = integrate.cumulative_trapezoid(run._signal("speed", run.speed, grid), grid, initial=0.0)

    asked, varies = np.geterr(), bool(run.site_names)

    def set_evaluator(t: float, x: Array) -> None:
        with np.errstate(**asked):  # functions of the caller's
            drive, _ = run.drive(np.array([t]), float(np.interp(t, grid, distance)))
        speed, curvature, cant = drive[0, m : m + 3]
        evaluator.set(x, speed, curvature, cant, drive[0, :m], drive[0, m + 3 :] if varies else 0.0)

    def f(t: float, x: Array) -> Array:
        set_evaluator(t, x)
        return evaluator.rhs()

    def jacobian(t: float, x: Array) -> Array:
        set_evaluator(t, x)
        found = evaluator.jacobian()[:, : model.n_states]
        if not np.isfinite(found).all():
            raise _NotFiniteError
        return found

    implicit: Any = {"jac": jacobian} if method in _IMPLICIT else {}
    # the solvers divide by zero and underflow on their way, and rely on being allowed to
    with np.errstate(all="ignore"):
        solver = getattr(integrate, method)(f, 0.0, start, times[-1], rtol=rtol, atol=atol, **implicit)
        return _solved(solver, times)


def _solved(solver: Any, times: Array) -> Array:
    """Return the states at the times that a solver of SciPy reaches."""
    chunks, done = [solver.y[None, :].copy()], 1
    while solver.status == "running":
        before = solver.t
        try:
            solver.step()
        except _NotFiniteError:
            break
        # LSODA reports success without progress when the motion grows beyond all bounds
        if solver.status == "failed" or solver.t == before or not np.isfinite(solver.y).all():
            break
        reached = int(np.searchsorted(times, solver.t, side="right"))
        if reached > done:
            chunks.append(solver.dense_output()(times[done:reached]).T)
            done = reached
    return np.concatenate(chunks)


class _NotFiniteError(Exception):
    """Derivatives are infinite, which solvers cannot work with."""


def _response(run: _Run, times: Array, states: Array) -> control.TimeResponseData:
    import control

    drive, _ = run.drive(times, 0.0)
    names = list(run.model.state_names)
    return control.TimeResponseData(
        times,
        states.T,
        states.T,
        drive.T,
        issiso=False,
        output_labels=names,
        state_labels=names,
        input_labels=[*run.model.input_names, *_CONDITIONS, *run.site_names],
        title=f"{run.model.name}",
        sysname=run.model.name,
        plot_inputs=False,
    )
