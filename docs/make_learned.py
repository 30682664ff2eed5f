"""Write what is told of the shipped learned policy into docs/learning.md, with its picture.

``--search SEED ...`` first searches policies with other seeds (minutes each) and compares all on
vehicles that none was trained on; the outcome is kept in docs/learned.json. Without it the page is made
from there.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from joblib import Parallel, delayed

import agents
import design
import railenv
from agents.controllers.service import CONICITY, CREEP_FACTOR
from agents.controllers.shipped import coach
from agents.learning.designs import SEED
from agents.learning.learning_plots import plot_search
from agents.learning.policy_search import search_policy

DOCS = Path(__file__).resolve().parent
PAGE, DATA = DOCS / "learning.md", DOCS / "learned.json"
MARKS = re.compile(r"(<!-- shipped policy -->\n).*?(<!-- end of shipped policy -->)", re.DOTALL)
CLASSICAL = ("output-feedback", "lqg-scheduled", "lqg")
SHIPPED, GRADIENT = "learned", "learned-by-gradient"
UNSEEN: dict[str, dict[str, float]] = {
    "conicity 0.37": {"conicity": 0.37},
    "conicity 0.23, creep 0.7": {"conicity": 0.23, "creep_factor": 0.7},
    "conicity 0.37, creep 0.7": {"conicity": 0.37, "creep_factor": 0.7},
    "creep 0.7": {"creep_factor": 0.7},
    "body 20 % heavier": {"body_mass": 1.2},
    "body 20 % lighter": {"body_mass": 0.8},
    "bogie frame 10 % heavier": {"frame_mass": 1.1, "frame_yaw_inertia": 1.1},
    "primary springs 15 % stiffer": {"primary_longitudinal_stiffness": 1.15},
    "primary springs 15 % softer": {"primary_longitudinal_stiffness": 0.85},
}
"""Vehicles that no controller was tuned or trained on; masses and springs by factors."""
ABSOLUTE = ("conicity", "creep_factor")


def unseen(controller: Any) -> dict[str, dict[str, float | None]]:
    """Return critical speeds (m/s) of a controller on the unseen vehicles.

    The robust one is over conicity, so that vehicles of a certain conicity have none.
    """
    rows = {}
    for name, changes in UNSEEN.items():
        plan = agents.Plan(
            curves=agents.Plan().curves[:1],
            creep_factor=(changes.get("creep_factor", 1.0),) * 2,
            frictions=(),
            ride_speeds=(80.0,),
            ride_duration=1.0,
            delays=(),
            noises=(),
        )
        plain = coach()
        own = plain.plant.vehicle
        values = {k: v if k in ABSOLUTE else v * getattr(own, k) for k, v in changes.items()}
        found = agents.evaluate(controller, plain.replace(**values), plan=plan)
        rows[name] = {"linear": found.linear, "nonlinear": found.nonlinear}
        if "conicity" not in changes:
            rows[name]["robust"] = found.robust
    return rows


def row(controller: Any, name: str) -> dict[str, Any]:
    """Return what the tables say of a controller."""
    plan = agents.Plan(frictions=(), delays=(), noises=())
    found = agents.evaluate(controller, coach(), name=name, plan=plan)
    return {
        "linear": found.linear,
        "nonlinear": found.nonlinear,
        "robust": found.robust,
        "curves": {curve.name: curve.nonlinear for curve in found.curves[1:]},
        "moments": [ride["moment_rms"] for ride in found.ride],
        "unseen": unseen(controller),
    }


def second_mode() -> list[float]:
    """Return speed (m/s) and frequency (Hz) from which a second mode of the vehicle alone grows."""
    vehicle = railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW).replace(
        conicity=CONICITY[1], creep_factor=CREEP_FACTOR[1]
    )

    def growing(speed: float) -> np.ndarray:
        poles = design.linearize(vehicle, speed=speed).poles()
        return poles[(poles.real > 0.0) & (poles.imag > 0.0)]

    low, high = 100.0, 200.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if len(growing(middle)) < 2 else (low, middle)
    return [high, float(np.abs(growing(high).imag).max() / (2.0 * np.pi))]


def measure(seeds: list[int]) -> dict[str, Any]:
    """Search policies with other seeds, and compare all, two side by side."""
    kept: list[str | int] = [*CLASSICAL, SHIPPED, GRADIENT, *seeds]
    rows = Parallel(n_jobs=2)(delayed(_measured)(which) for which in kept)
    names = [f"seed {which}" if isinstance(which, int) else which for which in kept]
    return {**dict(zip(names, rows, strict=True)), "second mode": second_mode()}


def _measured(which: str | int) -> dict[str, Any]:
    """Return the row of a shipped controller, or of the policy that is searched with a seed."""
    if isinstance(which, str):
        return row(agents.shipped(which), which)
    base = agents.shipped("output-feedback")
    searched = search_policy(coach(), base, seed=which)  # type: ignore[arg-type]
    about = searched.policy.about
    told = row(searched.policy, f"seed {which}")
    return {**told, "chosen": about["chosen"], "start": about["judged"][0]}


def text() -> str:
    """Return the tables."""
    data = json.loads(DATA.read_text(encoding="utf-8"))
    about = agents.shipped(SHIPPED).about
    seeds = [name for name in data if name.startswith("seed ")]
    rows = [(f"{SHIPPED} (seed {SEED})", data[SHIPPED]), *((s, data[s]) for s in seeds)]
    rows += [(name, data[name]) for name in (GRADIENT, *CLASSICAL)]
    start = about["judged"][0]
    runs = about["generations"] * about["population"]
    episodes = runs * sum(len(about["lessons"][k]) for k in ("small", "large", "rides"))
    base = data["output-feedback"]["robust"]
    scores = {generation: score for generation, _, score in about["judged"]}
    (low, high), second = CONICITY, data["second mode"]
    lines = [
        f"The shipped policy is the outcome of {about['generations']} generations of "
        f"{about['population']} candidates ({episodes} episodes, seed {SEED}), chosen from generation "
        f"{about['chosen']}. Its start was stable up to {start[1]:.1f} m/s with every "
        f"conicity from {low:g} to {high:g} and every creep factor from {CREEP_FACTOR[0]:g} to "
        f"{CREEP_FACTOR[1]:g}; its score was {start[2]:.1f}, that of the chosen one "
        f"{scores[about['chosen']]:.1f}. The base is stable up to {base:.1f} m/s. "
        f"{_choice(about, base)}",
        "",
        f"A second mode limits the robust speed of all controllers: with conicity {high:g} and creep "
        f"factor {CREEP_FACTOR[1]:g} the vehicle alone has one of {second[1]:.1f} Hz that is "
        f"unstable from {second[0]:.1f} m/s on, and a yaw moment on the frame hardly moves it.",
        "",
        "![Learning curve of the shipped policy](pictures/learned.png)",
        "",
        "Speeds are in m/s, on curves the nonlinear ones; rms moments (kN m) on irregular track at 80, "
        "110 and 140 m/s. The curves are not those of the lessons:",
        "",
        "| controller | linear | nonlinear | robust | "
        + " | ".join(data[SHIPPED]["curves"])
        + " | moment at 80 | at 110 | at 140 |",
        "|---|" + "---:|" * (6 + len(data[SHIPPED]["curves"])),
    ]
    for name, r in rows:
        speeds = [_speed(r[k]) for k in ("linear", "nonlinear")] + [_speed(r["robust"], 2)]
        speeds += [_speed(speed) for speed in r["curves"].values()]
        moments = " | ".join(f"{1e-3 * m:.2f}" for m in r["moments"])
        lines.append(f"| {name} | {' | '.join(speeds)} | {moments} |")
    lines += [
        "",
        "Vehicles on which no controller was tuned or trained: linear / nonlinear / robust critical "
        f"speed, the robust one here only over conicity, from {low:g} to {high:g}, unless it is "
        "given:",
        "",
        "| vehicle | " + " | ".join(name for name, _ in rows) + " |",
        "|---|" + "---:|" * len(rows),
        *(
            f"| {vehicle} | "
            + " | ".join(" / ".join(map(_speed, r["unseen"][vehicle].values())) for _, r in rows)
            + " |"
            for vehicle in UNSEEN
        ),
    ]
    return "\n".join(lines) + "\n"


def _choice(about: dict[str, Any], base: float) -> str:
    """Say by which rule the policy was chosen."""
    if max(robust for _, robust, _ in about["judged"]) >= base + about["gain"]:
        return "It has the best score of the evaluated policies that are more robust."
    return (
        f"No evaluated policy is more robust than the base by {about['gain']:g} m/s; this one "
        "is the most robust of them. The later ones have better scores, but are less robust."
    )


def _speed(value: float | None, digits: int = 1) -> str:
    if value is None:
        return "failed"
    return "> 400" if value >= 400.0 else f"{value:.{digits}f}"


def page(old: str) -> str:
    """Return the page with the tables in it."""
    return MARKS.sub(lambda m: f"{m[1]}{text()}{m[2]}", old)


if __name__ == "__main__":
    mpl.use("Agg")
    if "--search" in sys.argv:
        chosen = [int(a) for a in sys.argv[sys.argv.index("--search") + 1 :]]
        DATA.write_text(json.dumps(measure(chosen), indent=1) + "\n", encoding="utf-8")
    told = agents.shipped(SHIPPED).about
    drawn = plot_search(np.array(told["means"]), np.array(told["judged"]))
    drawn.figure.savefig(DOCS / "pictures" / "learned.png", dpi=120, bbox_inches="tight")
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
