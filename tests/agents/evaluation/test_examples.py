"""The examples of controllers run."""

import dataclasses
import math

import agents
from examples import compare_on_own_vehicle, own_controller


def test_controllers_are_compared_on_a_vehicle_from_a_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(compare_on_own_vehicle.MINE)
    plan = dataclasses.replace(
        agents.Plan.quick(), curves=((math.inf, 0.0),), ride_duration=1.0, delays=(), noises=()
    )
    passive, damper, lqr = compare_on_own_vehicle.compare(path, plan)
    assert passive.vehicle == "STEEP_COACH"
    assert passive.linear < damper.linear < lqr.linear


def test_a_controller_of_ones_own_is_evaluated():
    plan = dataclasses.replace(
        agents.Plan.quick(), curves=((math.inf, 0.0),), ride_duration=1.0, delays=(), noises=()
    )
    found = own_controller.main(plan)
    assert 140.0 < found.linear < 155.0
    assert 91.0 < found.nonlinear <= found.linear
    assert found.robust is None
