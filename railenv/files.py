"""Files: written whole or not at all; npz files of any origin, read without executing anything."""

from __future__ import annotations

import io
import math
import os
import struct
import zipfile
import zlib
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from railenv.errors import ParameterError, one_line

LARGEST = 2**28
"""Largest unpacked size of a file, bytes."""

_SUFFIX = ".npy"
_DAMAGE = (
    EOFError,
    KeyError,
    NotImplementedError,  # compression methods that zipfile does not support
    OSError,
    RuntimeError,  # a password
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)


def write_whole(path: str | PathLike[str], content: str | bytes) -> None:
    """Write a file atomically: if the process is killed, the file is the old or the new one."""
    target = Path(path)
    partial = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with partial.open("wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, target)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def npz(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the content of an npz file that holds some arrays."""
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def read_arrays(path: str | PathLike[str]) -> dict[str, NDArray[Any]]:
    """Return the arrays of an npz file by name.

    Raises
    ------
    ParameterError
        If it is not an npz file, is damaged, holds objects (pickles), or unpacks to more than
        ``LARGEST``.
    FileNotFoundError
        If it does not exist.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            size = sum(member.file_size for member in members)
            if size > LARGEST:
                raise ParameterError(
                    f"{path} unpacks to {size} bytes; it must not be more than {LARGEST}"
                )
            return {m.filename.removesuffix(_SUFFIX): _array(archive.read(m)) for m in members}
    except (FileNotFoundError, ParameterError):
        raise
    except _DAMAGE as error:
        said = one_line(str(error))  # zipfile shows the file itself
        raise ParameterError(f"{path} is not an npz file, or is damaged: {said}") from None


def _array(content: bytes) -> NDArray[Any]:
    """Return an array from its bytes, whose number must match the header."""
    stream = io.BytesIO(content)
    version = npy.read_magic(stream)
    if version != (1, 0):  # NumPy's format for everything without field names
        raise ValueError(f"an array of the format {version}")
    shape, _, dtype = npy.read_array_header_1_0(stream)
    if dtype.hasobject:
        raise ValueError("it holds Python objects, which are not loaded (allow_pickle=False)")
    if math.prod(shape) * dtype.itemsize != len(content) - stream.tell():
        raise ValueError(f"an array of shape {shape} in {len(content)} bytes")
    stream.seek(0)
    return npy.read_array(stream, allow_pickle=False)
