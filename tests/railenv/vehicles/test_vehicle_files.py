"""Assemblies as TOML files: what is written reads back, and what is wrong is told clearly."""

import contextlib

import numpy as np
import pytest
import tomlkit

import railenv
from railenv.envs.settings import settings
from railenv.errors import ParameterError, UnknownNameError
from railenv.vehicles import elements, files
from railenv.vehicles.assembly import Assembly
from railenv.vehicles.vehicle import COMMENTS

KINDS = {"bogie": railenv.Bogie, "dual_wheelset": railenv.DualWheelset}

SMALL = """
[parameters]
half_wheelbase = 1.2
frame_mass = 3000.0

[[wheelset]]
name = "w1"
x = "half_wheelbase"
mass = 1400.0
roll_inertia = 915.0
pitch_inertia = 140.0
yaw_inertia = 915.0
wheel_radius = 0.4575
half_gauge = 0.7176
conicity = 0.05
friction = 0.2
flange_clearance = 0.00923
lateral_creep = 6.563e6
lateral_spin_creep = 1.2e3
spin_creep = 16.0
longitudinal_creep = 6.563e6
vertical_rail_stiffness = 62e6
lateral_rail_stiffness = 16.17e6

[[wheelset]]
name = "w2"
like = "w1"
x = "-half_wheelbase"

[[body]]
name = "b"
z = 0.44
mass = "frame_mass"
roll_inertia = 2260.0
yaw_inertia = 3160.0
vertical_load_mass = "frame_mass + 17000"

[[spring]]
name = "p1"
between = ["w1", "b"]
pair = true
y = 1.0
k_x = 10e6
k_y = 5e6
k_z = 0.55e6
c_z = 6e3

[[spring]]
name = "p2"
like = "p1"
between = ["w2", "b"]

[[stop]]
name = "stop"
between = ["b", "ground"]
force = [[0.02, 0.025, 0.03], [0.0, 696.0, 2107.0]]

[[damper]]
name = "lateral"
between = ["b", "ground"]
c = 60e3
"""


def read(tmp_path, text, name="mine.toml"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return Assembly.from_toml(path)


# ---------------------------------------------------------------------------- round trips


@pytest.mark.parametrize("vehicle", railenv.PRESETS, ids=lambda v: v.name)
@pytest.mark.parametrize("kind", KINDS)
def test_shipped_vehicles_read_back_equal(tmp_path, vehicle, kind):
    model = KINDS[kind](vehicle)
    written = model.assembly.to_toml(tmp_path / "mine.toml", units=COMMENTS)
    back = Assembly.from_toml(tmp_path / "mine.toml")
    assert back == model.assembly
    assert (tmp_path / "mine.toml").read_text(encoding="utf-8") == written
    again = railenv.Assembled(back)
    assert again.structure == railenv.Assembled(model.assembly).structure == model.structure
    rng = np.random.default_rng(1)
    x, u = 1e-3 * rng.standard_normal(model.n_states), rng.standard_normal(model.n_inputs)
    where = {"speed": 60.0, "curvature": 1e-3, "cant": 0.05}
    np.testing.assert_array_equal(again.rhs(x, u, **where), model.rhs(x, u, **where))


def test_parameters_keep_units_and_meanings_as_comments():
    text = railenv.Bogie(railenv.TABLE_1).assembly.to_toml(units=COMMENTS)
    assert "frame_mass = 3000.0 # mass of the bogie frame [kg]" in text
    assert 'k_x = "primary_longitudinal_stiffness" # longitudinal stiffness [N/m]' in text
    for vehicle in (railenv.TABLE_1, railenv.HIGH_SPEED_COACH_HOLLOW):
        assert set(vehicle.parameters()) <= set(COMMENTS)
    for line in text.splitlines():
        assert (
            "=" not in line
            or "#" in line
            or line.split()[0] in ("name", "provenance", "between", "pair")
        )


def everything():
    """A vehicle that has a part of every kind, and a number in every field."""

    def filled(kind, **given):
        if kind is elements.Wheelset:  # the law of creep that has numbers of its own
            given |= {"conicity": 0.05, "saturation": "polach", "saturation_of": "wheel"}
            given |= {"right_contact": railenv.LinearProfile(0.2, 0.03, 13.6)}
        for f in kind.number_fields():
            if f not in given:
                bounds = next(x for x in elements.dataclasses.fields(kind) if x.name == f)
                given[f] = min(0.5, bounds.metadata["bounds"].get("high", 0.5))
        return kind(**given)

    bodies = [filled(kind, name=f"a_{kind.kind}") for kind in elements.BODIES]
    table = ((0.0, 0.1, 0.2), (0.0, 10.0, 15.0))
    parts = []
    for kind in elements.ELEMENTS:
        given = {"name": f"the_{kind.kind}", "between": ("a_wheelset", "a_body")}
        if "pair" in {f.name for f in elements.dataclasses.fields(kind)}:
            given["pair"] = True
        if kind in (elements.Damper, elements.SeriesDamper):
            given |= {"c": None, "force": table}
        if kind is elements.Stop:
            given["force"] = ((0.1, 0.2), (0.0, 10.0))
        parts.append(filled(kind, **given))
    return Assembly(
        name="everything",
        bodies=tuple(bodies),
        elements=tuple(parts),
        gravity=9.0,
        wheelbase_curving=0.0,
    )


def test_every_field_of_every_kind_of_part_reads_back(tmp_path):
    vehicle = everything()
    vehicle.to_toml(tmp_path / "all.toml")
    assert Assembly.from_toml(tmp_path / "all.toml") == vehicle


def test_a_file_says_what_it_describes(tmp_path):
    flat, parts = tmp_path / "flat.toml", tmp_path / "parts.toml"
    railenv.TABLE_1.to_toml(flat)
    railenv.Bogie(railenv.TABLE_1).assembly.to_toml(parts)
    assert not files.describes_assembly(files.read(flat))
    assert files.describes_assembly(files.read(parts))
    with pytest.raises(ParameterError, match=r"is read by railenv\.Vehicle\.from_toml"):
        Assembly.from_toml(flat)
    with pytest.raises(ParameterError, match=r"is read by railenv\.Assembly\.from_toml"):
        railenv.Vehicle.from_toml(parts)


def test_a_file_without_a_name_has_that_of_the_file(tmp_path):
    vehicle = read(tmp_path, SMALL)
    assert vehicle.name == "mine"
    assert vehicle.values["w1_conicity"] == 0.05
    both = vehicle.replace(w1_conicity=0.1)
    found = both.with_numbers({**both.values, **both.tables})
    assert [w.left.conicity for w in found.wheelsets] == [0.1, 0.1]


# --------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("c_z = 6e3", "c_zz = 6e3", r"field of p1 in .*'c_zz' \(did you mean 'c_z'\?\)"),
        ("[[stop]]", "[[stpo]]", r"name in .*'stpo' \(did you mean 'stop'\?\)"),
        ("mass = 1400.0\n", "", r"w1 in .* lacks mass"),
        ('name = "w1"\n', "", r"wheelset number 1 in .* lacks name"),
        ('name = "w2"\n', "", r"wheelset number 2 in .* lacks name"),
        ('between = ["w1", "b"]\n', "", r"p1 in .* lacks between \(the two bodies to which"),
        ('between = ["w1", "b"]', 'between = ["w1"]', "it must be two names of bodies"),
        ('between = ["w1", "b"]', 'between = "w1"', "between of 'p1' is 'w1'; it must be two names"),
        ('between = ["w1", "b"]', "between = 5", "between of 'p1' is 5; it must be two names"),
        ('between = ["w1", "b"]', 'between = ["w1", "w1"]', "p1 is attached to w1 twice"),
        (
            'between = ["w1", "b"]',
            'between = ["w3", "b"]',
            "body to which p1 is attached: 'w3'; allowed are w1, w2, b, ground",
        ),
        (
            "mass = 1400.0",
            "mass = -3.0",
            "mass of w1 is -3 kg; it must be finite and greater than 0 kg",
        ),
        (
            "frame_mass = 3000.0",
            "frame_mass = -3.0",
            "mass of b is -3 kg; it must be finite and greater",
        ),
        (
            '"frame_mass + 17000"',
            '"open(1)"',
            r"vertical_load_mass of b is 'open\(1\)'; it must be a num",
        ),
        ('"frame_mass + 17000"', '"frame_mass / 0"', "vertical_load_mass of b is .* divides by zero"),
        (
            '"frame_mass + 17000"',
            '"frame_mas + 17000"',
            r"parameter in vertical_load_mass of b: 'frame_mas' \(did you mean 'frame_mass'\?\)",
        ),
        ("c = 60e3\n", "", "lateral has neither c nor force; give one of them"),
        ("c = 60e3", "c = 60e3\nforce = [[0.0, 1.0], [0.0, 1.0]]", "lateral has both c and force"),
        ('name = "p2"', 'name = "p1"', "p1 cannot name a part of mine: names must differ"),
        ('name = "stop"', 'name = "ground"', "ground cannot name a part"),
        ('name = "stop"', 'name = "a stop"', "name of a stop is 'a stop'; it must be a word"),
        ("[0.02, 0.025, 0.03]", "[0.02, 0.02, 0.03]", "x of force of stop is .* must rise from point"),
        ("[0.02, 0.025, 0.03]", "[0.02, 0.025]", "force of stop has 2 x and 3 y"),
        ("[0.0, 696.0, 2107.0]", "[1.0, 696.0, 2107.0]", "first point is the clearance"),
        ("y = 1.0\n", "", "p1 is a pair without y; give the arm"),
        ("pair = true", "pair = 1", "pair of p1 is 1; it must be true or false"),
        ('like = "w1"', 'like = "w7"', r"wheelset that w2 in .* is like: 'w7'"),
        ("conicity = 0.05", "conicity = true", "conicity of Cone is True, which is not a number"),
        (
            "conicity = 0.05",
            "conicity = [0.05]",
            r"conicity of Cone is \[0.05\], which is not a number",
        ),
        ("[[wheelset]]", "[[clamped]]\nname = 5\n[[wheelset]]", "name of a clamped is 5"),
        (
            "half_wheelbase = 1.2",
            'half_wheelbase = "1.2"',
            "half_wheelbase is '1.2', which is not a num",
        ),
        ("[[damper]]", "[damper]", r"damper in .* must be tables, each headed \[\[damper\]\]"),
        ("[parameters]", "name = 5\n[parameters]", "name in .* is 5; it must be a text"),
        ("[parameters]", "gravity = -1.0\n[parameters]", "gravity is -1 m/s"),
        (
            "[parameters]",
            "wheelbase_curving = 2.0\n[parameters]",
            "wheelbase_curving is 2.0; it must be",
        ),
        ("[[wheelset]]", "[[wheelset", "is not a TOML file"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, old, new, message):
    assert old in SMALL
    with pytest.raises(ParameterError, match=message):
        read(tmp_path, SMALL.replace(old, new, 1))


def test_a_body_that_nothing_holds_is_named(tmp_path):
    loose = '\n[[body]]\nname = "lost"\nmass = 1.0\nroll_inertia = 1.0\nyaw_inertia = 1.0\n'
    with pytest.raises(ParameterError, match="nothing holds lost of mine to the ground"):
        read(tmp_path, SMALL + loose)


def test_a_falling_series_damper_is_refused(tmp_path):
    damper = '\n[[series_damper]]\nname = "d"\nbetween = ["b", "ground"]\nk = 1e6\n'
    with pytest.raises(ParameterError, match="force of d must rise everywhere"):
        read(tmp_path, SMALL + damper + "force = [[0.0, 0.1, 0.2], [0.0, 10.0, 5.0]]\n")


def test_unknown_parameters_of_a_file_say_which_there_are(tmp_path):
    vehicle = read(tmp_path, SMALL)
    with pytest.raises(UnknownNameError, match=r"'frame_mas' \(did you mean 'frame_mass'\?\)"):
        vehicle.replace(frame_mas=1.0)


def test_damaged_files_raise_nothing_else(tmp_path):
    """A value of any type in any place is refused by name, or taken."""
    document = tomlkit.parse(SMALL).unwrap()
    path = tmp_path / "odd.toml"
    places = [
        (kind, i, field)
        for kind, tables in document.items()
        if isinstance(tables, list)
        for i, table in enumerate(tables)
        for field in table
    ]
    for value in (True, -1, "x +", [[], []], {}, [["w1"], "b"]):
        for kind, i, field in places:
            changed = tomlkit.parse(SMALL).unwrap()
            changed[kind][i][field] = value
            path.write_text(tomlkit.dumps(changed), encoding="utf-8")
            with contextlib.suppress(ParameterError):
                railenv.Assembled(Assembly.from_toml(path))


# ---------------------------------------------------------------------------- equipment

EQUIPMENT = """
[[yaw_actuator]]
between = ["b", "ground"]
limit = 20e3

[[lateral_actuator]]
name = "hold_off"
between = ["b", "w1"]
z = 0.2
limit = 8e3

[sensors]
bodies = ["w1", "b"]
gyro_bandwidth = 30.0
"""


def equipped_file(tmp_path, equipment=EQUIPMENT):
    path = tmp_path / "equipped.toml"
    text = railenv.Bogie(railenv.HIGH_SPEED_COACH).assembly.to_toml()
    path.write_text(text + equipment, encoding="utf-8")
    return path


def test_actuators_and_sensors_of_a_file_are_what_the_vehicle_carries(tmp_path):
    vehicle = railenv.Assembly.from_toml(equipped_file(tmp_path))
    model = railenv.Equipped(railenv.Assembled(vehicle))
    assert model.command_names == ("command_b", "command_hold_off")
    assert model.limits.tolist() == [20e3, 8e3]
    assert [mount.acts for mount in model.equipment.mounts] == ["yaw", "lateral"]
    assert model.sensed == ("w1", "b")
    assert model.sensors == railenv.Sensors.standard().replace(gyro_bandwidth=30.0)
    usual = railenv.Equipped(railenv.Assembled(vehicle), "primary", sensed=["b"])
    assert usual.command_names == ("command_w1", "command_w2")
    assert usual.sensed == ("b",)
    bare = railenv.Assembled(railenv.Bogie(railenv.HIGH_SPEED_COACH).assembly)
    assert railenv.Assembled(vehicle).structure == bare.structure  # they share the plant's kernels


def test_file_with_equipment_comes_back_equal(tmp_path):
    vehicle = railenv.Assembly.from_toml(equipped_file(tmp_path))
    again = tmp_path / "again.toml"
    vehicle.replace(conicity=0.1).to_toml(again)
    found = railenv.Assembly.from_toml(again)
    assert (found.actuators, found.sensors, found.sensed) == (
        vehicle.actuators,
        vehicle.sensors,
        vehicle.sensed,
    )
    assert found.parameters["conicity"] == 0.1


def test_environment_of_a_file_has_its_actuators(tmp_path):
    vehicle = railenv.Assembly.from_toml(equipped_file(tmp_path))
    own = settings("bogie", {"vehicle": vehicle}).equipped
    assert own.command_names == ("command_b", "command_hold_off")
    usual = settings("bogie", {"vehicle": vehicle, "actuator": "none"}).equipped
    assert usual.command_names == ()


@pytest.mark.parametrize(
    ("equipment", "message"),
    [
        ("[[yaw_actuator]]\nlimit = 1.0", "yaw_actuator number 1 in .* lacks between"),
        ('[[yaw_actuator]]\nbetween = ["b", "roof"]', "unknown body of actuator b: 'roof'"),
        ('[[yaw_actuator]]\nbetween = ["b", "ground"]\nlimt = 1.0', "did you mean 'limit'"),
        ('[[yaw_actuator]]\nbetween = ["b", "ground"]\nlimit = -1.0', "limit is -1 N m"),
        ("yaw_actuator = 5", "yaw_actuator in .* must be tables"),
        ('[sensors]\nbodies = ["roof"]', "unknown body that carries sensors: 'roof'"),
        ('[sensors]\nbodies = "b"', "they must be a list of names"),
        ("[sensors]\nnoise = 1.0", "unknown field of sensors"),
        ("sensors = 5", "it must be a table"),
    ],
)
def test_equipment_that_cannot_be_is_named(tmp_path, equipment, message):
    path = equipped_file(tmp_path, "")
    text = path.read_text(encoding="utf-8")
    parts = (text, equipment) if equipment.startswith("[") else (equipment, text)
    path.write_text("\n".join(parts), encoding="utf-8")
    with pytest.raises(ParameterError, match=message):
        railenv.Assembly.from_toml(path)
