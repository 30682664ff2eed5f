"""Stability over any two parameters: critical speed, damping or growth rate, computed in parallel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.places import Place
from design.linear.quantities import meaning_of
from design.loop.feedback import as_feedback
from design.stability.critical_speed import SPEED_RANGE
from design.studies.map_cells import CellFunction, Quantity
from design.studies.store import Record
from design.studies.study import Study, run_study
from railenv import checks
from railenv.errors import ParameterError, shown
from railenv.extras import require
from railenv.models import Model

if TYPE_CHECKING:
    import control
    import xarray
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

QUANTITIES = get_args(Quantity)
_BATCH = 8  # cells of a row in one task if each takes milliseconds

_VARIABLES = {
    "critical_speed": ("critical speed", "m/s"),
    "damping": ("damping ratio of the least stable mode", "1"),
    "growth": ("growth rate of the least stable mode", "1/s"),
    "frequency": ("frequency of the critical mode", "Hz"),
}


@dataclass(frozen=True)
class Axis:
    """A varied parameter.

    Attributes
    ----------
    name : str
    meaning, unit : str
        Text for labels; the unit is empty for parameters of your own equations.
    values : ndarray
    """

    name: str
    meaning: str
    unit: str
    values: Array


@dataclass(frozen=True)
class StabilityMap:
    """Stability over two parameters.

    All arrays have shape (n_first, n_second): entry [i, j] is at value i of the first axis and value j
    of the second.

    Attributes
    ----------
    model_name : str
    quantity : {"critical_speed", "damping", "growth"}
    axes : tuple of two Axis
    held : dict of str to float
        Radius (m), cant (rad) and speed (m/s), unless they vary.
    speed_range : (float, float)
        Range of the search for critical speeds, m/s.
    period : float or None
        Control period (s) of a closed loop; None for the vehicle alone.
    critical_speed : ndarray or None
        Critical speeds, m/s; NaN if there is none. None for other quantities.
    loss : ndarray of str or None
        Kind of the loss of stability, see :class:`design.CriticalSpeed`; empty if there is no
        equilibrium at the lowest speed.
    damping, growth : ndarray or None
        Damping ratio (in a map of "damping") and growth rate (1/s) of the mode with the least damping
        ratio ("damping"), or with the largest growth rate ("growth"). NaN if there is no equilibrium.
    frequency : ndarray
        Frequency (Hz) of the critical mode, or of that mode.
    notes : ndarray of str
        Reason why a cell has no result; empty if it has one.
    ended : str or None
        Reason why not all cells were computed.
    """

    model_name: str
    quantity: Quantity
    axes: tuple[Axis, Axis]
    held: Mapping[str, float]
    speed_range: tuple[float, float]
    period: float | None
    critical_speed: Array | None
    loss: NDArray[np.str_] | None
    damping: Array | None
    growth: Array | None
    frequency: Array
    notes: NDArray[np.str_]
    ended: str | None

    @property
    def value(self) -> Array:
        """The quantity itself."""
        return np.asarray(getattr(self, self.quantity))

    @property
    def variables(self) -> dict[str, Array]:
        """The computed arrays of numbers by name."""
        named = {name: getattr(self, name) for name in _VARIABLES}
        return {name: values for name, values in named.items() if values is not None}

    def to_xarray(self) -> xarray.Dataset:
        """Return the map as an :class:`xarray.Dataset` with coordinates, units and long names.

        Raises
        ------
        MissingPackageError
            If xarray is not installed (extra ``xarray``).
        """
        require("xarray", "xarray", "to_xarray", "xarray")
        import xarray

        first, second = self.axes
        dims = (first.name, second.name)
        data: dict[str, Any] = {
            name: (dims, values, {"long_name": _VARIABLES[name][0], "units": _VARIABLES[name][1]})
            for name, values in self.variables.items()
        }
        if self.loss is not None:
            data["loss"] = (dims, self.loss, {"long_name": "kind of the loss of stability"})
        data["note"] = (dims, self.notes, {"long_name": "reason why there is no result"})
        coordinates = {
            a.name: (a.name, a.values, {"long_name": a.meaning, "units": a.unit}) for a in self.axes
        }
        attributes = {"model": self.model_name, "quantity": self.quantity, **self.held}
        if self.period is not None:
            attributes["period"] = self.period
        if self.quantity == "critical_speed":
            attributes["speed_range"] = list(self.speed_range)
        if self.ended is not None:
            attributes["ended"] = self.ended
        return xarray.Dataset(data, coordinates, attributes)

    def summary(self) -> dict[str, Any]:
        """Return the map as plain numbers and strings, ready for JSON; infinite radii are None."""
        result = {
            "model": self.model_name,
            "quantity": self.quantity,
            "axes": {axis.name: _nullable(axis.values) for axis in self.axes},
            "units": {axis.name: axis.unit for axis in self.axes},
            **{name: None if math.isinf(v) else v for name, v in self.held.items()},
            "speed_range": list(self.speed_range),
            "period": self.period,
            **{name: [_nullable(row) for row in values] for name, values in self.variables.items()},
            "notes": self.notes.tolist(),
            "ended": self.ended,
        }
        if self.loss is not None:
            result["loss"] = self.loss.tolist()
        return result

    def __str__(self) -> str:
        first, second = self.axes
        size = f"{first.values.size} x {second.values.size} cells, {first.name} x {second.name}"
        found = self.value[np.isfinite(self.value)]
        unit = "" if self.quantity == "damping" else " " + _VARIABLES[self.quantity][1]
        kind = self.quantity.replace("_", " ")
        span = f"{kind} {found.min():.4g} to {found.max():.4g}{unit}" if found.size else f"no {kind}"
        return f"{self.model_name}, {size}: {span}"

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the map in colours, with contours and the boundary of stability."""
        from design.studies.map_plots import plot_stability_map

        return plot_stability_map(self, ax)


def stability_map(
    model: Model,
    axes: Mapping[str, ArrayLike],
    *,
    quantity: Quantity = "critical_speed",
    speed: float | None = None,
    radius: float = math.inf,
    cant: float = 0.0,
    speed_range: tuple[float, float] = SPEED_RANGE,
    controller: Any | None = None,
    period: float | None = None,
    longest_step: float | None = None,
    store: str | Path | None = None,
    n_jobs: int | None = -1,
    progress: bool = False,
) -> StabilityMap:
    """Map critical speed, damping or growth rate over two parameters, in parallel.

    Cells are computed in processes of this machine, or on a dask or ray cluster that
    ``joblib.parallel_config`` selects.

    Parameters
    ----------
    model : Model
    axes : mapping of str to array_like
        Two parameters with their values: "radius" (m; ``math.inf`` is tangent track), "cant" (rad),
        "speed" (m/s, not for critical speeds), "gain" (a factor on the commands of the controller) or
        any of ``model.variable_names``. Values in order, radii in order of the curvature.
    quantity : {"critical_speed", "damping", "growth"}
        Critical speed (m/s); or of the running equilibrium at a speed, the least damping ratio of a
        mode, or the largest growth rate (1/s).
    speed : float, optional
        Speed for damping and growth if it does not vary, m/s.
    radius, cant : float
        Curve radius (m) and cant (rad) if they do not vary.
    speed_range : (float, float)
        Range of the search for critical speeds, m/s.
    controller : array_like, control.StateSpace or Feedback, optional
        Closes the loop once per control period, as in :func:`design.closed_loop`. A matrix is the same
        for all cells.
    period : float, optional
        Control period, s; the controller's own, or 0.005 s.
    longest_step : float, optional
        Longest step between the sampled speeds of a search for a critical speed, as in
        :func:`design.critical_speed`.
    store : path, optional
        File to which finished cells are appended. A later call with the same arguments continues it.
    n_jobs : int or None
        Number of workers; -1 for all available, None for the number in ``joblib.parallel_config``.
    progress : bool
        Show a progress bar.

    Returns
    -------
    StabilityMap
        The map, with NaN if there is no equilibrium, and the reason in ``notes``. An interrupt (Ctrl-C)
        returns the finished cells, and ``ended`` says so.

    Raises
    ------
    ParameterError
        If an argument is not allowed, or the store has other settings.

    Examples
    --------
    >>> import design, railenv
    >>> coach = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    >>> axes = {"radius": [2000.0, 8000.0], "conicity": [0.05, 0.1]}
    >>> design.stability_map(coach, axes, n_jobs=1).critical_speed.round(1)
    array([[56.9, 55.9],
           [84.4, 82.7]])
    """
    chosen = _axes(model, axes, controller)
    _check(model, chosen, quantity, speed, radius, cant)
    function = CellFunction(
        Place(model, float(radius), checks.cant(cant)),
        tuple(axis.name for axis in chosen),
        quantity,
        None if speed is None else checks.speed(speed),
        checks.speeds(speed_range),
        controller,
        period,
        longest_step,
    )
    _check_values(function, chosen)
    model.kernels()  # compiled and cached before the workers ask for them, all at once
    found = run_study(
        function,
        [(u, v) for u in chosen[0].values.tolist() for v in chosen[1].values.tolist()],
        batches=_batches(chosen, quantity),
        store=store,
        settings=function.settings({axis.name: axis.values for axis in chosen}),
        n_jobs=n_jobs,
        progress=progress,
        title=f"stability map, {model.name}",
    )
    return _assembled(function, chosen, found)


def _assembled(function: CellFunction, axes: tuple[Axis, Axis], found: Study) -> StabilityMap:
    """Return the map made from the records of a study."""
    place = function.place
    held = {"radius": place.radius, "cant": place.cant, "speed": function.speed}
    period: float | None = None
    if function.controller is not None:
        period = as_feedback(function.controller, place.model, function.period).period
    return StabilityMap(
        model_name=place.model.name,
        quantity=function.quantity,
        axes=axes,
        held={n: v for n, v in held.items() if v is not None and n not in function.names},
        speed_range=function.speed_range,
        period=period,
        **_arrays(found.records, function.quantity, (axes[0].values.size, axes[1].values.size)),
        ended=found.ended,
    )


def _axes(model: Model, axes: Mapping[str, ArrayLike], controller: Any | None) -> tuple[Axis, Axis]:
    if len(checks.mapping("axes", axes)) != 2:
        raise ParameterError(f"axes is {shown(axes)}; it must map two parameters to their values")
    gain = () if controller is None else ("gain",)
    if gain and "gain" in axes and "gain" in model.variable_names:
        raise ParameterError(
            f"gain is a parameter of {model.name} and a factor on the controller; rename the parameter"
        )
    checks.known("axis", axes, ["radius", "cant", "speed", *gain, *model.variable_names])
    known = {
        "radius": ("curve radius", "m"),
        "cant": ("cant angle", "rad"),
        "speed": ("forward speed", "m/s"),
        "gain": ("factor on the controller's commands", "1"),
    }
    made = []
    for name, given in axes.items():
        own = name in model.variable_names  # a parameter of the model may have any name
        meaning, unit = meaning_of(model, name) if own else known[name]
        made.append(Axis(name, meaning, unit, _ordered(name, given)))
    return made[0], made[1]


def _ordered(name: str, given: ArrayLike) -> Array:
    values = checks.numbers(name, given, least=2)
    order = [checks.curvature(v) for v in values.tolist()] if name == "radius" else values
    steps = np.diff(order)
    if not ((steps > 0).all() or (steps < 0).all()):
        by = "of the curvature 1/R " if name == "radius" else ""
        raise ParameterError(f"{name} must have its values in strict order {by}")
    return values


def _check(
    model: Model,
    axes: Sequence[Axis],
    quantity: Quantity,
    speed: float | None,
    radius: float,
    cant: float,
) -> None:
    """Raise ParameterError if arguments contradict each other."""
    checks.choice("quantity", quantity, list(QUANTITIES))
    checks.curvature(radius)
    checks.cant(cant)
    names = [axis.name for axis in axes]
    given = {"radius": radius != math.inf, "cant": cant != 0.0, "speed": speed is not None}
    for name, is_given in given.items():
        if is_given and name in names:
            raise ParameterError(f"{name} is both an axis and held; leave one of them out")
    if quantity == "critical_speed" and ("speed" in names or speed is not None):
        raise ParameterError(
            "a map of critical speeds searches for the speed; leave speed out, or choose "
            "quantity='damping' or 'growth'"
        )
    if quantity != "critical_speed" and "speed" not in names and speed is None:
        raise ParameterError(f"a map of {quantity} needs a speed, as an axis or as speed=")


def _check_values(function: CellFunction, axes: tuple[Axis, Axis]) -> None:
    """Raise ParameterError, before anything is computed, for a value that is not allowed."""
    first, second = (axis.values.tolist() for axis in axes)
    for cell in [*((u, second[0]) for u in first), *((first[0], v) for v in second)]:
        place = function.place_of(cell)
        speed = function.speed or SPEED_RANGE[0]
        if "speed" in function.names:
            speed = checks.speed(cell[function.names.index("speed")])
        place.model.check_conditions(speed, checks.curvature(place.radius), checks.cant(place.cant))
        if not np.isfinite(
            [v for n, v in zip(function.names, cell, strict=True) if n != "radius"]
        ).all():
            raise ParameterError(f"the axes have values that are not finite: {cell}")


def _batches(axes: tuple[Axis, Axis], quantity: Quantity) -> list[list[int]]:
    """Return the indices of the cells of each task: rows, or parts of rows if cells take long."""
    index = np.arange(axes[0].values.size * axes[1].values.size).reshape(axes[0].values.size, -1)
    if quantity == "critical_speed":
        return [row[k : k + _BATCH].tolist() for row in index for k in range(0, row.size, _BATCH)]
    along_first = axes[0].name == "speed" or (axes[0].name == "gain" and axes[1].name != "speed")
    return [row.tolist() for row in (index.T if along_first else index)]


def _arrays(
    records: Sequence[Record | None], quantity: Quantity, shape: tuple[int, int]
) -> dict[str, Any]:
    """Return the attributes of a map that are arrays, from the records of its cells."""

    def numbers(name: str) -> Array:
        values = [None if r is None else r[name] for r in records]
        return np.array([math.nan if v is None else v for v in values]).reshape(shape)

    def texts(name: str, missing: str) -> NDArray[np.str_]:
        return np.array([missing if r is None else r[name] for r in records]).reshape(shape)

    critical = quantity == "critical_speed"
    return {
        "critical_speed": numbers("critical_speed") if critical else None,
        "loss": texts("loss", "") if critical else None,
        "damping": None if critical else numbers("damping"),
        "growth": None if critical else numbers("growth"),
        "frequency": numbers("frequency"),
        "notes": texts("note", "not computed"),
    }


def _nullable(values: Array) -> list[float | None]:
    return [v if math.isfinite(v) else None for v in values.tolist()]
