"""Fuzzed: vehicles, tracks, equations, equilibria, analyses and simulations."""

from __future__ import annotations

import dataclasses
import math
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import sympy
from hypothesis import strategies as st

import design
import railenv
from benchmarks.reliability import values
from benchmarks.reliability.fuzz import Area
from benchmarks.reliability.values import ANYTHING, number, rarely
from railenv.batch import Batch
from railenv.equations import functions
from railenv.errors import ParameterError
from railenv.kernels.source import kernel_source
from railenv.vehicles import Vehicle

_FOLDER = Path(tempfile.mkdtemp(prefix="railenv-fuzz-"))
_FIELDS = [f.name for f in dataclasses.fields(Vehicle)]


def finite(value: Any) -> bool:
    """Whether all numbers of an array are finite."""
    return bool(np.isfinite(np.asarray(value, dtype=float)).all())


# ------------------------------------------------------------------------- vehicles, files


def _vehicle(changes: dict[str, Any]) -> None:
    try:
        made = railenv.HIGH_SPEED_COACH.replace(**changes)
    except ParameterError as error:
        if not any(name in str(error) for name in changes):
            raise AssertionError(f"{error} names none of {list(changes)}") from error
        raise
    assert finite(list(made.parameters().values()))
    assert not math.isnan(made.klingel_wavelength)
    path = _FOLDER / "vehicle.toml"
    made.to_toml(path)
    assert Vehicle.from_toml(path) == made


def _vehicle_file(content: bytes) -> None:
    path = _FOLDER / "changed.toml"
    path.write_bytes(content)
    made = Vehicle.from_toml(path)
    assert finite(list(made.parameters().values()))


@st.composite
def _vehicle_tables(draw: Any) -> bytes:
    """Draw a TOML file with any values in any fields."""
    names = rarely(st.sampled_from(_FIELDS), st.text("abc_", min_size=1, max_size=4))
    texts = st.sampled_from(
        [
            "1",
            "-1.0",
            "0.0",
            "1e300",
            "1e999",
            "nan",
            "-inf",
            "true",
            '"x"',
            "[1]",
            "{a = 1}",
            "1979-05-27",
        ]
    )
    rows = draw(st.dictionaries(names, texts, max_size=3))
    base = draw(st.sampled_from(['base = "TABLE_1"', 'base = "NONE"', "base = 1", ""]))
    rows.pop("base", None)
    return "\n".join([base, *(f"{name} = {text}" for name, text in rows.items())]).encode()


def _cooperrider(changes: dict[str, Any]) -> None:
    model = railenv.CooperriderBogie().replace(**changes)
    assert finite(list(model.parameters.values()))


def _equipment(example: tuple[str, str, dict[str, Any], dict[str, Any]]) -> None:
    plant, place, actuator, sensors = example
    kind = railenv.Bogie if plant == "bogie" else railenv.DualWheelset
    model = railenv.Equipped(
        kind(railenv.HIGH_SPEED_COACH),
        place,  # type: ignore[arg-type]
        railenv.Actuator.secondary().replace(**actuator),
        railenv.Sensors.standard().replace(**sensors),
    )
    assert finite(list(model.parameters.values()))


def _names(kind: Any) -> list[str]:
    return [f.name for f in dataclasses.fields(kind)]


# ---------------------------------------------------------------------------------- track


def _track(example: tuple[Any, ...]) -> None:
    kind, arguments = example
    track = railenv.Track(*arguments) if kind == "knots" else railenv.Track.into_curve(**arguments)
    places = np.linspace(-10.0, 1e4, 50)
    assert finite(track.curvature_at(places))
    assert finite(track.cant_at(places))


_LISTS = st.one_of(
    st.lists(number(-1e3, 1e3), max_size=4), st.lists(number(-0.1, 0.1), max_size=4), ANYTHING
)
_TRACKS = st.one_of(
    st.tuples(st.just("knots"), st.tuples(_LISTS, _LISTS, _LISTS)),
    st.tuples(
        st.just("curve"),
        st.fixed_dictionaries(
            {
                "radius": rarely(values.RADII, ANYTHING),
                "cant": rarely(values.CANTS, ANYTHING),
                "straight": number(0.0, 500.0),
                "transition": number(1.0, 500.0),
            },
            optional={"curve": number(1.0, 500.0)},
        ),
    ),
)


# --------------------------------------------------------------------- derivatives, batches


@st.composite
def _points(draw: Any) -> tuple[Any, Any, Any, dict[str, Any]]:
    model = draw(values.MODELS)
    size = draw(st.sampled_from([1e-3, 1.0, 1e3, 1e100, 1e300]))
    seed = draw(st.integers(0, 2**32 - 1))
    x: Any = size * np.random.default_rng(seed).uniform(-1.0, 1.0, model.n_states)
    u: Any = None
    if draw(st.integers(0, 3)) == 0:
        x = draw(st.one_of(ANYTHING, st.lists(ANYTHING, max_size=3), st.just(x[:-1])))
    if draw(st.integers(0, 3)) == 0:
        u = draw(st.one_of(ANYTHING, st.just(np.full(model.n_inputs, size))))
    where = draw(
        st.fixed_dictionaries(
            {"speed": rarely(values.SPEEDS, ANYTHING)},
            optional={
                "curvature": rarely(st.floats(-0.006, 0.006), ANYTHING),
                "cant": rarely(values.CANTS, ANYTHING),
            },
        )
    )
    return model, x, u, where


def _derivatives(example: tuple[Any, Any, Any, dict[str, Any]]) -> None:
    model, x, u, where = example
    assert finite(model.rhs(x, u, **where))
    for matrix in (*model.jacobian(x, u, **where), model.condition_jacobian(x, u, **where)):
        assert finite(matrix)
    if isinstance(model, railenv.Equipped):
        assert finite(model.signals(x, u, **where))


def _batch(example: dict[str, Any]) -> None:
    n, dtype = example["n"], example["dtype"]
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    batch = Batch([model] * n if isinstance(n, int) else n, dtype)
    for name in ("conditions", "states", "inputs"):
        if name in example:
            setattr(batch, name, example[name])
    batch.integrate(step=example["step"], steps=example["steps"])


_BATCHES = st.fixed_dictionaries(
    {
        "n": st.one_of(st.integers(0, 3), st.just([None])),
        "dtype": rarely(st.sampled_from(["float64", "float32"]), ANYTHING),
        "step": number(1e-5, 1e-3),
        "steps": rarely(st.integers(-1, 5), values.COUNTS),
    },
    optional={
        "conditions": rarely(st.tuples(values.SPEEDS, st.just(0.0), st.just(0.0)), ANYTHING),
        "states": rarely(st.just(np.zeros(24)), ANYTHING),
        "inputs": ANYTHING,
    },
)


# ------------------------------------------------------------------------------- equations

_TERMS = st.recursive(
    st.sampled_from(["y", "d", "speed", "p.k", "u", "1.5", "2", "-1"]),
    lambda inner: st.one_of(
        st.tuples(st.sampled_from("+-*/"), inner, inner).map(lambda t: f"({t[1]} {t[0]} {t[2]})"),
        st.tuples(st.sampled_from(["%", "//", "**"]), inner, inner).map(
            lambda t: f"({t[1]} {t[0]} {t[2]})"
        ),
        st.tuples(st.sampled_from(functions.__all__[:-1]), inner).map(lambda t: f"{t[0]}({t[1]})"),
        st.tuples(st.sampled_from(["abs", "sympy.sign", "max", "float", "p.missing *"]), inner).map(
            lambda t: f"{t[0]}({t[1]})" if t[0] != "max" else f"max({t[1]}, 0)"
        ),
        inner.map(lambda t: f"{t}**2"),
        inner.map(lambda t: f"sympy.pi*{t}"),
        st.tuples(inner, inner, inner).map(lambda t: f"where_positive({', '.join(t)})"),
    ),
    max_leaves=8,
)
_FUNCTIONS = {name: getattr(functions, name) for name in functions.__all__}


def _equations(term: str) -> None:
    """Generate kernels and compare what their text computes in plain Python with the equations."""
    code = compile(term, "term", "eval")

    def equations(x: Any, u: Any, speed: Any, curvature: Any, cant: Any, p: Any) -> list[Any]:
        names = {"y": x[0], "d": x[1], "u": u[0], "speed": speed, "p": p, "sympy": sympy}
        return [x[1], eval(code, {**_FUNCTIONS, **names})]

    try:
        text = kernel_source(equations, ["y", "d"], ["u"], ["k"], "fuzzed")
    except ZeroDivisionError:
        return  # two numbers of the equations themselves
    module: dict[str, Any] = {"math": math, "L": 1, "jit": lambda f: f, "real": float}
    module |= {"_fma": lambda a, b, c: a * b + c, "_rows": lambda w: w}
    module |= {"_read": lambda rows, i: rows[i], "_write": np.ndarray.__setitem__}
    module |= {f"_{name}": getattr(math, name) for name in ("sin", "cos", "tan")}
    exec(text, module)
    w = np.zeros(40)
    w[:7] = 0.3, 0.7, 0.2, 2.0, 0.0, 0.0, 1.1
    try:
        module["rhs"](w, np.zeros(1))
        expected = equations([0.3, 0.7], [0.2], 2.0, 0.0, 0.0, SimpleNamespace(k=1.1))[1]
        expected = complex(expected)
    except (ArithmeticError, ValueError, TypeError):
        return  # undefined at this point: the logarithm of a negative number
    if abs(expected) < 1e10 and not expected.imag:
        assert math.isclose(w[8], expected.real, rel_tol=1e-6, abs_tol=1e-9), (w[8], expected)


# ----------------------------------------------------------------- equilibrium and analysis


@st.composite
def _running(draw: Any) -> tuple[Any, dict[str, Any]]:
    return draw(values.MODELS), draw(values.conditions())


def _equilibrium(example: tuple[Any, dict[str, Any]]) -> None:
    model, where = example
    found = railenv.find_equilibrium(model, **where)
    assert finite(found.state)
    assert found.residual < 1e-5
    system = design.linearize(model, **where)
    assert finite(system.A)
    assert finite(np.abs(system.poles()))


@st.composite
def _searches(draw: Any) -> tuple[Any, dict[str, Any]]:
    arguments = draw(
        st.fixed_dictionaries(
            {},
            optional={
                "radius": rarely(values.RADII, ANYTHING),
                "cant": rarely(values.CANTS, ANYTHING),
                "speed_range": rarely(
                    st.sampled_from([(3.0, 400.0), (10.0, 20.0), (50.0, 120.0)]),
                    st.one_of(ANYTHING, st.tuples(ANYTHING, ANYTHING)),
                ),
            },
        )
    )
    return draw(values.MODELS), arguments


def _critical_speed(example: tuple[Any, dict[str, Any]]) -> None:
    model, arguments = example
    found = design.critical_speed(model, **arguments)
    low, high = arguments.get("speed_range", (3.0, 400.0))
    assert str(found)
    if found.speed is not None:
        assert low * (1 - 1e-9) <= found.speed <= high * (1 + 1e-9), found.speed
    if found.frequency is not None:
        assert math.isfinite(found.frequency)
        assert found.frequency >= 0.0


_VALUES = st.one_of(
    st.lists(st.floats(5.0, 120.0), min_size=1, max_size=4), st.lists(ANYTHING, max_size=3), ANYTHING
)


def _analysis(example: tuple[str, Any, dict[str, Any]]) -> None:
    kind, given, where = example
    coach = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    if kind == "speed locus":
        locus: Any = design.speed_locus(coach, given, **where)
        assert finite(np.abs(locus.loci))
    elif kind == "parameter locus":
        locus = design.parameter_locus(coach, "conicity", given, speed=60.0, **where)
        assert finite(np.abs(locus.loci))
    elif kind == "map":
        chart = design.stability_map(
            coach,
            {"conicity": given, "friction": [0.2, 0.3]},
            quantity="growth",
            speed=60.0,
            n_jobs=1,
            **where,
        )
        assert (np.isfinite(chart.value) == (chart.notes == "")).all()
    elif kind == "closed loop":
        equipped = railenv.Equipped(coach)
        loop = design.closed_loop(equipped, given, speed=60.0, **where)
        assert math.isfinite(loop.growth)
    elif kind == "sweep":
        sweep = design.curve_sweep(coach, given, **({"cant": where["cant"]} if "cant" in where else {}))
        assert all(str(found) for found in sweep.results)
    else:
        design.robust_critical_speed(coach, None, given)


_GIVEN: dict[str, st.SearchStrategy[Any]] = {
    "speed locus": st.lists(st.floats(5.0, 120.0), min_size=2, max_size=4, unique=True).map(sorted),
    "parameter locus": st.lists(st.floats(0.02, 0.4), min_size=2, max_size=4, unique=True).map(sorted),
    "map": st.lists(st.floats(0.02, 0.4), min_size=2, max_size=3, unique=True).map(sorted),
    "closed loop": st.floats(-1e5, 1e5).map(lambda gain: gain * np.eye(1, 28)),
    "sweep": st.lists(values.RADII, min_size=1, max_size=2),
    "robust": st.dictionaries(
        st.sampled_from(["conicity", "friction", "mass"]),
        st.tuples(st.floats(0.05, 0.2), st.floats(0.2, 0.4)),
        min_size=1,
        max_size=1,
    ),
}


@st.composite
def _analyses(draw: Any) -> tuple[str, Any, dict[str, Any]]:
    kind = draw(st.sampled_from(sorted(_GIVEN)))
    given = draw(rarely(_GIVEN[kind], _VALUES))
    optional = {
        "radius": rarely(values.RADII, ANYTHING),
        "cant": rarely(values.CANTS, ANYTHING),
    }
    return kind, given, draw(st.fixed_dictionaries({}, optional=optional))


# ------------------------------------------------------------------------------ simulation


def _not_long(duration: Any) -> bool:
    """Tell what is refused or soon done from what rightly takes minutes."""
    return not (isinstance(duration, int | float) and 0.05 < duration < 1e8)


@st.composite
def _runs(draw: Any) -> tuple[Any, dict[str, Any]]:
    model = draw(values.MODELS)
    names = st.one_of(st.sampled_from(model.state_names), st.sampled_from(["y_w9", "", 3]))
    optional: dict[str, Any] = {
        "radius": rarely(values.RADII, ANYTHING),
        "cant": rarely(values.CANTS, ANYTHING),
        "perturbation": rarely(st.dictionaries(names, number(-0.05, 0.05), max_size=2), ANYTHING),
        "initial_state": st.one_of(
            st.just(np.zeros(model.n_states)), st.just(np.full(model.n_states, 1e200)), ANYTHING
        ),
        "inputs": st.dictionaries(
            st.sampled_from([*model.input_names, "nothing"]),
            st.one_of(
                number(-1e4, 1e4), st.sampled_from([np.sin, lambda t: t[:2], lambda t: t + np.nan])
            ),
            max_size=2,
        ),
        "step": number(1e-4, 1e-3),
        "output_step": number(1e-3, 1e-2),
        "method": st.sampled_from(["RK4", "RK45", "Radau", "LSODA", "Euler", "", None, 3]),
        "track": st.one_of(
            st.just(railenv.Track.into_curve(radius=800.0, cant=0.1, straight=1.0, transition=5.0)),
            ANYTHING,
        ),
        "rtol": number(1e-8, 1e-3),
    }
    arguments = draw(
        st.fixed_dictionaries(
            {
                "speed": rarely(
                    values.SPEEDS,
                    st.one_of(
                        ANYTHING,
                        st.sampled_from([lambda t: 30.0 + t, lambda t: 0.0 * t, lambda t: t[:3], len]),
                    ),
                ),
                "duration": rarely(st.floats(1e-3, 0.05), ANYTHING.filter(_not_long)),
            },
            optional=optional,
        )
    )
    return model, arguments


def _simulation(example: tuple[Any, dict[str, Any]]) -> None:
    model, arguments = example
    response = railenv.simulate(model, **arguments)
    assert finite(response.outputs)
    assert response.outputs.shape == (model.n_states, len(response.time))
    assert math.isclose(response.time[-1], arguments["duration"], rel_tol=1e-9)


AREAS = (
    Area(
        "vehicle fields",
        st.dictionaries(
            rarely(st.sampled_from([*_FIELDS, "creep_factor"]), st.sampled_from(["conicty", "mass"])),
            ANYTHING,
            min_size=1,
            max_size=3,
        ),
        _vehicle,
        6000,
    ),
    Area("vehicle files, values", _vehicle_tables(), _vehicle_file, 4000),
    Area(
        "vehicle files, damaged",
        values.changed_text(railenv.HIGH_SPEED_COACH.to_toml()),
        _vehicle_file,
        3000,
    ),
    Area(
        "Cooperrider parameters",
        st.dictionaries(
            st.sampled_from([*_names(railenv.CooperriderParameters), "k7"]), ANYTHING, max_size=3
        ),
        _cooperrider,
        1500,
    ),
    Area(
        "actuators and sensors",
        st.tuples(
            st.sampled_from(["bogie", "dual"]),
            rarely(st.sampled_from(["secondary", "primary", "none"]), ANYTHING),
            st.dictionaries(
                st.sampled_from([*_names(railenv.Actuator), "power"]), ANYTHING, max_size=2
            ),
            st.dictionaries(st.sampled_from([*_names(railenv.Sensors), "range"]), ANYTHING, max_size=2),
        ),
        _equipment,
        2000,
    ),
    Area("tracks", _TRACKS, _track, 3000),
    Area("derivatives", _points(), _derivatives, 5000),
    Area("batches", _BATCHES, _batch, 2000),
    Area("equations of one's own", _TERMS, _equations, 2000),
    Area("equilibria and linear models", _running(), _equilibrium, 3000),
    Area("critical speeds", _searches(), _critical_speed, 1500, quick=15),
    Area("loci, maps and loops", _analyses(), _analysis, 700, quick=40),
    Area("simulations", _runs(), _simulation, 4000),
)
