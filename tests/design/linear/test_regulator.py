"""Regulators and Kalman filters against the equations that define them, and against simulation."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov

import agents
import design
import railenv
from design.linear.regulator import scales
from railenv.errors import ParameterError, UnknownNameError

COACH = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))
DUAL = railenv.Equipped(railenv.DualWheelset(railenv.TABLE_1), "primary")
CASES = [pytest.param(COACH, 160.0, id="bogie"), pytest.param(DUAL, 50.0, id="dual wheelset")]
FAST = 160.0  # m/s, where the coach alone hunts


def by_size(values):
    return np.sort(np.abs(values))[::-1]


def magnitudes(model, system):
    """Typical magnitude of each state: what makes the equations of a like size."""
    known = dict(zip(model.state_names, model.scale, strict=True))
    limit = 1e-3 * model.actuator.limit
    return np.array([known.get(label, limit) for label in system.state_labels])


# ------------------------------------------------------------------------ the lateral model


@pytest.mark.parametrize(("model", "speed"), CASES)
def test_lateral_motion_is_independent_of_the_rest_on_tangent_track(model, speed):
    full = design.linearize(model, speed=speed)
    sampled = design.lateral_model(model, speed=speed)
    lateral = [n in sampled.state_labels for n in full.state_labels]
    sensors = [n in model.sensor_names for n in full.state_labels]
    rest = ~(np.array(lateral) | sensors)
    scale = model.scale
    A = full.A * scale / scale[:, None]
    assert np.abs(A[np.ix_(lateral, rest)]).max() < 1e-9 * np.abs(A[np.ix_(lateral, lateral)]).max()
    expected = np.exp(np.linalg.eigvals(full.A[np.ix_(lateral, lateral)]) * sampled.dt)
    n = sum(lateral)
    assert by_size(np.linalg.eigvals(sampled.A[:n, :n])) == pytest.approx(by_size(expected), rel=1e-6)


def test_lateral_model_has_the_commands_on_their_way_and_the_readings():
    late = design.lateral_model(COACH.replace(delay=0.012), speed=FAST, sensors=True)
    assert list(late.state_labels[-3:]) == ["command_b[-1]", "command_b[-2]", "command_b[-3]"]
    assert list(late.output_labels) == ["accel_b", "gyro_b"]
    prompt = design.lateral_model(COACH.replace(delay=0.0), speed=FAST)
    assert not any("[" in label for label in prompt.state_labels)


# ------------------------------------------------------------------------ regulators


@pytest.mark.parametrize(("model", "speed"), CASES)
def test_regulator_satisfies_the_riccati_equation(model, speed):
    r = design.lqr(model, speed=speed)
    A, B, P, Q, R = r.system.A, r.system.B, r.cost, r.state_weight, r.command_weight
    T = magnitudes(model, r.system)  # entries as costs of typical deviations
    inner = R + B.T @ P @ B
    K = np.linalg.solve(inner, B.T @ P @ A)
    residual = (A.T @ P @ A - A.T @ P @ B @ K + Q - P) * T * T[:, None]
    assert np.abs(residual).max() < 1e-7 * np.abs(P * T * T[:, None]).max()
    error = np.abs((r.gain - K) * T).max()
    assert error < 1e-6 * np.abs(r.gain * T).max()


@pytest.mark.parametrize(("model", "speed"), CASES)
def test_cost_is_the_lyapunov_sum_of_the_closed_loop(model, speed):
    r = design.lqr(model, speed=speed)
    T = magnitudes(model, r.system)
    loop = (r.system.A - r.system.B @ r.gain) * T / T[:, None]
    weight = (r.state_weight + r.gain.T @ r.command_weight @ r.gain) * T * T[:, None]
    P = solve_discrete_lyapunov(loop.T, weight)
    assert np.diag(P) == pytest.approx(np.diag(r.cost) * T**2, rel=1e-6)


def test_no_other_gain_costs_less():
    r = design.lqr(COACH, speed=FAST)
    T = magnitudes(COACH, r.system)
    rng = np.random.default_rng(1)
    for size in (0.01, 0.1, 0.3):
        K = r.gain * (1.0 + size * rng.uniform(-1.0, 1.0, r.gain.shape))
        loop = (r.system.A - r.system.B @ K) * T / T[:, None]
        weight = (r.state_weight + K.T @ r.command_weight @ K) * T * T[:, None]
        excess = solve_discrete_lyapunov(loop.T, weight) - r.cost * T * T[:, None]
        eigenvalues = np.linalg.eigvalsh(0.5 * (excess + excess.T))
        assert eigenvalues.max() > 0.0
        assert eigenvalues.min() > -1e-7 * np.abs(r.cost * T * T[:, None]).max()


@pytest.mark.parametrize(("model", "speed"), CASES)
def test_multipliers_do_not_depend_on_the_units_of_the_design(model, speed):
    r = design.lqr(model, speed=speed)
    assert by_size(r.multipliers)[0] < 1.0
    in_si = np.linalg.eigvals(r.system.A - r.system.B @ r.gain)
    assert by_size(in_si)[:8] == pytest.approx(by_size(r.multipliers)[:8], rel=1e-6)
    T = np.diag(r.cost) ** -0.5  # other units: each state by what it costs
    A, B = r.system.A * T / T[:, None], r.system.B * model.actuator.limit / T[:, None]
    R = r.command_weight * model.actuator.limit**2
    P = solve_discrete_are(A, B, r.state_weight * T * T[:, None], R)
    K = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    other = np.linalg.eigvals(A - B @ K)
    assert by_size(other)[:8] == pytest.approx(by_size(r.multipliers)[:8], rel=1e-5)


def test_multipliers_are_among_those_of_the_vehicle_under_the_controller():
    r = design.lqr(COACH, speed=FAST)
    controller = agents.LQR.design(COACH, speed=FAST)
    found = design.closed_loop(COACH, controller, speed=FAST).multipliers
    for value in r.multipliers[np.abs(r.multipliers) > 0.5]:
        assert np.abs(found - value).min() < 1e-6


def test_expensive_control_only_mirrors_what_is_unstable_into_the_unit_circle():
    r = design.lqr(COACH, speed=FAST, weights=design.Weights(moment=1e-4))
    own = np.linalg.eigvals(r.system.A)
    unstable = np.abs(own) > 1.0
    assert unstable.sum() == 2
    mirrored = own.copy()
    mirrored[unstable] = 1.0 / np.conj(own[unstable])
    assert by_size(r.multipliers)[:8] == pytest.approx(by_size(mirrored)[:8], rel=1e-3)


def test_cheaper_moments_cost_less_and_are_larger():
    costs, gains = [], []
    for moment in (0.3, 1.0, 3.0):
        r = design.lqr(COACH, speed=FAST, weights=design.Weights(moment=moment))
        start = np.array([1e-3 * n.startswith("y_") for n in r.system.state_labels])
        costs.append(start @ r.cost @ start)
        gains.append(np.abs(r.gain @ start).max())
    assert costs[0] > costs[1] > costs[2]
    assert gains[0] < gains[1] < gains[2]


# ------------------------------------------------------------------------ Kalman filters


def noises(model, observer, d):
    """What enters each period: factor of the states' covariance, and deviations of the readings."""
    m, p = len(model.command_names), observer.system.noutputs
    n = observer.system.nstates
    G = np.zeros((n + p, 2 + m + p))
    G[:n, :2] = d.alignment * observer.system.B[:, m:]
    prompt = design.lateral_model(model.replace(delay=0.0), speed=observer.speed, sensors=True)
    G[: prompt.nstates, 2 : 2 + m] = d.moment * model.actuator.limit * prompt.B
    G[n:, 2 + m :] = np.diag([d.accelerometer_drift, d.gyro_drift] * (p // 2))
    floor = np.append(scales(model, observer.system), np.full(p, 0.1)) * np.sqrt(1e-9)
    G = np.hstack([G, np.diag(floor)])  # the floor that Disturbances tells of
    sensors = model.sensors
    return G, np.array([sensors.accelerometer_noise, sensors.gyro_noise] * (p // 2))


@pytest.mark.parametrize(("model", "speed"), CASES)
def test_innovations_of_a_simulated_filter_are_white_and_as_large_as_they_must_be(model, speed):
    d = design.Disturbances()
    o = design.kalman(model, speed=speed, disturbances=d)
    G, noise = noises(model, o, d)
    slow = o.A - o.A @ o.M @ o.C
    assert np.abs(np.linalg.eigvals(slow)).max() < 1.0
    rng = np.random.default_rng(3)
    error, innovations = np.zeros(len(o.A)), []
    for _ in range(24000):  # the error of the estimate; the motion itself may be unstable
        e = o.C @ error + noise * rng.standard_normal(len(noise))
        innovations.append(e)
        error = o.A @ (error - o.M @ e) + G @ rng.standard_normal(G.shape[1])
    e = np.array(innovations[4000:])
    deviation = e.std(axis=0)
    for lag in (1, 2, 5, 20):
        correlation = (e[lag:].T @ e[:-lag]) / len(e) / np.outer(deviation, deviation)
        assert np.abs(correlation).max() < 5.0 / np.sqrt(len(e)), lag
    T = np.append(magnitudes(model, o.system), np.full(len(noise), 0.1))
    Q = (G @ G.T + o.A @ o.M @ np.diag(noise**2) @ o.M.T @ o.A.T) / T / T[:, None]
    P = solve_discrete_lyapunov(slow * T / T[:, None], Q) * T * T[:, None]
    S = o.C @ P @ o.C.T + np.diag(noise**2)
    assert deviation == pytest.approx(np.sqrt(np.diag(S)), rel=0.03)


@pytest.mark.parametrize(("model", "speed"), CASES)
def test_filter_of_any_other_gain_estimates_worse(model, speed):
    d = design.Disturbances()
    o = design.kalman(model, speed=speed, disturbances=d)
    G, noise = noises(model, o, d)
    T = np.append(magnitudes(model, o.system), np.full(len(noise), 0.1))

    def deviations(M):
        slow = o.A - o.A @ M @ o.C
        Q = (G @ G.T + o.A @ M @ np.diag(noise**2) @ M.T @ o.A.T) / T / T[:, None]
        P = solve_discrete_lyapunov(slow * T / T[:, None], Q)
        return np.sqrt(np.diag(P)[: model.n_states])

    best = deviations(o.M)
    rng = np.random.default_rng(2)
    for size in (0.05, 0.2):
        other = deviations(o.M * (1.0 + size * rng.uniform(-1.0, 1.0, o.M.shape)))
        assert (other > best * (1.0 - 1e-6)).all()
        assert (other > best * (1.0 + 1e-4)).any()


def test_filter_finds_the_offset_of_a_reading():
    o = design.kalman(COACH, speed=90.0)  # below the critical speed, at rest
    bias = np.array([0.05, 1e-3])
    z = np.zeros(len(o.A))
    for _ in range(40000):
        z = o.A @ (z + o.M @ (bias - o.C @ z))
    assert z[-2:] == pytest.approx(bias, rel=0.05)


def test_ideal_sensors_get_a_filter_too():
    ideal = railenv.Equipped(COACH.plant, "secondary", sensors=railenv.Sensors.ideal())
    o = design.kalman(ideal, speed=FAST)
    assert np.abs(np.linalg.eigvals(o.A - o.A @ o.M @ o.C)).max() < 1.0


# ------------------------------------------------------------------------ bad input


@pytest.mark.parametrize("name", ["displacement", "yaw", "moment"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_weights_are_positive(name, value):
    with pytest.raises(ParameterError, match=f"weight {name} is"):
        design.Weights(**{name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [("alignment", -1e-3), ("moment", -1.0), ("gyro_drift", float("nan")), ("accelerometer", 0.0)],
)
def test_disturbances_have_sizes(name, value):
    with pytest.raises(ParameterError, match=f"{name} is"):
        design.Disturbances(**{name: value})


@pytest.mark.parametrize("designed", [design.lqr, design.kalman, design.lateral_model])
def test_designs_need_a_vehicle_with_actuators_at_a_speed(designed):
    with pytest.raises(ParameterError, match="must be an Equipped vehicle with actuators"):
        designed(COACH.plant, speed=100.0)
    with pytest.raises(ParameterError, match="must be an Equipped vehicle with actuators"):
        designed(railenv.Equipped(COACH.plant, "none"), speed=100.0)
    with pytest.raises(ParameterError, match="speed is -1"):
        designed(COACH, speed=-1.0)
    with pytest.raises(ParameterError, match="period is 0"):
        designed(COACH, speed=100.0, period=0.0)


def test_unknown_disturbances_of_the_model_are_named():
    with pytest.raises(UnknownNameError, match="nowhere"):
        design.lateral_model(COACH, speed=100.0, disturbances=("nowhere",))
