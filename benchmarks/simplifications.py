"""Compute what the paper's simplifications cost: ``python -m benchmarks.simplifications``.

Writes ``design/reproduction/data/simplifications.json``, of which the report makes a section. Whole
coaches compile for some minutes when their kernels are not there yet.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict

from rich.console import Console

import design
from design.reproduction import paper
from design.reproduction.simplifications import BODIES, CONTACTS, RESULTS, Body, Simplified, model
from railenv.files import write_whole
from railenv.models import Bogie, Coach

_LOWEST = 40.0  # m/s, of branches


def case(contact: str, body: Body) -> Simplified:
    """Compute one case."""
    straight = design.critical_speed(model(contact, body, curving=False))
    shape = straight.mode_shape
    return Simplified(
        contact,
        body,
        _hunting(straight),
        persists_from(model(contact, body, curving=False), _hunting(straight)),
        *(on_curve(model(contact, body, curving=curving)) for curving in (False, True)),
        "" if shape is None else shape.name,
    )


def on_curve(vehicle: Bogie | Coach) -> float:
    """Return the linear critical speed (m/s) on the paper's curve."""
    return _hunting(design.critical_speed(vehicle, radius=paper.RADIUS, cant=paper.CANT))


def persists_from(vehicle: Bogie | Coach, linear: float) -> float:
    """Return the lowest speed (m/s) at which the branch of limit cycles has a motion."""
    top = 5.0 * math.ceil(1.03 * linear / 5.0)
    branch = design.cycle_branch(vehicle, parameter_range=(_LOWEST, top))
    assert branch.nonlinear_critical_speed is not None
    return branch.nonlinear_critical_speed


def _hunting(found: design.CriticalSpeed) -> float:
    """Return the speed (m/s) of a loss that is hunting, as all of them are here."""
    assert found.loss == "hunting", found
    assert found.speed is not None
    return found.speed


def main() -> None:
    """Compute all cases, the quick ones first, and write them in the order of the table."""
    console = Console(highlight=False, soft_wrap=True)
    found: dict[tuple[str, Body], Simplified] = {}
    for body in BODIES:
        for contact in CONTACTS:
            found[contact, body] = case(contact, body)
            console.print(found[contact, body])
    rows = [asdict(found[contact, body]) for contact in CONTACTS for body in BODIES]
    RESULTS.parent.mkdir(exist_ok=True)
    write_whole(RESULTS, json.dumps(rows, indent=1) + "\n")
    console.print(f"wrote {RESULTS}")


if __name__ == "__main__":
    main()
