"""How limit cycles, bifurcation diagrams and what simulation says of them are drawn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from design.plots import NEUTRAL, SERIES, STABLE, UNSTABLE, _axes, _curve, _drawn, style
from railenv import checks
from railenv.errors import ParameterError

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.cycles import Cycle, CycleBranch
    from design.diagram import SimulatedDiagram
    from design.hunting_map import HuntingMap
    from design.polach import SpeedRamp
    from design.spectrum import Spectrum

Array = NDArray[np.float64]

SPECIAL_MARKERS = {
    "fold": "o",
    "torus": "D",
    "period doubling": "s",
    "symmetry breaking": "^",
    "branch point": "v",
}
"""Marker of each kind of special point."""

_INK = "#333333"
_LABELS = {"speed": "speed (m/s)", "curvature": "curvature (1/m)", "cant": "cant (rad)"}
_DECADES = 8.0  # of the density shown below its peak


def _unit(state: str) -> tuple[float, str]:
    """Return the factor and the unit in which a state is drawn."""
    kind = state.split("_", maxsplit=1)[0]
    units = {"y": "mm", "z": "mm", "phi": "mrad", "psi": "mrad"}
    units |= {f"d{name}": f"{unit}/s" for name, unit in units.items()}
    return (1e3, units[kind]) if "_" in state and kind in units else (1.0, "")


def _axis(state: str, what: str = "") -> str:
    unit = _unit(state)[1]
    text = f"{what} of {state}" if what else state
    return f"{text} ({unit})" if unit else text


def stability_runs(stable: NDArray[np.bool_]) -> Iterator[tuple[slice, bool]]:
    """Yield stretches of equal stability; each overlaps the next by a point, so that lines join."""
    edges = [0, *(np.flatnonzero(np.diff(stable)) + 1).tolist(), len(stable)]
    for a, b in pairwise(edges):
        yield slice(a, min(b + 1, len(stable))), bool(stable[a])


def plot_branch(
    branch: CycleBranch,
    state: str | None = None,
    ax: Axes | None = None,
    clearance: float | None = None,
) -> control.ControlPlot:
    """Draw amplitude over the parameter: stable solid, unstable dashed, special points marked."""
    name = branch.setting.model.state_names[0] if state is None else state
    checks.known("state", [name], branch.setting.model.state_names)
    factor, _ = _unit(name)
    k = branch.setting.model.state_names.index(name)
    with style():
        ax = _axes(ax, (6.8, 4.6))
        _branch_lines(ax, branch, k, factor)
        for kind, marker in SPECIAL_MARKERS.items():
            points = [s for s in branch.special if s.kind == kind]
            if points:
                x = [s.value for s in points]
                y = [factor * s.cycle.amplitudes[k] for s in points]
                text = ", ".join(f"{v:.2f}" if abs(v) >= 1.0 else f"{v:.4g}" for v in x[:3])
                more = ", ..." if len(x) > 3 else ""
                unit = " m/s" if branch.parameter == "speed" else ""
                label = f"{kind} at {text}{more}{unit}"
                ax.plot(x, y, marker, color=_INK, mfc="white", mew=1.6, ms=7, label=label, zorder=5)
        if clearance is None and name.startswith("y_w"):
            clearance = branch.setting.model.parameters.get("flange_clearance")
        _clearance_line(ax, clearance, factor)
        curvature = branch.setting.curvature
        curve = _curve(1.0 / curvature if curvature else math.inf, branch.setting.cant)
        ax.set_xlabel(_LABELS.get(branch.parameter, branch.parameter.replace("_", " ")))
        ax.set_ylabel(_axis(name, "amplitude"))
        ax.set_ylim(0.0, None)
        ax.set_title(f"{branch.model_name}, {curve}: limit cycles")
        ax.legend(loc="best")
        return _drawn(ax)


def _branch_lines(ax: Axes, branch: CycleBranch, k: int, factor: float) -> None:
    """Draw the branch with the equilibrium, whose amplitude is zero, below it."""
    value = branch.value
    amplitude = factor * np.array([c.amplitudes[k] for c in branch.cycles])
    stable = branch.stable
    hopf = branch.hopf
    if hopf is not None and hopf.speed is not None:
        value = np.concatenate([[hopf.speed], value])
        amplitude = np.concatenate([[0.0], amplitude])
        stable = np.concatenate([stable[:1], stable])
        low, high = float(value.min()), float(value.max())
        low -= 0.1 * (high - low)
        ax.plot([low, hopf.speed], [0.0, 0.0], color=STABLE, lw=2.2, clip_on=False)
        ax.plot([hopf.speed, high], [0.0, 0.0], color=UNSTABLE, ls="--", lw=2.2, clip_on=False)
        text = f"Hopf point at {hopf.speed:.2f} m/s"
        ax.plot(hopf.speed, 0.0, "*", color=_INK, ms=11, label=text, zorder=5, clip_on=False)
    drawn = set()
    for part, is_stable in stability_runs(stable):
        label = "stable" if is_stable else "unstable"
        ax.plot(
            value[part],
            amplitude[part],
            color=STABLE if is_stable else UNSTABLE,
            ls="-" if is_stable else "--",
            label=None if label in drawn else f"{label} limit cycles",
        )
        drawn.add(label)


def _clearance_line(ax: Axes, clearance: float | None, factor: float) -> None:
    if clearance is not None:
        label = f"flange clearance {factor * clearance:.3g} mm"
        ax.axhline(factor * clearance, color=NEUTRAL, lw=1.2, ls=":", label=label)


def plot_cycle(
    cycle: Cycle, states: tuple[str, str] | None = None, ax: Axes | None = None
) -> control.ControlPlot:
    """Draw a periodic motion in the plane of two states."""
    names = cycle.state_names
    chosen = (names[0], names[len(names) // 2]) if states is None else states
    checks.known("state", chosen, names)
    with style():
        ax = _axes(ax, (5.2, 4.6))
        (fx, _), (fy, _) = (_unit(name) for name in chosen)
        x, y = (cycle.states[:, names.index(name)] for name in chosen)
        ax.plot(
            fx * x,
            fy * y,
            color=STABLE if cycle.stable else UNSTABLE,
            ls="-" if cycle.stable else "--",
            label="stable" if cycle.stable else "unstable",
        )
        ax.set_xlabel(_axis(chosen[0]))
        ax.set_ylabel(_axis(chosen[1]))
        ax.set_title(f"limit cycle at {cycle.speed:.4g} m/s, {cycle.frequency:.4g} Hz")
        ax.legend()
        return _drawn(ax)


def phase_portrait(
    response: control.TimeResponseData,
    states: tuple[str, str] | None = None,
    *,
    skip: float = 0.0,
    ax: Axes | None = None,
    color: str = STABLE,
) -> control.ControlPlot:
    """Draw a simulated motion in the plane of two states, as the paper's Figs 6 to 9.

    Parameters
    ----------
    response : control.TimeResponseData
        From :func:`railenv.simulate`.
    states : (str, str), optional
        The first state and its rate when left out.
    skip : float
        Time at the start to leave out, s.
    color : str
        Of the line.
    """
    names = list(response.output_labels)
    chosen = (names[0], names[len(names) // 2]) if states is None else states
    checks.known("state", chosen, names)
    kept = np.asarray(response.time) >= checks.number("skip", skip, low=0.0, unit="s")
    outputs = np.asarray(response.outputs)[:, kept]
    with style():
        ax = _axes(ax, (5.2, 4.6))
        (fx, _), (fy, _) = (_unit(name) for name in chosen)
        x, y = (outputs[names.index(name)] for name in chosen)
        ax.plot(fx * x, fy * y, color=color, lw=0.9)
        ax.plot(fx * x[-1], fy * y[-1], "o", color=_INK, ms=5, label="end")
        ax.set_xlabel(_axis(chosen[0]))
        ax.set_ylabel(_axis(chosen[1]))
        ax.set_title(f"{response.sysname or 'motion'} from {skip:g} s")
        ax.legend()
        return _drawn(ax)


def plot_diagram(
    diagram: SimulatedDiagram,
    state: str | None = None,
    radius: float | None = None,
    ax: Axes | None = None,
) -> control.ControlPlot:
    """Draw simulated amplitudes over speed as points: a colour per curve, a marker per start."""
    name = diagram.state_names[0] if state is None else state
    checks.known("state", [name], diagram.state_names)
    factor, _ = _unit(name)
    chosen = [i for i, r in enumerate(diagram.radius) if radius in (None, r)]
    if not chosen:
        known = ", ".join(f"{r:g}" for r in diagram.radius)
        raise ParameterError(f"radius is {radius:g} m; simulated were {known}")
    fresh = ax is None
    with style():
        ax = _axes(ax, (6.8, 4.6))
        colours = _colours(len(chosen))
        for colour, i in zip(colours, chosen, strict=True):
            for j, start in enumerate(diagram.starts):
                values = factor * diagram.amplitude[name][i, :, j]
                given = ", ".join(f"{k} {_unit(k)[0] * v:g} {_unit(k)[1]}" for k, v in start.items())
                place = _curve(float(diagram.radius[i]), diagram.cant) + ", " if len(chosen) > 1 else ""
                label = f"{place}simulated from {given if len(start) < 3 else f'start {j + 1}'}"
                ax.plot(
                    diagram.speed,
                    values,
                    ".o^sD"[j % 5] if fresh else "o",
                    color=colour if fresh else _INK,
                    mfc="white" if j or not fresh else colour,
                    ms=3.5 + 1.5 * (j > 0),
                    mew=0.9,
                    label=label if len(chosen) * len(diagram.starts) <= 8 or not j else None,
                )
        if fresh:
            _clearance_line(ax, diagram.clearance if name.startswith("y_w") else None, factor)
            ax.set_xlabel("speed (m/s)")
            ax.set_ylabel(_axis(name, "amplitude"))
            where = (
                _curve(float(diagram.radius[chosen[0]]), diagram.cant) if len(chosen) == 1 else "curves"
            )
            ax.set_title(f"{diagram.model_name}, {where}: motion at the end")
            ax.set_ylim(0.0, None)
        ax.legend(loc="best", fontsize=8)
        return _drawn(ax)


def _colours(count: int) -> list[str]:
    if count <= len(SERIES):
        return list(SERIES[:count])
    import matplotlib as mpl
    from matplotlib.colors import to_hex

    return [to_hex(c) for c in mpl.colormaps["viridis"](np.linspace(0.0, 0.9, count))]


def plot_ramp(ramp: SpeedRamp, ax: Axes | None = None) -> control.ControlPlot:
    """Draw amplitude over speed along a ramp."""
    factor, _ = _unit(ramp.state)
    with style():
        ax = _axes(ax, (6.8, 4.4))
        ax.plot(ramp.speed, factor * ramp.amplitude, color=STABLE, lw=1.4, label=str(ramp))
        if ramp.critical_speed is not None:
            ax.axvline(ramp.critical_speed, color=_INK, lw=1.0, ls=":")
        ax.set_xlabel("speed (m/s)")
        ax.set_ylabel(_axis(ramp.state, "amplitude"))
        ax.set_title(f"{ramp.model_name}: slow change of speed")
        ax.legend(loc="upper left")
        return _drawn(ax)


def plot_spectrum(
    spectrum: Spectrum, ax: Axes | None = None, label: str | None = None, color: str | None = None
) -> control.ControlPlot:
    """Draw the power spectral density over frequency."""
    factor, unit = _unit(spectrum.state)
    with style():
        ax = _axes(ax)
        density = factor**2 * spectrum.density[1:]
        text = (
            f"main frequency {spectrum.main_frequency:.3f} Hz, rms {factor * spectrum.rms:.3g} {unit}"
        )
        if label is None:
            ax.axvline(spectrum.main_frequency, color=UNSTABLE, lw=1.0, ls="--", label=text)
        else:
            label = f"{label}: {text.removeprefix('main frequency ')}"
        line = color or STABLE
        ax.semilogy(spectrum.frequency[1:], density, color=line, lw=1.2, label=label)
        ax.set_xlim(0.0, 10.0 * spectrum.main_frequency)
        peak = float(density.max())
        ax.set_ylim(peak * 10.0**-_DECADES, 5.0 * peak)
        ax.set_xlabel("frequency (Hz)")
        square = f"({unit})²/Hz" if unit else "1/Hz"
        ax.set_ylabel(f"power spectral density of {spectrum.state} ({square})")
        ax.set_title("power spectral density")
        ax.legend()
        return _drawn(ax)


def plot_map(chart: HuntingMap, ax: Axes | None = None) -> control.ControlPlot:
    """Draw where a vehicle never hunts, may hunt and must hunt."""
    with style():
        ax = _axes(ax, (6.8, 4.6))
        x, hopf, fold = chart.value, chart.hopf_speed, chart.fold_speed
        lower = np.where(np.isnan(fold), hopf, np.fmin(fold, hopf))
        top = 1.12 * float(np.nanmax(hopf))
        bottom = 0.85 * float(np.nanmin(lower))
        ax.fill_between(x, bottom, lower, color=STABLE, alpha=0.16, lw=0, label="never hunts")
        ax.fill_between(x, lower, hopf, color=SERIES[1], alpha=0.28, lw=0, label="may hunt")
        ax.fill_between(x, hopf, top, color=UNSTABLE, alpha=0.20, lw=0, label="must hunt")
        ax.plot(x, hopf, "o-", color=UNSTABLE, ms=4, label="Hopf point")
        ax.plot(x, fold, "s-", color=STABLE, ms=4, label="fold of limit cycles")
        ax.set_ylim(bottom, top)
        ax.set_xlim(float(x.min()), float(x.max()))
        ax.set_xlabel(_LABELS.get(chart.parameter, chart.parameter.replace("_", " ")))
        ax.set_ylabel("speed (m/s)")
        ax.set_title(f"{chart.model_name}: where it hunts")
        ax.legend(loc="best")
        return _drawn(ax)
