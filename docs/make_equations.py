"""Write the equations of docs/physics.md from the code: ``python docs/make_equations.py``.

The functions of :mod:`railenv.equations` are run on symbols, and what they return is printed in the
order in which it is written there. What stands on the page for the paper's bogie comes from its
assembly, element by element. A result that another equation uses appears there under its name. The
text around the equations is edited in the page itself.
"""

from __future__ import annotations

from pathlib import Path

import equations_contact
import equations_cooperrider
import equations_elements
import equations_equipment
import equations_shapes
import equations_vehicles
from blocks import refilled

PAGE = Path(__file__).resolve().parent / "physics.md"

SHOWN = (
    equations_shapes.BLOCKS
    | equations_contact.BLOCKS
    | equations_elements.BLOCKS
    | equations_vehicles.BLOCKS
    | equations_equipment.BLOCKS
    | equations_cooperrider.BLOCKS
)
"""Every block of equations of the page, by the name in its comments."""


def page(text: str) -> str:
    """Return the page with all its equations made anew."""
    return refilled(text, {name: shown.markdown for name, shown in SHOWN.items()})


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote {PAGE}")
