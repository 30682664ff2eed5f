"""The vehicles and models that the report compares, and their colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import railenv
from design.reproduction import paper
from design.style import SERIES
from railenv.models import Bogie, DualWheelset
from railenv.vehicles import Vehicle

ModelName = Literal["bogie", "dual_wheelset"]

_COACH = railenv.HIGH_SPEED_COACH.replace(
    wheelbase_curving=False,
    provenance=f"{railenv.HIGH_SPEED_COACH.provenance}; without wheelbase_curving, as the paper",
)

VEHICLES = (railenv.TABLE_1, railenv.TABLE_1_PRINTED_LOADS, _COACH)
MODELS: tuple[ModelName, ...] = ("bogie", "dual_wheelset")
MODEL_TITLES = {"bogie": "bogie", "dual_wheelset": "dual wheelset"}
PRINTED = {"bogie": paper.BOGIE, "dual_wheelset": paper.DUAL_WHEELSET}

VEHICLE_COLORS = {
    "TABLE_1": "#4a4ea3",
    "TABLE_1_PRINTED_LOADS": "#9b9ed6",
    "HIGH_SPEED_COACH": SERIES[1],
}
MODEL_COLORS = {"bogie": SERIES[2], "dual_wheelset": SERIES[3]}

_TYPES: dict[ModelName, type[Bogie] | type[DualWheelset]] = {
    "bogie": Bogie,
    "dual_wheelset": DualWheelset,
}


@dataclass(frozen=True)
class Case:
    """One model of one vehicle."""

    kind: ModelName
    vehicle: Vehicle

    @property
    def model(self) -> Bogie | DualWheelset:
        """The model."""
        return _TYPES[self.kind](self.vehicle)

    @property
    def key(self) -> str:
        """Name of the case in names of pieces and files."""
        return f"{self.kind}-{self.vehicle.name}"

    @property
    def title(self) -> str:
        """Name of the case in texts."""
        return f"{self.vehicle.name} {MODEL_TITLES[self.kind]}"

    @property
    def printed(self) -> paper.Printed:
        """The paper's printed results for this model."""
        return PRINTED[self.kind]


CASES = tuple(Case(kind, vehicle) for kind in MODELS for vehicle in VEHICLES)

COACH = next(c for c in CASES if c.kind == "bogie" and c.vehicle is _COACH)
"""The bogie whose critical speed is near the paper's."""
