"""Finished computations on disk: one file each, written whole, named after its dependencies."""

from __future__ import annotations

import hashlib
import inspect
import json
import marshal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import railenv
from design.reproduction import codec
from railenv.errors import ParameterError
from railenv.files import npz, read_arrays, write_whole

_TREE = "tree"
_ROOT = Path(__file__).resolve().parent.parent.parent
_CODE = (
    "railenv/*.py",
    "railenv/equations/*.py",
    "railenv/kernels/*.py",
    "railenv/kernels/texts/*",
    "railenv/vehicles/*.py",
    "railenv/vehicles/*.toml",
    "design/*.py",
    "design/linear/*.py",
    "design/loop/*.py",
    "design/stability/*.py",
    "design/cycles/*.py",
)
"""Files on which every computation may depend; the module of its function is added."""


@dataclass(frozen=True)
class Piece:
    """A computation whose result is kept.

    Attributes
    ----------
    name : str
        Name of the piece in a report, and of its file.
    function : callable
        Called with ``inputs`` as keywords. It depends on nothing else, and returns plain
        data or results of :mod:`design` (see :mod:`design.reproduction.codec`).
    inputs : mapping of str to object
    label : str
        Label in the progress bar; the name when left out.
    code : tuple of str
        Patterns of source files that the function uses beside its own module, ``railenv`` and
        ``design``; relative to the folder of the packages, such as ``agents/evaluation/*.py``.
    """

    name: str
    function: Callable[..., Any]
    inputs: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    code: tuple[str, ...] = ()

    @cached_property
    def key(self) -> str:
        """Hash of everything on which the result depends.

        These are the inputs, the package's version and code, and the module of the function.

        Raises
        ------
        ParameterError
            If an input cannot be stored, or a pattern of ``code`` matches no file.
        """
        tree, arrays = codec.encode(dict(self.inputs))
        inputs = json.dumps([tree, [array.tolist() for array in arrays]], sort_keys=True)
        parts = (
            self.name,
            self.function.__qualname__,
            _source(self.function),
            railenv.__version__,
            _fingerprint((*_CODE, *self.code)),
            inputs,
        )
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


@lru_cache
def _source(function: Callable[..., Any]) -> str:
    """Return the text of a function's module at the first call; for interactive functions, the code."""
    try:
        return inspect.getsource(sys.modules[function.__module__])
    except (OSError, TypeError):
        return marshal.dumps(function.__code__).hex()


@lru_cache
def _fingerprint(patterns: tuple[str, ...]) -> str:
    """Return a hash of the code that computes: equations, kernels, analysis."""
    digest = hashlib.sha256()
    for pattern in patterns:
        paths = sorted(_ROOT.glob(pattern))
        if not paths:
            raise ParameterError(f"code has the pattern {pattern!r}, which no file in {_ROOT} matches")
        for path in paths:
            digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


class Store:
    """The results of pieces in a directory, which is made when first needed."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory

    def path(self, piece: Piece) -> Path:
        """Return the file of a piece, whether or not it exists."""
        return self.directory / f"{piece.name}-{piece.key}.npz"

    def has(self, piece: Piece) -> bool:
        """Return whether a piece has been computed; a damaged file does not count."""
        try:
            self.load(piece)
        except (FileNotFoundError, ParameterError):
            return False
        return True

    def load(self, piece: Piece) -> Any:
        """Return the stored result of a piece.

        Raises
        ------
        FileNotFoundError
            If it has not been computed.
        ParameterError
            If its file is damaged.
        """
        path = self.path(piece)
        arrays = read_arrays(path)
        try:
            tree = json.loads(bytes(arrays.pop(_TREE)))
            return codec.decode(tree, [arrays[f"a{i}"] for i in range(len(arrays))])
        except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
            raise ParameterError(f"{path} is damaged: {error!r}") from None

    def save(self, piece: Piece, value: Any) -> None:
        """Write the result of a piece; the file appears whole or not at all."""
        tree, arrays = codec.encode(value)
        text = np.frombuffer(json.dumps(tree).encode(), dtype=np.uint8)
        named: dict[str, Any] = {_TREE: text, **{f"a{i}": a for i, a in enumerate(arrays)}}
        self.directory.mkdir(parents=True, exist_ok=True)
        write_whole(self.path(piece), npz(named))

    def clear(self) -> None:
        """Remove all stored results, and incomplete files of killed runs."""
        for pattern in ("*.npz", ".*.part"):
            for path in self.directory.glob(pattern):
                path.unlink()


class Results(Mapping[str, Any]):
    """Stored results of pieces by their names, each read on first use."""

    def __init__(self, store: Store, pieces: Iterable[Piece]) -> None:
        self._store = store
        self._pieces = {piece.name: piece for piece in pieces}
        self._read: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        """Return a result."""
        if name not in self._read:
            self._read[name] = self._store.load(self._pieces[name])
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        """Go through the names."""
        return iter(self._pieces)

    def __len__(self) -> int:
        """Return the number of results."""
        return len(self._pieces)
