"""First use of the bogie's kernels in this process, timed; prints JSON. Run by benchmarks.startup."""

from __future__ import annotations

import json
import time

import railenv
from benchmarks.plant import STEP, buffer


def main() -> None:
    """Load and call each kernel once."""
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    start = time.perf_counter()
    kernels = model.kernels()  # imports Numba
    w, t = buffer(model, model.guess)
    before_rhs = time.perf_counter()
    kernels.rhs(w, t)
    before_jacobian = time.perf_counter()
    kernels.jacobian(w, t)
    before_rk4 = time.perf_counter()
    kernels.rk4_hold(w, t, STEP, 1)
    end = time.perf_counter()
    seconds = {
        "first call of rhs of the bogie": before_jacobian - before_rhs,
        "first call of jacobian of the bogie": before_rk4 - before_jacobian,
        "first call of rk4_hold of the bogie": end - before_rk4,
        "all three, with the import of Numba": end - start,
    }
    print(json.dumps(seconds))


if __name__ == "__main__":
    main()
