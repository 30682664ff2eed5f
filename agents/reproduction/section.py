"""The shift of the Hopf point by controllers, as a section of the reproduction report."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from markupsafe import Markup

import agents
from agents.controllers.load import Loaded
from agents.evaluation.diagram import ClosedLoopDiagram
from agents.evaluation.evaluation import Evaluation, Plan
from agents.evaluation.leaderboard import columns, ordered, row
from agents.reproduction import computations, figures, words
from agents.reproduction import data as tables
from agents.reproduction.computations import CASE
from agents.reproduction.words import PASSIVE
from design.reproduction import DataTable, Drawing, Piece, Section, Settings, pieces
from design.reproduction.document import fragment
from design.reproduction.section import Data
from railenv.errors import ParameterError

_CODE = ("agents/controllers/*.py", "agents/evaluation/*.py", "railenv/envs/*.py")
_NAME = re.compile(r"[\w.-]+")
_RATES = 96  # speeds of the growth rates


class HopfPush(Section):
    """The coach's critical speeds with each of some controllers.

    Parameters
    ----------
    settings : Settings
        Settings of the whole report.
    plan : Plan
        Plan for the evaluation of every controller.
    controllers : mapping of str to controller, optional
        Controllers by name; all shipped ones when left out. The vehicle alone, ``"passive"``, must be
        among them.

    Raises
    ------
    ParameterError
        If the passive one is missing, or a name is not usable for a file.
    """

    key = "hopf-push"
    title = "Beyond the paper: pushing the Hopf point by control"

    def __init__(
        self, settings: Settings, plan: Plan, controllers: Mapping[str, Loaded] | None = None
    ) -> None:
        if controllers is None:
            controllers = {name: agents.shipped(name) for name in agents.shipped_names()}
        if PASSIVE not in controllers:
            raise ParameterError(
                f"controllers are {', '.join(controllers) or 'none'}; {PASSIVE!r} must be among them"
            )
        for name in controllers:
            if not _NAME.fullmatch(name):
                raise ParameterError(
                    f"name of a controller is {name!r}; it must consist of letters, digits, '.', '_' "
                    "and '-'"
                )
        self._settings = settings
        self._plan = plan
        self._content = {name: computations.plain(each) for name, each in controllers.items()}

    # ----------------------------------------------------------------- computations

    def pieces(self) -> tuple[Piece, ...]:
        """Return the computations for every controller, and the limit cycles without control."""
        made = (self._evaluation, self._diagram, self._growth)
        return (*(of(name) for of in made for name in self._content), self._branch())

    def _piece(self, kind: str, function: Any, name: str, what: str, **inputs: Any) -> Piece:
        inputs |= {"model": CASE.model, "name": name, "controller": self._content[name]}
        return Piece(f"hopf-push-{kind}-{name}", function, inputs, f"{what}, {name}", _CODE)

    def _evaluation(self, name: str) -> Piece:
        plan = {f.name: getattr(self._plan, f.name) for f in dataclasses.fields(self._plan)}
        return self._piece("evaluation", computations.evaluation, name, "critical speeds", plan=plan)

    def _diagram(self, name: str) -> Piece:
        speeds = np.linspace(*self._plan.speed_range, self._settings.diagram_speeds).tolist()
        return self._piece(
            "diagram",
            computations.diagram,
            name,
            "closed-loop diagram",
            speeds=speeds,
            duration=self._settings.diagram_duration,
        )

    def _growth(self, name: str) -> Piece:
        speeds = np.linspace(*self._plan.speed_range, _RATES).tolist()
        return self._piece("growth", computations.growth, name, "growth rates", speeds=speeds)

    def _branch(self) -> Piece:
        return pieces.branch(CASE, math.inf, self._settings)

    def evaluations(self, data: Data) -> list[Evaluation]:
        """Return the evaluations, the best first."""
        names = self._content
        return ordered([Evaluation.from_summary(data[self._evaluation(n).name]) for n in names])

    # ----------------------------------------------------------------- what is shown

    def text(self, data: Data) -> Markup:
        """Return the results of the controllers, the push of each, and the leaderboard."""
        found = self.evaluations(data)
        push = fragment(
            "table.html",
            paragraphs=words.paragraphs(found, agents.equipped(CASE.model)),
            caption=words.caption_of_pushes(found),
            header=words.push_columns(found[0]),
            rows=words.pushes(found),
            words=2,
        )
        leaderboard = fragment(
            "table.html",
            paragraphs=(),
            caption=words.caption_of_leaderboard(found),
            header=columns(found[0]),
            rows=[row(each) for each in found],
            words=2,
        )
        return push + leaderboard

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw the push on every curve, growth rates over speed, and the closed loops' diagrams."""
        found = self.evaluations(data)
        branch = data[self._branch().name]
        alone_first = sorted(self._content, key=lambda name: name != PASSIVE)
        diagrams = [ClosedLoopDiagram(**data[self._diagram(name).name]) for name in alone_first]
        rates = {e.controller: data[self._growth(e.controller).name] for e in found}
        return (
            *figures.pushes(found),
            *figures.growth(found, rates),
            *figures.diagrams(diagrams, None if branch is None else branch["branch"]),
        )

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return critical speeds, runs on rough track, growth rates and diagrams."""
        found = self.evaluations(data)
        rates = {e.controller: data[self._growth(e.controller).name] for e in found}
        diagrams = [data[self._diagram(e.controller).name] for e in found]
        made = (
            tables.speeds(found),
            tables.robust(found),
            tables.frictions(found),
            tables.delays(found),
            tables.noises(found),
            tables.ride(found),
            tables.growth(rates),
            tables.diagrams(diagrams),
        )
        return tuple(table for table in made if table.rows)
