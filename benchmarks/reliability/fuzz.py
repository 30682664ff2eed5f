"""Runs a property over many random examples and counts the outcomes.

An outcome is a result that the property found sane, or one of the package's own exceptions. Anything
else (another exception, a result that is not finite, an example that takes too long) is a failure.
"""

from __future__ import annotations

import contextlib
import signal
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.strategies import SearchStrategy

from railenv.errors import RailenvError

LONGEST = 120.0
"""s of processor time that an example may take, the compilation of its kernels included."""

RESULT = "result"
FAILURE = "failure"

_LONGEST_MESSAGE = 2000  # characters
_SHOWN = 1000


class HangError(AssertionError):
    """An example took too long."""


@dataclass(frozen=True)
class Area:
    """Something that is fuzzed.

    Attributes
    ----------
    name : str
        What the page calls it.
    examples : SearchStrategy
        Of hypothesis.
    check : callable
        Does something with an example; raises AssertionError where the result is not sane.
    count : int
        Examples of the full run.
    quick : int
        Examples of the test.
    """

    name: str
    examples: SearchStrategy[Any]
    check: Callable[[Any], None]
    count: int
    quick: int = 30


@dataclass
class Tally:
    """What came out of an area.

    Attributes
    ----------
    outcomes : Counter
        Examples by "result", or the exception's name.
    failures : dict of str to str
        The shortest example that failed, by how and where it did.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    failures: dict[str, str] = field(default_factory=dict)

    @property
    def examples(self) -> int:
        """Number of examples."""
        return self.outcomes.total()


def run(area: Area, count: int, number: int = 0) -> Tally:
    """Run an area over about ``count`` examples, always the same ones for a number of the seed."""
    tally = Tally()

    @seed(number)
    @settings(
        max_examples=count,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate],
    )
    @given(example=area.examples)
    def one(example: Any) -> None:
        try:
            tally.outcomes[outcome_of(area.check, example)] += 1
        except Exception as error:  # whatever it is, it is what was looked for
            tally.outcomes[FAILURE] += 1
            note(tally.failures, error, example)

    one()
    return tally


def note(failures: dict[str, str], error: Exception, example: Any) -> None:
    """Keep the shortest example of each place and kind of failure."""
    frames = traceback.extract_tb(error.__traceback__)
    places = [f"{Path(f.filename).name}:{f.lineno}" for f in frames[-3:]]
    key = f"{type(error).__name__} in {' > '.join(places)}"
    text = f"{error} {example!r}"[:_SHOWN]
    if key not in failures or len(text) < len(failures[key]):
        failures[key] = text


def outcome_of(check: Callable[[Any], None], example: Any) -> str:
    """Return the outcome of one example; raises where it is a failure."""
    try:
        with limited(LONGEST), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of NumPy, about overflow on the way to an error
            check(example)
    except RailenvError as error:
        check_message(error)
        return type(error).__name__
    return RESULT


def check_message(error: RailenvError) -> None:
    """Check that an exception says something that a person can read."""
    text = str(error)
    assert text.strip(), f"{type(error).__name__} says nothing"
    assert len(text) < _LONGEST_MESSAGE, f"a message of {len(text)} characters: {text[:200]}"


@contextlib.contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise HangError in what takes more processor time than that."""

    def stop(*_: object) -> None:
        raise HangError(f"no end after {seconds:g} s of processor time")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
