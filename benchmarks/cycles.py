"""Limit cycles: the coach's branch through its fold, and the bifurcation diagram by simulation."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from functools import partial

import numpy as np

import design
import railenv
from benchmarks.table import Row, with_unit
from benchmarks.timing import processor_times

CANT = 0.0873  # rad
RADII = (math.inf, 20_000.0, 15_000.0, 12_500.0, 10_000.0, 8000.0, 6250.0)  # m
SPEEDS = np.linspace(70.0, 120.0, 60)  # m/s
DURATION = 20.0  # s


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    yield from _branch()
    yield from _branch_of_a_whole_vehicle()
    yield from _diagram()


def _branch() -> Iterator[Row]:
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    action = partial(design.cycle_branch, model, parameter_range=(30.0, 120.0))
    points, limit, repetitions = len(action()), 1.5, 5
    [(processor, elapsed)] = processor_times([action], repetitions)
    yield Row(
        f"limit cycles of the coach, Hopf point through fold to 120 m/s, {points} points",
        processor,
        "s",
        f"shortest processor time of {repetitions}",
        f"median elapsed, {with_unit(elapsed, 's')}; {with_unit(processor / points, 'ms')} a point",
        required=f"at most {limit:g} s, 60 points or more",
        holds=processor <= limit and points >= 60,
    )


def _branch_of_a_whole_vehicle() -> Iterator[Row]:
    model = railenv.Coach(railenv.HIGH_SPEED_COACH)
    action = partial(design.cycle_branch, model, parameter_range=(60.0, 96.0))
    points, limit, repetitions = len(action()), 6.0, 3
    [(processor, elapsed)] = processor_times([action], repetitions)
    yield Row(
        f"limit cycles of the whole coach, Hopf point through fold, {points} points",
        processor,
        "s",
        f"shortest processor time of {repetitions}",
        f"median elapsed, {with_unit(elapsed, 's')}; {with_unit(processor / points, 'ms')} a point",
        required=f"at most {limit:g} s",
        holds=processor <= limit,
    )


def _diagram() -> Iterator[Row]:
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    limit, elapsed = 15.0, []
    design.simulated_diagram(model, SPEEDS, duration=0.1, window=0.1)  # compiles
    for _ in range(2):
        start = time.perf_counter()
        design.simulated_diagram(model, SPEEDS, radii=RADII, cant=CANT, duration=DURATION)
        elapsed.append(time.perf_counter() - start)
    yield Row(
        f"simulated bifurcation diagram, {len(RADII)} radii x {len(SPEEDS)} speeds x 2 starts x "
        f"{DURATION:g} s",
        min(elapsed),
        "s",
        "shortest elapsed of 2",
        required=f"at most {limit:g} s",
        holds=min(elapsed) <= limit,
    )
