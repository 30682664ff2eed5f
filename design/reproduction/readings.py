"""Results of the search over readings of the print (``python -m benchmarks.readings.run``)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).with_name("data") / "readings.json"
"""Counts of the search."""

UNITS = {"m/s": 1.0, "km/h": 1.0 / 3.6}
"""Possible units of the paper's speeds, in m/s."""


def results() -> dict[str, Any]:
    """Return the counts of the search, with its axes."""
    found: dict[str, Any] = json.loads(RESULTS.read_text(encoding="utf-8"))
    return found
