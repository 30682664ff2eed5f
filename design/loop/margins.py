"""Stability margins of a sampled closed loop in gain, phase and delay."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import control
import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from design.loop.sampled import ClosedLoop, SampledDynamics, Settled
from railenv import checks
from railenv.models import Model

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LONGEST_DELAY = 0.2
"""Default limit of the search for the delay margin: additional delay, s."""

_GRID, _NEAR = 1200, 41  # frequencies over the whole range, and about each resonance
_LOWEST = 1e-4  # of Nyquist's frequency
_SCAN = 0.5  # of a control period: step of the search for the delay margin
_DELAY_ROOT = 1e-9  # s
_ROOT = 1e-12  # of a frequency


@dataclass(frozen=True)
class ChannelMargins:
    """Margins of one command, with the other loops closed.

    Attributes
    ----------
    channel : str
        The command.
    gain_margin : float
        Factor by which the gain may grow before stability is lost; ``math.inf`` if there is no limit.
    gain_reduction : float
        Factor to which it may fall; 0 if the loop is stable without this command.
    phase_margin : float
        Phase lag or lead, rad; ``math.inf`` if no phase makes the loop unstable.
    gain_frequency, reduction_frequency, phase_frequency : float or None
        Frequency of the oscillation that begins there, Hz.
    disk_margin : float
        Balanced disk margin: gain and phase may vary together by the disk of this size.
    disk_gain_margin : float
        Factor by which the gain may grow or shrink within the disk.
    disk_phase_margin : float
        Phase within the disk, rad.
    disk_frequency : float
        Frequency where the loop is closest to instability, Hz.
    loop : control.StateSpace
        Its loop transfer function, for negative feedback.
    """

    channel: str
    gain_margin: float
    gain_reduction: float
    phase_margin: float
    gain_frequency: float | None
    reduction_frequency: float | None
    phase_frequency: float | None
    disk_margin: float
    disk_gain_margin: float
    disk_phase_margin: float
    disk_frequency: float
    loop: control.StateSpace = field(repr=False, compare=False)

    def __str__(self) -> str:
        return (
            f"{self.channel}: gain {self.gain_reduction:.4g} to {self.gain_margin:.4g}, phase "
            f"{math.degrees(self.phase_margin):.1f}°, disk {self.disk_margin:.3f} (gain "
            f"{self.disk_gain_margin:.3g}, phase {math.degrees(self.disk_phase_margin):.1f}°)"
        )

    def summary(self) -> dict[str, Any]:
        """Return the numbers, ready for JSON; None where there is no limit."""
        names = [f for f in self.__dataclass_fields__ if f != "loop"]
        values = {name: getattr(self, name) for name in names}
        return {n: None if v == math.inf else v for n, v in values.items()}


@dataclass(frozen=True)
class Margins:
    """Margins of a closed loop at one running condition.

    Attributes
    ----------
    closed_loop : ClosedLoop
        The loop, with its least damped mode.
    delay : float
        Transport delay of the loop, s.
    channels : tuple of ChannelMargins
        Margins of each command; empty if the closed loop is unstable.
    disk_margin, disk_gain_margin, disk_phase_margin : float or None
        As in ChannelMargins (factor, rad), but all commands vary at once, independently of each other.
    disk_frequency : float or None
        Hz.
    delay_margin : float or None
        Additional transport delay (s) of all commands at which stability is lost; None if there is none
        up to ``longest_delay``, or the loop is unstable.
    delay_frequency : float or None
        Frequency of the oscillation that begins there, Hz.
    longest_delay : float
        Limit of the search: additional delay, s.
    """

    closed_loop: ClosedLoop
    delay: float
    channels: tuple[ChannelMargins, ...]
    disk_margin: float | None
    disk_gain_margin: float | None
    disk_phase_margin: float | None
    disk_frequency: float | None
    delay_margin: float | None
    delay_frequency: float | None
    longest_delay: float

    @property
    def stable(self) -> bool:
        """Whether the closed loop is stable; there are no margins otherwise."""
        return self.closed_loop.stable

    @property
    def least_damped(self) -> complex:
        """Eigenvalue (1/s) of the mode with the smallest damping ratio, imaginary part not negative."""
        values = self.closed_loop.eigenvalues
        k = int(np.argmin(np.where(values.imag >= 0.0, self.closed_loop.damping, np.inf)))
        return complex(values[k])

    def __getitem__(self, channel: str) -> ChannelMargins:
        """Return the margins of one command by its name."""
        checks.known("channel", [channel], [c.channel for c in self.channels])
        return next(c for c in self.channels if c.channel == channel)

    def __str__(self) -> str:
        lines = [str(self.closed_loop)]
        if not self.stable:
            return "\n".join([*lines, "no margins: the closed loop is unstable"])
        mode = self.least_damped
        lines.append(
            f"least damped mode: {abs(mode.imag) / (2.0 * math.pi):.4g} Hz, damping ratio "
            f"{-mode.real / abs(mode):.4g}"
        )
        lines += [str(c) for c in self.channels]
        if len(self.channels) > 1 and self.disk_margin is not None:
            lines.append(f"all commands at once: disk {self.disk_margin:.3f}")
        if self.delay_margin is None:
            lines.append(
                f"delay: more than {self.longest_delay:g} s above the present {self.delay:g} s"
            )
        else:
            lines.append(
                f"delay: {self.delay_margin:.5f} s above the present {self.delay:g} s, then "
                f"{self.delay_frequency:.4g} Hz"
            )
        return "\n".join(lines)

    def summary(self) -> dict[str, Any]:
        """Return plain numbers and strings, ready for JSON; None where there is no limit."""
        loop, mode = self.closed_loop, self.least_damped
        several = ("disk_margin", "disk_gain_margin", "disk_phase_margin", "disk_frequency")
        numbers = {name: getattr(self, name) for name in several}
        return {
            "model": loop.model_name,
            "speed": loop.speed,
            "radius": None if math.isinf(loop.radius) else loop.radius,
            "cant": loop.cant,
            "period": loop.period,
            "delay": self.delay,
            "stable": self.stable,
            "spectral_radius": loop.spectral_radius,
            "least_damped": {
                "growth": mode.real,
                "frequency": abs(mode.imag) / (2.0 * math.pi),
                "damping": -mode.real / abs(mode),
            },
            "channels": [c.summary() for c in self.channels],
            **{name: None if value == math.inf else value for name, value in numbers.items()},
            "delay_margin": self.delay_margin,
            "delay_frequency": self.delay_frequency,
            "longest_delay": self.longest_delay,
        }

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the Nyquist curves of the channels, with the disk that they avoid."""
        from design.loop.margin_plots import plot_margins

        return plot_margins(self, ax)


def margins(
    model: Model,
    controller: Any,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    period: float | None = None,
    delay: float | None = None,
    channel: str | None = None,
    longest_delay: float = LONGEST_DELAY,
) -> Margins:
    """Compute the stability margins of a vehicle under a sampled controller, about their equilibrium.

    Each command is opened between controller and actuator, while the others stay closed. Gain and
    phase margins are taken where the frequency response of the exact discrete loop, in state space,
    crosses the negative real axis and the unit circle. Disk margins are those of
    ``control.disk_margins``. The delay margin comes from the map over a period: the delay grows from 0
    until a multiplier leaves the unit circle.

    Parameters
    ----------
    model : Model
        A :class:`railenv.Equipped` vehicle, or any other model whose inputs the controller commands.
    controller : array_like, control.StateSpace or Feedback
        See :func:`design.loop.feedback.as_feedback`.
    speed : float
        Forward speed, m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track, negative the other hand) and cant (rad).
    period : float, optional
        Control period, s; the controller's own, or 0.005 s.
    delay : float, optional
        Transport delay of the commands, s; the actuator's own, or none.
    channel : str, optional
        The only command to report; all when left out.
    longest_delay : float
        Additional delay up to which the delay margin is searched, s.

    Returns
    -------
    Margins

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium, or none under the controller.
    UnknownNameError
        If the controller does not command the channel.

    Examples
    --------
    >>> import control, design, railenv
    >>> model = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))
    >>> damper = control.ss([], [], [], [[-2e5]], 0.005, inputs=["gyro_b"], outputs=["command_b"])
    >>> found = design.margins(model, damper, speed=130.0)
    >>> round(found["command_b"].gain_margin, 3), round(found.delay_margin, 4)
    (3.608, 0.0708)
    """
    longest = checks.number("longest_delay", longest_delay, low=0.0, open_low=True, unit="s")
    sampled = SampledDynamics(model, controller, period=period, delay=delay)
    names = list(sampled.feedback.output_labels)
    if channel is not None:
        checks.known("channel", [channel], names)
    about = sampled.settled(speed, radius, cant)
    closed = sampled.closed(about, radius)
    if not closed.stable:
        return Margins(closed, sampled.delay, (), None, None, None, None, None, None, longest)
    opened = sampled.loop(*about)
    omega = frequencies(opened)
    chosen = names if channel is None else [channel]
    channels = tuple(_channel(opened, name, omega) for name in chosen)
    disk = _disk(opened, omega)
    limit = _delay_margin(sampled, about, longest)
    return Margins(closed, sampled.delay, channels, *disk, *limit, longest)


def response(loop: control.StateSpace, omega: Array) -> Complex:
    """Return the frequency response of a discrete loop, shape (n_omega, n_outputs, n_inputs)."""
    return np.moveaxis(np.atleast_3d(loop(np.exp(1j * omega * loop.dt), squeeze=False)), -1, 0)


def frequencies(opened: control.StateSpace) -> Array:
    """Return frequencies (rad/s) up to Nyquist's, dense around resonances of open and closed loop."""
    period = float(opened.dt)
    nyquist = math.pi / period
    chosen = [np.geomspace(_LOWEST, 1.0, _GRID) * nyquist, np.linspace(0.0, nyquist, _GRID)[1:-1]]
    poles = np.concatenate([opened.poles(), np.linalg.eigvals(opened.A - opened.B @ opened.C)])
    poles = poles[np.abs(poles) > 1e-6]
    spread = np.tan(np.linspace(-1.5, 1.5, _NEAR))
    for z in poles[poles.imag > 0.0]:
        s = np.log(z) / period
        chosen.append(s.imag + spread * max(abs(s.real), 1e-6 * s.imag))
    omega = np.unique(np.concatenate(chosen))
    return omega[(omega >= _LOWEST * nyquist) & (omega <= nyquist * (1.0 - 1e-9))]


def _others_closed(loop: control.StateSpace, name: str) -> control.StateSpace:
    """Return the loop of one command with negative feedback around all others (without D)."""
    names = list(loop.output_labels)
    k = names.index(name)
    rest = [i for i in range(len(names)) if i != k]
    A = loop.A - loop.B[:, rest] @ loop.C[rest]
    return control.ss(A, loop.B[:, [k]], loop.C[[k]], 0, loop.dt, inputs=[name], outputs=[name])


def _channel(opened: control.StateSpace, name: str, omega: Array) -> ChannelMargins:
    loop = _others_closed(opened, name)
    w_gain = _crossings(loop, omega, lambda value: value.imag)
    w_gain = np.concatenate([w_gain, [0.0, math.pi / loop.dt]])  # it is also real at the ends
    at = response(loop, w_gain)[:, 0, 0].real
    w_gain, gains = w_gain[at < 0.0], -1.0 / at[at < 0.0]
    up = _nearest(gains, w_gain, gains > 1.0, min, math.inf)
    down = _nearest(gains, w_gain, gains < 1.0, max, 0.0)
    w_phase = _crossings(loop, omega, lambda value: abs(value) - 1.0)
    angles = np.abs(np.angle(-response(loop, w_phase)[:, 0, 0]))
    phase = _nearest(angles, w_phase, np.ones(len(angles), dtype=bool), min, math.inf)
    disk, disk_gain, disk_phase, disk_frequency = _disk(loop, omega)
    return ChannelMargins(
        channel=name,
        gain_margin=up[0],
        gain_reduction=down[0],
        phase_margin=phase[0],
        gain_frequency=up[1],
        reduction_frequency=down[1],
        phase_frequency=phase[1],
        disk_margin=disk,
        disk_gain_margin=disk_gain,
        disk_phase_margin=disk_phase,
        disk_frequency=disk_frequency,
        loop=loop,
    )


def _crossings(loop: control.StateSpace, omega: Array, function: Callable[[complex], float]) -> Array:
    """Return the frequencies (rad/s) at which a function of the response passes zero."""

    def at(w: float) -> float:
        return function(complex(response(loop, np.array([w]))[0, 0, 0]))

    values = np.array([function(complex(z)) for z in response(loop, omega)[:, 0, 0]])
    found = np.flatnonzero((values[:-1] < 0.0) != (values[1:] < 0.0))
    roots = [optimize.brentq(at, omega[k], omega[k + 1], xtol=_ROOT * omega[k]) for k in found]
    return np.array(roots, dtype=float)


def _nearest(
    values: Array,
    omega: Array,
    chosen: NDArray[np.bool_],
    pick: Callable[[Array], float],
    otherwise: float,
) -> tuple[float, float | None]:
    """Return the smallest or largest of some values, and its frequency (Hz)."""
    if not chosen.any():
        return otherwise, None
    value = pick(values[chosen])
    return float(value), float(omega[chosen][values[chosen] == value][0]) / (2.0 * math.pi)


def _disk(loop: control.StateSpace, omega: Array) -> tuple[float, float, float, float]:
    """Return disk margin, its gain (factor) and phase (rad), and the frequency (Hz)."""
    coarse = control.disk_margins(loop, omega, returnall=True)[0]
    k = int(np.argmin(coarse))
    near = np.linspace(omega[max(k - 1, 0)], omega[min(k + 1, len(omega) - 1)], _NEAR)
    size, gain, phase = control.disk_margins(loop, near, returnall=True)
    k = int(np.argmin(size))
    factor = float(control.db2mag(gain[k])) if math.isfinite(gain[k]) else math.inf
    return float(size[k]), factor, math.radians(phase[k]), float(near[k]) / (2.0 * math.pi)


def _delay_margin(
    sampled: SampledDynamics, about: Settled, longest: float
) -> tuple[float | None, float | None]:
    """Return the additional delay (s) at which stability is lost, and the frequency (Hz) there."""

    def multipliers(extra: float) -> Complex:
        late = SampledDynamics(sampled.model, sampled.feedback, delay=sampled.delay + extra)
        return np.linalg.eigvals(late.matrix(*about)).astype(complex)  # the delay does not change it

    def excess(extra: float) -> float:
        return float(np.abs(multipliers(extra)).max()) - 1.0

    step = _SCAN * sampled.period
    stable = 0.0
    while stable < longest:
        tried = min(stable + step, longest)
        if excess(tried) > 0.0:
            limit = float(optimize.brentq(excess, stable, tried, xtol=_DELAY_ROOT))
            values = multipliers(limit)
            angle = abs(float(np.angle(values[np.argmax(np.abs(values))])))
            return limit, angle / (2.0 * math.pi * sampled.period)
        stable = tried
    return None, None
