"""Machine code on disk that cannot be damaged unnoticed.

Numba keeps compiled functions as files without a checksum: of a file cut short it raises an error of
its own on every later run, and of changed bytes it would run whatever they are. Here every file begins
with the hash of the rest. One that does not match is compiled and written anew.
"""

from __future__ import annotations

import hashlib
import pickle
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import caching

_HASH = hashlib.sha256
_LENGTH = _HASH().digest_size

_NumbasFile: Any = caching.IndexDataCacheFile  # it carries no types


def checked(jit: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a compiling decorator whose results are kept on disk, each with its hash."""

    def decorated(function: Any) -> Any:
        dispatcher = jit(function)
        dispatcher.enable_caching()
        kept = dispatcher._cache
        kept._cache_file = _CheckedFile(
            kept._cache_path, kept._impl.filename_base, kept._impl.locator.get_source_stamp()
        )
        return dispatcher

    return decorated


class _CheckedFile(_NumbasFile):
    """Index and data files of one compiled function."""

    def _dump(self, obj: Any) -> bytes:
        content = super()._dump(obj)
        return _HASH(content).digest() + content

    def _save_index(self, overloads: Any) -> None:
        content = self._dump((self._version, self._source_stamp, overloads))
        with self._open_for_write(self._index_path) as file:
            file.write(content)

    def _load_index(self) -> Any:
        try:
            version, stamp, overloads = _whole(Path(self._index_path))
        except (FileNotFoundError, _DamagedError):
            return {}
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _load_data(self, name: str) -> Any:
        return _whole(Path(self._data_path(name)))  # what it raises means: compile it

    def save(self, key: Any, data: Any) -> None:
        """Keep a compiled function; without room for it, say so and go on."""
        try:
            super().save(key, data)
        except OSError as error:
            _warn_of_saving(self._cache_path, str(error))


class _DamagedError(OSError):
    """The content of a file is not what was written to it."""


def _whole(path: Path) -> Any:
    """Return what a file holds; a damaged one is never unpickled."""
    content = path.read_bytes()
    if content[:_LENGTH] != _HASH(content[_LENGTH:]).digest():
        _warn_of_damage(path.parent)
        raise _DamagedError(f"{path} is damaged")
    return pickle.loads(content[_LENGTH:])


@cache
def _warn_of_damage(folder: Path) -> None:
    warnings.warn(
        f"compiled kernels in {folder} are damaged; they are compiled again. If this comes back, "
        "delete that folder, or set RAILENV_CACHE_DIR to another",
        RuntimeWarning,
        stacklevel=2,
    )


@cache
def _warn_of_saving(folder: str, error: str) -> None:
    warnings.warn(
        f"a compiled kernel cannot be kept in {folder} ({error}); it is compiled again in every "
        "process. Make room, or set RAILENV_CACHE_DIR to another directory",
        RuntimeWarning,
        stacklevel=2,
    )
