"""Pictures of environments side by side: a present one of each, or those of all steps."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railenv.envs.fleet import Fleet
from railenv.envs.showing import Recorder


class Views:
    """The drawing of every environment of a fleet; without a render mode it does nothing.

    Parameters
    ----------
    fleet : Fleet
    render_mode : {"rgb_array", "rgb_array_list"}, optional
    """

    def __init__(self, fleet: Fleet, render_mode: str | None) -> None:
        n = fleet.n if render_mode else 0
        self._recorders = [Recorder(fleet, render_mode, i) for i in range(n)]
        self._keeps = render_mode == "rgb_array_list"
        self._kept: list[list[Any]] = [[] for _ in range(n)]

    def restart(self, rows: Iterable[int]) -> None:
        """Forget the past of some environments, at their reset."""
        if self._recorders:
            for i in rows:
                self._recorders[i].restart()
                self._kept[i] = []
                if self._keeps:
                    self._keep(i)

    def forget(self) -> None:
        """Forget the past of all environments."""
        for recorder in self._recorders:
            recorder.restart()
        self._kept = [[] for _ in self._recorders]

    def record(self, commands: NDArray[np.float64], waiting: NDArray[np.int_]) -> None:
        """Add a control step of the environments; some only wait to be reset."""
        for i, recorder in enumerate(self._recorders):
            recorder.record(commands[i])
            if self._keeps and i not in waiting:
                self._keep(i)

    def _keep(self, i: int) -> None:
        self._kept[i].append(self._recorders[i].draw())

    def draw(self) -> tuple[Any, ...]:
        """Return a picture of each environment, or a list of those kept, which are then forgotten."""
        if not self._keeps:
            return tuple(recorder.draw() for recorder in self._recorders)
        for recorder in self._recorders:
            recorder.check()
        kept, self._kept = self._kept, [[] for _ in self._recorders]
        return tuple(kept)

    def close(self) -> None:
        """Close the renderers."""
        for recorder in self._recorders:
            recorder.close()
