"""Compute the numbers of docs/contact.md and draw its pictures: ``python docs/make_contact.py``.

The text around the tables is edited in the page itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from blocks import refilled
from matplotlib.figure import Figure

import design
import railenv
from design.style import style
from railenv.contact.hertz import wheel_ellipse
from railenv.contact.laws import ContactLaw
from railenv.contact.pair import STEP, WIDTH

PAGE = Path(__file__).resolve().parent / "contact.md"
PICTURES = PAGE.parent / "pictures"

COACH = railenv.HIGH_SPEED_COACH
ON_PROFILES = railenv.HIGH_SPEED_COACH_S1002
HOLLOW = railenv.HIGH_SPEED_COACH_HOLLOW
WHEELS = ("S1002", "S1002_WORN")
WIDTHS = (0.5 * WIDTH, WIDTH, 2.0 * WIDTH)
AMPLITUDE = 3e-3
"""m; the amplitude that standards name."""


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table whose columns after the first are numbers."""
    lines = [headings, ["---", *["---:"] * (len(headings) - 1)], *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def _onset(vehicle: railenv.Vehicle) -> tuple[str, str]:
    """Return critical speed and frequency on tangent track."""
    found = design.critical_speed(railenv.Bogie(vehicle))
    return f"{found.speed:.1f} m/s", f"{found.frequency:.2f} Hz"


def _lowest(vehicle: railenv.Vehicle) -> str:
    """Return the lowest speed of hunting on the branch from the critical speed."""
    branch = design.cycle_branch(railenv.Bogie(vehicle), parameter_range=(30.0, 110.0))
    return f"{branch.nonlinear_critical_speed:.1f} m/s"


def _parameters(law: ContactLaw) -> tuple[str, str, str]:
    """Return the linear parameters for small motions."""
    found = law.linear(1e-4)
    return f"{found.conicity:.3f}", f"{found.contact_angle:.3f}", f"{found.contact_angle_rate:.1f} 1/m"


def laws() -> str:
    """Hopf point of the coach on contact laws side by side."""
    linear = COACH.replace(contact=railenv.LinearProfile(0.2, 0.03, 13.6))
    cases = [
        *((f"`Cone({c:g})`", COACH.replace(conicity=c)) for c in (0.05, 0.2, 0.4)),
        ("`LinearProfile(0.2, 0.03, 13.6)`", linear),
        *(
            (f"`HollowTread({c:g}, 0.034, 0.3)`", HOLLOW.replace(conicity=c))
            for c in (0.05, 0.1, 0.2, 0.4)
        ),
        ("S1002, new", ON_PROFILES),
        ("S1002, worn", railenv.HIGH_SPEED_COACH_S1002_WORN),
    ]
    rows = [(name, *_parameters(v.contact), *_onset(v)) for name, v in cases if v.contact]
    return table(("contact", "conicity", "contact angle", "its rate", "hunts from", "at"), rows)


def profiles() -> str:
    """Equivalent conicity of the profiles over the amplitude."""
    amplitudes = (0.0005, 0.001, 0.002, 0.003, 0.004, 0.006)
    rows = []
    for wheel in WHEELS:
        pair = railenv.ProfilePair(wheel)
        found = pair.equivalent_conicity(amplitudes)
        rows.append((f"`{wheel}`", *(f"{value:.3f}" for value in found)))
    return table(("wheel", *(f"{1e3 * a:g} mm" for a in amplitudes)), rows)


def _pair(wheel: str, width: float) -> railenv.ProfilePair:
    return railenv.ProfilePair(wheel, width=width, step=STEP * min(1.0, width / WIDTH))


def patches() -> str:
    """Width that belongs to a wheel load."""
    rows = []
    for load in (10e3, 30e3, 55.9e3, 110e3):
        lateral = wheel_ellipse(load, COACH.wheel_radius, 0.3).lateral
        width = lateral**2 / (5.0 * 0.3)
        rows.append((f"{1e-3 * load:g} kN", f"{1e3 * lateral:.1f} mm", f"{width:.2g} m"))
    return table(("wheel load", "lateral semi-axis", "width"), rows)


def widths() -> str:
    """How much conicity and critical speed depend on the width."""
    rows = []
    for wheel in WHEELS:
        for width in WIDTHS:
            pair = _pair(wheel, width)
            small, usual = pair.equivalent_conicity([1e-3, AMPLITUDE])
            vehicle = ON_PROFILES.replace(contact=pair)
            onset = _onset(vehicle)
            angle_rate = pair.linear(1e-4).contact_angle_rate
            cells = (f"{small:.3f}", f"{usual:.3f}", f"{angle_rate:.1f} 1/m", *onset, _lowest(vehicle))
            rows.append((f"`{wheel}`, {width:.2g} m", *cells))
    headings = ("wheel, width", "conicity at 1 mm", "at 3 mm", "rate of the angle, small motions")
    return table((*headings, "hunts from", "at", "down to"), rows)


MADE = {"profiles": profiles, "laws": laws, "patches": patches, "widths": widths}


def page(text: str) -> str:
    """Return the page with its tables made anew."""
    return refilled(text, MADE)


def _speeds(vehicle: railenv.Vehicle, conicities: Sequence[float]) -> list[float]:
    models = (railenv.Bogie(vehicle.replace(conicity=c)) for c in conicities)
    return [design.critical_speed(model).speed or math.nan for model in models]


def conicity_picture() -> Figure:
    """Draw the critical speed over the conicity, for a cone and a hollow tread."""
    conicities = [0.035, *(0.01 * k for k in range(4, 51))]
    with style():
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        ax = figure.subplots()
        ax.plot(conicities, _speeds(COACH, conicities), color="#5c666b", label="cone")
        ax.plot(conicities, _speeds(HOLLOW, conicities), color="#1f6f8b", label="hollow tread")
        for wheel, mark in zip(WHEELS, ("o", "s"), strict=True):
            pair = railenv.ProfilePair(wheel)
            found = design.critical_speed(railenv.Bogie(ON_PROFILES.replace(contact=pair)))
            at = pair.equivalent_conicity(AMPLITUDE)
            ax.plot([at], [found.speed], mark, color="#c8432b", label=f"{wheel}, conicity at 3 mm")
        ax.set_xlabel("conicity")
        ax.set_ylabel("critical speed (m/s)")
        ax.set_ylim(bottom=0.0)
        ax.set_title("coach bogie on tangent track", loc="left")
        ax.legend()
        return figure


def draw() -> None:
    """Draw the pictures of the page."""
    mpl.use("agg")
    railenv.ProfilePair().plot().savefig(PICTURES / "contact-s1002.png", dpi=110)
    conicity_picture().savefig(PICTURES / "contact-conicity.png", dpi=120)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    draw()
    print(f"wrote {PAGE.name} and its pictures")
