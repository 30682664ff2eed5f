"""Compiles a model's kernels with Numba, cached on disk under the hash of everything compiled.

Numba's own cache looks at one file's time stamp and does not see an edit of a file it imports. Here
the generated kernels, the runtime and a header become one file whose name is the hash of its text, so
a cached result can only ever be that of the very text. Compiling happens at first use of a function.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
import warnings
from functools import cache
from importlib import resources
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import platformdirs

from railenv.files import write_whole

_KERNELS_GO_HERE = "# --- kernels go here ---\n"
_LAYOUT_IMPORT = "from railenv.kernels.layout import Layout\n"
_FUTURE = "from __future__ import annotations\n"  # allowed in a file's first lines only

Program = Literal["integrate", "environment"]

SCALAR = 1
LANES = {"float64": 16, "float32": 32}
"""Lanes of one block: as many as keep the vector units of current processors busy."""

_HEADER = """
import math
import numba
import numpy as np
from numba import prange
from numba.extending import intrinsic
from railenv.kernels.cache import checked

_options = dict(error_model="numpy", fastmath=False, boundscheck=False)
jit = checked(numba.njit(**_options))
parallel_jit = checked(numba.njit(parallel=True, **_options))
inline = numba.njit(forceinline=True, **_options)
real = np.{dtype}
ROUNDER = real({rounder!r})
L = {lanes}
"""
# 1.5 * 2^(mantissa bits): adding it leaves no bits for fractions
_ROUNDER = {"float64": 1.5 * 2.0**52, "float32": 1.5 * 2.0**23}


def cache_directory() -> Path:
    """Directory of compiled kernels: ``RAILENV_CACHE_DIR``, or the user's cache directory.

    Falls back, with a warning, on a temporary directory where that cannot be written.
    """
    chosen = os.environ.get("RAILENV_CACHE_DIR")
    path = Path(chosen) if chosen else Path(platformdirs.user_cache_dir("railenv")) / "kernels"
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except OSError as error:
        return _fallback(path, str(error))


@cache
def _fallback(path: Path, error: str) -> Path:
    """Return a temporary directory for this process, with one warning."""
    fallback = Path(tempfile.mkdtemp(prefix="railenv-kernels-"))
    warnings.warn(
        f"compiled kernels cannot be kept in {path} ({error}); compiling into {fallback} for "
        "this process. Set RAILENV_CACHE_DIR to a directory that can be written.",
        RuntimeWarning,
        stacklevel=3,
    )
    return fallback


@cache
def shipped_source(name: str) -> str:
    """Text of the checked-in kernels of one of the package's own models."""
    return _text_of(f"{name}.py")


def compilable_text(source: str, lanes: int, dtype: str, program: Program = "integrate") -> str:
    """Join header, elementary functions, generated kernels and integrators into one text."""
    functions, integrators = _text_of("runtime.py").split(_KERNELS_GO_HERE)
    # in place of the import, so that an edit of the layout is seen too
    layout = _text_of("layout.py").replace(_FUTURE, "")
    integrators = integrators.replace(_LAYOUT_IMPORT, layout)
    header = _HEADER.format(dtype=dtype, rounder=_ROUNDER[dtype], lanes=lanes)
    further = [_text_of("environment.py")] if program == "environment" else []
    return "\n".join([header, functions, source, integrators, *further])


def _text_of(name: str) -> str:
    return resources.files("railenv.kernels").joinpath(name).read_text(encoding="utf-8")


@cache
def load(
    source: str, lanes: int = SCALAR, dtype: str = "float64", program: Program = "integrate"
) -> ModuleType:
    """Import the kernels of a model, compiling nothing yet.

    Parameters
    ----------
    source : str
        Text from :func:`railenv.kernels.source.kernel_source`.
    lanes : int
        Number of systems that the kernels advance together.
    dtype : {"float64", "float32"}
        Type of the buffer.
    program : {"integrate", "environment"}
        "environment" adds the control steps of environments; the source is an equipped model's.

    Returns
    -------
    module
        With the functions of the kernels and of ``railenv/kernels/runtime.py``, and ``LAYOUT``.
    """
    text = compilable_text(source, lanes, dtype, program)
    name = f"railenv_kernel_{hashlib.sha256(text.encode()).hexdigest()[:24]}"
    path = cache_directory() / f"{name}.py"
    if not _holds(path, text):
        write_whole(path, text)
    return _import(name, path)


def _holds(path: Path, text: str) -> bool:
    try:
        return path.read_text(encoding="utf-8") == text
    except (OSError, UnicodeDecodeError):
        return False


def _import(name: str, path: Path) -> ModuleType:
    spec: Any = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # Numba looks its functions' globals up there
    try:
        code = spec.loader.get_code(name)
    except (EOFError, ImportError, TypeError, ValueError):  # Python's own compiled file is damaged
        Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)
        code = spec.loader.get_code(name)
    exec(code, module.__dict__)
    return module
