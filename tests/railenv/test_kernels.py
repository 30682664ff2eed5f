"""Generated kernels: their source, their cache on disk, elementary functions and integrators."""

import math
import pickle
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import integrate

import railenv
from railenv.batch import Batch
from railenv.equations.functions import atan, cos, exp, log, sin, sqrt, tan, tanh
from railenv.kernels import cache as checked_cache
from railenv.kernels import loader, store
from railenv.kernels.source import kernel_source

load_anew = loader.load.__wrapped__
"""``loader.load`` without its memory, as another process sees the cache on disk."""


def shift_of(amount):
    """Return equations x' = k x + amount, whose kernel tells by its result what it was made from."""

    def equations(x, u, speed, curvature, cant, p):
        return [p.k * x[0] + amount]

    return equations


def shift_source(amount):
    return kernel_source(shift_of(amount), ["x"], [], ["k"], "shift")


def evaluate(kernels, x=0.0):
    """Right-hand side of a shift model's kernels at x with k = 2."""
    layout = kernels.LAYOUT
    w = np.zeros(layout.rows)
    w[layout.x], w[layout.p] = x, 2.0
    kernels.rhs(w, np.zeros(1))
    return w[layout.dx]


@pytest.fixture
def cache(tmp_path, monkeypatch):
    directory = tmp_path / "kernels"
    monkeypatch.setenv("RAILENV_CACHE_DIR", str(directory))
    return directory


# --------------------------------------------------------------------- generated source


def test_kernels_name_their_signals_and_parameters_as_the_models_do(any_model):
    kernels = any_model.kernels()
    assert any_model.state_names == kernels.STATES
    assert any_model.input_names == kernels.INPUTS
    assert tuple(any_model.parameters) == kernels.PARAMETERS
    layout = kernels.LAYOUT
    assert layout.p - layout.c == 3
    assert layout.rows == layout.j + len(kernels.CELLS)


def test_generated_source_is_plain_and_without_literals_of_a_fixed_precision():
    # a literal inside the loop would make float32 lanes compute in float64
    for model in (railenv.CooperriderBogie(), railenv.Equipped(railenv.Bogie(railenv.TABLE_1), "both")):
        text = model._source
        body = [line for line in text.splitlines() if line.startswith("        ")]
        assert len(body) > 100
        assert not any("." in line.replace("math.sqrt", "") for line in body)


# ----------------------------------------------------------------- texts kept by structure

source_anew = store.source_of.__wrapped__
"""``store.source_of`` without its memory, as another process sees the cache on disk."""


def counting(text):
    """Return what writes a text, and the list of times that it did."""
    times = []

    def write():
        times.append(text)
        return text

    return write, times


def test_text_of_a_structure_is_written_once_and_kept(cache):
    write, times = counting("STATES = ()\n")
    recipe = store.Recipe("one structure", write)
    assert source_anew(recipe) == source_anew(recipe) == "STATES = ()\n"
    assert len(times) == 1
    assert store.Recipe("another", write).key != recipe.key
    assert [p.name for p in cache.glob("*.source")] == [f"{recipe.key}.source"]


def test_edited_equations_give_a_structure_another_key(monkeypatch):
    recipe = store.Recipe("one structure", str)
    before = recipe.key
    store.writers_hash.cache_clear()
    content = store._content
    monkeypatch.setattr(
        store, "_content", lambda n: content(n) + b"#" * n.endswith("equations.contact")
    )
    try:
        assert recipe.key != before
    finally:
        store.writers_hash.cache_clear()


@pytest.mark.parametrize("damage", [b"", b"\xff\xfe", b"STATES = (7,)\n"])
def test_damaged_text_is_written_anew(cache, damage):
    write, times = counting("STATES = ()\n")
    recipe = store.Recipe("a damaged one", write)
    source_anew(recipe)
    (path,) = cache.glob("*.source")
    path.write_bytes(damage)
    assert source_anew(recipe) == "STATES = ()\n"
    assert len(times) == 2


def test_vehicles_of_one_structure_share_their_kernels():
    coach, table = railenv.Bogie(railenv.HIGH_SPEED_COACH), railenv.Bogie(railenv.TABLE_1)
    assert coach.structure == table.structure
    assert coach.kernels() is table.kernels()
    assert railenv.DualWheelset(railenv.TABLE_1).structure != table.structure


def test_a_kept_structure_needs_no_tracing():
    code = (
        "import sys, numpy, railenv; m = railenv.Bogie(railenv.TABLE_1); "
        "m.rhs(numpy.zeros(24), speed=20.0); print('sympy' in sys.modules)"
    )
    railenv.Bogie(railenv.TABLE_1).kernels()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


# ------------------------------------------------------------------------ cache on disk


def test_edited_equations_get_kernels_of_their_own(cache):
    first = loader.load(shift_source(0.25))
    assert evaluate(first) == 0.25
    edited = loader.load(shift_source(0.5))
    assert evaluate(edited) == 0.5
    assert edited.__file__ != first.__file__
    assert evaluate(first, x=1.0) == 2.25  # the first is still what it was


@pytest.mark.parametrize("variant", [{"lanes": 16}, {"lanes": 32, "dtype": "float32"}])
def test_lanes_and_precision_get_kernels_of_their_own(cache, variant):
    source = shift_source(0.75)
    assert loader.load(source, **variant).__file__ != loader.load(source).__file__


def test_compiled_kernels_are_kept_where_the_environment_says(cache):
    kernels = loader.load(shift_source(1.25))
    assert evaluate(kernels) == 1.25
    assert Path(kernels.__file__).parent == cache
    assert kernels.rhs.stats.cache_misses
    assert list(cache.rglob("*.nbi")), "the compiled code itself is cached too"
    again = load_anew(shift_source(1.25))
    assert evaluate(again) == 1.25
    assert again.rhs.stats.cache_hits
    assert not again.rhs.stats.cache_misses


@pytest.mark.parametrize(
    "damage",
    [lambda text: "", lambda text: text[: len(text) // 2], lambda text: text.replace("1.5)", "7.5)")],
    ids=["emptied", "cut short", "another kernel"],
)
def test_damaged_cache_file_is_rewritten(cache, damage):
    source = shift_source(1.5)
    path = Path(load_anew(source).__file__)
    whole = path.read_text(encoding="utf-8")
    path.write_text(damage(whole), encoding="utf-8")
    assert path.read_text(encoding="utf-8") != whole
    assert evaluate(load_anew(source)) == 1.5
    assert path.read_text(encoding="utf-8") == whole
    assert not list(cache.glob("*.tmp"))


def test_binary_rubbish_in_the_cache_is_rewritten(cache):
    source = shift_source(1.75)
    path = Path(load_anew(source).__file__)
    path.write_bytes(b"\xff\xfe\x00")
    assert evaluate(load_anew(source)) == 1.75


def _flipped(content, place):
    return content[:place] + bytes([content[place] ^ 0x10]) + content[place + 1 :]


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize(
    "damage",
    [
        lambda content: b"",
        lambda content: content[:20],
        lambda content: content[:-1],
        lambda content: _flipped(content, 5),
        lambda content: _flipped(content, len(content) // 2),
    ],
    ids=["emptied", "start only", "last byte lost", "hash changed", "content changed"],
)
def test_damaged_machine_code_is_compiled_again_and_told(cache, kind, damage):
    checked_cache._warn_of_damage.cache_clear()
    source = shift_source(1.875)
    assert evaluate(load_anew(source)) == 1.875
    (path,) = cache.rglob(f"*rhs*.{kind}")
    path.write_bytes(damage(path.read_bytes()))
    with pytest.warns(RuntimeWarning, match=r"in .*__pycache__ are damaged.* RAILENV_CACHE_DIR"):
        value = evaluate(again := load_anew(source))
    assert value == 1.875
    assert again.rhs.stats.cache_misses
    healed = load_anew(source)
    assert evaluate(healed) == 1.875
    assert healed.rhs.stats.cache_hits


def test_a_pickle_in_the_place_of_machine_code_is_not_opened(cache, tmp_path):
    class Bomb:
        def __reduce__(self):
            return (tmp_path / "exploded").write_text, ("!",)

    source = shift_source(1.9)
    evaluate(load_anew(source))
    for path in (*cache.rglob("*.nbi"), *cache.rglob("*.nbc")):
        path.write_bytes(pickle.dumps(Bomb()))
    checked_cache._warn_of_damage.cache_clear()
    with pytest.warns(RuntimeWarning, match="damaged"):
        assert evaluate(load_anew(source)) == 1.9
    assert not (tmp_path / "exploded").exists()


@pytest.mark.parametrize("length", [0, 10, 16, 100])
def test_damaged_file_of_python_itself_is_compiled_again(cache, monkeypatch, length):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    source = shift_source(2.125)
    load_anew(source)
    (path,) = cache.rglob("*.pyc")
    path.write_bytes(path.read_bytes()[:length])
    assert evaluate(load_anew(source)) == 2.125


def test_without_room_for_machine_code_kernels_are_used_all_the_same(cache, monkeypatch):
    def full(self, path):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(checked_cache._CheckedFile, "_open_for_write", full)
    checked_cache._warn_of_saving.cache_clear()
    with pytest.warns(RuntimeWarning, match=r"No space left.*RAILENV_CACHE_DIR"):
        assert evaluate(load_anew(shift_source(2.25))) == 2.25


def test_cache_that_cannot_be_written_warns_and_compiles_elsewhere(tmp_path, monkeypatch):
    # below a file there can be no directory, not even for root
    obstacle = tmp_path / "file"
    obstacle.write_text("in the way")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.setenv("RAILENV_CACHE_DIR", str(obstacle / "kernels"))
    monkeypatch.setattr(loader.tempfile, "tempdir", str(elsewhere))
    with pytest.warns(RuntimeWarning, match=r"cannot be kept in .*Set RAILENV_CACHE_DIR"):
        kernels = loader.load(shift_source(2.5))
    assert evaluate(kernels) == 2.5
    assert Path(kernels.__file__).is_relative_to(elsewhere)
    assert obstacle.read_text() == "in the way"


def test_writable_cache_gives_no_warning(cache):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert loader.cache_directory() == cache
    assert cache.is_dir()
    assert not list(cache.iterdir())


# ------------------------------------------------------------------ elementary functions

OF_ANY = (sin, cos, tan, tanh, exp, atan)
OF_POSITIVE = (sqrt, log)
FUNCTIONS = (*OF_ANY, *OF_POSITIVE)
TAN = FUNCTIONS.index(tan)


def elementary(x, u, speed, curvature, cant, p):
    return [f(argument) for f, argument in zip(FUNCTIONS, x, strict=True)]


ELEMENTARY = railenv.Model("elementary", [f.__name__ + "_of" for f in FUNCTIONS], [], elementary, {})


def elementary_points(dtype, largest=20.0):
    """Arguments of the functions, a row for each system, and the values of Python's own functions."""
    a = np.linspace(-largest, largest, 4001).astype(dtype)
    # the numbers next to the poles of the tangent and the zeros of sine and cosine
    quarters = (0.5 * math.pi * np.arange(-12, 13)).astype(dtype)
    quarters = quarters[np.abs(quarters) < largest]
    a = np.concatenate([a, quarters, np.nextafter(quarters, dtype(99.0))])
    b = np.geomspace(1e-6, 1e6, len(a)).astype(dtype)
    states = np.stack([a] * len(OF_ANY) + [b] * len(OF_POSITIVE), axis=1).astype(float)
    return states, np.array([elementary(x, (), 1.0, 0.0, 0.0, None) for x in states.tolist()])


def errors_in_ulp(values, reference, dtype):
    """Errors in units of rounding: absolute below 1, and the tangent's after its amplification."""
    size = np.maximum(np.abs(reference), 1.0)
    size[:, TAN] = 1.0 + reference[:, TAN] ** 2
    return (np.abs(values - reference) / size).max(axis=0) / np.finfo(dtype).eps


def scalar_values(states):
    evaluator = ELEMENTARY.evaluator()
    values = np.empty_like(states)
    for x, row in zip(states, values, strict=True):
        evaluator.set(x, 1.0)
        row[:] = evaluator.rhs()
    return values


def lane_values(states, dtype):
    batch = Batch([ELEMENTARY] * len(states), dtype=dtype)
    batch.states = states
    return batch.rhs()


@pytest.mark.parametrize(
    "values", [scalar_values, lambda s: lane_values(s, "float64")], ids=["scalar", "lanes"]
)
def test_elementary_functions_are_accurate_to_rounding(values):
    states, reference = elementary_points(np.float64)
    found = values(states)
    assert (errors_in_ulp(found, reference, np.float64) <= 3.0).all()
    # relative as well, next to zeros and poles too, where the reduction of the argument shows
    assert_allclose(found, reference, rtol=1e-14, atol=0)


def test_elementary_functions_of_lanes_equal_those_of_scalar_kernels_to_the_bit():
    states, _ = elementary_points(np.float64)
    assert_array_equal(lane_values(states, "float64"), scalar_values(states))


def test_elementary_functions_of_float32_lanes_are_accurate_to_rounding_at_the_angles_of_a_vehicle():
    states, reference = elementary_points(np.float32, largest=1.5)
    found = lane_values(states, "float32")
    assert found.dtype == np.float32
    assert (errors_in_ulp(found, reference, np.float32) <= 3.0).all()


# --------------------------------------------------------------------------- integrators


def van_der_pol(x, u, speed, curvature, cant, p):
    q, v = x
    return [v, p.mu * speed * (1.0 - q * q) * v - sin(q) + u[0]]


OSCILLATOR = railenv.Model("van der Pol", ["q", "v"], ["force"], van_der_pol, {"mu": 0.1})
START = [0.5, 0.8]
DURATION = 4.0

CONSTANT = (0.3, 10.0)
DRIVEN = (lambda t: 0.5 * np.cos(3.0 * t), lambda t: 10.0 + 3.0 * np.sin(2.0 * t))


def oscillate(force, speed, step, duration=DURATION):
    response = railenv.simulate(
        OSCILLATOR,
        speed=speed,
        initial_state=START,
        inputs={"force": force},
        duration=duration,
        step=step,
        output_step=duration,
    )
    return response.states[:, -1]


def at(signal, t):
    return float(signal(t)) if callable(signal) else signal


@pytest.mark.parametrize(("force", "speed"), [CONSTANT, DRIVEN], ids=["constant", "driven"])
def test_runge_kutta_converges_with_order_four(force, speed):
    def f(t, x):
        return OSCILLATOR.plain_rhs(x.tolist(), [at(force, t)], at(speed, t))

    exact = integrate.solve_ivp(f, (0.0, DURATION), START, method="DOP853", rtol=1e-13, atol=1e-14)
    steps = 2.0 ** -np.arange(4.0, 9.0)
    errors = [np.abs(oscillate(force, speed, h) - exact.y[:, -1]).max() for h in steps]
    order, _ = np.polyfit(np.log(steps), np.log(errors), 1)
    assert order == pytest.approx(4.0, abs=0.2)
    assert errors[-1] < 1e-8


@pytest.mark.parametrize(("force", "speed"), [CONSTANT, DRIVEN], ids=["constant", "driven"])
def test_one_step_is_that_of_the_classical_method(force, speed):
    h, x = 0.25, np.array(START)

    def f(t, x):
        return np.array(OSCILLATOR.plain_rhs(x.tolist(), [at(force, t)], at(speed, t)))

    k1 = f(0.0, x)
    k2 = f(h / 2.0, x + h / 2.0 * k1)
    k3 = f(h / 2.0, x + h / 2.0 * k2)
    k4 = f(h, x + h * k3)
    expected = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    assert_allclose(oscillate(force, speed, h, duration=h), expected, rtol=1e-14)


def test_driven_integrator_with_signals_that_stay_constant_equals_the_constant_one():
    force, speed = CONSTANT
    driven = oscillate(lambda t: np.full_like(t, force), speed, 0.01)
    assert_allclose(driven, oscillate(force, speed, 0.01), rtol=1e-13)
