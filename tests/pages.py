"""Scripts of docs/ as modules, for the tests that compare the pages with them."""

import importlib
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"


def script(name):
    """Import a script of docs/; such scripts import each other by their bare names."""
    if str(DOCS) not in sys.path:
        sys.path.append(str(DOCS))
    return importlib.import_module(name)
