"""Compare controllers on a vehicle of your own, read from a TOML file.

python -m examples.compare_on_own_vehicle mine.toml
"""

import sys
import tempfile
from pathlib import Path

import agents
import railenv
from agents.evaluation.leaderboard import markdown

MINE = """\
base = "HIGH_SPEED_COACH"
name = "STEEP_COACH"
provenance = "the shipped coach on steeper cones"
conicity = 0.15
"""


def compare(path, plan):
    """Design three controllers for a vehicle and evaluate them and the vehicle alone."""
    vehicle = railenv.Vehicle.from_toml(path)
    model = agents.equipped(railenv.Bogie(vehicle))
    controllers = {
        "passive": agents.Passive.design(model),
        "yaw rate": agents.YawRateFeedback.design(model, gain=1.5e5, washout=0.5),
        "LQR, full state": agents.LQR.design(model, speed=130.0),
    }
    return [
        agents.evaluate(controller, model, name=name, plan=plan)
        for name, controller in controllers.items()
    ]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        file = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder) / "mine.toml"
        if len(sys.argv) < 2:
            file.write_text(MINE)
        print(markdown(compare(file, agents.Plan.quick())))
