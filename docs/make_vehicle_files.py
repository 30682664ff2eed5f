"""Make the tables of docs/vehicle-files.md from the metadata of the parts."""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
from collections.abc import Callable
from pathlib import Path

DOCS = Path(__file__).resolve().parent
sys.path += [str(DOCS), str(DOCS.parent)]

from blocks import refilled  # noqa: E402

from railenv.contact.given import LAWS  # noqa: E402
from railenv.contact.laws import ContactLaw  # noqa: E402
from railenv.contact.profiles import SHIPPED  # noqa: E402
from railenv.vehicles import ParameterRecord, describe, files  # noqa: E402
from railenv.vehicles.actuators import Actuator, Sensors  # noqa: E402
from railenv.vehicles.elements import BODIES, ELEMENTS, Part  # noqa: E402

PAGE = DOCS / "vehicle-files.md"
_HEAD = "| field | unit | meaning | default | allowed |\n|---|---|---|---|---|"


PAIR = {
    "wheel": ("", "profile of the wheel"),
    "rail": ("", "profile of the rail"),
    "inclination": ("rad", "lean of the rail towards the track's centre; 0 if measured in the track"),
    "gauge": ("m", "distance of the rails"),
    "back_to_back": ("m", "distance of the backs of the flanges"),
    "nominal_radius": ("m", "radius of the wheel at its tape circle"),
    "tape_circle": ("m", "distance of the tape circle from the back of the flange"),
    "gauge_depth": ("m", "depth below the top of the rail where the gauge is measured"),
    "width": ("m", "width of the weights: b^2 / 5R of the contact patch"),
    "step": ("m", "step of the search over the shift"),
    "rail_yield": (
        "m",
        "wheel load over the lateral stiffness of the rail; 0 for a rail that does not yield",
    ),
    "grid": ("m", "step of the tables that the equations of motion read"),
    "new": ("", "the new pair, a table of law `profiles`"),
    "worn": ("", "the worn pair, a table of law `profiles`"),
}
"""Unit and meaning of the fields of contact laws that are no numbers of the equations."""


def _row(name: str, unit: str, meaning: str, default: str, allowed: str) -> str:
    return f"| `{name}` | {unit} | {meaning} | {default} | {allowed} |"


def _default(field: dataclasses.Field[object]) -> str:
    """Return what a field is when it is left out."""
    if field.default is dataclasses.MISSING:
        return "must be given"
    if field.default is None:
        return "left out"
    if isinstance(field.default, float):
        return f"`{field.default:g}`"
    return f"`{str(field.default).lower()}`" if field.default is False else f'`"{field.default}"`'


def _allowed(field: dataclasses.Field[object]) -> str:
    """Return the range of a field, or its choices."""
    if "allowed" in field.metadata:
        return ", ".join(f'`"{value}"`' for value in field.metadata["allowed"])
    if field.name == "between":
        return "two names"
    if field.name in ("contact", "right_contact"):
        return "a table, [contact laws](#contact-laws)"
    if field.name == "conicity":
        return "above 0, at most 0.7"
    if "table" in field.metadata:
        return "`[[...], [...]]`"
    bounds = field.metadata.get("bounds")
    if bounds is None:
        return "`true`, `false`" if field.default is False else "a word"
    low, high = bounds.get("low"), bounds.get("high")
    said = [] if low is None else [f"{'above' if bounds.get('open_low') else 'at least'} {low:g}"]
    return ", ".join([*said, *([] if high is None else [f"at most {high:g}"])]) or "any number"


def table(kind: type[Part]) -> str:
    """Return the table of one kind of part, below what it is."""
    said = inspect.getdoc(kind) or ""
    rows = [
        _row(f.name, f.metadata.get("unit", ""), f.metadata["meaning"], _default(f), _allowed(f))
        for f in dataclasses.fields(kind)
    ]
    return "\n".join([said.replace("``", "`"), "", _HEAD, *rows])


def _law_row(field: dataclasses.Field[object]) -> str:
    """Return the row of one field of a contact law."""
    if "bounds" in field.metadata:
        unit, meaning, allowed = field.metadata["unit"], field.metadata["meaning"], _allowed(field)
    else:
        unit, meaning = PAIR[field.name]
        shipped = ", ".join(f'`"{n}"`' for n, kind in SHIPPED.items() if kind == field.name)
        allowed = f"{shipped}, a file, or points" if shipped else "a number" if unit else "a table"
    return _row(field.name, unit, meaning, _default(field), allowed)


def contact_laws() -> str:
    """Return the tables of all contact laws, each below what it is."""
    return "\n\n".join(_law(kind) for kind in LAWS)


def _law(kind: type[ContactLaw]) -> str:
    said = (inspect.getdoc(kind) or "").partition("\n\nParameters")[0]
    said = re.sub(r":(?:class|meth|func):`(.+?)`", r"`\1`", said).replace("``", "`")
    rows = [_law_row(f) for f in dataclasses.fields(kind)]
    return "\n".join([f'### `law = "{kind.kind}"`', "", said, "", _HEAD, *rows])


def whole() -> str:
    """Return the table of what a file says of the vehicle as a whole."""
    defaults = {"gravity": "`9.81`", "wheelbase_curving": "`1.0`", "shifting_loads": "`false`"}
    allowed = {
        "gravity": "above 0",
        "wheelbase_curving": "0, 1",
        "shifting_loads": "`true`, `false`",
        "parameters": "a table of numbers",
    }
    rows = [
        _row(name, unit, meaning, defaults.get(name, "left out"), allowed.get(name, "a text"))
        for name, (unit, meaning) in files.PLAIN.items()
    ]
    return "\n".join([_HEAD, *rows])


def _number_rows(record: ParameterRecord, kind: type) -> list[str]:
    """Rows of the numbers of actuators or sensors, with their defaults."""
    fields = {f.name: f for f in dataclasses.fields(kind)}
    return [
        _row(r.name, r.unit, r.meaning, f"`{getattr(record, r.name):g}`", _allowed(fields[r.name]))
        for r in describe(kind)
    ]


def actuator() -> str:
    """Return the table of the fields of an actuator."""
    where = [
        _row("name", "", "of its states and its command", "the first body's name", "a word"),
        _row("between", "", "bodies on which it acts and reacts", "must be given", "two names"),
        _row("x", "m", "place of a lateral one along the vehicle", "`0`", "any number"),
        _row("z", "m", "height of a lateral one", "`0`", "any number"),
    ]
    return "\n".join([_HEAD, *where, *_number_rows(Actuator.secondary(), Actuator)])


def sensors() -> str:
    """Return the table of the fields of the sensors."""
    where = _row("bodies", "", "bodies that carry them", "the frames", "a list of names")
    return "\n".join([_HEAD, where, *_number_rows(Sensors.standard(), Sensors)])


def makers() -> dict[str, Callable[[], str]]:
    """Return what makes each block of the page."""

    def of(kind: type[Part]) -> Callable[[], str]:
        return lambda: table(kind)

    equipment = {"actuator": actuator, "sensors": sensors, "contact laws": contact_laws}
    return {"vehicle": whole, **equipment, **{kind.kind: of(kind) for kind in (*BODIES, *ELEMENTS)}}


def page(text: str) -> str:
    """Return the page with its tables made anew."""
    return refilled(text, makers())


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
