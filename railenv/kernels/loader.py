"""Compiles a model's kernels with Numba, cached on disk under the hash of everything compiled.

Numba's own cache looks at one file's time stamp and does not see an edit of a file it imports. Here
the generated kernels, the hand-written texts and a header become one file whose name is the hash of
its text, so a cached result can only ever be that of the very text. Compiling happens at first use of a
function.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import sys
import tempfile
import warnings
from functools import cache
from importlib import resources
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import platformdirs

from railenv.errors import CompilationError
from railenv.files import write_whole
from railenv.kernels.layout import Layout
from railenv.tables import WIDE

_KERNELS_GO_HERE = "# --- kernels go here ---\n"
_FIRST_KERNEL = "\n@jit\n"

Program = Literal["integrate", "environment"]

SCALAR = 1
LANES = {"float64": 16, "float32": 32}
"""Lanes of one block: as many as keep the vector units of current processors busy."""

_HEADER = """
import math
import numba
import numpy as np
from numba import types
from numba.extending import intrinsic
from railenv.kernels.cache import checked

_options = dict(error_model="numpy", fastmath=False, boundscheck=False)
# short kernels keep the GIL: beside a busy thread of Python, getting it back takes up to 5 ms
jit = checked(numba.njit(**_options))
nogil_jit = checked(numba.njit(nogil=True, **_options))
inline = numba.njit(forceinline=True, **_options)
real = np.{dtype}
ROUNDER = real({rounder!r})
L = {lanes}
# columns of a table, and lanes that look up in it together
WIDE = {wide}
AT_ONCE = min(L, WIDE)
"""
_ROWS = """
NX = {0.n_states}
U, C, P, FIRST_SITE, DX = {0.u}, {0.c}, {0.p}, {0.sites}, {0.dx}
WORK, O, J, Q = {0.work}, {0.o}, {0.j}, {0.q}
"""
# 1.5 * 2^(mantissa bits): adding it leaves no bits for fractions
_ROUNDER = {"float64": 1.5 * 2.0**52, "float32": 1.5 * 2.0**23}


def cache_directory() -> Path:
    """Directory of compiled kernels: ``RAILENV_CACHE_DIR``, or the user's cache directory.

    Falls back, with a warning, on a temporary directory where that cannot be written, or where the user
    has no home.
    """
    chosen = os.environ.get("RAILENV_CACHE_DIR")
    path = Path(chosen) if chosen else _users_cache()
    if path is None:
        return _fallback("the user's cache directory", "the user has no home directory")
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except OSError as error:
        return _fallback(str(path), str(error))


def _users_cache() -> Path | None:
    """Return the user's cache directory; None for a user without a home."""
    try:
        path = Path(platformdirs.user_cache_dir("railenv")) / "kernels"
    except RuntimeError:  # no HOME, and a user number without an entry in passwd
        return None
    return path if path.is_absolute() else None  # "~/.cache" where ~ stands for nothing


@cache
def _fallback(place: str, error: str) -> Path:
    """Return a temporary directory for this process, with one warning."""
    from multiprocessing.util import Finalize

    fallback = Path(tempfile.mkdtemp(prefix="railenv-kernels-"))
    # unlike atexit this runs at the end of forked workers too, and only in the process that made it
    Finalize(None, shutil.rmtree, args=(fallback, True), exitpriority=0)
    warnings.warn(
        f"compiled kernels cannot be kept in {place} ({error}); compiling into {fallback} for "
        "this process. Set RAILENV_CACHE_DIR to a directory that can be written.",
        RuntimeWarning,
        stacklevel=3,
    )
    return fallback


def compilable_text(source: str, lanes: int, dtype: str, program: Program = "integrate") -> str:
    """Join header, elementary functions, generated kernels and integrators into one text."""
    functions, integrators = _text_of("integrators.pyk").split(_KERNELS_GO_HERE)
    header = _header(lanes, dtype)
    rows = _ROWS.format(layout_of(source))
    further = [_text_of("environment.pyk")] if program == "environment" else []
    return "\n".join([header, functions, source, rows, integrators, *further])


def _header(lanes: int, dtype: str) -> str:
    return _HEADER.format(dtype=dtype, rounder=_ROUNDER[dtype], lanes=lanes, wide=WIDE)


def layout_of(source: str) -> Layout:
    """Return the rows of the buffer of some generated kernels."""
    head: dict[str, Any] = {}
    exec(source.partition(_FIRST_KERNEL)[0], head)  # names and cells: literals only
    states, inputs, parameters, cells, further = (
        len(head[name]) for name in ("STATES", "INPUTS", "PARAMETERS", "CELLS", "PARAMETER_CELLS")
    )
    own = (head["N_SIGNALS"], further, head["N_LOOKUPS"], len(head["SITES"]))
    return Layout(states, inputs, parameters, cells, *own)


def _text_of(name: str) -> str:
    return resources.files("railenv.kernels").joinpath("texts", name).read_text(encoding="utf-8")


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
        With the functions of the kernels and of ``railenv/kernels/texts``, and ``LAYOUT``.

    Raises
    ------
    CompilationError
        If Numba is told to compile nothing.
    """
    module: Any = _module(compilable_text(source, lanes, dtype, program))
    module.LAYOUT = layout_of(source)
    return module


@cache
def load_pictures() -> ModuleType:
    """Import the kernels for pictures, of ``texts/pictures.pyk``, compiling nothing yet.

    Raises
    ------
    CompilationError
        If Numba is told to compile nothing.
    """
    return _module("\n".join([_header(SCALAR, "float64"), _text_of("pictures.pyk")]))


def _module(text: str) -> ModuleType:
    """Import a text from where its compiled functions are kept."""
    _check_numba()
    name = f"railenv_kernel_{hashlib.sha256(text.encode()).hexdigest()[:24]}"
    path = cache_directory() / f"{name}.py"
    if not _holds(path, text):
        write_whole(path, text)
    return _import(name, path)


def _check_numba() -> None:
    from numba.core import config

    if getattr(config, "DISABLE_JIT", 0):
        raise CompilationError(
            "NUMBA_DISABLE_JIT is 1; it must be 0 or not set: kernels run as machine code only"
        )


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
