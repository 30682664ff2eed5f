"""Blocks of a page that a script makes: between ``<!-- made: name -->`` and ``<!-- end -->``.

The text around the blocks is edited in the page itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping

_BLOCK = re.compile(r"<!-- made: (.+?) -->\n.*?<!-- end -->", re.DOTALL)


def refilled(text: str, makers: Mapping[str, Callable[[], str]], others: Collection[str] = ()) -> str:
    """Return the text of a page with all its blocks made anew, but those that another script makes.

    Raises
    ------
    ValueError
        If a block is missing from the page, stands there twice, or is unknown.
    """
    found = [name for name in _BLOCK.findall(text) if name not in others]
    if sorted(found) != sorted(makers):
        raise ValueError(f"the page has the blocks {sorted(found)}, made are {sorted(makers)}")

    def made(match: re.Match[str]) -> str:
        name = match[1]
        if name in others:
            return match[0]
        return f"<!-- made: {name} -->\n\n{makers[name]()}\n\n<!-- end -->"

    return _BLOCK.sub(made, text)


def table(headings: list[str], rows: list[list[str]], text_columns: int = 1) -> str:
    """Return a Markdown table whose first columns are text, and the others numbers."""
    rule = ["---"] * text_columns + ["---:"] * (len(headings) - text_columns)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in [headings, rule, *rows])
