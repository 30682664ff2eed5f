"""A progress bar around a loop."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeVar

Item = TypeVar("Item")


def tracked(items: Sequence[Item], title: str, shown: bool) -> Iterable[Item]:
    """Return some items to loop over; on request, a bar shows how many are done."""
    if not shown:
        return items
    from rich.progress import track

    return track(items, description=title, total=len(items))
