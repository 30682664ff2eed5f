"""Shipped controllers and their designs go together."""

import pytest

import agents
from agents.controllers.shipped import FIRST, NAMES, shipped_problems
from agents.learning.designs import DESIGNS, PROBLEM_DESIGNS
from agents.problems import problem
from railenv.errors import UnknownNameError


def test_every_shipped_controller_has_a_design_and_a_file():
    assert tuple(DESIGNS) == NAMES
    assert set(PROBLEM_DESIGNS) == set(shipped_problems())
    for name, designs in PROBLEM_DESIGNS.items():
        assert set(agents.shipped_names(name)) <= set(designs)


@pytest.mark.parametrize("name", [p for p in PROBLEM_DESIGNS if p != FIRST])
def test_what_is_shipped_for_a_problem_reads_and_commands_what_its_vehicle_has(name):
    model = problem(name).model()
    for kind in agents.shipped_names(name):
        controller = agents.shipped(kind, name)
        assert controller.commands == model.command_names
        agents.Rollout(model, controller, [agents.Case(20.0)]).run(0.1)


def test_what_is_not_shipped_is_named():
    with pytest.raises(UnknownNameError, match="allowed are bogie-secondary-v1"):
        agents.shipped("output-feedback", "tram")
    assert agents.shipped_names("tram") == []
