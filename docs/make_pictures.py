"""Draw the pictures of docs/tutorial.md from its own code: ``python docs/make_pictures.py``."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

DOCS = Path(__file__).resolve().parent
PAGE = DOCS / "tutorial.md"


def main() -> None:
    """Run the blocks of the page in order; each picture is of the block before it."""
    namespace: dict[str, object] = {"__name__": "__main__"}
    parts = re.findall(r"```python\n(.*?)```|!\[.*?\]\((.+?\.png)\)", PAGE.read_text(), re.DOTALL)
    for block, picture in parts:
        if block:
            plt.close("all")
            exec(compile(block, PAGE.name, "exec"), namespace)
        else:
            plt.gcf().savefig(DOCS / picture, dpi=120, bbox_inches="tight")
            print(f"wrote {picture}")


if __name__ == "__main__":
    main()
