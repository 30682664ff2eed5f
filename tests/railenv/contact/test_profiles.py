"""Profiles, their files, and what is said about bad ones."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from railenv import Profile
from railenv.contact.profiles import SHIPPED, Curve
from railenv.errors import ParameterError
from tests.railenv.contact.shapes import table


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_profiles_lie_as_they_must_and_tell_their_source(name):
    profile = Profile.named(name)
    assert profile.name == name
    assert profile.kind == SHIPPED[name]
    assert (np.diff(profile.y) > 0.0).all()
    assert profile.source
    if profile.kind == "wheel":
        assert profile.y[np.argmin(profile.z)] == pytest.approx(-0.055, abs=1e-3)
        assert profile.curve()(np.zeros(1)).z[0] == pytest.approx(0.0, abs=1e-7)
    assert Profile.named(name) == profile
    assert hash(Profile.named(name)) == hash(profile)
    assert repr(profile) == f"Profile('{name}', '{profile.kind}', {len(profile.y)} points)"


def test_uic60_is_symmetric_upright_and_the_benchmarks_inclined():
    rail = Profile.named("UIC60")
    top = int(np.argmax(rail.z))
    for depth in (0.001, 0.005, 0.014, 0.03):
        left = np.interp(-depth, rail.z[:top], rail.y[:top])
        right = np.interp(depth, -rail.z[top:], rail.y[top:])
        assert left == pytest.approx(-right, abs=2e-6)
        if depth == 0.014:
            assert right - left == pytest.approx(0.072, abs=1e-4)
    inclined = rail.turned(1.0 / 40.0)
    original = table("mbench_uic60")
    y, z = 1e-3 * original["y_mm"], -1e-3 * original["z_mm"]
    shift = y[np.argmax(z)] - inclined.y[np.argmax(inclined.z)]
    seen = z > -0.03
    found = inclined.curve()(y[seen] - shift).z
    assert_allclose(found - found.max(), z[seen], atol=2e-7)


def test_curve_follows_circles_and_straight_lines():
    angle = np.linspace(-1.2, 1.2, 40)
    radius = 0.013
    made = Curve.through(radius * np.sin(angle), radius * np.cos(angle))
    y = np.linspace(-0.011, 0.011, 500)
    assert_allclose(made(y).z, np.sqrt(radius**2 - y**2), atol=5e-8)
    assert_allclose(made(y).slope, -y / np.sqrt(radius**2 - y**2), atol=2e-4)
    line = Curve.through(
        np.array([0.0, 0.01, 0.012, 0.03, 0.05]), np.array([0.0, 1e-3, 1.2e-3, 3e-3, 5e-3])
    )
    y = np.linspace(0.0, 0.05, 77)
    assert_allclose(line(y).z, 0.1 * y, atol=1e-16)
    assert_allclose(line(y).slope, 0.1, rtol=1e-12)


# ------------------------------------------------------------------------------------- files


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("S1002", "w.prw"),
        ("UIC60", "r.prr"),
        ("S1002", "w.whl"),
        ("UIC60", "r.ban"),
        ("S1002", "w.csv"),
        ("UIC60", "r.txt"),
    ],
)
def test_files_round_trip(name, file, tmp_path):
    profile = Profile.named(name)
    path = tmp_path / file
    profile.write(path)
    again = Profile.read(path, kind=profile.kind)
    assert_allclose(again.points, profile.points, atol=1e-12)
    assert again.name == path.stem
    assert profile.source[:40] in again.source


SIMPACK = """! made by hand
header.begin
  version = 1
  type    = 1   ! wheel
header.end
spline.begin
  comment = 'by hand'
  shift.y = 0.001
  mirror.y = {mirror}
  units.len = 'm'
  units.len.f = {factor}
  point.begin
  ! y z weight
{points}
  point.end
spline.end
"""


def rows(points, scale=1.0):
    return "\n".join(f"{scale * y:.9g} {scale * z:.9g} 1.0" for y, z in points)


@pytest.mark.parametrize(("factor", "scale"), [(1.0, 1.0), (1000.0, 1000.0)])
def test_simpack_says_units_shift_mirror_and_signs(factor, scale, tmp_path):
    wheel = Profile.named("S1002")
    path = tmp_path / "w.prw"
    # the flange at positive y, heights downwards, and all of it 1 mm off
    told = -wheel.points * scale
    told[:, 0] -= 0.001
    path.write_text(SIMPACK.format(mirror=0, factor=factor, points=rows(told)))
    assert_allclose(Profile.read(path).points, wheel.points, atol=1.1e-3 if factor == 1e3 else 1e-10)
    again = Profile.read(path, name="mine")
    assert again.source == "by hand"
    assert again.name == "mine"
    path.write_text(SIMPACK.format(mirror=1, factor=factor, points=rows(told)))
    assert Profile.read(path).y[0] == pytest.approx(again.y[0], abs=1e-12)  # the flange tells the side


def test_miniprof_has_columns_offsets_and_a_tape_circle(tmp_path):
    wheel = Profile.named("S1002")
    path = tmp_path / "w.whl"
    told = 1e3 * wheel.points
    lines = "\n".join(f"0.5 {70.0 + y:.9g} {z:.9g}" for y, z in told)
    path.write_text(
        f'ProgramName=MiniProf\nColumnDef=A,X,Y\nXYPoints={len(told)}\nXOffset=1.0\nWheelID="7"\n\n{lines}\n'
    )
    assert_allclose(Profile.read(path, tape_circle=0.071).points, wheel.points, atol=1e-10)
    path.write_text(path.read_text().replace("XYPoints=399", "XYPoints=400"))
    with pytest.raises(ParameterError, match="says XYPoints = 400 and has 399 points"):
        Profile.read(path)


@pytest.mark.parametrize(
    ("head", "scale"),
    [("y_mm,z_mm", 1e3), ("y [m]; z [m]", 1.0), ("# units: mm", 1e3), ("# y z in m", 1.0)],
)
def test_text_declares_its_units(head, scale, tmp_path):
    rail = Profile.named("UIC519_RAIL_A")
    path = tmp_path / "r.txt"
    path.write_text(head + "\n" + "\n".join(f"{y} {z}" for y, z in (scale * rail.points).tolist()))
    assert_allclose(Profile.read(path, kind="rail").points, rail.points, atol=1e-12)
    with pytest.raises(ParameterError, match=r"seem to be in m+ and were taken for m"):
        Profile.read(path, kind="rail", units="m" if scale == 1e3 else "mm")
    mirrored = Profile.read(path, kind="rail", mirror=True)
    assert_allclose(mirrored.y, -rail.y[::-1], atol=1e-12)


@pytest.mark.parametrize("between", [";", "; ", "\t", "  "])
def test_text_may_have_decimal_commas(between, tmp_path):
    """As spreadsheets of most of Europe write them."""
    rail = Profile.named("UIC519_RAIL_A")
    rows = [f"{1e3 * y:.9f}{between}{1e3 * z:.9f}".replace(".", ",") for y, z in rail.points.tolist()]
    path = tmp_path / "r.csv"
    path.write_text("y [mm];z [mm]\n" + "\n".join(rows))
    assert_allclose(Profile.read(path, kind="rail").points, rail.points, atol=1e-12)


GOOD = "y_mm,z_mm\n" + "\n".join(f"{y},{-(y**2) / 600:.6f}" for y in range(-30, 31))


@pytest.mark.parametrize(
    ("name", "text", "given", "message"),
    [
        ("r.csv", GOOD, {}, "does not state its kind of profile"),
        ("r.csv", GOOD.replace("_mm", ""), {"kind": "rail"}, "does not state its units"),
        ("r.csv", GOOD, {"kind": "track"}, "kind of profile is 'track'"),
        ("r.csv", GOOD, {"kind": "rail", "units": "inch"}, "units is 'inch'"),
        ("r.csv", GOOD.replace("0,-1.5", "0,left"), {"kind": "rail"}, "line 2 is '-30,left'|line"),
        ("r.csv", "y_mm,z_mm\n", {"kind": "rail"}, "has no points"),
        ("r.csv", GOOD + ",7", {"kind": "rail"}, "line 62 .* two numbers"),
        ("r.csv", GOOD + "\nnan,0", {"kind": "rail"}, r"point 62 of 62 is \(y = nan, z = 0\)"),
        ("w.csv", GOOD, {"kind": "wheel", "mirror": True}, "mirror is for rails"),
        ("r.doc", GOOD, {}, "must end in"),
        ("r.prr", GOOD, {}, "no point.begin"),
        ("r.prr", GOOD, {"kind": "wheel"}, "profile of a rail, not of a wheel"),
        ("r.prr", SIMPACK.format(mirror=0, factor=1, points="0 0"), {}, "says type = 1"),
        ("w.prw", SIMPACK.format(mirror=0, factor=0, points="0 0"), {}, "units.len.f = 0"),
        ("w.prw", SIMPACK.format(mirror=0, factor="x", points="0 0"), {}, "must be a number"),
        ("w.prw", SIMPACK.format(mirror=0, factor=1, points="0"), {}, "line 14 is '0'"),
        ("w.whl", "ColumnDef=A,C\n\n0 0\n", {}, "must hold X and Y"),
        ("w.whl", "A=1\n\n0 0\nB=2\n", {}, "line 4 has the key 'B' after points"),
    ],
)
def test_bad_files_say_where(name, text, given, message, tmp_path):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(ParameterError, match=message):
        Profile.read(path, **given)


def test_writing_keeps_kinds_apart(tmp_path):
    with pytest.raises(ParameterError, match="profile of a rail, not of a wheel"):
        Profile.named("S1002").write(tmp_path / "w.prr")
    with pytest.raises(ParameterError, match="must end in"):
        Profile.named("S1002").write(tmp_path / "w.doc")


# ------------------------------------------------------------------------------- bad points


def crown(count=61):
    y = np.linspace(-0.036, 0.036, count)
    return np.stack([y, -(y**2) / 0.6], axis=1)


def test_points_in_other_units_or_order():
    good = crown()
    assert Profile.of(good[::-1], kind="rail") == Profile.of(good, kind="rail")
    with pytest.raises(ParameterError, match=r"72 m wide .* seem to be in mm and were taken for m"):
        Profile.of(1e3 * good, kind="rail")
    with pytest.raises(ParameterError, match="seem to be in m and were taken for mm"):
        Profile.of(1e-3 * good, kind="rail")
    with pytest.raises(ParameterError, match=r"has shape \(61, 3\)"):
        Profile.of(np.ones((61, 3)), kind="rail")
    with pytest.raises(ParameterError, match="has 4 points; it needs at least 5"):
        Profile.of(good[:4], kind="rail")
    with pytest.raises(ParameterError, match="not an array of points"):
        Profile.of("S1002", kind="wheel")
    wheel = Profile.named("S1002").points
    with pytest.raises(ParameterError, match="flange at y > 0; "):
        Profile.of(wheel * np.array([-1, 1]), kind="wheel")
    with pytest.raises(ParameterError, match="flange at z > 0; "):
        Profile.of(wheel * np.array([1, -1]), kind="wheel")
    with pytest.raises(ParameterError, match="y = 0 must lie within"):
        Profile.of(wheel + np.array([0.08, 0.0]), kind="wheel")
    with pytest.raises(ParameterError, match="it must be finite"):
        Profile.of(np.where(np.arange(61)[:, None] == 7, np.inf, good), kind="rail")


def test_folds_are_errors_and_overhanging_faces_are_cut():
    good = crown()
    folded = good.copy()
    folded[[40, 41]] = folded[[41, 40]]
    with pytest.raises(ParameterError, match=r"folds at point \(y = 0\.0132, .* next one is"):
        Profile.of(folded, kind="rail")
    # a gauge face that hangs over below the head, and one within it
    head = np.stack([np.linspace(-0.036, 0.036, 61), np.zeros(61)], axis=1)
    under = [[-0.0362, -0.004], [-0.0364, -0.012], [-0.0360, -0.020], [-0.0355, -0.03]]
    assert Profile.of(np.vstack([under[::-1], head]), kind="rail").y[0] == -0.0364
    within = [[-0.0362, -0.004], [-0.0358, -0.012]]
    with pytest.raises(ParameterError, match="folds at point"):
        Profile.of(np.vstack([within[::-1], head]), kind="rail")
    # the back of a flange
    wheel = Profile.named("S1002").points
    back = [[-0.0695, 0.01], [-0.0698, 0.0]]
    assert Profile.of(np.vstack([back, wheel]), kind="wheel").y[0] == -0.0698
    bent = np.vstack([wheel[:200], wheel[198:199] - (0, 1e-3), wheel[200:]])
    with pytest.raises(ParameterError, match="folds at point"):
        Profile.of(bent, kind="wheel")
