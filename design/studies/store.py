"""Results of a study on disk: a file of JSON lines, which runs append to and later runs continue.

The first line has the settings of the study, every other line the result of one cell. Lines are
appended by one write for each batch; a line cut short by a crash is dropped when the file is opened
again. Every result has a checksum, so that a changed number is not taken for a result.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from railenv.errors import ParameterError

Record = dict[str, Any]
"""Result of one cell: names with numbers, strings, None, or lists of these."""

_FORMAT = "railenv study 2"
_CHECK = "crc32"
_SHOWN = 5  # differences listed in a message


class Store:
    """The file of one study. One run at a time writes to it.

    Parameters
    ----------
    path : path
        Path of the file, which is made if it does not exist.
    settings : mapping
        Everything on which the results depend, as plain numbers, strings, lists and mappings.

    Raises
    ------
    ParameterError
        If the file is from a study with other settings (the message lists them), or is not a study.
    """

    def __init__(self, path: str | Path, settings: Mapping[str, Any]) -> None:
        self.path = Path(path)
        if self.path.is_dir():
            raise ParameterError(f"store is {str(path)!r}, a directory; it must be a file")
        self.records: dict[int, Record] = {}
        header = {"format": _FORMAT, "settings": plain(settings)}
        lines = self._lines()
        if lines:
            self._check(lines[0], header)
            for number, line in enumerate(lines[1:], start=2):
                record = self._parsed(line, number)
                self.records[record.pop("cell")] = record
        else:
            self._append([header])

    def add(self, records: Mapping[int, Record]) -> None:
        """Append the results of some cells in one write."""
        self._append([checked({"cell": cell, **record}) for cell, record in records.items()])
        self.records.update(records)

    def _lines(self) -> list[bytes]:
        """Return the complete lines, and cut off an incomplete one."""
        if not self.path.exists():
            return []
        content = self.path.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            if whole == 0 and not content.startswith(b'{"format"'[: len(content)]):
                raise self._foreign()
            with self.path.open("r+b") as file:
                file.truncate(whole)
        return content[:whole].splitlines()

    def _check(self, line: bytes, header: Mapping[str, Any]) -> None:
        try:
            found = json.loads(line)
        except (RecursionError, ValueError):
            raise self._foreign() from None
        settings = isinstance(found, dict) and found.get("format") == _FORMAT and found.get("settings")
        if not isinstance(settings, dict):
            raise self._foreign()
        different = list(differences(settings, header["settings"]))
        if different:
            more = len(different) - _SHOWN
            raise ParameterError(
                f"store {str(self.path)!r} is from a study with other settings: "
                + "; ".join(different[:_SHOWN])
                + (f"; and {more} more" if more > 0 else "")
                + ". Name another file, or delete this one"
            )

    def _parsed(self, line: bytes, number: int) -> Record:
        try:
            record = json.loads(line)
            whole = record.pop(_CHECK) == _checksum(record) and isinstance(record["cell"], int)
        except (AttributeError, KeyError, RecursionError, TypeError, ValueError):
            whole = False
        if not whole:
            raise ParameterError(
                f"store {str(self.path)!r} is damaged: line {number} is not as it was written; delete "
                "that line to compute its cell again"
            )
        return record

    def _foreign(self) -> ParameterError:
        return ParameterError(f"store {str(self.path)!r} exists and is not the store of a study")

    def _append(self, lines: list[Mapping[str, Any]]) -> None:
        text = "".join(json.dumps(line, allow_nan=False) + "\n" for line in lines)
        with self.path.open("ab") as file:  # flushed by one write when closed
            file.write(text.encode())


def checked(record: Record) -> Record:
    """Return a result with its checksum, as a line of the file."""
    return {**record, _CHECK: _checksum(record)}


def _checksum(record: Any) -> int:
    return zlib.crc32(json.dumps(record, allow_nan=False).encode())


def plain(value: Any) -> Any:
    """Return a value for JSON; numbers that are not finite become strings."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, Mapping):
        return {str(name): plain(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    return value


def differences(stored: Any, present: Any, name: str = "") -> Iterator[str]:
    """Yield the differences between two settings, one text for each."""
    if isinstance(stored, dict) and isinstance(present, dict):
        for key in [*stored, *(k for k in present if k not in stored)]:
            inner = f"{name}.{key}" if name else key
            yield from differences(stored.get(key), present.get(key), inner)
    elif stored != present:
        yield f"{name} is {_short(stored)} there, {_short(present)} now"


def _short(value: Any) -> str:
    if isinstance(value, list) and len(value) > 3:
        return f"[{value[0]}, {value[1]}, ..., {value[-1]}] ({len(value)} values)"
    return "not given" if value is None else repr(value)
