"""H-infinity synthesis: the norm by a second method, what the loop does, and what is refused."""

import control
import numpy as np
import pytest

import design
import railenv
from design.linear.regulator import Disturbances, Weights
from railenv.errors import ParameterError, UnknownNameError

COACH = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))
RANGES = {"conicity": (0.05, 0.4), "creep_factor": (0.6, 1.4)}
WEIGHTS = Weights(yaw=1e-3, moment=20.0)
DISTURBANCES = Disturbances(alignment=4e-5, moment=0.3, accelerometer=0.1, gyro=1e-3)
SPEEDS = (60.0, 120.0)


@pytest.fixture(scope="module")
def models():
    return {v: design.uncertain_model(COACH, speed=v, ranges=RANGES) for v in SPEEDS}


@pytest.fixture(scope="module")
def found(models):
    return {
        v: design.h_infinity(model, weights=WEIGHTS, disturbances=DISTURBANCES)
        for v, model in models.items()
    }


def gains(system, frequencies):
    """Return the largest singular value at frequencies (rad per period)."""
    return np.array(
        [
            np.linalg.svd(
                system.C @ np.linalg.solve(np.exp(1j * f) * np.eye(system.nstates) - system.A, system.B)
                + system.D,
                compute_uv=False,
            )[0]
            for f in frequencies
        ]
    )


@pytest.mark.parametrize("speed", SPEEDS)
def test_norm_on_a_grid_of_frequencies_is_the_computed_one_and_below_the_bound(found, speed):
    made = found[speed]
    assert np.abs(np.linalg.eigvals(made.closed_loop.A)).max() < 1.0
    peak = gains(made.closed_loop, np.geomspace(1e-5, np.pi, 4000)).max()
    assert peak == pytest.approx(made.norm, rel=2e-3)
    assert made.norm <= 1.001 * made.bound
    assert made.least < made.bound


@pytest.mark.parametrize("speed", SPEEDS)
def test_closed_loop_of_the_vehicle_has_the_multipliers_of_the_synthesis(found, speed):
    """The vehicle's own loop is put together elsewhere, with vertical motion and other states."""
    made = found[speed]
    law = control.ss(
        made.A,
        made.B,
        made.C,
        made.D,
        0.005,
        inputs=list(COACH.sensor_names),
        outputs=list(COACH.command_names),
    )
    loop = design.closed_loop(COACH, law, speed=speed)
    assert loop.stable
    whole, own = loop.multipliers, made.closed_loop.poles()
    slow = own[np.abs(own) > 0.5]
    assert np.abs(slow[:, None] - whole).min(axis=1).max() < 1e-5


def test_a_loop_from_a_larger_share_of_the_bound_has_a_larger_norm(models, found):
    """Near the smallest bound the gain is the same at all frequencies that count; far from it, not."""
    loose = design.h_infinity(models[120.0], weights=WEIGHTS, disturbances=DISTURBANCES, slack=10.0)
    near = found[120.0]
    assert loose.least == near.least
    assert near.norm < loose.norm


def test_smallest_bound_is_not_above_that_of_python_control(models, found):
    """hinfsyn goes below the smallest bound where its own loop exceeds it; never far above it."""
    plant = found[60.0].plant
    n = plant.nstates
    M = np.linalg.inv(np.eye(n) + plant.A)
    mapped = control.ss(
        (plant.A - np.eye(n)) @ M,
        np.sqrt(2.0) * M @ plant.B,
        np.sqrt(2.0) * plant.C @ M,
        plant.D - plant.C @ M @ plant.B,
    )
    _, loop, _, _ = control.hinfsyn(mapped, len(COACH.sensor_names), 1)
    assert found[60.0].least <= 1.03 * control.linfnorm(loop)[0]


def test_what_is_steady_is_not_fed_back(found):
    for made in found.values():
        steady = made.C @ np.linalg.solve(np.eye(len(made.A)) - made.A, made.B) + made.D
        largest = np.abs(made.D).max()
        assert np.abs(steady).max() < 1e-6 * largest


def test_filters_whiten_noise_and_drift(found):
    """The spectrum of white noise with a random walk, through the filter, is 1 at all frequencies."""
    plant = found[60.0].plant
    model = design.lateral_model(COACH, speed=60.0, sensors=True)
    z = np.exp(1j * np.array([1e-3, 1e-2, 0.1, 0.3]))  # at higher ones the readings are near rounding
    drives = list(model.input_labels).index("command_b")
    for row, noise, drift in (
        (0, DISTURBANCES.accelerometer, DISTURBANCES.accelerometer_drift),
        (1, DISTURBANCES.gyro, DISTURBANCES.gyro_drift),
    ):
        spectrum = noise**2 + drift**2 / np.abs(z - 1.0) ** 2
        read = np.array([model(point)[row, drives] * COACH.limits[0] for point in z])
        whitened = np.array([plant(point)[row - 2, -1] for point in z])
        np.testing.assert_allclose(np.abs(whitened / read) ** 2 * spectrum, 1.0, rtol=1e-4)


def test_a_controller_that_is_told_what_was_applied_is_stable_by_itself(found):
    for made in found.values():
        assert np.abs(np.linalg.eigvals(made.A - made.E @ made.C)).max() < 1.0


def test_unforeseen_forces_add_to_what_the_loop_has_to_bear(models):
    alone = design.uncertain_model(COACH, speed=120.0, ranges={})
    assert not alone.changes
    sure = design.h_infinity(alone, weights=WEIGHTS, disturbances=DISTURBANCES, slack=1.1)
    assert sure.norm <= 1.001 * sure.bound  # with few disturbances, too
    wide = design.h_infinity(models[120.0], weights=WEIGHTS, disturbances=DISTURBANCES, motion=1e-3)
    assert sure.least < wide.least


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"motion": -1.0}, "motion is -1"),
        ({"motion": float("nan")}, "motion is nan"),
        ({"slack": 1.0}, "slack is 1"),
        ({"slack": float("inf")}, "slack is inf"),
        ({"roll_off": 0.0}, "roll_off is 0"),
        ({"disturbances": Disturbances(gyro_drift=0.0)}, "gyro_drift is 0"),
    ],
)
def test_impossible_values_are_refused(models, given, message):
    with pytest.raises(ParameterError, match=message):
        design.h_infinity(models[60.0], **given)


def test_impossible_models_are_refused():
    with pytest.raises(UnknownNameError, match="wear"):
        design.uncertain_model(COACH, speed=60.0, ranges={"wear": (0.0, 1.0)})
    with pytest.raises(ParameterError, match="ranges"):
        design.uncertain_model(COACH, speed=60.0, ranges={"conicity": (0.4, 0.05)})
    with pytest.raises(ParameterError, match="must be an Equipped vehicle"):
        design.uncertain_model(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW), speed=60.0, ranges={})


def test_a_problem_without_a_solution_says_so(models):
    with pytest.raises(ParameterError, match=r"no H-infinity controller is found .* at 60 m/s"):
        design.h_infinity(
            models[60.0], weights=Weights(yaw=1e-12, moment=1e-9), disturbances=DISTURBANCES
        )
