"""Compute the numbers of docs/validation.md: ``python docs/make_validation.py``.

The paper's claims are those of docs/claims.json, which ``railenv reproduce`` computes (some minutes)
and writes to results/data. The text around the tables is edited in the page itself.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from blocks import refilled
from numpy.typing import NDArray

import design
import railenv
from design.reproduction import sections
from design.reproduction.adhesion import adhesion_limit
from design.reproduction.cases import CASES, MODEL_TITLES
from design.reproduction.paper import CANT, RADIUS
from design.reproduction.readings import results as searched
from design.reproduction.sections.claims import WORDS
from design.reproduction.simplifications import results as simplified
from railenv.contact.laws import ContactLaw
from railenv.equations.contact import creep_magnitude, normal_contact, point, saturation, wheel
from railenv.equations.coordinates import Motion, Rail, Running

PAGE = Path(__file__).resolve().parent / "validation.md"
CLAIMS = PAGE.with_name("claims.json")

REFERENCE = PAGE.parent.parent / "tests" / "data" / "contact"

PERTURBATION = {"y_w1": 1e-3}
SAMPLES = 300
STEP = 1e-30
"""Of complex-step derivatives."""

DEMO = "a demo of continuation at bifurcation.de"

TABLE_1_BOGIE = railenv.Bogie(railenv.TABLE_1)
TABLE_1_DUAL = railenv.DualWheelset(railenv.TABLE_1)
COACH = railenv.Bogie(railenv.HIGH_SPEED_COACH)
COACH_DUAL = railenv.DualWheelset(railenv.HIGH_SPEED_COACH)
COACH_ON_PROFILES = railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002)

LAWS: tuple[ContactLaw, ...] = (
    railenv.Cone(0.2),
    railenv.LinearProfile(0.2, 0.03, 13.6),
    railenv.ArcProfile(0.05, 0.5, 0.3),
    railenv.HollowTread(0.2, 0.034, 0.3),
    railenv.ProfilePair(),
    railenv.ProfileFamily(railenv.ProfilePair(), railenv.ProfilePair("S1002_WORN"), 0.5),
)
"""One of each kind."""


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


# ------------------------------------------------------------------------- critical speeds


def tangent() -> str:
    """Critical speeds on tangent track beside those of other implementations."""
    other = "an independent implementation"
    coach = railenv.HIGH_SPEED_COACH
    linear = railenv.Bogie(coach.replace(contact=railenv.LinearProfile(0.2, 0.03, 13.6)))
    cases = (
        ("Cooperrider bogie", railenv.CooperriderBogie(), "68.66", DEMO),
        ("Cooperrider bogie", railenv.CooperriderBogie(), "68.644 m/s at 3.998 Hz", other),
        ("`TABLE_1`, bogie", TABLE_1_BOGIE, "12.460 m/s at 0.763 Hz", other),
        ("`TABLE_1`, dual wheelset", TABLE_1_DUAL, "34.175 m/s at 1.868 Hz", other),
        ("`HIGH_SPEED_COACH`, bogie", COACH, "116.471 m/s at 3.113 Hz", other),
        (
            "the same, conicity 0.2",
            railenv.Bogie(coach.replace(conicity=0.2)),
            "103.489 m/s at 6.425 Hz",
            other,
        ),
        ("the same, `LinearProfile(0.2, 0.03, 13.6)`", linear, "92.08 m/s at 6.193 Hz", other),
    )
    rows = []
    for name, model, reference, source in cases:
        found = design.critical_speed(model)
        ours = f"{found.speed:.3f} m/s at {found.frequency:.3f} Hz" if found.speed else str(found)
        rows.append((name, ours, reference, source))
    return table(("model", "here", "there", "where"), rows)


# --------------------------------------------------------------------------- closed forms


def _free_wheelset_wavelength(**contact: Any) -> float:
    """Wavelength (m) of the hunting of a wheelset without suspension and spin, at walking pace."""
    names = railenv.TABLE_1.parameters()
    springs = [n for n in names if n.startswith(("primary_", "yaw_damper_")) and n != "primary_arm"]
    vehicle = railenv.TABLE_1.replace(
        **contact,
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
    for conicity in (1e-3, 0.05, 0.2, 0.4):
        plane = railenv.TABLE_1.replace(conicity=conicity).klingel_wavelength
        computed = _free_wheelset_wavelength(conicity=conicity)
        rows.append((f"{conicity:g}", f"{computed:.3f} m", f"{plane:.3f} m"))
    return table(("conicity", "here", "Klingel"), rows)


def arcs() -> str:
    """Conicity that the wavelength of a free wheelset on arcs tells, beside the closed form."""
    rows = []
    r0, a = railenv.TABLE_1.wheel_radius, railenv.TABLE_1.half_gauge
    for angle, tread, rail in ((0.02, 0.6, 0.3), (0.034, 0.4, 0.3), (0.1, 0.8, 0.08)):
        law = railenv.ArcProfile(angle, tread, rail)
        wavelength = _free_wheelset_wavelength(contact=law)
        found = a * r0 * (2.0 * math.pi / wavelength) ** 2
        closed = tread * angle / (tread - rail) * (a + rail * math.sin(math.atan(angle))) / a
        rows.append((f"{angle:g}", f"{tread:g} m", f"{rail:g} m", f"{found:.4f}", f"{closed:.4f}"))
    return table(("contact angle", "wheel", "rail", "here", "closed form"), rows)


# ------------------------------------------------------------------- forces without friction


def _numbers(law: ContactLaw, **changes: Any) -> Any:
    """Return the numbers of a wheelset of the coach on a contact law."""
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(contact=law, **changes))
    values = {**model.assembly.values, **model.assembly.tables}
    return model.assembly.with_numbers(values).wheelsets[0]


def _normal_forces(place: Sequence[Any], p: Any) -> list[Any]:
    """Return F_y, F_z, M_x and M_z of the normal contact of both wheels at y, z, phi and psi."""
    w, rail = Motion(*place, 0.0, 0.0, 0.0, 0.0), Rail(0.0, 0.0, 0.0)
    sides = [normal_contact(point(side, w, rail, p), w, rail, p) for side in (+1, -1)]
    return [
        sum(column)
        for column in zip(*[(n.lateral, n.vertical, n.roll, n.yaw) for n in sides], strict=True)
    ]


def gravity() -> str:
    """Gravitational stiffness of a wheelset on nearly rigid rails without friction."""
    rows, load = [], 1e5
    for conicity in (0.05, 0.2, 0.4):
        p = _numbers(railenv.Cone(conicity), vertical_rail_stiffness=1e13)
        rest = [0.0, -load / 2e13, 0.0, 0.0]
        columns = []
        for i in range(3):
            place = [x + (1j * STEP if i == j else 0.0) for j, x in enumerate(rest)]
            columns.append([f.imag / STEP for f in _normal_forces(place, p)[:3]])
        stiffness = -np.array(columns).T
        held, free = stiffness[0, 0], stiffness[1:, 1:]
        found = held - stiffness[0, 1:] @ np.linalg.solve(free, stiffness[1:, 0])
        unit = load * conicity / p.half_gauge
        k = p.wheel_radius * conicity / p.half_gauge
        closed = 2.0 / (1.0 - k) + (k + conicity**2) / (1.0 - k) ** 2
        rows.append((f"{conicity:g}", f"{found / unit:.3f}", f"{closed:.3f}"))
    return table(("conicity", "here, in W λ / a", "closed form"), rows)


def work() -> str:
    """Work of the forces of the normal contact round closed paths."""
    turn = 2.0 * math.pi * np.arange(4000) / 4000
    size = np.array([5e-3, 2e-4, 2e-3, 1e-2])
    late = np.array([0.0, 1.0, 0.6, 2.0])
    path = size[:, None] * np.sin(turn + late[:, None])
    path[1] -= 4e-3  # in contact all the way
    along = size[:, None] * np.cos(turn + late[:, None]) * (turn[1] - turn[0])
    rows = []
    for law in LAWS:
        p = _numbers(law)
        force = np.array([_normal_forces(place, p) for place in path.T.tolist()]).T
        power = force * along
        total, there = abs(power.sum()), np.abs(power.sum(axis=0)).sum()
        rows.append((f"`{type(law).__name__}`", f"{there:.0f} J", _bound(total) + " J"))
    return table(("law", "work there and back, added up", "sum round the path"), rows)


# --------------------------------------------------------------------------- profiles


def _reference(name: str) -> Any:
    return np.genfromtxt(
        REFERENCE / f"{name}.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )


def contact_program() -> str:
    """Contact of S1002 on UIC 60 beside CONTACT's case A-2.2."""
    made = railenv.ProfilePair(width=5e-6, step=5e-6)
    worst: dict[str, list[float]] = {"tread": [0.0, 0.0, 0.0], "flange": [0.0, 0.0, 0.0]}
    for row in _reference("mbench_a22_contact"):
        outwards = 1.0 if row["wheel"] == "right" else -1.0
        tilt = -row["roll_rad"] * outwards
        eta = 1e-3 * row["y_mm"] * outwards + made.nominal_radius * tilt + 0.75 * tilt**2 / 2
        pair = made
        if tilt < -5e-3:  # the other wheel climbs: that much roll moves the place on the crown
            pair = dataclasses.replace(made, inclination=made.inclination - tilt)
        expected = abs(row["contact_angle_rad"])
        angle = abs(pair.angle(eta) + tilt - expected)
        rise = abs(pair.radius(eta) - made.nominal_radius - 1e-3 * row["wheel_z_mm"])
        found = worst["tread" if expected < 0.2 else "flange"]
        found[:] = [found[0] + 1, max(found[1], angle), max(found[2], rise)]
    rows = [
        (where, f"{n:.0f}", f"{angle:.4f} rad", f"{1e3 * rise:.3f} mm")
        for where, (n, angle, rise) in worst.items()
    ]
    return table(("where", "places", "contact angle, largest difference", "rolling radius"), rows)


_CASES = {"E1": "UIC519_A", "E2": "UIC519_B", "E3": "UIC519_H", "E4": "UIC519_I"}
_GAUGE = 1.4351958
"""m; puts the origin of the rail's data 750 mm off the centre of the track."""


def conicity() -> str:
    """Equivalent conicity of the standard's cases, from its tables and from the profiles."""
    rows = []
    for name, profile in _CASES.items():
        delta = 1e-3 * _reference(f"en15302_{name}_rolling_radius_difference")["delta_r_mm"]
        y = 1e-4 * (np.arange(len(delta)) - 0.5 * (len(delta) - 1))
        standard = _reference(f"en15302_{name}_conicity")
        standard = standard[standard["amplitude_mm"] < 6.01]
        amplitude = 1e-3 * standard["amplitude_mm"]
        pair = railenv.ProfilePair(
            profile, "UIC519_RAIL_A", inclination=0.0, gauge=_GAUGE, width=1e-6, step=5e-6
        )
        both = (
            railenv.equivalent_conicity(y, delta, amplitude),
            pair.equivalent_conicity(amplitude),
        )
        cells = []
        for found in both:
            inside = (found >= standard["lower_method1"]) & (found <= standard["upper_method1"])
            off = np.abs(found - standard["conicity"]).max()
            cells += [f"{off:.4f}", f"{inside.sum()} of {len(found)}"]
        rows.append((name, *cells))
    return table(
        (
            "case",
            "its table, difference",
            "within the band",
            "its profiles, difference",
            "within the band",
        ),
        rows,
    )


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
    p = _numbers(railenv.Cone(0.05))
    worst = 0.0
    for _ in range(SAMPLES):
        violence = 10.0 ** rng.uniform(-4.0, 1.5)
        place = rng.uniform(-1.0, 1.0, 4) * [2e-2, 2e-3, 8e-3, 5e-2]
        w = Motion(*place, *(violence * rng.uniform(-1.0, 1.0, 4)))
        run = Running(rng.uniform(1.0, 150.0), rng.uniform(-4e-3, 4e-3), 0.1)
        left, right = (wheel(side, w, Rail(0.0, 0.0, 0.0), run, p) for side in (+1, -1))
        load = left.normal.magnitude + right.normal.magnitude
        if load > 0.0:
            demand = creep_magnitude(left) + creep_magnitude(right)
            worst = max(worst, saturation(left, right, p)[0] * demand / (p.friction * load))
    return worst


def _worst_differences(rng: np.random.Generator) -> dict[str, float]:
    """Largest relative differences of kernels, Jacobians and mirror images."""
    worst = dict.fromkeys(("kernel", "jacobian", "mirror"), 0.0)
    for model in (TABLE_1_BOGIE, COACH, COACH_ON_PROFILES, TABLE_1_DUAL, railenv.CooperriderBogie()):
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


def simplifications() -> str:
    """Speeds of the coach with one simplification of the paper after the other taken back."""
    return table(sections.simplifications.HEADER, sections.simplifications.rows(simplified()))


def readings() -> str:
    """How many readings of the print give the paper's speeds."""
    return table(sections.readings.HEADER, sections.readings.rows(searched()))


MAKERS = {
    "tangent": tangent,
    "klingel": klingel,
    "arcs": arcs,
    "gravity": gravity,
    "work": work,
    "CONTACT": contact_program,
    "conicity": conicity,
    "limits": limits,
    "paper": paper,
    "adhesion": adhesion,
    "readings": readings,
    "simplifications": simplifications,
}
"""Every table of the page, by the name in its comments."""


def page(text: str) -> str:
    """Return the page with all its numbers computed anew."""
    return refilled(text, MAKERS)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote {PAGE}")
