"""Draw the data flow of docs/architecture.md: ``python docs/make_diagram.py``."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path

PICTURE = Path(__file__).resolve().parent / "pictures" / "data-flow.svg"

WIDTH, ROW, HEIGHT = 680, 84, 46  # of the picture, from row to row, of a box: pixels
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
    "equations": Box(
        250, 0, 230, "railenv/equations", "plain functions of scalars", "railenv/equations"
    ),
    "physics": Box(560, 0, 190, "docs/physics.md", "the same as LaTeX", "docs/physics.md"),
    "graph": Box(
        250, 1, 230, "kernels/graph", "assignments, exact derivatives", "railenv/kernels/graph.py"
    ),
    "source": Box(250, 2, 230, "kernels/source", "text of rhs, jacobian", "railenv/kernels/source.py"),
    "generated": Box(560, 2, 190, "generated kernels", "checked in", "railenv/kernels/bogie.py"),
    "loader": Box(
        250, 3, 230, "kernels/loader", "one text, its hash, Numba", "railenv/kernels/loader.py"
    ),
    "runtime": Box(560, 3, 190, "kernels/texts", "tan, sin, cos, RK4", "railenv/kernels/texts"),
    "vehicles": Box(560, 4, 200, "vehicles, equipment", "parameters, TOML", "railenv/vehicles.py"),
    "models": Box(250, 4, 230, "models", "Model, Evaluator", "railenv/models.py"),
    "equilibrium": Box(118, 5, 150, "equilibrium", "branches", "railenv/equilibrium.py"),
    "simulation": Box(301, 5, 172, "simulation, batch", "motions in time", "railenv/simulation.py"),
    "envs": Box(505, 5, 170, "envs", "Gymnasium, in lanes", "railenv/envs"),
    "design": Box(208, 6, 250, "design", "critical speeds, loci, limit cycles", "design"),
    "agents": Box(505, 6, 170, "agents", "Stable-Baselines3", "agents"),
    "cli": Box(208, 7, 250, "command line, plots", "tables, JSON, pictures", "railenv/cli"),
}
"""Stations, from the equations down to what a person sees."""

ARROWS = (
    ("equations", "graph", "run on symbols"),
    ("equations", "physics", "symbols"),
    ("graph", "source", ""),
    ("source", "generated", "make kernels"),
    ("source", "loader", "own equations"),
    ("generated", "loader", ""),
    ("runtime", "loader", ""),
    ("loader", "models", "machine code, cached on disk"),
    ("vehicles", "models", ""),
    ("models", "equilibrium", ""),
    ("models", "simulation", ""),
    ("models", "envs", ""),
    ("equilibrium", "design", ""),
    ("simulation", "design", ""),
    ("envs", "agents", ""),
    ("design", "cli", ""),
)
"""From, to, and what goes along."""

ORACLE = "run on floats and complex numbers: the oracle of the tests"

_STYLE = """
text { font-family: system-ui, sans-serif; text-anchor: middle; fill: #1d2733; }
.title { font-size: 15px; font-weight: 600; }
.text { font-size: 13px; }
.label { font-size: 12px; fill: #45566a; }
.box { fill: #eef3f9; stroke: #5b7fa6; stroke-width: 1.2; }
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
    """Return the arrow from the equations past everything generated to the models."""
    top, bottom = BOXES["equations"], BOXES["models"]
    x1, x2 = top.x - top.width / 2, bottom.x - bottom.width / 2 - 3
    y1, y2 = top.y + HEIGHT / 2, bottom.y + HEIGHT / 2
    x, y = 60, (y1 + y2) / 2
    return (
        f'<path class="arrow dashed" d="M{x1:g} {y1:g} H{x} V{y2:g} H{x2:g}"/>\n'
        f'<text class="label" transform="translate({x - 9} {y:g}) rotate(-90)">{ORACLE}</text>'
    )


def picture() -> str:
    """Return the diagram as SVG."""
    height = 2 * MARGIN + ROW * max(box.row for box in BOXES.values()) + HEIGHT
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:g}" '
        f'width="{WIDTH}" height="{height:g}" role="img">',
        "<title>Data flow of railenv</title>",
        f"<style>{_STYLE}</style>",
        '<defs><marker id="head" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="#45566a"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{height:g}" rx="8" fill="#ffffff"/>',
        *(_arrow(BOXES[start], BOXES[end], label) for start, end, label in ARROWS),
        _oracle(),
        *map(_box, BOXES.values()),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    PICTURE.parent.mkdir(exist_ok=True)
    PICTURE.write_text(picture(), encoding="utf-8")
    print(f"wrote {PICTURE}")
