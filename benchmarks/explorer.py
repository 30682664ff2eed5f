"""How long after a slider the results of the Explorer are there: ``python -m benchmarks.explorer``.

The server's part: from the slider to the message for the browser, results and figures, of every
result one after the other. Processor time, since other processes take part of the elapsed one.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

import railenv
from railenv.explorer.page import Page
from railenv.explorer.state import State
from railenv.explorer.tasks import Accepted, Done

REPETITIONS = 15

STATES = {
    "bogie, hollow treads": State(),
    "bogie, profiles": State(vehicle=railenv.HIGH_SPEED_COACH_S1002),
    "dual wheelset": State(kind="dual-wheelset"),
    "whole coach": State(kind="coach"),
    "bogie under LQG": State(controller="lqg", speed_range=(20.0, 200.0)),
}


class Clocked:
    """Runs tasks at once, and notes when each result is shown."""

    def __init__(self, deliver: Callable[[Any], None]) -> None:
        self.deliver = deliver
        self.times: dict[str, float] = {}

    def start(self, task: Any) -> None:
        """Run a task to its end."""
        start = time.process_time()
        self.times = {}
        for update in task:
            self.deliver(update)
            if not isinstance(update, Accepted):
                self.times[type(update).__name__] = time.process_time() - start

    def cancel(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


def measured(clock: Clocked, slider: Any, first: float, step: float) -> dict[str, float]:
    """Return the median time (s) after which each result is there, of some moves of a slider."""
    found: dict[str, list[float]] = {}
    for k in range(1, REPETITIONS + 2):
        slider.value = first + k * step
        for name, value in clock.times.items():
            found.setdefault(name, []).append(value)
    return {name: statistics.median(values[1:] or values) for name, values in found.items()}


def main() -> None:
    """Print a table."""
    results = ("Stability", "Present", "Motion", "ContactCurves", Done.__name__)
    table = Table(title="milliseconds of processor time after a slider", box=box.SIMPLE)
    for title in ("page", "slider", "locus", "modes now", "motion", "contact", "all"):
        table.add_column(title, justify="right" if title not in ("page", "slider") else "left")
    for name, state in STATES.items():
        clocks: list[Clocked] = []

        def clocked(deliver: Any, _: Any, clocks: list[Clocked] = clocks) -> Clocked:
            clocks.append(Clocked(deliver))
            return clocks[-1]

        page = Page(state, clocked)
        sliders = {"speed": (page.controls.speed, 90.0, 0.5)}
        for number in ("conicity", "wear", "friction"):
            if number in page.controls.numbers:
                widget = page.controls.numbers[number]
                sliders[number] = (widget, float(widget.value), 0.01)
        for slider, (widget, first, step) in sliders.items():
            found = measured(clocks[0], widget, first, step)
            cells = [f"{1e3 * found[r]:.0f}" if r in found else "" for r in results]
            table.add_row(name, slider, *cells)
    Console().print(table)


if __name__ == "__main__":
    main()
