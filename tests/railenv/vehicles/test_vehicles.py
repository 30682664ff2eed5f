"""Vehicle records: checks of every field, files, and the numbers that are shipped."""

import dataclasses
import math
import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import railenv
from railenv.errors import ParameterError, UnknownNameError
from railenv.vehicles import QUANTITIES, CooperriderParameters, Vehicle, describe, preset
from railenv.vehicles.further import GROUPS

FIELDS = {f.name: f for f in dataclasses.fields(Vehicle)}
FURTHER = [name for names in GROUPS.values() for name in names]
TABLES = [name for name in FURTHER if "table" in FIELDS[name].metadata]
POINTS = ((0.0, 0.1, 0.3), (0.0, 5e3, 8e3))
COMPLETE = railenv.TABLE_1.replace(**{name: POINTS if name in TABLES else 1.0 for name in FURTHER})
"""A vehicle with all parts that there are."""
RECORDS = {Vehicle: COMPLETE, CooperriderParameters: railenv.COOPERRIDER}
QUANTITY_FIELDS = [
    pytest.param(record, f, id=f"{kind.__name__}.{f.name}")
    for kind, record in RECORDS.items()
    for f in dataclasses.fields(kind)
    if "bounds" in f.metadata
]


def allowed(f):
    """Return any float that the field allows, to the ends of its range."""
    bounds = f.metadata["bounds"]
    return st.floats(
        bounds.get("low"),
        bounds.get("high"),
        exclude_min=bounds.get("open_low", False),
        allow_nan=False,
        allow_infinity=False,
    )


def any_of(law):
    """Return contact laws of a kind that has numbers alone."""
    return st.builds(law, **{f.name: allowed(f) for f in dataclasses.fields(law)})


vehicles = st.builds(
    Vehicle,
    contact=st.one_of(any_of(railenv.Cone), any_of(railenv.LinearProfile)),
    saturation=st.sampled_from(["heuristic", "polach"]),
    saturation_of=st.sampled_from(["wheelset", "wheel"]),
    load_dependent_creep=st.booleans(),
    name=st.text(),
    provenance=st.text(),
    wheelbase_curving=st.booleans(),
    load_bookkeeping=st.sampled_from(["once", "printed"]),
    **{name: allowed(FIELDS[name]) for name in QUANTITIES},
)


# ---------------------------------------------------------------------------- metadata


@pytest.mark.parametrize(("record", "f"), QUANTITY_FIELDS)
def test_every_quantity_says_its_symbol_unit_meaning_and_source(record, f):
    for key in ("symbol", "unit", "meaning", "source"):
        assert isinstance(f.metadata[key], str)
        assert f.metadata[key].strip(), f"{f.name} lacks its {key}"
    assert set(f.metadata["bounds"]) <= {"low", "high", "open_low"}


def test_every_field_is_described_in_order():
    for kind in RECORDS:
        rows = describe(kind)
        assert [row.name for row in rows] == [f.name for f in dataclasses.fields(kind)]
        assert all(row.meaning for row in rows)


def test_every_field_is_a_quantity_a_label_or_a_switch():
    others = {"name", "provenance", "conicity", "contact", "wheelbase_curving", "load_bookkeeping"}
    others |= {"saturation", "saturation_of", "load_dependent_creep", "overturning"}
    assert set(FIELDS) == set(QUANTITIES) | others | set(FURTHER)
    assert not set(QUANTITIES) & others


def test_symbols_are_unique():
    symbols = [row.symbol for row in describe(Vehicle) if row.symbol]
    assert len(symbols) == len(set(symbols)) == len(QUANTITIES) + len(FURTHER) + 1  # the conicity


def test_parameters_are_the_quantities_and_the_switches_as_numbers():
    vehicle = railenv.TABLE_1.replace(wheelbase_curving=True, load_bookkeeping="printed")
    parameters = vehicle.parameters()
    assert list(parameters) == [*QUANTITIES, "conicity", "wheelbase_curving", "printed_loads"]
    assert all(type(value) is float for value in parameters.values())
    assert (parameters["wheelbase_curving"], parameters["printed_loads"]) == (1.0, 1.0)
    assert parameters["conicity"] == vehicle.conicity
    plain = railenv.TABLE_1.parameters()
    assert (plain["wheelbase_curving"], plain["printed_loads"]) == (0.0, 0.0)


def values(vehicle):
    """Return what a vehicle is made from."""
    return {name: getattr(vehicle, name) for name in FIELDS}


def test_part_of_a_vehicle_is_given_as_a_whole_or_not_at_all():
    for group, names in GROUPS.items():
        if len(names) == 1:
            continue
        for left_out in names:
            with pytest.raises(ParameterError, match=f"the {group} lacks {left_out}; give all of"):
                COMPLETE.replace(**{left_out: None})
        assert COMPLETE.replace(**dict.fromkeys(names)).groups == COMPLETE.groups - {group}
    assert railenv.TABLE_1.groups == set()


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("wrong", [3.0, "none", ((0.0, 1.0), (0.0,)), ((0.0, -1.0), (0.0, 5.0))])
def test_characteristic_that_is_none_is_refused(name, wrong):
    with pytest.raises(ParameterError, match=name):
        COMPLETE.replace(**{name: wrong})


# ----------------------------------------------------------------------------- refusals


def out_of_range(f):
    """Return values just beyond the field's range and far beyond it."""
    bounds = f.metadata["bounds"]
    values = [math.nan, math.inf, -math.inf]
    if "low" in bounds:
        low = bounds["low"]
        values += [low if bounds.get("open_low") else math.nextafter(low, -math.inf), low - 3.0]
    if "high" in bounds:
        values += [math.nextafter(bounds["high"], math.inf), bounds["high"] + 2.0]
    return values


@pytest.mark.parametrize(("record", "f"), QUANTITY_FIELDS)
def test_value_out_of_range_is_refused_with_field_value_and_range(record, f):
    for value in out_of_range(f):
        with pytest.raises(ParameterError) as refusal:
            record.replace(**{f.name: value})
        message = str(refusal.value)
        assert message.startswith(f"{f.name} is {value:g}")
        assert "it must be finite" in message
        if "low" in f.metadata["bounds"]:
            words = "greater than" if f.metadata["bounds"].get("open_low") else "at least"
            assert f"{words} {f.metadata['bounds']['low']:g}" in message
        if "high" in f.metadata["bounds"]:
            assert f"at most {f.metadata['bounds']['high']:g}" in message


@pytest.mark.parametrize(("record", "f"), QUANTITY_FIELDS)
def test_value_that_is_no_number_is_refused_with_field_and_value(record, f):
    for value in ("0.1", "", True, False, None, [0.1], 0.1j, {"value": 0.1}):
        if value is None and f.default is None:
            continue  # a part that the vehicle may lack
        with pytest.raises(ParameterError) as refusal:
            record.replace(**{f.name: value})
        assert f"{f.name} is {value!r}, which is not a number" in str(refusal.value)


@pytest.mark.parametrize(("record", "f"), QUANTITY_FIELDS)
def test_ends_of_the_range_are_allowed(record, f):
    bounds = f.metadata["bounds"]
    ends = [bounds["high"]] if "high" in bounds else [1e300]
    if "low" in bounds:
        low = bounds["low"]
        ends.append(math.nextafter(low, math.inf) if bounds.get("open_low") else low)
    for value in ends:
        assert getattr(record.replace(**{f.name: value}), f.name) == value


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"conicity": 2, "contact": None}, "conicity of Cone is 2"),
        ({"conicity": 0, "contact": None}, "conicity of Cone is 0"),
        ({"conicity": "0.1", "contact": None}, "conicity of Cone is '0.1', which is not a number"),
        ({"saturation": "fastsim"}, "saturation is 'fastsim'; it must be 'heuristic' or 'polach'"),
        ({"saturation_of": "axle"}, "saturation_of is 'axle'; it must be 'wheelset' or 'wheel'"),
        ({"load_dependent_creep": 1}, "load_dependent_creep is 1; it must be true or false"),
        (
            {"wheelset_mass": -1800.0},
            "wheelset_mass is -1800 kg; it must be finite and greater than 0 kg",
        ),
        ({"wheel_radius": 0.0}, "wheel_radius is 0 m"),
        ({"name": 7}, "name is 7; it must be a string"),
        ({"provenance": None}, "provenance is None; it must be a string"),
        ({"wheelbase_curving": 1}, "wheelbase_curving is 1; it must be true or false"),
        ({"wheelbase_curving": "false"}, "wheelbase_curving is 'false'"),
        ({"load_bookkeeping": "twice"}, "load_bookkeeping is 'twice'; it must be 'once' or 'printed'"),
        ({"load_bookkeeping": None}, "load_bookkeeping is None"),
        ({"load_bookkeeping": np.array([1.0, 2.0])}, r"load_bookkeeping is array\(\[1\., 2\.\]\)"),
    ],
)
def test_impossible_vehicles_are_refused(change, message):
    with pytest.raises(ParameterError, match=message):
        railenv.TABLE_1.replace(**change)
    # on creation as well, not by `replace` alone
    with pytest.raises(ParameterError, match=message):
        Vehicle(**{**values(railenv.TABLE_1), **change})


@pytest.mark.parametrize("record", RECORDS.values(), ids=lambda r: type(r).__name__)
def test_replace_with_an_unknown_name_is_refused(record):
    with pytest.raises(UnknownNameError, match=r"unknown field: 'conicty'.*allowed are .*conicity"):
        record.replace(conicty=0.1)


@pytest.mark.parametrize("record", RECORDS.values(), ids=lambda r: type(r).__name__)
def test_records_are_frozen(record):
    with pytest.raises(dataclasses.FrozenInstanceError):
        record.conicity = 0.1
    changed = record.replace(conicity=0.1)
    assert changed.conicity == 0.1
    assert record.conicity == 0.05
    assert hash(changed) != hash(record)


def test_whole_numbers_become_floats():
    mass = railenv.TABLE_1.replace(wheelset_mass=1500).wheelset_mass
    assert type(mass) is float
    assert mass == 1500.0


# --------------------------------------------------------------------------------- files


@settings(max_examples=60, deadline=None, derandomize=True)
@given(vehicle=vehicles)
def test_a_vehicle_in_a_file_is_the_vehicle_to_the_last_bit(vehicle, tmp_path_factory):
    path = tmp_path_factory.mktemp("vehicle") / "vehicle.toml"
    text = vehicle.to_toml(path)
    again = Vehicle.from_toml(path)
    assert again == vehicle
    assert again.to_toml() == text  # so that the sign of a zero counts too


@pytest.mark.parametrize("vehicle", railenv.PRESETS, ids=lambda v: v.name)
def test_file_of_a_shipped_vehicle_is_plain_toml_with_units(vehicle, tmp_path):
    text = vehicle.to_toml(tmp_path / "v.toml")
    assert (tmp_path / "v.toml").read_text(encoding="utf-8") == text
    short = isinstance(vehicle.contact, railenv.Cone)
    expected = values(vehicle) | {"contact": vehicle.contact.to_mapping()}
    del expected["contact" if short else "conicity"]
    expected = {
        n: [list(x) for x in v] if n in TABLES else v for n, v in expected.items() if v is not None
    }
    assert tomllib.loads(text) == expected
    for line in text.split("\n[contact]")[0].splitlines():
        name = line.split(" = ")[0]
        assert FIELDS[name].metadata["meaning"] in line
        if name in (*QUANTITIES, *FURTHER):
            assert line.endswith(f"[{FIELDS[name].metadata['unit']}]")


def read(tmp_path, content):
    path = tmp_path / "vehicle.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return Vehicle.from_toml(path)


def test_base_supplies_what_the_file_leaves_out(tmp_path):
    vehicle = read(
        tmp_path, 'base = "HIGH_SPEED_COACH"\nname = "worn"\nconicity = 0.3\nbody_mass = 40000'
    )
    assert vehicle == railenv.HIGH_SPEED_COACH.replace(name="worn", conicity=0.3, body_mass=40000.0)


@pytest.mark.parametrize("name", [v.name for v in railenv.PRESETS])
def test_every_shipped_vehicle_can_be_a_base(tmp_path, name):
    assert read(tmp_path, f'base = "{name}"') == preset(name)


@pytest.mark.parametrize(
    ("content", "kind", "message"),
    [
        ("", ParameterError, r"lacks name, provenance, wheelset_mass.*a `base` vehicle"),
        ('base = "TABLE_9"', UnknownNameError, "unknown vehicle: 'TABLE_9'.*allowed are TABLE_1"),
        ("base = 1", ParameterError, "base in .* is 1; it must be a vehicle's name"),
        ('base = "TABLE_1"\nconicty = 0.1', UnknownNameError, r"unknown field in .*: 'conicty'"),
        ('base = "TABLE_1"\nprinted_loads = 1', UnknownNameError, "'printed_loads'"),
        (
            'base = "TABLE_1"\nconicity = "0.1"',
            ParameterError,
            "conicity of Cone is '0.1', which is not a number",
        ),
        ('base = "TABLE_1"\nconicity = true', ParameterError, "conicity of Cone is True"),
        ('base = "TABLE_1"\nconicity = 2020-01-01', ParameterError, "conicity .* is .*not a number"),
        ('base = "TABLE_1"\n[conicity]\nvalue = 0.1', ParameterError, "conicity .* is .*not a number"),
        ('base = "TABLE_1"\nconicity = nan', ParameterError, "conicity of Cone is nan"),
        ('base = "TABLE_1"\nwheelset_mass = -1', ParameterError, "wheelset_mass is -1 kg"),
        ('base = "TABLE_1"\nwheelbase_curving = 0', ParameterError, "wheelbase_curving is 0"),
        ("base =", ParameterError, "is not a TOML file"),
        ('name = "x"\nname = "y"', ParameterError, "is not a TOML file"),
        (b"\xff\xfe\x00", ParameterError, "is not a TOML file"),
    ],
)
def test_files_that_are_no_vehicle_are_refused(tmp_path, content, kind, message):
    with pytest.raises(kind, match=message):
        read(tmp_path, content)


def test_missing_field_is_named(tmp_path):
    text = railenv.TABLE_1.to_toml()
    without = "\n".join(line for line in text.splitlines() if not line.startswith("conicity"))
    with pytest.raises(ParameterError, match=r"TABLE_1 lacks contact; give a contact law, or conicity"):
        read(tmp_path, without)


def test_a_file_that_does_not_exist_is_the_usual_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        Vehicle.from_toml(tmp_path / "nowhere.toml")


# ------------------------------------------------------------------------ shipped numbers


def test_presets_are_found_by_their_names():
    assert [preset(v.name) for v in railenv.PRESETS] == list(railenv.PRESETS)
    with pytest.raises(UnknownNameError, match="unknown vehicle: 'table_1'"):
        preset("table_1")


def test_coach_shares_contact_and_geometry_with_table_1():
    for name in QUANTITIES:
        of_the_coach = (
            name.startswith(("primary_", "secondary_", "yaw_damper_")) or name == "wheelset_mass"
        )
        if not of_the_coach:
            assert getattr(railenv.HIGH_SPEED_COACH, name) == getattr(railenv.TABLE_1, name), name
    assert railenv.HIGH_SPEED_COACH.contact == railenv.TABLE_1.contact == railenv.Cone(0.05)


def test_printed_loads_differ_from_table_1_in_the_bookkeeping_alone():
    changed = values(railenv.TABLE_1_PRINTED_LOADS)
    differing = {k for k, v in values(railenv.TABLE_1).items() if changed[k] != v}
    assert differing == {"name", "provenance", "load_bookkeeping"}


def test_external_load_is_that_of_one_bogie():
    vehicle = railenv.TABLE_1.replace(body_mass=20000.0, frame_mass=2000.0, gravity=10.0)
    assert vehicle.external_load == pytest.approx(120e3)


def test_klingel_wavelength_follows_its_formula():
    vehicle = railenv.TABLE_1.replace(half_gauge=0.75, wheel_radius=0.48, conicity=0.1)
    assert vehicle.klingel_wavelength == pytest.approx(2.0 * math.pi * math.sqrt(3.6))
