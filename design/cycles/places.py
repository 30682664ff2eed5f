"""A vehicle on a curve, for studies over parameters."""

from __future__ import annotations

from dataclasses import dataclass

from railenv.models import Model

CURVE = ("radius", "cant")
"""Names of parameters of the curve, not of the model."""


@dataclass(frozen=True)
class Place:
    """A model and the curve on which it runs."""

    model: Model
    radius: float
    cant: float

    def replace(self, **changes: float) -> Place:
        """Return the place with radius (m), cant (rad) or quantities of the model changed."""
        curve = {name: changes[name] for name in CURVE if name in changes}
        of_model = {name: value for name, value in changes.items() if name not in CURVE}
        return Place(
            self.model.replace(**of_model) if of_model else self.model,
            curve.get("radius", self.radius),
            curve.get("cant", self.cant),
        )
