"""Shipped controllers and their designs go together."""

import agents
from agents.controllers.shipped import NAMES
from agents.learning.designs import DESIGNS


def test_every_shipped_controller_has_a_design_and_a_file():
    assert tuple(DESIGNS) == NAMES
    assert tuple(agents.shipped_names()) == NAMES
