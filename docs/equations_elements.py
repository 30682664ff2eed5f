"""Equations of the force elements on docs/physics.md."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import sympy
from equations_shown import BEYOND, Shown, rows
from symbols import SIDE, marks
from written import traced

from railenv.equations import elements, motion
from railenv.equations.coordinates import Motion, Running, Wrench
from railenv.equations.elements import Arm, End, Relative

_AXES = ("x", "y", "z")
_MOVES = r"x y z \phi \theta \psi"
SEEN = Relative(
    *marks(" ".join(rf"d_{{{c}}}" for c in _MOVES.split())),
    *marks(" ".join(rf"\dot~d_{{{c}}}" for c in _MOVES.split())),
)
"""What an element sees: displacements and rates."""

WRENCH = Wrench(*marks("F_{x} F_{y} F_{z} M_{x} M_{y} M_{z}"))
_HEIGHT = sympy.Symbol("h")
STATE, INPUT = sympy.Symbol("q"), sympy.Symbol("u")


def _moving(index: str = "") -> Motion:
    """Return all coordinates of a body, its pitch among them."""
    marked = f"_{{{index}}}" if index else ""
    names = ("y", "z", r"\phi", r"\psi")
    here = [sympy.Symbol(f"{c}{marked}") for c in (*names, r"\theta")]
    rate = [sympy.Symbol(rf"\dot {c}{marked}") for c in (*names, r"\theta")]
    return Motion(*here[:4], *rate[:4], here[4], rate[4])


def _arm(index: str = "") -> Arm:
    marked = f"_{{{index}}}" if index else ""
    return Arm(*(sympy.Symbol(f"{c}{marked}") for c in "XYZ"))


def _end(index: str) -> End:
    """Return an end of an element in the body A or B, where the track is that of the body's place."""
    track = rf"V \kappa_{{{index}}} \phi_{{se{index}}} \kappa'_{{{index}}} \phi'_{{se{index}}}"
    return End(_arm(index), _moving(index), Running(*marks(track)))


_A, _B = _end("A"), _end("B")


def _element(**own: Any) -> SimpleNamespace:
    """Return an element whose numbers are symbols; ``own`` has those that are not called as usual."""
    numbers = {name: sympy.Symbol(name) for name in ("k", "c")}
    for kind in ("k", "c"):
        numbers |= {f"{kind}_{axis}": sympy.Symbol(f"{kind}_{{{axis}}}") for axis in _AXES}
    numbers |= {f"k_{name}": sympy.Symbol(rf"k_{{\{mark}}}") for name, mark in _BENDING.items()}
    usual = {"y": sympy.Symbol("Y"), "pair": False, "force": None, "axis": "y"}
    return SimpleNamespace(**numbers | usual | own)


_BENDING = {"roll": "phi", "pitch": "theta", "yaw": "psi"}


def _law(law: Any, **own: Any) -> tuple[Wrench, list[Any]]:
    wrench, rates = traced(law, _element(**own), SEEN, [STATE], [INPUT])
    return wrench, list(rates)


# ------------------------------------------------------------------------- attachments


def _attachment() -> list[str]:
    here, _ = traced(elements.point, _arm(), _moving())
    return rows("u_{x} ; u_{y} ; u_{z}", here[:3])


def _relative() -> list[str]:
    seen = traced(elements.relative, _A, _B, _HEIGHT, sympy.Symbol("c"))
    names: dict[Any, Any] = {}
    for index, end in zip("AB", (_A, _B), strict=True):
        here, _ = traced(elements.point, end.arm, end.motion)
        names |= {u: sympy.Symbol(f"u_{{{c}{index}}}") for u, c in zip(here[:3], _AXES, strict=True)}
    place, _ = traced(elements.track_between, _A, _B, _HEIGHT)
    moves = ("x", "y", "z", r"\phi", r"\theta", r"\psi")
    for moved, c in zip(place, moves, strict=True):
        if moved != 0:
            names[moved] = sympy.Symbol(f"t_{{{c}}}")
    return rows(" ; ".join(f"d_{{{c}}}" for c in moves), seen[:6], names)


def _track_between() -> list[str]:
    place, rate = traced(elements.track_between, _A, _B, _HEIGHT)
    turn, twist = sympy.Symbol(r"\vartheta"), sympy.Symbol(r"\varphi")
    found: list[str] = []
    for parts, dot in ((place, ""), (rate, r"\dot ")):
        turned, twisted = parts[0].args[0], parts[3]
        names = {turned: sympy.Symbol(f"{dot}{turn}"), twisted: sympy.Symbol(f"{dot}{twist}")}
        found += rows(rf"{dot}{turn} ; {dot}{twist}", [turned, twisted])
        moves = (("x", 0), ("y", 1), ("z", 2), (r"\phi", 3), (r"\psi", 5))
        lefts = " ; ".join(rf"{dot}t_{{{c}}}" for c, _ in moves)
        found += rows(lefts, [parts[i] for _, i in moves], names)
    return found


def _lean() -> list[str]:
    """Return the mean lean of both bodies, and the vertical stretch to second order."""
    with sympy.evaluate(False):
        means = _mean_lean("")
        names = dict(zip(means, _LEAN, strict=True))
        dots = marks(r"\dot~\bar~\phi \dot~\bar~\theta")
        rates = dict(zip(_mean_lean("d"), dots, strict=True))
    seen = traced(elements.lean, _A, _B, SEEN)
    return [
        *rows(r"\bar \phi ; \bar \theta", means),
        *rows(r"d_{z}^{\ast}", [seen.z], names),
        *rows(r"\dot d_{z}^{\ast}", [seen.dz], names | rates),
    ]


_LEAN = marks(r"\bar~\phi \bar~\theta")


def _mean_lean(rate: str) -> tuple[Any, Any]:
    """Return roll and pitch of the vertical between both bodies, or their rates."""
    return tuple(
        getattr(_A.motion, rate + own) + getattr(SEEN, rate + seen) / 2
        for own, seen in (("phi", "roll"), ("theta", "pitch"))
    )


def _where_moved_to() -> list[str]:
    with sympy.evaluate(False):
        names = dict(zip(_mean_lean(""), _LEAN, strict=True))
    on_a, on_b = traced(elements.where_moved_to, _A, _B, SEEN, WRENCH.force_z)
    found: list[str] = []
    for index, on in (("A", on_a), ("B", on_b)):
        lefts = " ; ".join(
            f"{c}_{{{axis}{index}}}" for c in (r"\Delta F", r"\Delta M") for axis in "xy"
        )
        found += rows(lefts, [on.force_x, on.force_y, on.roll, on.pitch], names)
    return found


def _at_centre() -> list[str]:
    found = traced(elements.at_centre, _arm(), WRENCH)
    return rows(r"M_{x}^{c} ; M_{y}^{c} ; M_{z}^{c}", [found.roll, found.pitch, found.yaw])


# ------------------------------------------------------------------------------- laws


def _spring() -> list[str]:
    wrench, _ = _law(elements.spring, pair=True)
    return rows(" ; ".join(map(str, WRENCH)), wrench)


def _along() -> list[str]:
    """Stretch of an element along each axis, on the side of a pair that the sign says."""
    found = [traced(elements.stretch, SIDE, _element(axis=axis), SEEN)[0] for axis in _AXES]
    return rows(r"e_{x\sigma} ; e_{y\sigma} ; e_{z\sigma}", found)


_ALONG = {SEEN.y: sympy.Symbol("e"), SEEN.dy: sympy.Symbol(r"\dot e")}
"""An element across, without arm, shows its law with nothing around it."""


def _laws() -> list[str]:
    """Return what each element gives, and the rate of its own state, as a table."""
    table, inverse = sympy.Symbol("T"), sympy.Symbol("T^{-1}")
    friction = _law(elements.friction, force=sympy.Symbol("F_{f}"), width=sympy.Symbol(r"w_{f}"))[
        0
    ].force_y
    series, (rate,) = _law(elements.series_damper)
    (by_table,) = _law(elements.series_damper, force=inverse)[1]
    laws = {
        "`Damper`": [("F", _law(elements.damper)[0].force_y)],
        "`Damper` with a table $T$": [("F", _law(elements.damper, force=table)[0].force_y)],
        "`SeriesDamper`": [("F", series.force_y), (r"\dot q", rate)],
        "`SeriesDamper` with a table $T$": [("F", series.force_y), (r"\dot q", by_table)],
        "`Stop`": [("F", _law(elements.stop, force=table)[0].force_y)],
        "`FrictionElement`": [("F", friction)],
        "`RollBar`": [("M_{x}", _law(elements.roll_bar)[0].roll)],
        "`TractionRod`": [("F_{x}", _law(elements.traction_rod)[0].force_x)],
        "`YawMoment`": [("M_{z}", _law(elements.yaw_moment)[0].yaw)],
        "`LateralForce`": [("F_{y}", _law(elements.lateral_force)[0].force_y)],
    }
    lines = ["| element | gives |", "|---|---|"]
    for name, given in laws.items():
        with sympy.evaluate(False):
            shown = [(left, expression.xreplace(_ALONG)) for left, expression in given]
        texts = [rows(left, [expression])[0].replace("&= ", "= ") for left, expression in shown]
        lines.append(f"| {name} | {', '.join(f'${text}$' for text in texts)} |")
    return lines


BLOCKS = {
    "attachment": Shown((elements.point,), _attachment, BEYOND),
    "relative": Shown((elements.relative, motion.seen_by), _relative, BEYOND),
    "track between": Shown((elements.track_between,), _track_between, BEYOND),
    "lean": Shown((elements.lean,), _lean, BEYOND),
    "where moved to": Shown((elements.where_moved_to,), _where_moved_to, BEYOND),
    "at centre": Shown((elements.at_centre,), _at_centre, BEYOND),
    "spring": Shown((elements.spring,), _spring, "A pair of springs with dampers"),
    "along": Shown((elements.stretch,), _along, "Stretch along an axis"),
    "laws": Shown(
        (
            elements.damper,
            elements.series_damper,
            elements.stop,
            elements.friction,
            elements.roll_bar,
            elements.traction_rod,
            elements.yaw_moment,
            elements.lateral_force,
        ),
        _laws,
        "What the other elements give",
        table=True,
    ),
}
"""Blocks of the page, by their names."""
