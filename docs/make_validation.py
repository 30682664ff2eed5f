"""Compute the numbers of docs/validation.md: ``python docs/make_validation.py``.

The paper's claims are those of docs/claims.json, which ``railenv reproduce`` computes (some minutes)
and writes to results/data. The text around the tables is edited in the page itself.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from blocks import refilled
from numpy.typing import NDArray

import design
import railenv
from design.reproduction.adhesion import adhesion_limit
from design.reproduction.cases import CASES, MODEL_TITLES
from design.reproduction.paper import CANT, RADIUS
from design.reproduction.sections.claims import WORDS
from railenv.equations.contact import creep_magnitude, saturation, wheel
from railenv.equations.coordinates import Motion, Rail, Running

PAGE = Path(__file__).resolve().parent / "validation.md"
CLAIMS = PAGE.with_name("claims.json")

PERTURBATION = {"y_w1": 1e-3}
SAMPLES = 300

TABLE_1_BOGIE = railenv.Bogie(railenv.TABLE_1)
TABLE_1_DUAL = railenv.DualWheelset(railenv.TABLE_1)
COACH = railenv.Bogie(railenv.HIGH_SPEED_COACH)
COACH_DUAL = railenv.DualWheelset(railenv.HIGH_SPEED_COACH)


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


# ------------------------------------------------------------------------- critical speeds


def tangent() -> str:
    """Critical speeds on tangent track beside those of other implementations."""
    other = "an independent implementation"
    cases = (
        ("Cooperrider bogie", railenv.CooperriderBogie(), "68.66 m/s", "a public continuation demo"),
        ("Cooperrider bogie", railenv.CooperriderBogie(), "68.644 m/s at 3.998 Hz", other),
        ("`TABLE_1`, bogie", TABLE_1_BOGIE, "12.315 m/s at 0.742 Hz", other),
        ("`TABLE_1`, dual wheelset", TABLE_1_DUAL, "35.219 m/s at 1.890 Hz", other),
        ("`HIGH_SPEED_COACH`, bogie", COACH, "116.121 m/s at 3.055 Hz", other),
        ("`HIGH_SPEED_COACH`, dual wheelset", COACH_DUAL, "none up to 250 m/s", other),
    )
    rows = []
    for name, model, reference, source in cases:
        found = design.critical_speed(model)
        ours = f"{found.speed:.3f} m/s at {found.frequency:.3f} Hz" if found.speed else str(found)
        rows.append((name, ours, reference, source))
    return table(("model", "here", "there", "where"), rows)


# --------------------------------------------------------------------------- closed forms


def _free_wheelset_wavelength(conicity: float) -> float:
    """Wavelength (m) of the hunting of a wheelset without suspension and spin, at walking pace."""
    names = railenv.TABLE_1.parameters()
    springs = [n for n in names if n.startswith(("primary_", "yaw_damper_")) and n != "primary_arm"]
    vehicle = railenv.TABLE_1.replace(
        conicity=conicity,
        body_mass=0.0,
        lateral_spin_creep=0.0,
        spin_creep=0.0,
        wheelset_pitch_inertia=0.0,
        **dict.fromkeys(springs, 0.0),
    )
    poles = design.linearize(railenv.DualWheelset(vehicle), speed=1.0).poles()
    hunting = poles[(poles.imag > 1e-3) & (np.abs(poles) < 50.0)]  # bounce and roll lie above
    return float(2.0 * math.pi / hunting[0].imag)


def klingel() -> str:
    """Wavelengths of a free wheelset beside Klingel's."""
    rows = []
    for conicity in (1e-3, 0.05, 0.2):
        v = railenv.TABLE_1.replace(conicity=conicity)
        plane = v.klingel_wavelength
        rolling = plane * math.sqrt(1.0 + v.wheel_radius * conicity / v.half_gauge)
        computed = _free_wheelset_wavelength(conicity)
        rows.append((f"{conicity:g}", f"{computed:.2f} m", f"{plane:.2f} m", f"{rolling:.2f} m"))
    return table(("conicity", "here", "Klingel", "Klingel, with the roll of the wheelset"), rows)


# --------------------------------------------------------------------------------- limits


def _states(model: railenv.Model, rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw a state: wheels pressed 1 mm into the rails, and all else a few scales away from zero."""
    x = 3.0 * model.scale * rng.standard_normal(model.n_states)
    x[[i for i, name in enumerate(model.state_names) if name.startswith("z_")]] -= 1e-3
    return x


def _signs(names: Sequence[str]) -> NDArray[np.float64]:
    return np.array([1.0 if "z_" in n or n.startswith("vert") else -1.0 for n in names])


def _worst_adhesion(rng: np.random.Generator) -> float:
    """Largest share of the adhesion limit that the creep forces of a wheelset take."""
    p = SimpleNamespace(**railenv.TABLE_1.parameters())
    worst = 0.0
    for _ in range(SAMPLES):
        violence = 10.0 ** rng.uniform(-4.0, 1.5)
        place = rng.uniform(-1.0, 1.0, 4) * [2e-2, 2e-3, 8e-3, 5e-2]
        w = Motion(*place, *(violence * rng.uniform(-1.0, 1.0, 4)))
        run = Running(rng.uniform(1.0, 150.0), rng.uniform(-4e-3, 4e-3), 0.1)
        left, right = (wheel(side, w, Rail(0.0, 0.0, 0.0), run, p) for side in (+1, -1))
        load = left.normal + right.normal
        if load > 0.0:
            demand = creep_magnitude(left) + creep_magnitude(right)
            worst = max(worst, saturation(left, right, p) * demand / (p.friction * load))
    return worst


def _worst_differences(rng: np.random.Generator) -> dict[str, float]:
    """Largest relative differences of kernels, Jacobians and mirror images."""
    worst = dict.fromkeys(("kernel", "jacobian", "mirror"), 0.0)
    for model in (TABLE_1_BOGIE, COACH, TABLE_1_DUAL, railenv.CooperriderBogie()):
        mirror = _signs(model.state_names)
        for _ in range(SAMPLES // 10):
            x, u = _states(model, rng), np.zeros(model.n_inputs)
            conditions: dict[str, Any] = {"speed": rng.uniform(5.0, 150.0)}
            if not isinstance(model, railenv.CooperriderBogie):
                conditions |= {"curvature": rng.uniform(-2e-3, 2e-3), "cant": rng.uniform(-0.1, 0.1)}
            here = model.rhs(x, u, **conditions)
            size = np.abs(here).max()
            oracle = np.array(model.plain_rhs(x.tolist(), u.tolist(), **conditions))
            worst["kernel"] = max(worst["kernel"], np.abs(here - oracle).max() / size)
            turned = {k: v if k == "speed" else -v for k, v in conditions.items()}
            there = mirror * model.rhs(mirror * x, u, **turned)
            worst["mirror"] = max(worst["mirror"], np.abs(here - there).max() / size)
            A, _ = model.jacobian(x, u, **conditions)
            columns = []
            for i in range(model.n_states):
                step = x.astype(complex)
                step[i] += 1e-30j
                columns.append(
                    np.imag(model.plain_rhs(step.tolist(), u.tolist(), **conditions)) / 1e-30
                )
            exact = np.array(columns).T
            worst["jacobian"] = max(worst["jacobian"], np.abs(A - exact).max() / np.abs(exact).max())
    return worst


def _order() -> float:
    """Order of the integrator, from how halving the step reduces the error."""

    def end(step: float) -> NDArray[np.float64]:
        response = railenv.simulate(
            COACH, speed=80.0, perturbation=PERTURBATION, duration=0.4, step=step, output_step=0.4
        )
        return np.asarray(response.states)[:, -1]

    exact = end(2.5e-5)
    errors = [float(np.linalg.norm((end(step) - exact) / COACH.scale)) for step in (8e-4, 4e-4)]
    return math.log2(errors[0] / errors[1])


def _bound(value: float) -> str:
    """Write an upper bound of a small number as a power of ten that any processor keeps."""
    return f"below 1e{math.ceil(math.log10(max(value, 1e-13))) + 1}"


def limits() -> str:
    """Compare what must hold whatever the numbers with what does."""
    rng = np.random.default_rng(1)
    usage, worst = _worst_adhesion(rng), _worst_differences(rng)
    rows = [
        ("creep forces of a wheelset over its adhesion", f"at most {usage:.3f}", "1"),
        ("curve of the other hand against the mirror image", _bound(worst["mirror"]), "0"),
        ("kernels against the equations in plain Python", _bound(worst["kernel"]), "0"),
        ("Jacobians against complex steps", _bound(worst["jacobian"]), "0"),
        ("order of the integrator", f"{_order():.1f}", "4"),
    ]
    return table(("what", "found", "limit"), rows)


# ------------------------------------------------------------------------------ the paper


def paper() -> str:
    """Write the claims of the paper that the reproduction report has judged, from its data."""
    columns = json.loads(CLAIMS.read_text(encoding="utf-8"))
    rows: dict[str, list[str]] = {}
    for i, claim in enumerate(columns["claim"]):
        told = [f"{columns['statement'][i]} ({columns['source'][i]})", columns["paper"][i]]
        verdict = WORDS[columns["verdict"][i]]
        rows.setdefault(claim, told).append(f"**{verdict}**: {columns['ours'][i]}")
    vehicles = dict.fromkeys(columns["vehicle"])
    return table(("claim", "paper", *(f"`{name}`" for name in vehicles)), list(rows.values()))


def adhesion() -> str:
    """Speeds at which the lateral load of a curve takes all adhesion."""
    rows = [
        (MODEL_TITLES[case.kind], f"{adhesion_limit(case, RADIUS, CANT):.1f} m/s")
        for case in CASES
        if case.vehicle is railenv.TABLE_1_PRINTED_LOADS
    ]
    return table(("`TABLE_1_PRINTED_LOADS`", "all adhesion is taken at"), rows)


MAKERS = {
    "tangent": tangent,
    "klingel": klingel,
    "limits": limits,
    "paper": paper,
    "adhesion": adhesion,
}
"""Every table of the page, by the name in its comments."""


def page(text: str) -> str:
    """Return the page with all its numbers computed anew."""
    return refilled(text, MAKERS)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote {PAGE}")
