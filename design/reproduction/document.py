"""The report as one HTML file that needs no other: templates, style and figures inside it."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

import railenv


@dataclass(frozen=True)
class Picture:
    """A figure in the document.

    Attributes
    ----------
    svg : bytes
    caption, group : str
        As in :class:`design.reproduction.section.Drawing`.
    """

    svg: bytes
    caption: str
    group: str

    @property
    def source(self) -> str:
        """The figure as a data URI."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.svg).decode()


@dataclass(frozen=True)
class Part:
    """A section in the document: its heading, text, figures and files."""

    key: str
    title: str
    text: Markup
    pictures: tuple[Picture, ...]
    files: tuple[str, ...]

    @property
    def groups(self) -> list[tuple[str, list[Picture]]]:
        """Rows of figures side by side, with the row's heading."""
        return [(name, list(items)) for name, items in groupby(self.pictures, lambda p: p.group)]


_VALUE = re.compile(r"(?<=\d) (?=(m/s|m|mm|Hz|s|rad)\b)|(?<=\bR) (?==)|(?<=\bR =) (?=\d)")


def _kept_together(text: str) -> str:
    """Return a text with no line break between a value and its unit."""
    return _VALUE.sub("\u00a0", text)


def _breakable(name: str) -> Markup:
    """Return a name that may be broken after its underscores."""
    return Markup("_<wbr>").join(name.split("_"))


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("design.reproduction", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"values": _kept_together, "breakable": _breakable}
    return environment


def fragment(template: str, **values: Any) -> Markup:
    """Return a section's text from one of the templates; all values are escaped."""
    return Markup(_environment().get_template(template).render(**values))


def page(parts: Sequence[Part], note: str) -> str:
    """Return the whole document."""
    environment = _environment()
    loader = environment.loader
    assert loader is not None
    style = Markup(loader.get_source(environment, "style.css")[0])  # our own file
    return environment.get_template("page.html").render(
        parts=parts, note=note, style=style, version=railenv.__version__
    )
