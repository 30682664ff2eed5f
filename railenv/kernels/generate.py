"""Write the checked-in kernels of the package's own models: ``make kernels``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from railenv.equations import bogie, cooperrider, dual_wheelset
from railenv.equations.equipped import EQUIPMENT
from railenv.equipment import Actuator, Sensors
from railenv.vehicles import COOPERRIDER, TABLE_1


@dataclass(frozen=True)
class Shipped:
    """Equations, names and title of one of the package's own models."""

    equations: Callable[..., Sequence[Any]]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    title: str
    signals: Callable[..., Sequence[Any]] | None = None

    def source(self) -> str:
        """Generate the kernels; needs SymPy."""
        from railenv.kernels.source import kernel_source

        return kernel_source(
            self.equations, self.states, self.inputs, self.parameters, self.title, self.signals
        )


SHIPPED = {
    "bogie": Shipped(
        bogie.bogie, bogie.STATES, bogie.INPUTS, tuple(TABLE_1.parameters()), "two-axle bogie"
    ),
    "dual_wheelset": Shipped(
        dual_wheelset.dual_wheelset,
        dual_wheelset.STATES,
        dual_wheelset.INPUTS,
        tuple(TABLE_1.parameters()),
        "dual wheelset",
    ),
    "cooperrider": Shipped(
        cooperrider.cooperrider_bogie,
        cooperrider.STATES,
        cooperrider.INPUTS,
        tuple(COOPERRIDER.parameters()),
        "Cooperrider bogie",
    ),
}
"""The models whose kernels are checked in, by the name of their file."""

_EQUIPPED_PARAMETERS = (
    *TABLE_1.parameters(),
    *Actuator.secondary().parameters(),
    *Sensors.standard().parameters(),
)

SHIPPED |= {
    f"{plant}_{place}": Shipped(
        equipment.equations,
        equipment.state_names,
        equipment.input_names,
        _EQUIPPED_PARAMETERS,
        f"{plant.replace('_', ' ')} with sensors and {place.replace('none', 'no')} actuators",
        equipment.signals,
    )
    for (plant, place), equipment in EQUIPMENT.items()
}


def main() -> None:
    """Regenerate every checked-in kernel."""
    for name, shipped in SHIPPED.items():
        path = Path(__file__).with_name(f"{name}.py")
        path.write_text(shipped.source(), encoding="utf-8")
        print(f"wrote {path.name}")


if __name__ == "__main__":
    main()
