"""The cost of the paper's simplifications: contact, body at rest, and straight axles on a curve."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

import railenv
from design.reproduction import paper
from design.reproduction.document import fragment
from design.reproduction.drawing import INK, legend_below, panel
from design.reproduction.section import Data, DataTable, Drawing, Section
from design.reproduction.simplifications import (
    AMPLITUDE,
    BODIES,
    CONTACTS,
    LINEAR,
    PAPERS,
    PROFILES,
    Simplified,
    of,
    results,
)
from design.reproduction.store import Piece
from design.style import SERIES
from railenv.contact.laws import LinearProfile

_READINGS = (
    ("tangent", "tangent, linear", "o"),
    ("persists_from", "tangent, hunting persists from", "D"),
    ("without_curving", "curve without wheelbase curving", "s"),
    ("with_curving", "curve with wheelbase curving", "^"),
)
"""Field of a case, its label, and its mark."""

HEADER = ("contact", "body", *(words for _, words, _ in _READINGS), "mode lost")
"""Headings of the table."""

_COLORS = {"at rest": SERIES[0], "moving": SERIES[1]}


class Simplifications(Section):
    """The same coach on four contacts, under a body at rest and a moving one."""

    key = "simplifications"
    title = "What the simplifications cost"

    def pieces(self) -> tuple[Piece, ...]:
        """Return no pieces: the cases were computed ahead, since coaches compile for minutes."""
        return ()

    def text(self, data: Data) -> Markup:
        """Return the simplifications and the table."""
        found = results()
        linear = CONTACTS[LINEAR]
        assert isinstance(linear, LinearProfile)
        first, last = of(found, PAPERS, "at rest"), of(found, PROFILES, "moving")
        paragraphs = [
            f"The same coach ({railenv.HIGH_SPEED_COACH.name}, everything else equal) with one "
            "simplification of the paper after the other taken back. Contact: the paper's cone; a cone "
            f"with the conicity that S1002 wheels on UIC 60 rails have at {1e3 * AMPLITUDE:g} mm "
            f"({linear.conicity:.3f}); a linear profile with their contact angle "
            f"({linear.contact_angle:.3f} rad) and its rate ({linear.contact_angle_rate:.1f} rad/m) "
            "too; the profiles themselves. Body: at rest above one bogie, as the paper's load, or a "
            "body that moves on two bogies. Curve: the paper's, with its angle within the wheelbase "
            "left out, as in the paper, or turning the wheelsets of a bogie against the frame.",
            _summary(first, last),
            *_shares(found),
        ]
        return fragment(
            "table.html",
            paragraphs=paragraphs,
            caption=f"Speeds in m/s; curve: R = {paper.RADIUS:g} m, cant {paper.CANT} rad, linear.",
            header=HEADER,
            rows=rows(found),
            words=2,
        )

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw all speeds of the table."""
        return (draw(results()),)

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the table."""
        header = (
            "contact",
            "body",
            "tangent_m_per_s",
            "persists_from_m_per_s",
            "without_curving_m_per_s",
            "with_curving_m_per_s",
            "mode",
        )
        numbers = [
            (one.contact, one.body, *(getattr(one, field) for field, *_ in _READINGS), one.mode)
            for one in results()
        ]
        return (DataTable("simplifications", header, numbers),)


def draw(found: tuple[Simplified, ...]) -> Drawing:
    """Draw the speeds, a row for each contact and body."""
    figure, ax = panel("", 5.2)
    places = np.arange(len(found))[::-1] - np.repeat(np.arange(len(CONTACTS)), len(BODIES)) * 0.4
    for place, one in zip(places, found, strict=True):
        speeds = [getattr(one, field) for field, *_ in _READINGS]
        color = _COLORS[one.body]
        ax.plot([min(speeds), max(speeds)], [place, place], color=color, lw=1.0, alpha=0.5)
        for speed, (_, _, mark) in zip(speeds, _READINGS, strict=True):
            ax.plot(speed, place, mark, color=color, ms=5.5, mfc="none" if mark == "D" else color)
    middles = places.reshape(len(CONTACTS), len(BODIES)).mean(axis=1)
    ax.set_yticks(middles, [name.replace(" on ", "\non ").replace(", ", ",\n") for name in CONTACTS])
    ax.tick_params(axis="y", length=0)
    ax.grid(visible=False, axis="y")
    ax.set_xlabel("speed (m/s)")
    handles = [
        ax.plot([], [], mark, color=INK, ms=5.5, mfc="none" if mark == "D" else INK, label=words)[0]
        for _, words, mark in _READINGS
    ]
    handles += [
        ax.plot([], [], color=_COLORS[body], lw=3.0, label=f"body {body}")[0] for body in BODIES
    ]
    legend_below(figure, handles)
    caption = (
        "What each simplification does to the speed at which the coach hunts; curve: "
        f"R = {paper.RADIUS:g} m, cant {paper.CANT} rad."
    )
    return Drawing("simplifications", figure, caption)


def rows(found: tuple[Simplified, ...]) -> list[tuple[str, ...]]:
    """Return the table, a row for each contact and body."""
    return [
        (one.contact, one.body, *(f"{getattr(one, field):.1f}" for field, *_ in _READINGS), one.mode)
        for one in found
    ]


def _summary(first: Simplified, last: Simplified) -> str:
    return (
        f"All together: {first.without_curving:.1f} m/s on the curve as the paper models it, "
        f"{last.with_curving:.1f} m/s with profiles, a moving body and wheelbase curving; on tangent "
        f"track hunting persists from {first.persists_from:.1f} and {last.persists_from:.1f} m/s, and "
        f"the linear critical speeds are {first.tangent:.1f} and {last.tangent:.1f} m/s."
    )


def _shares(found: tuple[Simplified, ...]) -> list[str]:
    """Return the least and the largest change by each simplification alone."""
    body = [
        of(found, name, "moving").tangent / of(found, name, "at rest").tangent - 1.0
        for name in CONTACTS
    ]
    curving = [one.with_curving / one.without_curving - 1.0 for one in found]
    persists = [one.persists_from / one.tangent - 1.0 for one in found]
    return [
        f"The moving body changes the linear critical speed by {_range(body)}, wheelbase curving that "
        f"on the curve by {_range(curving)}. The linear answer is a simplification itself: against it "
        f"the speed from which hunting persists differs by {_range(persists)}. What one simplification "
        "costs depends on the others: on profiles, where the contact angle grows with the shift, the "
        "body matters least, and a curve moves the wheelsets to where the contact is another."
    ]


def _range(changes: list[float]) -> str:
    return f"{max(changes):.0%} to {min(changes):.0%}".replace("-", "\u2212")
