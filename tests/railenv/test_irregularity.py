"""Synthesised track irregularity has the spectrum and the rms of ERRI B176."""

# ruff: noqa: NPY002 - the legacy generator is looked at on purpose

import math
import re

import gymnasium
import numpy as np
import pytest
from scipy import integrate, signal

import railenv
from railenv import irregularity
from railenv.errors import ParameterError, UnknownNameError
from railenv.irregularity import Line, spectrum, synthesise

KINDS = ("align", "vert", "cross")


@pytest.mark.parametrize("level", ["low", "high"])
@pytest.mark.parametrize("kind", KINDS)
def test_welch_estimate_follows_the_erri_spectrum(kind, level):
    line = synthesise(level, seed=3, samples=2**17)
    frequency, density = signal.welch(
        getattr(line, kind), fs=1.0 / line.spacing, nperseg=4096, window="hann"
    )
    wavenumber = 2 * math.pi * frequency
    inside = (wavenumber > 2 * math.pi / 100.0) & (wavenumber < 2 * math.pi / 3.3)
    estimate = density[inside] / (2 * math.pi)  # per rad/m
    # about 64 segments: smooth over bands before comparing
    ratio = estimate / spectrum(kind, wavenumber[inside], level)
    bands = np.array_split(ratio, 12)
    assert all(abs(band.mean() - 1.0) < 0.1 for band in bands)


@pytest.mark.parametrize(("level", "rms"), [("low", 0.714e-3), ("high", 1.213e-3)])
def test_rms_of_alignment_over_3_to_25_m_is_that_of_erri(level, rms):
    low, high = 2 * math.pi / 25.0, 2 * math.pi / 3.0
    power, _ = integrate.quad(lambda w: float(spectrum("align", w, level)), low, high)
    assert math.sqrt(power) == pytest.approx(rms, rel=2e-3)
    line = irregularity.line(level)
    transform = np.fft.rfft(line.align) / len(line.align)
    wavenumber = 2 * math.pi * np.fft.rfftfreq(len(line.align), line.spacing)
    inside = (wavenumber > low) & (wavenumber < high)
    assert math.sqrt(2 * np.sum(np.abs(transform[inside]) ** 2)) == pytest.approx(rms, rel=0.05)


def test_kinds_are_independent_and_have_no_mean():
    line = synthesise("low", seed=1)
    for kind in KINDS:
        record = getattr(line, kind)
        assert abs(record.mean()) < 1e-12
        for other in KINDS:
            if other != kind:
                assert abs(np.corrcoef(record, getattr(line, other))[0, 1]) < 0.15


def test_same_seed_same_line_and_another_seed_another():
    a, b, c = (synthesise("low", seed=s, samples=4096) for s in (5, 5, 6))
    np.testing.assert_array_equal(a.align, b.align)
    assert np.abs(a.align - c.align).max() > 1e-4


def test_line_is_linear_between_samples_and_repeats():
    line = Line(np.array([0.0, 1.0, 4.0, 2.0]), np.zeros(4), np.zeros(4), 0.5)
    np.testing.assert_allclose(
        line.at("align", [0.0, 0.25, 0.75, 1.75, 2.0, 2.25]), [0, 0.5, 2.5, 1, 0, 0.5]
    )
    assert line.length == 2.0


def test_global_generator_is_untouched():
    np.random.seed(0)
    before = np.random.get_state()[1].copy()
    synthesise("high", seed=2, samples=256)
    np.testing.assert_array_equal(np.random.get_state()[1], before)


def test_bad_arguments_name_quantity_and_value():
    with pytest.raises(UnknownNameError, match="irregularity level: 'medium'"):
        spectrum("align", 1.0, "medium")
    with pytest.raises(UnknownNameError, match="'gauge'"):
        irregularity.line("low").at("gauge", 0.0)
    with pytest.raises(ParameterError, match="samples is 5"):
        synthesise("low", seed=0, samples=5)
    with pytest.raises(ParameterError, match="spacing is 0 m"):
        synthesise("low", seed=0, spacing=0.0)


# ------------------------------------------------------------------- measured lines


def ramped(samples=401, spacing=0.25):
    """A line of known shape that does not repeat."""
    s = spacing * np.arange(samples)
    return Line(
        2e-3 * np.sin(0.3 * s), 3e-3 * np.cos(0.2 * s), 1e-3 * np.sin(0.1 * s), spacing, repeats=False
    )


def test_line_that_ends_fades_over_20_m_and_is_zero_beyond():
    line = ramped()
    assert line.length == 100.0
    assert (line.at("vert", [-50.0, -1e-9, 0.0, 100.0, 100.1, 1e6]) == 0.0).all()
    np.testing.assert_allclose(line.at("vert", [5.0, 95.0]), 0.25 * line.vert[[20, 380]])
    np.testing.assert_array_equal(line.at("vert", line.spacing * np.arange(80, 321)), line.vert[80:321])
    around = line.faded()
    assert around.repeats
    inside = np.linspace(0.0, 100.0, 401)
    np.testing.assert_allclose(
        around.at("align", 100.25 + inside), line.at("align", inside), atol=1e-17
    )
    with pytest.raises(ParameterError, match=r"a line that does not repeat has 10 m; .* at least 40 m"):
        ramped(41)


def test_line_survives_its_file(tmp_path):
    line = ramped()
    line.to_file(tmp_path / "line.csv")
    read = Line.from_file(tmp_path / "line.csv", unit="m")
    assert not read.repeats
    assert read.spacing == pytest.approx(0.25, rel=1e-12)
    for kind in KINDS:
        np.testing.assert_array_equal(getattr(read, kind), getattr(line, kind))


RAILS = "distance,alignment_left,alignment_right,level_left,level_right"


def write_rails(path, rows, head=RAILS, comment=""):
    path.write_text(comment + "\n".join([head, *(",".join(f"{v:.9g}" for v in row) for row in rows)]))
    return path


def test_channels_of_both_rails_become_alignment_level_and_cross_level(tmp_path):
    s = 0.5 * np.arange(201)
    left, right = 4.0 * np.sin(0.2 * s), 2.0 * np.sin(0.2 * s)
    up, down = 3.0 + 0.0 * s, -1.5 + 0.0 * s
    path = write_rails(
        tmp_path / "rails.csv",
        zip(1200.0 + s, left, right, up, down, strict=True),
        comment="# recorded in mm\n# base 1500 mm\n",
    )
    line = Line.from_file(path, unit="mm", repeats=True)
    np.testing.assert_allclose(line.align, 3e-3 * np.sin(0.2 * s), atol=1e-11)
    np.testing.assert_allclose(line.vert, 0.75e-3)
    np.testing.assert_allclose(line.cross, 4.5e-3 / 1.5)  # the left rail is 4.5 mm higher
    other = Line.from_file(path, unit="mm", base=1.6, opposite=["level_left", "level_right"])
    np.testing.assert_allclose(other.cross, -4.5e-3 / 1.6)
    np.testing.assert_allclose(other.align, line.align)
    measured = write_rails(
        tmp_path / "cross.csv",
        zip(s, left, right, up, down, 6.0 + 0.0 * s, 9.0 + 0.0 * s, strict=True),
        head=RAILS.replace(",", ";") + ";Cross level;gauge",
    )
    measured.write_text(measured.read_text().replace(",", ";"))
    np.testing.assert_allclose(Line.from_file(measured, unit="mm").cross, 6e-3 / 1.5)


def test_rows_at_varying_spacing_come_to_their_median_spacing(tmp_path):
    generator = np.random.default_rng(4)
    s = np.cumsum(generator.choice([0.2, 0.25, 0.25, 0.25, 0.3], 600))
    shape = 1e-3 * np.sin(2 * math.pi * (s - s[0]) / 20.0)
    rows = zip(s, shape, shape, 2 * shape, 2 * shape, strict=True)
    line = Line.from_file(write_rails(tmp_path / "varying.csv", rows), unit="m")
    assert line.spacing == pytest.approx(0.25)
    assert line.length == pytest.approx(s[-1] - s[0], abs=0.25)
    places = line.spacing * np.arange(len(line.align))
    np.testing.assert_allclose(line.align, 1e-3 * np.sin(2 * math.pi * places / 20.0), atol=2e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.replace("level_right", "levels"), r"has no column level_right; it needs distance"),
        (lambda t: t.replace("\n2,0.001", "\n2,nan"), r"alignment_left in row 6 of .* is 'nan'"),
        (lambda t: t.replace("\n2,0.001", "\n2,"), r"alignment_left in row 6 of .* is ''"),
        (
            lambda t: t.replace("\n2,", "\n1,"),
            r"distance in row 6 of .* is 1 m after 1.5 m; it must incr",
        ),
        (lambda t: t.replace("\n2,0.001", "\n2,12.5"), r"row 6 of .* is 12.5 m; .* may not be m"),
        (
            lambda t: t.replace("\n2,0.001,", "\n2,"),
            r"row 6 of .* has 4 columns; the first row names 5",
        ),
        (
            lambda t: "\n".join(r for r in t.splitlines() if not re.match(r"2\d(\.5)?,", r)),
            r"no such gap",
        ),
        (lambda t: "", "is empty"),
        (lambda t: t.splitlines()[0], "has 0 rows"),
    ],
)
def test_bad_files_are_told_by_file_column_and_row(tmp_path, change, message):
    path = write_rails(tmp_path / "rails.csv", [(k / 2, 1e-3, 1e-3, 0, 0) for k in range(101)])
    Line.from_file(path, unit="m")
    path.write_text(change(path.read_text()))
    with pytest.raises(ParameterError, match=message) as found:
        Line.from_file(path, unit="m")
    assert "rails.csv" in str(found.value)


def test_bad_ways_to_read_a_file_are_refused(tmp_path):
    path = write_rails(tmp_path / "rails.csv", [(k / 2, 1e-3, 1e-3, 0, 0) for k in range(101)])
    with pytest.raises(ParameterError, match="unit is 'cm'; it must be 'm' or 'mm'"):
        Line.from_file(path, unit="cm")
    with pytest.raises(UnknownNameError, match="column in opposite: 'gauge'"):
        Line.from_file(path, unit="m", opposite=["gauge"])
    with pytest.raises(ParameterError, match="base is 0 m"):
        Line.from_file(path, unit="m", base=0.0)


# --------------------------------------------------------------- under a vehicle

COACH = railenv.Bogie(railenv.HIGH_SPEED_COACH)


def rails_of(response, kind):
    """Displacements under the leading and the trailing wheelset of a response."""
    return [response.inputs[response.input_labels.index(f"{kind}_{w}")] for w in ("w1", "w2")]


@pytest.mark.parametrize("kind", KINDS)
def test_trailing_wheelset_passes_the_same_track_later(kind):
    half = COACH.vehicle.half_wheelbase
    speed = 2 * half / 0.05  # a wheelbase is ten samples
    response = railenv.simulate(
        COACH, speed=speed, duration=2.0, irregularity="low", irregularity_factor=0.5
    )
    first, second = rails_of(response, kind)
    grown = math.ceil(20.0 / speed / 0.005)
    np.testing.assert_allclose(second[grown + 10 :], first[grown:-10], atol=1e-12)
    distance = speed * response.time
    expected = (
        0.5 * np.minimum(distance / 20.0, 1.0) * irregularity.line("low").at(kind, distance + half)
    )
    np.testing.assert_allclose(first, expected, atol=1e-14)
    assert np.ptp(first) > 1e-4


def test_irregularity_is_the_same_as_inputs_of_the_same_course():
    line, half, speed = ramped(), COACH.vehicle.half_wheelbase, 60.0
    own = railenv.simulate(COACH, speed=speed, duration=2.0, irregularity=line)
    inputs = {
        f"{kind}_{w}": lambda t, kind=kind, x=x: (
            np.minimum(speed * t / 20.0, 1.0) * line.at(kind, speed * t + x)
        )
        for kind in KINDS
        for w, x in (("w1", half), ("w2", -half))
    }
    given = railenv.simulate(COACH, speed=speed, duration=2.0, inputs=inputs)
    np.testing.assert_allclose(own.outputs, given.outputs, atol=1e-12)
    assert np.abs(own.outputs[0]).max() > 1e-4
    assert (rails_of(own, "vert")[0][own.time > 105.0 / speed] == 0.0).all()  # beyond the line's end
    assert railenv.simulate(COACH, speed=speed, duration=0.1, irregularity=None).inputs[3:9].any() == 0


def test_other_integrators_see_the_same_track():
    common = {"speed": 60.0, "duration": 0.5, "irregularity": "high"}
    own = railenv.simulate(COACH, **common)
    other = railenv.simulate(COACH, method="DOP853", rtol=1e-6, **common)
    np.testing.assert_allclose(own.outputs[:12], other.outputs[:12], atol=2e-6)


def test_irregularity_that_cannot_be_is_refused():
    common = {"speed": 50.0, "duration": 0.1}
    with pytest.raises(ParameterError, match="inputs has vert_w1, and irregularity displaces"):
        railenv.simulate(COACH, irregularity="low", inputs={"vert_w1": 0.001}, **common)
    with pytest.raises(ParameterError, match="cooperrider has no inputs that displace its rails"):
        railenv.simulate(railenv.CooperriderBogie(), irregularity="low", **common)
    with pytest.raises(UnknownNameError, match="irregularity: 'medium'"):
        railenv.simulate(COACH, irregularity="medium", **common)
    with pytest.raises(ParameterError, match=r"irregularity is 3; it must be the name of a level or a"):
        railenv.simulate(COACH, irregularity=3, **common)
    with pytest.raises(ParameterError, match="irregularity_factor is -1"):
        railenv.simulate(COACH, irregularity="low", irregularity_factor=-1.0, **common)


def test_environments_run_on_a_line_of_ones_own():
    line = ramped()
    env = gymnasium.make("railenv/Bogie-v1", irregularity=line).unwrapped
    half = env.settings.vehicle.half_wheelbase
    env.reset(seed=3, options={"speed": 80.0, "radius": math.inf, "offset": 0.0})
    start = env.fleet.episodes[0].line_offset
    assert 0.0 <= start <= 100.25
    for k in range(1, 201):
        env.step(np.zeros(1))
        s = 80.0 * 0.005 * k
        place = start + s + np.array([half, -half])
        expected = min(s / 20.0, 1.0) * line.at("align", place % 100.25)
        np.testing.assert_allclose(env.fleet.rails(0), expected, atol=1e-6)  # fades are per sample
    with pytest.raises(ParameterError, match="irregularity is 3; it must be the name of a level or a"):
        gymnasium.make("railenv/Bogie-v1", irregularity=3)
