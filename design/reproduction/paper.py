"""The paper's running conditions and results as printed. Nothing here is computed."""

from __future__ import annotations

from dataclasses import dataclass

RADIUS = 6250.0
"""m, the curve of Figs 6 to 9."""

CANT = 0.0873
"""rad, Table 1's cant: 131 mm over a base of 1.5 m."""

RADII = (250.0, 10_000.0)
"""m, the range of Fig 5."""

DIAGRAM_RADII = (250.0, 500.0, 750.0, 1000.0, 2500.0, 6000.0, 10_000.0)
"""m, the curves of Figs 10 and 11."""

DIAGRAM_SPEEDS = (10.0, 180.0)
"""m/s, the range of Figs 10 and 11."""

LINEAR_TO_SIMULATED = 0.0875
"""Difference between the linear and the simulated critical speed, section 4.1."""

NATURAL = 1.0
"""Usual natural frequencies of a bogie, Hz, section 4.4."""


@dataclass(frozen=True)
class Printed:
    """The paper's printed results for one model at 6250 m.

    Attributes
    ----------
    steady, hunting : float
        Speeds (m/s) at which it shows steady running and hunting.
    steady_figure, hunting_figure : str
    frequency : float
        Main frequency (Hz) above the critical speed, Fig 13.
    frequency_below : float
        Main frequency (Hz) between the nonlinear and the linear critical speed, Fig 12.
    rms, rms_below : float
        Root mean squares with Figs 13 and 12; the paper gives no unit.
    """

    steady: float
    hunting: float
    steady_figure: str
    hunting_figure: str
    frequency: float
    frequency_below: float
    rms: float
    rms_below: float


BOGIE = Printed(115.0, 120.0, "Fig 6", "Fig 7", 2.734, 1.005, 77.9542, 100.3711)
DUAL_WHEELSET = Printed(130.0, 140.0, "Fig 8", "Fig 9", 2.78, 0.855, 74.5568, 118.4378)
