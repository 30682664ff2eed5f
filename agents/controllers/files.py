"""Controllers on disk: npz files of plain arrays with a JSON header; nothing in them is executed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.errors import ParameterError
from railenv.files import npz, read_arrays, write_whole

SCHEMA = "railenv controller 1"
"""Mark of the files, with the version of their layout."""

_HEADER = "header"


@dataclass(frozen=True)
class ControllerFile:
    """Content of a file.

    Attributes
    ----------
    kind : str
        Name of the controller's class.
    header : dict
        Plain numbers, strings and lists.
    arrays : dict of ndarray
    """

    kind: str
    header: dict[str, Any]
    arrays: dict[str, NDArray[Any]]

    def arrays_named(self, *names: str) -> dict[str, NDArray[Any]]:
        """Return some arrays.

        Raises
        ------
        ParameterError
            If one is missing.
        """
        missing = [name for name in names if name not in self.arrays]
        if missing:
            raise ParameterError(f"the file of a {self.kind} lacks {', '.join(missing)}")
        return {name: self.arrays[name] for name in names}


def write(path: str | PathLike[str], content: ControllerFile) -> None:
    """Write a controller's file, whole or not at all."""
    header = {"schema": SCHEMA, "kind": content.kind, **content.header}
    text = np.array(json.dumps(header, allow_nan=False))
    write_whole(path, npz({_HEADER: text, **content.arrays}))


def read(path: str | PathLike[str], kind: str | None = None) -> ControllerFile:
    """Read a controller's file.

    Parameters
    ----------
    path : path
    kind : str, optional
        Class that it must hold.

    Raises
    ------
    ParameterError
        If it is not such a file, is damaged, or holds another kind.
    FileNotFoundError
        If it does not exist.
    """
    try:
        arrays = read_arrays(path)
        header = json.loads(str(arrays.pop(_HEADER)))
        schema, found = header.pop("schema"), header.pop("kind")
    except FileNotFoundError:
        raise
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise ParameterError(f"{path} is not a controller's file, or is damaged: {error}") from None
    if schema != SCHEMA:
        raise ParameterError(f"{path} has the layout {schema!r}; this version reads {SCHEMA!r}")
    if kind is not None:
        checks.known(f"kind of controller in {path}", [found], [kind])
    return ControllerFile(found, header, arrays)


class Restorable(Protocol):
    """A controller that can be stored in a file."""

    @classmethod
    def from_file(cls, content: ControllerFile) -> Self:
        """Return the controller in a file."""


R = TypeVar("R", bound=Restorable)


def restored(content: ControllerFile, kinds: Sequence[type[R]], where: str) -> R:
    """Return the controller that a file's content describes; ``where`` names it in errors.

    Raises
    ------
    ParameterError
        If its kind is not one of ``kinds``, or its header is damaged.
    """
    known = {kind.__name__: kind for kind in kinds}
    checks.known(f"kind of controller in {where}", [content.kind], list(known))
    try:
        return known[content.kind].from_file(content)
    except (KeyError, TypeError, AttributeError) as error:
        raise ParameterError(f"{where} is damaged: {error!r} in its header") from None
