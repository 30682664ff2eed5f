"""Draw the pictures of pages from their own code: ``python docs/make_pictures.py``.

A picture is the block's ``figure``, or else what it drew last.
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
PAGES = (DOCS / "tutorial.md", DOCS / "how-to" / "assess.md")


def main() -> None:
    """Draw the pictures of all pages, in a folder where their blocks may write files."""
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
    ):
        for page in PAGES:
            draw(page)


def draw(page: Path) -> None:
    """Run the blocks of a page in order; each picture is of the block before it."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    parts = re.findall(r"```python\n(.*?)```|!\[.*?\]\((.+?\.png)\)", page.read_text(), re.DOTALL)
    for block, picture in parts:
        if block:
            plt.close("all")
            namespace.pop("figure", None)
            exec(compile(block, page.name, "exec"), namespace)
        else:
            figure = namespace.get("figure") or plt.gcf()
            figure.savefig(page.parent / picture, dpi=120, bbox_inches="tight")
            print(f"wrote {picture}")


if __name__ == "__main__":
    main()
