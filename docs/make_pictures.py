"""Draw the pictures of pages from their own code: ``python docs/make_pictures.py``.

A picture that follows a block is its ``figure``, or else what it drew last.
"""

from __future__ import annotations

import contextlib
import re
import tempfile
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

DOCS = Path(__file__).resolve().parent
PAGES = (DOCS / "tutorial.md", DOCS / "limit-cycles.md", DOCS / "how-to" / "assess.md")


def main() -> None:
    """Draw the pictures of all pages, in a folder where their blocks may write files."""
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
    ):
        for page in PAGES:
            draw(page)


def draw(page: Path) -> None:
    """Run the blocks of a page in order; a picture right after one is of it."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    pattern = r"```python\n(.*?)```(?:\s*!\[[^\]]*\]\(([^)]+\.png)\))?"
    for block, picture in re.findall(pattern, page.read_text(), re.DOTALL):
        plt.close("all")
        namespace.pop("figure", None)
        exec(compile(block, page.name, "exec"), namespace)
        if picture:
            figure = namespace.get("figure") or plt.gcf()
            figure.savefig(page.parent / picture, dpi=120, bbox_inches="tight")
            print(f"wrote {picture}")


if __name__ == "__main__":
    main()
