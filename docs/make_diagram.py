"""Draw the pictures of docs/architecture.md, wings and data flow: ``python docs/make_diagram.py``."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path

PICTURES = Path(__file__).resolve().parent / "pictures"

WIDTH, ROW, HEIGHT = 680, 84, 46  # of a picture, from row to row, of a box: pixels
MARGIN = 14


@dataclass(frozen=True)
class Box:
    """One station of the data.

    Attributes
    ----------
    x, row : float
        Middle of the box: pixels, and number of the row.
    width : float
        Pixels.
    title, text : str
        Module or file, and what it holds.
    path : str
        Where it lives in the repository; empty for what does not.
    """

    x: float
    row: float
    width: float
    title: str
    text: str
    path: str = ""

    @property
    def y(self) -> float:
        """Upper edge, pixels."""
        return MARGIN + ROW * self.row


BOXES = {
    "equations": Box(250, 0, 230, "railenv/equations", "physics, per element", "railenv/equations"),
    "physics": Box(560, 0, 190, "docs/physics.md", "the same as LaTeX", "docs/physics.md"),
    "assembly": Box(
        250, 1, 230, "vehicles/assembly", "equations of a structure", "railenv/vehicles/assembly.py"
    ),
    "parts": Box(560, 1, 190, "railenv/vehicles", "parts, numbers, TOML", "railenv/vehicles"),
    "graph": Box(
        250, 2, 230, "kernels/graph", "assignments, exact derivatives", "railenv/kernels/graph.py"
    ),
    "source": Box(250, 3, 230, "kernels/source", "text of rhs, jacobian", "railenv/kernels/source.py"),
    "texts": Box(560, 3, 190, "kernels/texts", "tables, RK4, environments", "railenv/kernels/texts"),
    "loader": Box(
        250, 4, 230, "kernels/store, loader", "text and machine code, kept", "railenv/kernels/store.py"
    ),
    "models": Box(250, 5, 230, "model, models", "Model, Assembled, Bogie", "railenv/model.py"),
    "equipment": Box(560, 5, 190, "equipment", "actuators, sensors", "railenv/equipment.py"),
    "equilibrium": Box(118, 6, 150, "equilibrium", "branches", "railenv/equilibrium.py"),
    "simulation": Box(301, 6, 172, "simulation, batch", "motions in time", "railenv/simulation.py"),
    "envs": Box(505, 6, 170, "envs", "Gymnasium, in lanes", "railenv/envs"),
    "design": Box(208, 7, 250, "design", "critical speeds, loci, limit cycles", "design"),
    "agents": Box(505, 7, 170, "agents", "controllers, learning", "agents"),
}
"""Stations, from the equations down to what a person asks for."""

ARROWS = (
    ("equations", "assembly", ""),
    ("equations", "physics", "symbols"),
    ("parts", "assembly", ""),
    ("assembly", "graph", "run on symbols, once per structure"),
    ("graph", "source", ""),
    ("source", "loader", ""),
    ("texts", "loader", ""),
    ("loader", "models", "kernels; numbers are arguments"),
    ("models", "equipment", ""),
    ("models", "equilibrium", ""),
    ("models", "simulation", ""),
    ("equipment", "envs", ""),
    ("equilibrium", "design", ""),
    ("simulation", "design", ""),
    ("envs", "agents", ""),
    ("design", "agents", ""),
)
"""From, to, and what goes along."""

ORACLE = "run on floats and complex numbers: the oracle of the tests"

# ------------------------------------------------------------------------------- wings

Room = tuple[str, str]
"""Name of a module or a folder, and what is done there."""

WINGS: dict[str, tuple[tuple[Room, ...], ...]] = {
    "agents": (
        (("reproduction", "the report's section"), ("learning", "training, policies, search")),
        (("evaluation", "rollouts, leaderboard"), ("tuning", "on families of plants")),
        (("controllers", "interface, files, classical and learned ones"),),
    ),
    "design": (
        (("reproduction", "report on the paper"), ("studies", "maps, many cells in parallel")),
        (("irregular", "chaos"), ("curves", "over two parameters")),
        (("cycles", "limit cycles, Hopf, folds"), ("stability", "critical speed, loci, modes")),
        (("loop", "sampled loops, margins"), ("linear", "linearise, reduce, regulate")),
    ),
    "railenv": (
        (("envs", "environments of any model"),),
        (("simulation", "one run"), ("batch", "many in lanes"), ("equilibrium", "and branches")),
        (("equipment", "actuators, sensors"), ("models", "Bogie and others"), ("model", "any")),
        (("vehicles", "parts, records, TOML"), ("kernels", "trace, compile, run")),
        (("contact", "contact laws, profiles, Hertz, Kalker, FASTSIM"),),
        (("fields", "numbers and texts"), ("tables", "cubics on a grid")),
        (("equations", "contact, shapes, elements, bodies, motion, equipped"),),
    ),
}
"""Rooms of each wing, floor by floor from the top; a floor imports from those below it."""

_FLOOR, _GAP = 52, 8


def wings() -> str:
    """Return the picture of the wings as SVG."""
    parts, y = [], MARGIN
    for wing, floors in WINGS.items():
        height = 2 * _GAP + _FLOOR * len(floors)
        parts.append(
            f'<rect class="wing" x="{MARGIN}" y="{y}" width="{WIDTH - 2 * MARGIN - 88}" '
            f'height="{height}" rx="7"/>\n'
            f'<text class="title" transform="translate({MARGIN + 24} {y + height / 2:g}) rotate(-90)">'
            f"{wing}</text>"
        )
        for k, rooms in enumerate(floors):
            parts.append(_floor(rooms, y + _GAP + _FLOOR * k))
        y += height + _GAP
    bottom = y - _GAP
    x = WIDTH - MARGIN - 80
    parts.append(
        f'<rect class="wing" x="{x}" y="{MARGIN}" width="80" height="{bottom - MARGIN}" rx="7"/>\n'
        + "\n".join(
            f'<text class="{kind}" x="{x + 40}" y="{bottom / 2 + 18 * k:g}">{line}</text>'
            for k, (kind, line) in enumerate(
                (("title", "cli"), ("title", "explorer"), ("text", "may use"), ("text", "all wings"))
            )
        )
    )
    return _picture("Wings of railenv", parts, bottom + MARGIN)


def _floor(rooms: tuple[Room, ...], y: float) -> str:
    left, right = MARGIN + 44, WIDTH - MARGIN - 88 - _GAP
    width = (right - left - _GAP * (len(rooms) - 1)) / len(rooms)
    found = []
    for k, (name, text) in enumerate(rooms):
        x = left + k * (width + _GAP)
        found.append(
            f'<rect class="box" x="{x:g}" y="{y + 3:g}" rx="5" width="{width:g}" height="{HEIGHT}"/>\n'
            f'<text class="title" x="{x + width / 2:g}" y="{y + 22:g}">{escape(name)}</text>\n'
            f'<text class="text" x="{x + width / 2:g}" y="{y + 40:g}">{escape(text)}</text>'
        )
    return "\n".join(found)


# --------------------------------------------------------------------------- data flow

_STYLE = """
text { font-family: system-ui, sans-serif; text-anchor: middle; fill: #1d2733; }
.title { font-size: 15px; font-weight: 600; }
.text { font-size: 13px; }
.label { font-size: 12px; fill: #45566a; }
.box { fill: #eef3f9; stroke: #5b7fa6; stroke-width: 1.2; }
.wing { fill: #f7f9fc; stroke: #b8c6d8; stroke-width: 1.2; }
.arrow { fill: none; stroke: #45566a; stroke-width: 1.4; marker-end: url(#head); }
.dashed { stroke-dasharray: 5 4; }
"""


def _box(box: Box) -> str:
    left = box.x - box.width / 2
    return (
        f'<rect class="box" x="{left:g}" y="{box.y:g}" rx="5" '
        f'width="{box.width:g}" height="{HEIGHT}"/>\n'
        f'<text class="title" x="{box.x:g}" y="{box.y + 19:g}">{escape(box.title)}</text>\n'
        f'<text class="text" x="{box.x:g}" y="{box.y + 37:g}">{escape(box.text)}</text>'
    )


def _arrow(start: Box, end: Box, label: str) -> str:
    if start.row == end.row:
        side = 1 if end.x > start.x else -1
        x1, y1 = start.x + side * start.width / 2, start.y + HEIGHT / 2
        x2, y2 = end.x - side * (end.width / 2 + 3), end.y + HEIGHT / 2
    else:
        # straight down where the boxes overlap, else towards the middle of the lower one
        x2 = min(max(start.x, end.x - end.width / 2 + 20), end.x + end.width / 2 - 20)
        x1 = min(max(x2, start.x - start.width / 2 + 20), start.x + start.width / 2 - 20)
        y1, y2 = start.y + HEIGHT, end.y - 3
    line = f'<path class="arrow" d="M{x1:g} {y1:g} L{x2:g} {y2:g}"/>'
    if not label:
        return line
    x, y = (x1 + x2) / 2, (y1 + y2) / 2
    if start.row == end.row:
        return f'{line}\n<text class="label" x="{x:g}" y="{y - 7:g}">{escape(label)}</text>'
    place = f'x="{x + 10:g}" y="{y + 4:g}" style="text-anchor: start"'
    return f'{line}\n<text class="label" {place}>{escape(label)}</text>'


def _oracle() -> str:
    """Return the arrow from the equations past everything compiled to the models."""
    top, bottom = BOXES["assembly"], BOXES["models"]
    x1, x2 = top.x - top.width / 2, bottom.x - bottom.width / 2 - 3
    y1, y2 = top.y + HEIGHT / 2, bottom.y + HEIGHT / 2
    x, y = 60, (y1 + y2) / 2
    return (
        f'<path class="arrow dashed" d="M{x1:g} {y1:g} H{x} V{y2:g} H{x2:g}"/>\n'
        f'<text class="label" transform="translate({x - 9} {y:g}) rotate(-90)">{ORACLE}</text>'
    )


def data_flow() -> str:
    """Return the picture of the data flow as SVG."""
    height = 2 * MARGIN + ROW * max(box.row for box in BOXES.values()) + HEIGHT
    arrows = [_arrow(BOXES[start], BOXES[end], label) for start, end, label in ARROWS]
    return _picture("Data flow of railenv", [*arrows, _oracle(), *map(_box, BOXES.values())], height)


def _picture(title: str, parts: list[str], height: float) -> str:
    """Return parts of a picture on white, as SVG."""
    head = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:g}" '
        f'width="{WIDTH}" height="{height:g}" role="img">',
        f"<title>{title}</title>",
        f"<style>{_STYLE}</style>",
        '<defs><marker id="head" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="#45566a"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{height:g}" rx="8" fill="#ffffff"/>',
    ]
    return "\n".join([*head, *parts, "</svg>"]) + "\n"


DRAWN = {"data-flow.svg": data_flow, "wings.svg": wings}
"""Every picture, by its file."""

if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    for name, draw in DRAWN.items():
        (PICTURES / name).write_text(draw(), encoding="utf-8")
        print(f"wrote {PICTURES / name}")
