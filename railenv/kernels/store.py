"""Texts of kernels, written when a structure is first used and kept in the cache.

Tracing and differentiating equations takes a second or two and needs SymPy. The text is therefore
kept under the hash of the structure (what the equations are made of, without the numbers) and of the
code that writes it, neither of which needs tracing.
"""

from __future__ import annotations

import hashlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from importlib import util
from pathlib import Path

from railenv.files import write_whole
from railenv.kernels.loader import cache_directory

_WRITERS = (
    "railenv.contact.family",
    "railenv.contact.laws",
    "railenv.contact.pair",
    "railenv.equations",
    "railenv.fields",
    "railenv.kernels.graph",
    "railenv.kernels.source",
    "railenv.equipment",
    "railenv.models",
    "railenv.mounting",
    "railenv.vehicles.assembly",
    "railenv.vehicles.declared",
    "railenv.vehicles.elements",
    "railenv.vehicles.expressions",
)
"""Modules, and packages with all of theirs, on which the text of a kernel depends."""


@dataclass(frozen=True)
class Recipe:
    """How to get the text of some kernels; recipes of the same structure are equal.

    Attributes
    ----------
    structure : str
        Names everything on which the text depends, but the code of the package.
    write : callable
        Traces the equations and returns the text.
    """

    structure: str
    write: Callable[[], str] = field(compare=False)

    @property
    def key(self) -> str:
        """Name under which the text is kept: the hash of the structure and of what writes it."""
        return hashlib.sha256(f"{self.structure} {writers_hash()}".encode()).hexdigest()[:32]


@cache
def source_of(recipe: Recipe) -> str:
    """Return the text of some kernels, from the cache on disk or written now."""
    path = cache_directory() / f"{recipe.key}.source"
    text = _read(path)
    if text is None:
        text = recipe.write()
        write_whole(path, f"{_digest(text)}\n{text}")
    return text


@cache
def writers_hash() -> str:
    """Return the hash of the code that writes kernels, without importing it."""
    digest = hashlib.sha256()
    for name in _WRITERS:
        inside = util.find_spec(name)
        places = inside.submodule_search_locations if inside else None
        modules = pkgutil.iter_modules(places, f"{name}.") if places else ()
        for module in (name, *sorted(m.name for m in modules)):
            digest.update(_content(module))
    return digest.hexdigest()


def _content(name: str) -> bytes:
    """Bytes of a module's file: its source, or where only that exists its compiled form."""
    spec = util.find_spec(name)
    loader = getattr(spec, "loader", None)
    if spec is None or spec.origin is None or not hasattr(loader, "get_data"):
        raise RuntimeError(f"the file of {name} cannot be found; railenv is not installed whole")
    found: bytes = loader.get_data(spec.origin)  # type: ignore[union-attr]
    return found


def _read(path: Path) -> str | None:
    """Return a kept text; None where there is none, or it is damaged."""
    try:
        digest, _, text = path.read_text(encoding="utf-8").partition("\n")
    except (OSError, UnicodeDecodeError):
        return None
    return text if digest == _digest(text) else None


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
