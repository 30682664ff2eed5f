"""Actuators and sensors as part of the plant's equations."""

import math
from types import SimpleNamespace

import control
import numpy as np
import pytest

import design
import railenv
from railenv.errors import ParameterError

COACH = railenv.Bogie(railenv.HIGH_SPEED_COACH)
DUAL = railenv.DualWheelset(railenv.TABLE_1)
CASES = [(COACH, "none"), (COACH, "secondary"), (COACH, "primary"), (DUAL, "none"), (DUAL, "primary")]
equipped = pytest.mark.parametrize(
    ("plant", "place"), CASES, ids=[f"{plant.name}-{place}" for plant, place in CASES]
)


def yaw(first, second="ground", **changes):
    return railenv.YawActuator(
        between=(first, second), actuator=railenv.Actuator.secondary().replace(**changes)
    )


def lateral(first, second="ground", **place):
    actuator = railenv.Actuator.secondary().replace(limit=10e3)
    return railenv.LateralActuator(between=(first, second), actuator=actuator, **place)


def delays(*values):
    given = [yaw(b, delay=d) for b, d in zip(("b", "w1"), values, strict=True)]
    return railenv.Equipped(COACH, actuators=given)


def swing(x, u, speed, curvature, cant, p):
    y, psi, dy, dpsi = x
    return [dy, dpsi, -p.k * y - speed * psi, -p.k * psi + y + u[0] / p.I]


NAMES = (["y", "psi", "dy", "dpsi"], ["M"], swing, {"k": 40.0, "I": 900.0})


def silent():
    return railenv.Model("silent", *NAMES)


def wheelset():
    body = railenv.MovingBody(name="w", y="y", psi="psi", yaw_moment="M")
    return railenv.Model("swing", *NAMES, bodies=[body])


def random_point(model, seed):
    rng = np.random.default_rng(seed)
    x = model.scale * rng.standard_normal(model.n_states)
    x[[i for i, name in enumerate(model.state_names) if name.startswith("z_")]] -= 1e-3
    u = np.array([1e3 if n[0] in "Mc" and n[:2] != "cr" else 1e-4 for n in model.input_names])
    return x, u * rng.standard_normal(model.n_inputs)


@equipped
def test_jacobian_equals_complex_step_of_the_equations(plant, place):
    model = railenv.Equipped(plant, place, railenv.Actuator.secondary().replace(parallel_damping=1e5))
    x, u = random_point(model, 1)
    A, B = model.jacobian(x, u, speed=60.0, curvature=1e-3, cant=0.05)
    exact = np.hstack([A, B])
    v = np.concatenate([x, u]).tolist()
    n = model.n_states
    for j in range(len(v)):
        z = [complex(a) for a in v]
        z[j] += 1e-30j
        column = np.imag(model.plain_rhs(z[:n], z[n:], 60.0, 1e-3, 0.05)) / 1e-30
        scale = np.abs(exact).max(axis=1)
        assert (np.abs(exact[:, j] - column) <= 1e-9 * scale).all(), model.state_names


@equipped
def test_signals_of_the_kernel_are_those_of_the_equations(plant, place):
    model = railenv.Equipped(plant, place)
    x, u = random_point(model, 2)
    kernel = model.signals(x, u, speed=60.0, curvature=1e-3, cant=0.05)
    plain = model.equipment.signals(
        x.tolist(), u.tolist(), 60.0, 1e-3, 0.05, SimpleNamespace(**model.parameters)
    )
    np.testing.assert_allclose(kernel, plain, rtol=1e-10, atol=1e-6)
    assert len(model.signal_names) == len(plain)


@equipped
def test_idle_equipment_leaves_the_critical_speed_alone(plant, place):
    bare = design.critical_speed(plant, speed_range=(3.0, 250.0))
    carried = design.critical_speed(railenv.Equipped(plant, place), speed_range=(3.0, 250.0))
    assert carried.loss == bare.loss
    assert carried.speed == pytest.approx(bare.speed, rel=1e-7)


def test_lag_is_a_second_order_system_of_the_given_bandwidth_and_damping():
    model = railenv.Equipped(COACH, "secondary")
    linear = design.linearize(model, speed=50.0, outputs=["T_b"])
    omega = 2 * math.pi * model.actuator.bandwidth
    lag = control.tf([omega**2], [1, 2 * model.actuator.damping * omega, omega**2])
    k = model.input_names.index("command_b")
    for w in (1.0, 30.0, omega, 500.0):
        assert complex(linear(1j * w)[0, k]) == pytest.approx(complex(lag(1j * w)), rel=1e-9)


def step_response(model, command):
    """Simulate a step of the command from the equilibrium without one."""
    rest = railenv.find_equilibrium(model, speed=50.0).state
    return railenv.simulate(
        model, speed=50.0, duration=0.1, initial_state=rest, inputs={"command_b": command}
    )


def test_applied_moment_stays_within_its_limit_though_the_lag_overshoots():
    model = railenv.Equipped(COACH, "secondary")
    response = step_response(model, 1e6)
    developed = response.outputs[model.state_names.index("T_b")]
    assert developed.max() > 1.01 * model.actuator.limit  # damping 0.7 overshoots by 4.6 %
    # the plant feels the limit: the same as a constant moment, once the lag has settled
    held = model.rhs(response.outputs[:, -1], speed=50.0)
    x = response.outputs[:, -1].copy()
    x[model.state_names.index("T_b")] = 5.0 * model.actuator.limit
    pushed = model.rhs(x, speed=50.0)
    np.testing.assert_allclose(pushed[:24], held[:24], rtol=1e-6, atol=1e-6)


def test_rate_limit_bounds_the_rise_of_the_moment():
    slow = railenv.Actuator.secondary().replace(rate_limit=1e5)
    model = railenv.Equipped(COACH, "secondary", slow)
    response = step_response(model, 26e3)
    rise = np.diff(response.outputs[model.state_names.index("T_b")]) / np.diff(response.time)
    assert rise.max() <= 1e5 * (1 + 1e-9)
    assert rise.max() == pytest.approx(1e5, rel=1e-6)


def test_primary_actuators_react_on_the_frame():
    model = railenv.Equipped(COACH, "primary")
    x = np.zeros(model.n_states)
    base = model.rhs(x, speed=50.0)
    x[model.state_names.index("T_w1")] = 1e3
    change = model.rhs(x, speed=50.0) - base
    v = COACH.vehicle
    i, j = (model.state_names.index(n) for n in ("dpsi_w1", "dpsi_b"))
    assert change[i] * v.wheelset_yaw_inertia == pytest.approx(1e3)
    assert change[j] * v.frame_yaw_inertia == pytest.approx(-1e3)


def test_parallel_damper_is_linear_for_small_and_flat_for_large_rates():
    damped = railenv.Actuator.secondary().replace(parallel_damping=2.45e6, parallel_force_limit=9.8e3)
    model, bare = (railenv.Equipped(COACH, "secondary", a) for a in (damped, None))
    i = model.state_names.index("dpsi_b")

    def moment(rate):
        x = np.zeros(model.n_states)
        x[i] = rate
        pair = (m.rhs(x, speed=50.0)[i] for m in (model, bare))
        return -(next(pair) - next(pair)) * COACH.vehicle.frame_yaw_inertia

    assert moment(1e-6) == pytest.approx(2 * 2.45e6 * 1.3**2 * 1e-6, rel=1e-3)
    assert moment(1.0) == pytest.approx(2 * 9.8e3 * 1.3, rel=1e-3)
    assert moment(-1.0) == pytest.approx(-moment(1.0))


def test_sensors_at_rest_in_a_curve_read_cant_deficiency_and_the_tracks_own_turning():
    model = railenv.Equipped(COACH, "secondary")
    speed, radius, cant = 60.0, 4000.0, 0.03
    found = railenv.find_equilibrium(model, speed=speed, radius=radius, cant=cant)
    uncompensated = speed**2 / radius - 9.81 * cant
    assert found["accel_b"] == pytest.approx(9.81 * found["phi_b"] - uncompensated, rel=1e-9)
    assert found["gyro_b"] == pytest.approx(-speed / radius, rel=1e-9)
    plant = railenv.find_equilibrium(COACH, speed=speed, radius=radius, cant=cant).state
    settled = model.steady_state(plant, speed=speed, curvature=1 / radius, cant=cant)
    np.testing.assert_allclose(settled, found.state, atol=1e-12)


def test_guiding_forces_and_loads_balance_the_lateral_force_and_the_weight_on_a_curve():
    model = railenv.Equipped(COACH, "none")
    speed, radius, cant = 60.0, 4000.0, 0.03
    state = railenv.find_equilibrium(model, speed=speed, radius=radius, cant=cant).state
    signals = model.signals(state, speed=speed, curvature=1 / radius, cant=cant)
    named = dict(zip(model.signal_names, signals, strict=True))
    v = COACH.vehicle
    mass = 2 * v.wheelset_mass + v.frame_mass + v.body_mass / 2
    guiding = sum(named[f"Y_left_w{i}"] - named[f"Y_right_w{i}"] for i in (1, 2))
    # what the secondary springs take against a body at rest in the track frame
    spring = 2 * v.secondary_lateral_stiffness * state[model.state_names.index("y_b")]
    lateral = mass * (speed**2 / radius - v.gravity * cant)
    assert guiding + spring == pytest.approx(lateral, rel=1e-9)
    loads = sum(value for name, value in named.items() if name.startswith("Q"))
    assert loads == pytest.approx(mass * (v.gravity + speed**2 / radius * cant), rel=1e-9)


def test_linear_model_of_the_equipped_vehicle_sees_the_sensors_filters():
    model = railenv.Equipped(COACH, "secondary", sensors=railenv.Sensors.ideal())
    system = design.linearize(model, speed=80.0, outputs=["gyro_b"])
    assert system.output_labels == ["gyro_b"]
    plant = design.linearize(COACH, speed=80.0, outputs=["dpsi_b"])
    k, m = model.input_names.index("M_b"), COACH.input_names.index("M_b")
    w = 20.0
    slow = 1.0 / (1.0 + 1j * w / (2 * math.pi * 1e3))
    assert complex(system(1j * w)[0, k]) == pytest.approx(complex(plant(1j * w)[0, m]) * slow, rel=1e-6)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: railenv.Equipped(DUAL, "secondary"), "'none', 'primary'"),
        (lambda: railenv.Equipped(COACH, "roof"), "place is 'roof'"),
        (lambda: railenv.Equipped(railenv.Equipped(COACH)), "without equipment"),
        (lambda: railenv.Equipped(silent()), "does not say which of its states are whose motion"),
        (lambda: railenv.Equipped(COACH, sensed=["roof"]), "unknown sensed body: 'roof'"),
        (lambda: railenv.Equipped(COACH, actuators=[yaw("b", "roof")]), "unknown body of actuator b"),
        (lambda: railenv.Equipped(COACH, actuators=[yaw("b"), yaw("b", "w1")]), "names must differ"),
        (lambda: railenv.Equipped(COACH, "none", actuators=[yaw("b")]), "either them or these"),
        (lambda: railenv.Equipped(COACH, actuators=[5.0]), "actuators has 5.0"),
        (lambda: railenv.YawActuator(between=("b", "b")), "must be the names of two bodies"),
        (lambda: railenv.Equipped(COACH, "both").actuator, "2 kinds of actuators"),
        (lambda: delays(0.0, 0.01), "delays of the actuators are 0, 0.01 s"),
        (lambda: railenv.Equipped(wheelset(), actuators=[lateral("w")]), "no lateral_force"),
        (lambda: railenv.Equipped(railenv.HIGH_SPEED_COACH), "must be a railenv.Model without equip"),
        (lambda: railenv.Equipped(COACH, actuator=5.0), "must be a railenv.Actuator"),
        (lambda: railenv.Actuator.secondary().replace(delay=-0.01), "delay is -0.01 s"),
        (lambda: railenv.Actuator.primary().replace(limit=0.0), "limit is 0 N m"),
        (lambda: railenv.Sensors.standard().replace(gyro_noise=math.nan), "gyro_noise is nan"),
    ],
)
def test_impossible_equipment_is_refused(build, message):
    with pytest.raises(ParameterError, match=message):
        build()


def test_replace_changes_the_vehicle_and_keeps_the_equipment():
    model = railenv.Equipped(COACH, "secondary").replace(conicity=0.2)
    assert model.plant.vehicle.conicity == 0.2
    assert model.place == "secondary"


# ------------------------------------------------------------- any model, any actuators


def momentum(model, name, value):
    """Rates of momentum that one actuator's state adds: lateral, and about the track's origin."""
    v = COACH.vehicle
    x = np.zeros(model.n_states)
    base = model.rhs(x, speed=50.0)
    x[model.state_names.index(name)] = value
    change = dict(zip(model.state_names, model.rhs(x, speed=50.0) - base, strict=True))
    mass = {"w1": v.wheelset_mass, "w2": v.wheelset_mass, "b": v.frame_mass}
    yaw = {"w1": v.wheelset_yaw_inertia, "w2": v.wheelset_yaw_inertia, "b": v.frame_yaw_inertia}
    roll = {"w1": v.wheelset_roll_inertia, "w2": v.wheelset_roll_inertia, "b": v.frame_roll_inertia}
    place = {"w1": v.half_wheelbase, "w2": -v.half_wheelbase, "b": 0.0}
    height = {"w1": 0.0, "w2": 0.0, "b": v.frame_height}
    force = {b: mass[b] * change[f"dy_{b}"] for b in mass}
    about_z = sum(yaw[b] * change[f"dpsi_{b}"] + place[b] * force[b] for b in mass)
    about_x = sum(roll[b] * change[f"dphi_{b}"] - height[b] * force[b] for b in mass)
    return force, about_z, about_x


def test_all_yaw_actuators_at_once_have_numbers_of_their_own():
    model = railenv.Equipped(COACH, "both")
    assert model.command_names == ("command_w1", "command_w2", "command_b")
    assert model.limits.tolist() == [5e3, 5e3, 26e3]
    weak = model.replace(primary_limit=1e3, conicity=0.1)
    assert weak.limits.tolist() == [1e3, 1e3, 26e3]
    assert weak.plant.vehicle.conicity == 0.1
    assert weak.structure == model.structure
    secondary = railenv.Equipped(COACH, "secondary")
    x, u = np.zeros(model.n_states), np.zeros(secondary.n_states)
    x[model.state_names.index("T_b")] = u[secondary.state_names.index("T_b")] = 2e3
    np.testing.assert_allclose(model.rhs(x, speed=50.0)[:24], secondary.rhs(u, speed=50.0)[:24])


def test_lateral_actuator_between_two_bodies_keeps_the_momentum_and_has_its_arms():
    model = railenv.Equipped(COACH, actuators=[lateral("b", "w1", x=0.3, z=0.1)], sensed=["w1", "b"])
    assert model.state_names[24:] == ("F_b", "dF_b", "accel_w1", "gyro_w1", "accel_b", "gyro_b")
    force, about_z, about_x = momentum(model, "F_b", 1e3)
    assert force["b"] == pytest.approx(1e3)
    assert force["w1"] == pytest.approx(-1e3)
    assert force["w2"] == pytest.approx(0.0, abs=1e-9)
    assert about_z == pytest.approx(0.0, abs=1e-9)
    assert about_x == pytest.approx(0.0, abs=1e-9)


def test_lateral_actuator_against_the_ground_turns_the_frame_about_its_arm():
    model = railenv.Equipped(COACH, actuators=[lateral("b", x=0.3, z=0.1)])
    force, about_z, about_x = momentum(model, "F_b", 1e3)
    assert force["b"] == pytest.approx(1e3)
    assert about_z == pytest.approx(0.3 * 1e3)
    assert about_x == pytest.approx(-0.1 * 1e3)
    moved = model.replace(b_x=0.0)
    assert momentum(moved, "F_b", 1e3)[1] == pytest.approx(0.0, abs=1e-9)


def test_equations_of_ones_own_carry_actuators_and_sensors():
    model = railenv.Equipped(wheelset(), actuators=[yaw("w")])
    assert model.state_names == ("y", "psi", "dy", "dpsi", "T_w", "dT_w", "accel_w", "gyro_w")
    x = np.zeros(8)
    x[4] = 1800.0
    assert model.rhs(x, speed=20.0)[3] == pytest.approx(2.0)
    linear = design.linearize(model, speed=20.0, outputs=["dpsi"])
    assert abs(complex(linear(0.5j)[0, model.input_names.index("command_w")])) > 0.0


def test_actuators_of_the_cooperrider_bogie_react_once():
    plant = railenv.CooperriderBogie()
    model = railenv.Equipped(plant, "primary")
    x = np.zeros(model.n_states)
    base = model.rhs(x, speed=50.0)
    x[model.state_names.index("T_w1")] = 1e3
    change = dict(zip(model.state_names, model.rhs(x, speed=50.0) - base, strict=True))
    p = plant.record
    assert change["dpsi_w1"] * p.wheelset_yaw_inertia == pytest.approx(1e3)
    assert change["dpsi_b"] * p.frame_yaw_inertia == pytest.approx(-1e3)
    lifted = railenv.Equipped(plant, actuators=[yaw("w1")])  # against the ground: none on the frame
    base = lifted.rhs(np.zeros(lifted.n_states), speed=50.0)
    x = np.zeros(lifted.n_states)
    x[lifted.state_names.index("T_w1")] = 1e3
    change = dict(zip(lifted.state_names, lifted.rhs(x, speed=50.0) - base, strict=True))
    assert change["dpsi_w1"] * p.wheelset_yaw_inertia == pytest.approx(1e3)
    assert change["dpsi_b"] == pytest.approx(0.0, abs=1e-12)


def two_masses(x, u, speed, curvature, cant, p):
    a, b, da, db = x
    return [da, db, -p.k * a + u[0], -p.k * b + u[1]]


def test_the_same_equations_with_other_bodies_have_kernels_of_their_own():
    found = []
    for own in ("F_a", "F_b"):
        body = railenv.MovingBody(name="w", y=own[-1], lateral_force=own)
        plant = railenv.Model(
            "two masses", ["a", "b", "da", "db"], ["F_a", "F_b"], two_masses, {"k": 4.0}, bodies=[body]
        )
        model = railenv.Equipped(plant, actuators=[lateral("w")])
        x = np.zeros(model.n_states)
        x[model.state_names.index("F_w")] = 3.0
        found.append(model.rhs(x, speed=20.0)[2:4].tolist())
    assert found == [[3.0, 0.0], [0.0, 3.0]]


# ---------------------------------------------------------------- the usual lateral actuators


def test_usual_lateral_actuators_stand_at_the_secondary_springs():
    usual = railenv.Equipped(COACH, "lateral")
    v = COACH.vehicle
    given = railenv.LateralActuator(
        between=("b", "ground"), actuator=railenv.Actuator.lateral(), z=v.frame_height
    )
    own = railenv.Equipped(COACH, actuators=[given])
    assert usual.parameters == own.parameters
    assert usual.state_names == own.state_names
    x, u = random_point(usual, 4)
    np.testing.assert_array_equal(usual.rhs(x, u, speed=60.0), own.rhs(x, u, speed=60.0))
    assert usual.limits == [20e3]


def test_usual_place_follows_the_vehicle_and_a_given_one_stays():
    model = railenv.Equipped(COACH, "lateral")
    assert model.replace(frame_height=0.5).parameters["b_z"] == 0.5
    moved = model.replace(b_z=0.3)
    assert moved.replace(frame_height=0.5).parameters["b_z"] == 0.3
    assert model.replace(friction=0.3).parameters["b_z"] == model.parameters["b_z"]


def test_lateral_actuators_need_a_frame_or_an_input_of_ones_own():
    with pytest.raises(ParameterError, match="'none', 'primary'"):
        railenv.Equipped(DUAL, "lateral")
    names = (["y", "dy"], ["F"], lambda x, u, *_: [x[1], u[0] - x[0]], {"k": 1.0})
    pushed = railenv.MovingBody(name="f", y="y", lateral_force="F", x=2.0)
    model = railenv.Equipped(railenv.Model("pushed", *names, bodies=[pushed]), "lateral")
    assert model.command_names == ("command_f",)
    assert (model.parameters["f_x"], model.parameters["f_z"]) == (2.0, 0.0)
    still = railenv.Model("still", *names, bodies=[railenv.MovingBody(name="f", y="y")])
    with pytest.raises(ParameterError, match="actuators of a still are at 'none'"):
        railenv.Equipped(still, "lateral")
