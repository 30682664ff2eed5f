"""What the pages take from the code is what the code says."""

import inspect
import json
import re

import numpy as np
import pytest
import sympy

import design
from benchmarks.clients.listed import CLIENTS
from benchmarks.reliability.run import AREAS
from design.reproduction import FULL, paper, reproduce
from design.reproduction.cases import VEHICLES
from design.reproduction.claims import cases_of
from design.reproduction.claims_of_body import BODY_RULES
from design.reproduction.claims_of_creep import CREEP_RULES
from design.reproduction.claims_of_diagrams import FURTHER_RULES
from design.reproduction.claims_of_frequencies import FREQUENCY_RULES
from design.reproduction.claims_of_motions import FIRST_RULES
from design.reproduction.sections.claims import Claims
from railenv.equations import (
    actuator,
    bodies,
    contact,
    cooperrider,
    creep,
    elements,
    loads,
    motion,
    sensors,
    shapes,
)
from railenv.equations.functions import atan, exp, log
from railenv.equations.symbolic import TableValue, WherePositive
from tests.pages import DOCS, ROOT, script

make_equations = script("make_equations")
make_diagram = script("make_diagram")
written = script("written")


def text(page):
    return (DOCS / page).read_text(encoding="utf-8")


# -------------------------------------------------------------------------------- physics


def test_equations_of_the_page_are_those_of_the_code():
    assert make_equations.page(text("physics.md")) == text("physics.md")


def test_page_has_every_equation_of_the_code():
    modules = (actuator, bodies, contact, cooperrider, creep, elements, loads, motion, sensors, shapes)
    public = {
        function
        for module in modules
        for name, function in inspect.getmembers(module, inspect.isfunction)
        if function.__module__ == module.__name__ and not name.startswith("_")
    }
    shown = {function for block in make_equations.SHOWN.values() for function in block.origin}
    assert public - shown == set()


def test_every_equation_of_the_page_has_the_value_that_the_code_computes(monkeypatch):
    pairs = []

    def recorded(expression):
        pairs.append((expression, written.tidy(expression)))
        return pairs[-1][1]

    monkeypatch.setattr(script("equations_shown"), "tidy", recorded)
    for block in make_equations.SHOWN.values():
        block.markdown()
    assert len(pairs) > 80
    rng = np.random.default_rng(1)
    for pair in pairs:
        # any odd function will do for what tables give
        raw, shown = (e.replace(TableValue, lambda name, x, *_: x**3) for e in pair)
        symbols = sorted(raw.free_symbols, key=str)
        for _ in range(3):
            numbers = dict(zip(symbols, rng.uniform(-2.0, 2.0, len(symbols)), strict=True))
            values = [complex(e.subs(numbers).doit()) for e in (raw, shown)]
            assert values[0] == pytest.approx(values[1], rel=1e-9, abs=1e-12), raw


def test_every_correction_of_the_print_stands_once_with_its_reason():
    rows = re.findall(r"^\| (\d+) \| (.+) \| (.+) \| (.+) \|$", text("physics.md"), re.MULTILINE)
    assert [int(number) for number, *_ in sorted(rows, key=lambda row: int(row[0]))] == [*range(1, 31)]
    assert all(len(reason) > 10 for *_, reason in rows)


def test_a_changed_equation_changes_the_page(monkeypatch):
    original = contact.creepages

    def changed(c, w, run, p):
        xi = original(c, w, run, p)
        return xi._replace(y=xi.y + run.cant)

    monkeypatch.setattr(contact, "creepages", changed)
    assert r"- \psi \right) + \phi_{se}" in make_equations.SHOWN["creepages"].markdown()


# ------------------------------------------------------------------ LaTeX as it is written

a, b, x, y = sympy.symbols("a b x y")


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (lambda: y - x, "y - x"),
        (lambda: 1.0 * x + 0.0, "x"),
        (lambda: -2.0 * a * a * (y - x), r"-2 a^{2} \left( y - x \right)"),
        (lambda: 0.5 * a * x, r"\frac{a x}{2}"),
        (lambda: -a * b / x * (y - 1.0), r"-\frac{a b}{x} \left( y - 1 \right)"),
        (lambda: (x + y) / a, r"\frac{x + y}{a}"),
        (lambda: x / (a * (x + y)), r"\frac{x}{a \left( x + y \right)}"),
        (lambda: a - (x - y), "a - x + y"),
        (lambda: a - b * (x - y), r"a - b \left( x - y \right)"),
        (lambda: (x / a) * (x / a), r"\frac{x^{2}}{a^{2}}"),
        (lambda: WherePositive(x - a, x - a, 0.0), r"\max\left( 0, x - a \right)"),
        (
            lambda: WherePositive(x - a, 1.0 / WherePositive(x - a, x, 3.0), y),
            r"\begin{cases} \frac{1}{x} & x > a \\ y & \text{otherwise} \end{cases}",
        ),
        (lambda: exp(log(x / a) / 3.0), r"\sqrt[3]{\frac{x}{a}}"),
        (lambda: TableValue(a, x, 1, 2, 4), r"a_{3}'\left( x \right)"),
        (lambda: x * atan(a), r"x \arctan a"),
        (
            lambda: WherePositive(-x - a, a, y),
            r"\begin{cases} a & x < -a \\ y & \text{otherwise} \end{cases}",
        ),
    ],
)
def test_latex_keeps_the_order_of_the_code(function, expected):
    assert written.latex(written.tidy(written.traced(function))) == expected


def test_what_is_printed_has_the_value_of_what_the_code_computes():
    values = {a: 0.7, b: -1.3, x: 2.1, y: 0.4}
    for function in (
        lambda: -a * b / x * (y - 1.0) + 0.5 * (x - y) * (x - y) / (a * x),
        lambda: a - b * (x - y) - (x / a) * (x / a) * 2.0,
        lambda: WherePositive(x - a, 1.0 / WherePositive(x - a, x, 3.0), y) - WherePositive(y, y, 0.0),
    ):
        raw = written.traced(function)
        numbers = [float(e.subs(values).doit()) for e in (raw, written.tidy(raw))]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-12)


def test_a_name_that_does_not_occur_is_refused():
    with pytest.raises(ValueError, match="does not occur"):
        written.named([x + y], {a * b: x})


# ------------------------------------------------------------------------ numbers, diagram


def test_numbers_of_the_validation_are_those_computed():
    make_validation = script("make_validation")
    assert make_validation.page(text("validation.md")) == text("validation.md")


def test_numbers_on_creep_are_those_computed():
    make_creep = script("make_creep")
    assert make_creep.page(text("how-to/creep.md")) == text("how-to/creep.md")


def test_numbers_on_the_contact_are_those_computed():
    make_contact = script("make_contact")
    assert make_contact.page(text("contact.md")) == text("contact.md")


def test_speeds_of_whole_vehicles_are_those_computed():
    make_coaches = script("make_coaches")
    page = text("limit-cycles.md")
    for conicity in make_coaches.CONICITIES:
        told = make_coaches.speeds(make_coaches.COACH.replace(conicity=conicity))
        assert f"| {conicity:g} | as shipped | 0.44, 0.44, 1.08 | {' | '.join(told)} |" in page
    kept = json.loads((DOCS / "coaches.json").read_text())
    for name, (alone, whole) in kept.items():
        assert re.search(rf"^\| {name} \|.*\| {alone:.1f} m/s \| {whole:.1f} m/s \|$", page, re.M)


def test_speeds_on_curves_are_those_kept():
    make_curves = script("make_curves")
    page = text("limit-cycles.md")
    for maker in make_curves.MAKERS.values():
        assert maker() in page
    for conicity, hopf, *_ in make_curves.kept()["speeds"]:
        found = design.critical_speed(make_curves.COACH.replace(conicity=conicity))
        assert hopf == pytest.approx(found.speed, rel=1e-5)


@pytest.mark.slow
def test_numbers_on_curves_are_those_computed():
    make_curves = script("make_curves")
    found, kept = make_curves.numbers(make_curves.curves()), make_curves.kept()
    assert make_curves.speeds(found) == make_curves.speeds(kept)
    assert make_curves.special(found) == make_curves.special(kept)


@pytest.mark.slow
def test_tables_of_whole_vehicles_are_made_again():
    assert script("make_coaches").page(text("limit-cycles.md")) == text("limit-cycles.md")


def test_the_table_of_irregular_motions_is_that_of_the_results():
    assert script("make_irregular").page(text("limit-cycles.md")) == text("limit-cycles.md")


def test_claims_of_the_page_are_those_that_the_report_judges():
    columns = json.loads((DOCS / "claims.json").read_text())
    rules = (*FIRST_RULES, *FREQUENCY_RULES, *CREEP_RULES, *FURTHER_RULES, *BODY_RULES)
    assert len(set(columns["claim"])) == len(rules)
    assert len(columns["claim"]) == len(set(columns["claim"])) * len(VEHICLES)
    onset = {
        vehicle: ours
        for claim, vehicle, ours in zip(
            columns["claim"], columns["vehicle"], columns["ours"], strict=True
        )
        if claim == "onset-bogie"
    }
    for case in cases_of("bogie"):
        found = design.critical_speed(case.model, radius=paper.RADIUS, cant=paper.CANT)
        assert onset[case.vehicle.name] == f"{found.speed:.2f} m/s"


@pytest.mark.slow
def test_claims_of_the_page_are_judged_again(tmp_path):
    reproduce([Claims(FULL, whole=True)], tmp_path, jobs=2)
    kept, found = (
        json.loads(path.read_text())
        for path in (DOCS / "claims.json", tmp_path / "data" / "claims.json")
    )
    # numbers of chaotic motions differ between processors
    for column in ("claim", "source", "statement", "paper", "vehicle", "verdict"):
        assert found[column] == kept[column]


def test_tables_of_reliability_are_those_measured_and_nothing_failed():
    make_reliability = script("make_reliability")
    assert make_reliability.page(text("reliability.md")) == text("reliability.md")
    rows = json.loads(text("reliability.json"))["measured"]
    examples = {r["name"]: sum(r["outcomes"].values()) for r in rows if r["part"] == "fuzz"}
    assert list(examples) == [area.name for area in AREAS]
    assert sum(examples.values()) > 50_000
    assert not any(row.get("failures") for row in rows)
    assert min(row["simulated"] for row in rows if row["part"] == "soak") >= 3600.0


def test_log_of_the_clients_is_what_was_run():
    make_clients = script("make_clients")
    assert make_clients.page(text("clients.md")) == text("clients.md")
    rows = json.loads(text("clients.json"))
    names = [client.name for client in CLIENTS]
    assert [row["name"] for row in rows] == names
    for client in CLIENTS:
        assert client.program.exists()
        for file in client.requirement_files:
            pins = [] if file is None else file.read_text(encoding="utf-8").splitlines()
            assert all("==" in pin for pin in pins if not pin.startswith("#")), file


@pytest.mark.parametrize("name", make_diagram.DRAWN)
def test_diagrams_are_generated(name):
    assert make_diagram.DRAWN[name]() == text(f"pictures/{name}")
    assert f"pictures/{name}" in text("architecture.md")


def test_stations_and_rooms_of_the_diagrams_exist():
    for box in make_diagram.BOXES.values():
        assert (ROOT / box.path).exists(), box.path
    for wing, floors in make_diagram.WINGS.items():
        for room, _ in (room for floor in floors for room in floor):
            path = ROOT / wing / room
            assert path.is_dir() or path.with_suffix(".py").exists(), path


def test_tables_of_the_problems_are_those_rated():
    make_problems = script("make_problems")
    found = json.loads((DOCS / "problems.json").read_text(encoding="utf-8"))
    page = text("problems.md")
    assert make_problems.rated(found) in page
    for one in make_problems.PROBLEMS[:4]:  # the others' wear takes a while
        assert f"| `{one.name}` | {one.asks} |" in page
        assert str(one.damper) in page
    passive = found["bogie-secondary-v1"]["ratings"]["best passive damper"]["robust"]
    assert f"has a robust critical speed of {passive:.1f} m/s" in text("controllers.md")


def test_what_each_controller_was_given_is_what_its_file_says():
    assert script("make_given").rows() in text("problems.md")


def test_methods_side_by_side_are_those_trained():
    make_methods = script("make_methods")
    found = json.loads((DOCS / "methods.json").read_text(encoding="utf-8"))
    assert make_methods.table(found, make_methods.neighbour()) in text("learning.md")
    assert {(run["method"], run["seed"]) for run in found} == {
        (method, seed) for method in make_methods.NAMES for seed in range(5)
    }


def test_what_controllers_do_is_what_they_do():
    assert script("make_explained").equivalents() in text("what-controllers-do.md")


def test_tables_of_the_tasks_are_those_measured():
    make_tasks = script("make_tasks")
    found = json.loads(text("tasks.json"))
    page = text("environments/tasks.md")
    assert make_tasks.earned(found) in page
    assert make_tasks.sections(found) in page


def test_blocks_of_a_page_and_their_makers_must_agree():
    blocks = script("blocks")
    page = "x\n<!-- made: one -->\nold\n<!-- end -->\ny"
    assert blocks.refilled(page, {"one": lambda: "new"}) == page.replace("old", "\nnew\n")
    with pytest.raises(ValueError, match="two"):
        blocks.refilled(page, {"two": lambda: "new"})
