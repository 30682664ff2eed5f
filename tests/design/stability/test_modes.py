"""Names, shares and frequencies of a vehicle's modes."""

import dataclasses
import math

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.linalg import eigh

import design
import railenv
from design.stability.mode_geometry import geometry_of
from design.stability.mode_names import mode_name, roll_axis
from design.stability.participation import Structure
from design.stability.roles import roles_of
from railenv.equations.coordinates import AT_REST
from railenv.equations.elements import Arm, point
from railenv.errors import ParameterError, UnknownNameError
from railenv.vehicles import elements

VEHICLE = railenv.HIGH_SPEED_COACH
UNDAMPED = {
    "secondary_lateral_damping": 0.0,
    "secondary_vertical_damping": 0.0,
    "primary_vertical_damping": 0.0,
}
STIFF = {
    "primary_longitudinal_stiffness": 1e10,
    "primary_lateral_stiffness": 1e10,
    "primary_vertical_stiffness": 1e10,
    "vertical_rail_stiffness": 1e11,
    "creep_factor": 100.0,  # wheelsets that do not slip sideways
}
ALL = 4.0  # springs of the secondary suspension


@pytest.fixture(scope="module")
def coach():
    return railenv.Coach(VEHICLE)


@pytest.fixture(scope="module")
def structure(coach):
    return Structure.of(coach)


@pytest.fixture(autouse=True)
def figures_closed():
    yield
    plt.close("all")


def hertz(squared):
    return math.sqrt(squared) / (2.0 * math.pi)


# ------------------------------------------------------------------------ closed forms


@pytest.fixture(scope="module")
def stiff():
    return design.modes(railenv.Coach(VEHICLE.replace(**STIFF, **UNDAMPED)), speed=5.0, highest=3.0)


def test_body_bounces_pitches_and_yaws_on_its_springs_as_closed_forms_say(stiff):
    v, h = VEHICLE, VEHICLE.body_height - VEHICLE.frame_height
    k_x, k_y, k_z = (ALL * getattr(v, f"secondary_{c}_stiffness") for c in WAYS)
    length, arm = v.half_pivot_distance, v.secondary_arm
    expected = {
        "body bounce": hertz(k_z / v.body_mass),
        "body pitch": hertz((k_z * length**2 + k_x * h**2) / v.body_pitch_inertia),
        "body yaw": hertz((k_y * length**2 + k_x * arm**2) / v.body_yaw_inertia),
    }
    for name, frequency in expected.items():
        assert stiff[name].frequency == pytest.approx(frequency, rel=0.02), name
        assert stiff[name].participation.roles["body"] > 0.99


WAYS = ("longitudinal", "lateral", "vertical")


def test_body_sways_about_the_axes_of_its_two_degrees_of_freedom(stiff):
    """Lateral motion and roll on springs below the centre of mass, which bear the weight.

    The weight stands on the springs through their middle: half of its couple with the shift of their
    tops tilts the body, and the body falls over its own height.
    """
    v, h = VEHICLE, VEHICLE.body_height - VEHICLE.frame_height
    k_y, k_z = ALL * v.secondary_lateral_stiffness, ALL * v.secondary_vertical_stiffness
    weight = v.body_mass * v.gravity
    of_tops = np.array([[k_y, weight / 2.0], [weight / 2.0, k_z * v.secondary_arm**2 - weight * h]])
    tops = np.array([[1.0, h], [0.0, 1.0]])  # how far the springs' tops move with the body
    stiffness = tops.T @ of_tops @ tops
    squared, shapes = eigh(stiffness, np.diag([v.body_mass, v.body_roll_inertia]))
    for i, name in enumerate(("body lower sway", "body upper sway")):
        assert stiff[name].frequency == pytest.approx(hertz(squared[i]), rel=0.02)
        axis = shapes[0, i] / shapes[1, i]
        assert stiff[name].roll_axis("body") == pytest.approx(axis, rel=0.02)
        assert (axis < 0.0) == (name == "body lower sway")


def test_body_bounces_and_pitches_on_both_suspensions_as_a_chain_of_masses():
    v = VEHICLE
    found = design.modes(railenv.Coach(v.replace(**UNDAMPED)), speed=5.0, highest=3.0)
    k = [
        ALL * v.secondary_vertical_stiffness,
        8.0 * v.primary_vertical_stiffness,
        8.0 * v.vertical_rail_stiffness,
    ]
    chain = np.array([[k[0], -k[0], 0.0], [-k[0], k[0] + k[1], -k[1]], [0.0, -k[1], k[1] + k[2]]])
    below = [2.0 * v.frame_mass, 4.0 * v.wheelset_mass]
    bounce = eigh(chain, np.diag([v.body_mass, *below]), eigvals_only=True)[0]
    assert found["body bounce"].frequency == pytest.approx(hertz(bounce), rel=0.02)
    reduced = v.body_pitch_inertia / v.half_pivot_distance**2
    pitch = eigh(chain, np.diag([reduced, *below]), eigvals_only=True)[0]
    assert found["body pitch"].frequency == pytest.approx(hertz(pitch), rel=0.02)


# ----------------------------------------------------------------------------- hunting


def test_body_hunting_is_told_from_bogie_hunting(coach):
    steep, flat = (design.critical_speed(coach.replace(conicity=c)) for c in (0.05, 0.02))
    assert steep.mode_shape.name == "bogie hunting, in phase"
    assert (
        str(steep) == f"bogie hunting, in phase from {steep.speed:.4f} m/s at {steep.frequency:.4f} Hz"
    )
    assert flat.mode_shape.name == "body hunting (upper sway)"
    assert str(flat).startswith("body hunting (upper sway) from ")
    assert steep.loss == flat.loss == "hunting"
    assert flat.summary()["mode"] == "body hunting (upper sway)"
    shares = [found.mode_shape.participation.roles["body"] for found in (steep, flat)]
    assert shares[0] < 0.4
    assert shares[1] > 0.6


def test_hunting_changes_from_body_to_bogie_where_the_body_has_half_of_the_energy(coach):
    conicities = [0.02, 0.025, 0.029, 0.033, 0.04, 0.1]
    found = [design.critical_speed(coach.replace(conicity=c)).mode_shape for c in conicities]
    shares = [shape.participation.roles["body"] for shape in found]
    assert shares == sorted(shares, reverse=True)
    change = np.interp(-0.5, np.negative(shares), conicities)
    assert change == pytest.approx(0.031, abs=0.001)
    for conicity, shape in zip(conicities, found, strict=True):
        assert shape.name.split(" hunting")[0] == ("body" if conicity < change else "bogie")


def test_wheelsets_that_hunt_point_where_they_go(coach):
    shape = design.critical_speed(coach).mode_shape
    for w in ("w1", "w2", "w3", "w4"):
        lead = np.angle(shape[f"psi_{w}"] / shape[f"y_{w}"])
        assert abs(lead - math.pi / 2.0) < math.pi / 4.0


def test_a_bogie_alone_hunts_without_saying_which():
    found = design.critical_speed(railenv.Bogie(VEHICLE))
    assert str(found).startswith("hunting from")
    assert found.mode_shape.name == "bogie hunting"
    dual = design.critical_speed(railenv.DualWheelset(railenv.TABLE_1))
    assert dual.mode_shape.name.startswith("wheelset hunting")


# ------------------------------------------------------------------------------- names


def named(structure, frequency=1.0, **moved):
    """Return the name of a shape of which some displacements are not zero."""
    shape = dict.fromkeys(structure.weights, 0j) | {n: complex(v) for n, v in moved.items()}
    return mode_name(shape, 2j * math.pi * frequency, structure.shares(shape))


@pytest.mark.parametrize(
    ("moved", "name"),
    [
        ({"z_body": 1.0}, "body bounce"),
        ({"theta_body": 1.0}, "body pitch"),
        ({"psi_body": 1.0}, "body yaw"),
        ({"phi_body": 1.0}, "body roll"),
        ({"y_body": 1.0}, "body lateral"),
        ({"y_body": 1.0, "phi_body": -0.5}, "body lower sway"),
        ({"y_body": 1.0, "phi_body": 0.5}, "body upper sway"),
        ({"z_b1": 1.0, "z_b2": 1.0}, "frame bounce, in phase"),
        ({"z_b1": 1.0, "z_b2": -1.0}, "frame bounce, opposite"),
        ({"theta_b1": 1.0, "theta_b2": 0.2}, "frame pitch, leading"),
        ({"theta_b1": 0.2, "theta_b2": 1.0}, "frame pitch, trailing"),
        ({"psi_b1": 1.0, "psi_b2": 1j}, "frame yaw"),
        ({"z_w1": 1.0, "z_w2": -1.0, "z_w3": -1.0, "z_w4": 1.0}, "wheelset bounce (+ - - +)"),
        ({"phi_w3": 1.0}, "wheelset roll, w3"),
        ({"y_w1": 1.0, "psi_w1": 0.1j, "y_b1": 0.9, "psi_b1": 0.1j}, "bogie hunting, leading"),
        ({"y_w1": 1.0, "psi_w1": 0.1j, "y_b1": 0.9, "y_w3": -1.0, "psi_w3": -0.1j, "y_b2": -0.9},
         "bogie hunting, opposite"),
        ({"y_w1": 1.0, "psi_w1": 0.1j}, "wheelset hunting, w1"),
        ({"y_w1": 1.0, "psi_w1": -0.1j}, "wheelset lateral, w1"),  # points away from where it goes
        ({"y_w1": 1.0, "psi_w1": 0.1j, "y_w3": 1.0, "psi_w3": 0.1j, "y_body": 0.6, "phi_body": 0.3},
         "body hunting (upper sway)"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_names_of_shapes(structure, moved, name):
    assert named(structure, **moved) == name
    assert named(structure, frequency=20.0, **moved) == name  # frequencies do not matter


def test_nothing_moves_sideways_on_the_axis_of_roll(structure):
    shape = dict.fromkeys(structure.weights, 0j) | {"y_body": 1.0 + 0j, "phi_body": 0.5 + 0j}
    axis = roll_axis(shape, structure, "body")
    here, _ = point(Arm(0.0, 0.0, axis), AT_REST._replace(y=1.0, phi=0.5))
    assert here[1] == pytest.approx(0.0)
    assert roll_axis(shape, structure, "b1") is None


def test_a_mode_that_hardly_oscillates_is_no_hunting(structure):
    shape = dict.fromkeys(structure.weights, 0j) | {"y_w1": 1.0, "psi_w1": -0.1}
    assert mode_name(shape, -5.0 + 0.1j, structure.shares(shape)) == "wheelset lateral, w1"


# ----------------------------------------------------------------------- roles, shares


def assembly(*bodies, joined):
    """Return a vehicle of some bodies (name and mass) over two wheelsets of the coach."""
    given = railenv.Bogie(VEHICLE).assembly
    inertias = {"roll_inertia": 1e3, "yaw_inertia": 1e3}
    springs = [
        elements.Spring(name=f"s{i}", between=pair, k_x=1e5, k_y=1e5, k_z=1e5)
        for i, pair in enumerate(joined)
    ]
    own = [elements.Body(name=name, mass=mass, **inertias) for name, mass in bodies]
    everything = (*given.wheelsets, *own)
    return railenv.Assembled(dataclasses.replace(given, bodies=everything, elements=tuple(springs)))


@pytest.mark.parametrize(
    ("bodies", "joined", "roles"),
    [
        ([("wagon", 2e4)], [("w1", "wagon"), ("w2", "wagon")], {"wagon": "body"}),
        ([("b", 3e3)], [("w1", "b"), ("w2", "b"), ("b", "ground")], {"b": "frame"}),
        (
            [("b", 3e3), ("bolster", 500.0), ("car", 3e4), ("motor", 1e3)],
            [("w1", "b"), ("w2", "b"), ("b", "bolster"), ("bolster", "car"), ("b", "motor")],
            {"b": "frame", "bolster": "other", "car": "body", "motor": "other"},
        ),
        (
            [("wagon", 2e4), ("tank", 500.0)],
            [("w1", "wagon"), ("w2", "wagon"), ("wagon", "tank")],
            {"wagon": "body", "tank": "other"},
        ),
    ],
    ids=["two-axle wagon", "bogie", "bolster and motor", "equipment under a wagon"],
)
def test_roles_follow_from_what_joins_the_bodies(bodies, joined, roles):
    model = assembly(*bodies, joined=joined)
    assert roles_of(model) == {"w1": "wheelset", "w2": "wheelset", **roles}


def test_other_masses_keep_their_names():
    model = assembly(
        ("b", 3e3), ("motor", 1e3), joined=[("w1", "b"), ("w2", "b"), ("b", "ground"), ("b", "motor")]
    )
    assert named(Structure.of(model), z_motor=1.0) == "motor bounce"


def test_shares_are_those_of_the_kinetic_energy():
    model = railenv.Bogie(VEHICLE)
    shape = design.critical_speed(model).mode_shape
    v = VEHICLE
    masses = {
        "w": (v.wheelset_mass, v.wheelset_mass, v.wheelset_roll_inertia, v.wheelset_yaw_inertia),
        "b": (v.frame_mass, v.frame_mass, v.frame_roll_inertia, v.frame_yaw_inertia),
    }
    energy = {
        f"{c}_{body}": masses[body[0]][i] * abs(shape.eigenvalue * shape[f"{c}_{body}"]) ** 2
        for body in ("w1", "w2", "b")
        for i, c in enumerate(("y", "z", "phi", "psi"))
    }
    total = sum(energy.values())
    for name, part in energy.items():
        assert shape.participation.shares[name] == pytest.approx(part / total)
    assert sum(shape.participation.bodies.values()) == pytest.approx(1.0)
    assert shape.participation.roles["frame"] == shape.participation.bodies["b"]
    assert shape.participation.measure == "kinetic energy"
    with pytest.raises(UnknownNameError, match="w3"):
        shape.participation.of(["w3"])


def test_equations_of_ones_own_share_amplitudes_and_say_so():
    model = railenv.CooperriderBogie()
    found = design.modes(model, speed=66.0)
    assert found.measure == "squared amplitude"
    assert "squared amplitude" in str(found)
    assert design.critical_speed(model).mode_shape.name == "bogie hunting"

    def oscillator(x, u, speed, curvature, cant, p):
        return [x[1], -p.k * x[0] - 0.1 * x[1]]

    plain = railenv.Model("oscillator", ["s", "rate"], [], oscillator, {"k": 4.0})
    (shape,) = design.modes(plain, speed=1.0)
    assert (shape.name, shape.participation) == ("rate", None)
    assert not shape.vertical


def test_actuators_and_sensors_change_no_names():
    bogie = railenv.Bogie(VEHICLE)
    plain = design.modes(bogie, speed=100.0, highest=3.5)
    equipped = design.modes(railenv.Equipped(bogie), speed=100.0, highest=3.5)
    assert plain["bogie hunting"].frequency == pytest.approx(
        equipped["bogie hunting"].frequency, rel=1e-2
    )
    assert equipped["bogie hunting"].participation.structure.roles["b"] == "frame"


# ------------------------------------------------------------------------------- table


def test_table_has_the_oscillating_poles_of_the_linear_model(coach):
    found = design.modes(coach, speed=60.0, radius=3000.0, cant=0.05)
    poles = design.linearize(coach, speed=60.0, radius=3000.0, cant=0.05).poles()
    upper = np.sort(poles[poles.imag > 1e-6].imag)
    np.testing.assert_allclose([s.eigenvalue.imag for s in found], upper, rtol=1e-6)
    assert len(found) == len(upper)
    assert len(design.modes(coach, speed=60.0, radius=3000.0, cant=0.05, highest=3.0)) < len(upper)


def test_table_tells_names_and_shares(coach):
    found = design.modes(coach, speed=20.0, highest=3.0)
    assert found.names[-2:] == ("body bounce", "body pitch")
    assert found.parts == ("wheelsets", "frames", "body")
    row = found.rows()[-1]
    assert row["mode"] == "body pitch"
    assert row["wheelsets"] + row["frames"] + row["body"] == pytest.approx(1.0)
    assert "body pitch" in str(found).splitlines()[-1]
    with pytest.raises(UnknownNameError, match="body pitsch"):
        found["body pitsch"]
    with pytest.raises(UnknownNameError, match="cab"):
        found["body pitch"].roll_axis("cab")


@pytest.mark.parametrize("wrong", [{"speed": -1.0}, {"speed": 10.0, "highest": 0.0}])
def test_bad_numbers_are_told(coach, wrong):
    with pytest.raises(ParameterError, match=r"speed|highest"):
        design.modes(coach, **wrong)


# ---------------------------------------------------------------------------- pictures


def test_table_is_drawn_with_a_bar_for_every_mode(coach, tmp_path):
    found = design.modes(coach, speed=20.0, highest=3.0)
    drawn = found.plot()
    labels = [text.get_text() for text in drawn.axes[0, 0].get_yticklabels()]
    assert labels == list(found.names)
    widths = np.sum([[bar.get_width() for bar in bars] for bars in drawn.axes[0, 0].containers], axis=0)
    np.testing.assert_allclose(widths, 1.0)
    drawn.figure.savefig(tmp_path / "modes.png")
    nothing = design.modes(coach, speed=20.0, highest=1e-5)
    with pytest.raises(ParameterError, match="no oscillating modes"):
        nothing.plot()


def body_line(ax):
    """Return the corners of the vehicle's body in some axes."""
    (line,) = [line for line in ax.lines if line.get_linestyle() == "--"]
    return np.array(line.get_data())


def test_lateral_modes_are_seen_from_above_and_from_behind(coach, tmp_path):
    shape = design.modes(coach, speed=20.0, highest=3.0)["body lower sway"]
    drawn = shape.plot(phases=(0.0, 90.0))
    assert drawn.axes.shape == (2, 2)
    assert "body lower sway" in drawn.figure.get_suptitle()
    across, up = body_line(drawn.axes[0, 1])
    roof, floor = across[up > up.mean()], across[up < up.mean()]
    # the body leans the way it moves: y is to the left
    assert np.sign(-roof.mean()) == np.sign(shape.at(0.0)[shape.names.index("y_body")])
    assert abs(roof.mean()) > abs(floor.mean())
    drawn.figure.savefig(tmp_path / "sway.png")
    single = shape.plot(ax=drawn.axes[0, 0])
    assert "body lower sway" in single.axes[0, 0].get_title(loc="left")


def test_vertical_modes_are_seen_from_the_side(coach):
    shape = design.modes(coach, speed=20.0, highest=3.0)["body pitch"]
    assert shape.vertical
    drawn = shape.plot(phases=(0.0,))
    along, up = body_line(drawn.axes[0, 0])
    roof = up > up.mean()
    front, back = up[roof & (along > 0.0)].mean(), up[roof & (along < 0.0)].mean()
    theta = shape.at(0.0)[shape.names.index("theta_body")]
    assert np.sign(back - front) == np.sign(theta)  # positive pitch is nose down


def test_a_whole_vehicle_is_animated(coach, tmp_path):
    found = design.critical_speed(coach)
    file = tmp_path / "coach.gif"
    found.mode_shape.animate(frames=2).save(file, writer="pillow")
    assert file.stat().st_size > 0


def test_what_stands_between_is_drawn_small():
    model = assembly(
        ("b", 3e3), ("motor", 1e3), joined=[("w1", "b"), ("w2", "b"), ("b", "ground"), ("b", "motor")]
    )
    geometry = geometry_of(model)
    by_name = {body.name: body for body in geometry.bodies}
    assert by_name["motor"].half_length < by_name["b"].half_length
    assert [body.name for body in geometry.frames] == ["b"]
