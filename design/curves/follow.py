"""Curves of bifurcations: the start, and the continuation from it."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.typing import ArrayLike

from design.curves.curve import BifurcationCurve, CurveKind, CurveSpecialPoint
from design.curves.plane import Range
from design.curves.run import Run
from design.curves.starts import from_critical_speed, from_cycle
from design.curves.switch import through
from design.cycles.cycle import SpecialPoint
from design.stability.loss import CriticalSpeed, HopfPoint
from railenv import checks
from railenv.errors import ParameterError, shown
from railenv.models import Model

Start = CriticalSpeed | HopfPoint | SpecialPoint | CurveSpecialPoint


def bifurcation_curve(
    model: Model,
    start: Start,
    parameters: Mapping[str, Range],
    *,
    kind: CurveKind | None = None,
    inputs: ArrayLike | None = None,
    points: int = 100,
    longest_step: float = 0.25,
    progress: bool = False,
) -> BifurcationCurve:
    """Follow a bifurcation over two parameters, through turning points, with its special points.

    Equilibria or periodic motions, with the condition that makes them critical as a further equation
    (minimally extended systems of bordered matrices), are followed by pseudo-arclength continuation
    from the start to both sides.

    Parameters
    ----------
    model : Model
        Model with the parameters of the start; a special point of a curve brings the values of that
        curve's two parameters.
    start : CriticalSpeed, HopfPoint, SpecialPoint or CurveSpecialPoint
        Start of the curve. Hunting gives a curve of Hopf points; a fold in which steady running ends,
        one of folds of equilibria; a special point of a branch of limit cycles, a curve of its own
        kind. Through a special point of a curve lead other curves, of which ``kind`` chooses one.
    parameters : mapping of str to (float, float)
        The two parameters, each with the range in which the curve is followed: "speed" (m/s),
        "curvature" (1/m), "cant" (rad), or a parameter of the model. Other running conditions are those
        of the start.
    kind : str, optional
        From a special point of a curve: "Hopf" (Bautin, Hopf-Hopf, fold-Hopf, Bogdanov-Takens), "fold
        of equilibria" (fold-Hopf, Bogdanov-Takens), "fold of cycles" (Bautin, fold-flip, fold-torus),
        "period doubling" (fold-flip, flip-torus, 1:2 resonance) or "torus" (fold-torus, flip-torus,
        double torus, 1:2 resonance).
    inputs : array_like, shape (n_inputs,), optional
        Constant inputs, zero when left out; a critical speed has its own.
    points : int
        Largest number of points on either side of the start.
    longest_step : float
        Longest step of arclength: 1 is a tenth of the range of a parameter, or a change of the motion
        as large as itself.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns what has been computed.

    Returns
    -------
    BifurcationCurve

    Raises
    ------
    CurveError
        If no curve is found at the start.
    ParameterError
        If no curve can be followed from the start, or the model does not allow the ranges.

    Examples
    --------
    >>> import design, railenv
    >>> bogie = railenv.CooperriderBogie()
    >>> hopf = design.critical_speed(bogie)
    >>> curve = design.bifurcation_curve(bogie, hopf, {"conicity": (0.04, 0.06), "speed": (50.0, 90.0)})
    >>> [round(v, 2) for v in curve.at("conicity", 0.05)]
    [68.64]
    """
    points = checks.whole("points", points)
    longest_step = checks.number("longest_step", longest_step, low=0.0, open_low=True)
    if isinstance(start, HopfPoint):
        start = start.critical
    u = checks.vector("inputs", inputs, model.input_names)
    if isinstance(start, CurveSpecialPoint):
        beginning = through(model, start, kind, parameters, u)
    elif kind is not None:
        raise ParameterError(f"kind is {kind!r}; it is needed at special points of curves only")
    elif isinstance(start, CriticalSpeed):
        if inputs is not None:
            raise ParameterError("inputs are given; a critical speed brings its own")
        beginning = from_critical_speed(model, start, parameters)
    elif isinstance(start, SpecialPoint):
        beginning = from_cycle(model, start, parameters, u)
    else:
        raise ParameterError(
            f"start is {shown(start)}; it must be a CriticalSpeed, a HopfPoint, or a special point of "
            "a branch of limit cycles or of another curve"
        )
    return Run(beginning, longest_step).curve(points, progress)
