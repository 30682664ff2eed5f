"""Energy of whole vehicles in motion: what is stored, lost, and given by what drives them.

The energy is written down by itself: of masses, their heights, the elements and the rails. On tangent
track at a steady speed it changes by what the dampers take and by what creep forces give or take; the
gyroscopic moments do no work.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

import railenv
from railenv.equations.coordinates import Running, motions
from railenv.equilibrium import find_equilibrium
from tests.railenv.contacts import CREEP, SMOOTH, rail_energy
from tests.railenv.oracle import contact as oracle
from tests.railenv.vehicles.assemblies import energy_and_loss_of, inertias, numbers

VEHICLES = (railenv.HIGH_SPEED_COACH, railenv.MANCHESTER_1, railenv.CRH380A)
COACH = railenv.Coach(railenv.HIGH_SPEED_COACH)  # on cones
NO_CREEP = dict.fromkeys(CREEP, 1e-9)
NO_DAMPING = dict.fromkeys(
    ("primary_vertical_damping", "secondary_lateral_damping", "secondary_vertical_damping"), 0.0
)
SPEED = 110.0  # above the critical one
THROWN = {"y_body": 0.06, "z_b1": 0.01, "phi_b2": 0.01, "psi_w1": 2e-3}  # against stops and flanges


class Energy:
    """Energy of a vehicle (J), and what its dampers take (W)."""

    def __init__(self, model):
        self.parts = model.assembly.elements
        self.vehicle = numbers(model.assembly)

    def __call__(self, x):
        """What masses, their heights, the elements and the rails hold; and what the dampers take."""
        vehicle = self.vehicle
        n = sum(map(len, vehicle.coordinates.values()))
        moving = motions(x, vehicle.coordinates)
        found = 0.5 * np.sum(inertias(vehicle) * x[n : 2 * n] ** 2)
        found += sum(body.mass * vehicle.gravity * moving[body.name].z for body in vehicle.bodies)
        for w in vehicle.wheelsets:
            found += rail_energy([getattr(moving[w.name], c) for c in ("y", "z", "phi", "psi")], w)
        stored, lost = energy_and_loss_of(vehicle, self.parts, x)
        return found + stored, lost


def random_state(model, rng, size):
    """Displacements of millimetres about the equilibrium, rates of decimetres a second."""
    x = find_equilibrium(model, speed=SPEED).state
    n = sum(map(len, model.assembly.coordinates.values()))
    q, dq = rng.uniform(-1.0, 1.0, (2, n))
    own = 1e-3 * rng.uniform(-1.0, 1.0, len(x) - 2 * n)
    return x + size * np.concatenate([2e-3 * q, 0.1 * dq, own])


def growth(model, energy, x):
    """Rate at which the stored energy grows as the vehicle moves (W)."""
    u = [0.0] * len(model.input_names)
    moves = np.array(model.plain_rhs(x.tolist(), u, SPEED, 0.0, 0.0), dtype=float)
    h = 1e-6
    return (energy(x + h * moves)[0] - energy(x - h * moves)[0]) / (2.0 * h)


def run(model, start, duration, **method):
    """Simulate; return the response, the energy (J) at each time and the work lost until then."""
    response = railenv.simulate(
        model, speed=SPEED, perturbation=start, duration=duration, output_step=1e-3, **method
    )
    stored, lost = np.transpose([*map(Energy(model), response.states.T)])
    return response, stored, cumulative_simpson(lost, x=response.time, initial=0.0)


@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.name)
def test_without_creep_a_whole_vehicle_loses_what_its_dampers_take_and_nothing_else(vehicle):
    model = railenv.Coach(vehicle.replace(**NO_CREEP))
    energy, rng = Energy(model), np.random.default_rng(5)
    for size in (0.3, 1.0, 3.0, 10.0):
        x = random_state(model, rng, size)
        _, lost = energy(x)
        assert lost > 10.0
        assert growth(model, energy, x) == pytest.approx(-lost, rel=1e-6)


def test_coach_without_creep_and_dampers_keeps_its_energy():
    model = COACH.replace(**NO_CREEP, **NO_DAMPING)
    response, energy, lost = run(model, THROWN, 0.5, method="DOP853", rtol=1e-10, atol=1e-12)
    at = dict(zip(COACH.state_names, response.states, strict=True))
    assert np.abs(at["y_body"] - at["y_b1"]).max() > 0.03  # stops set in at 20 mm
    assert np.abs(at["y_w1"]).max() > COACH.vehicle.flange_clearance
    given = energy[0] - Energy(model)(find_equilibrium(model, speed=SPEED).state)[0]
    assert given > 1000.0
    assert not lost.any()
    assert np.abs(energy - energy[0]).max() < 1e-6 * given


def test_coach_without_creep_loses_the_work_of_its_dampers():
    _, energy, lost = run(COACH.replace(**NO_CREEP), THROWN, 0.5, step=2.5e-4)
    assert lost[-1] > 1000.0
    assert np.abs(energy - energy[0] + lost).max() < 1e-5 * lost[-1]


# ----------------------------------------------------------------------------- with creep


def creep_powers(vehicle, x):
    """Power of the creep forces on the coordinates, what slip takes, and what the drive gives (W).

    The drive holds the speed V and turns the axles at V over the rolling radius.
    """
    on_coordinates = slip = drive = 0.0
    moving, running = motions(x, vehicle.coordinates), Running(SPEED, 0.0, 0.0)
    for axle in vehicle.wheelsets:
        w, p = moving[axle.name], SimpleNamespace(**vars(axle), conicity=axle.left.conicity)
        axle_line = np.array([-w.psi, 1.0, 0.0])  # of its roll the rolling radius takes account
        wheels = [oracle.creep(s, (w.y, w.z, w.phi, w.psi), w, SMOOTH, running, p) for s in (+1, -1)]
        for s, wheel, share in zip((+1, -1), wheels, oracle.shares(wheels, p), strict=True):
            linear, spin, _, (along, across, normal), arm = wheel
            force = share * (linear[0] * along + linear[1] * across)
            moment = np.cross(arm, force) + share * spin * normal
            on_coordinates += force[1:] @ [w.dy, w.dz] + moment[[0, 2]] @ [w.dphi, w.dpsi]
            drive -= SPEED * (force[0] + moment @ axle_line / p.wheel_radius)
            plane, radius = np.hypot(1.0, p.conicity + s * w.phi), -arm[2]
            forwards = SPEED * (1.0 - radius / p.wheel_radius) - arm[1] * w.dpsi
            sideways = (w.dy + radius * w.dphi - SPEED * w.psi) * plane
            turning = (w.dpsi - s * SPEED * p.conicity / radius) / plane
            slip -= share * (linear @ [forwards, sideways] + spin * turning)
    return on_coordinates, slip, drive


def test_with_creep_the_energy_changes_by_the_power_of_the_creep_forces_too():
    energy, rng = Energy(COACH), np.random.default_rng(6)
    for size in (0.1, 0.3, 1.0, 3.0):
        x = random_state(COACH, rng, size)
        given, slip, drive = creep_powers(energy.vehicle, x)
        _, lost = energy(x)
        assert slip > 100.0
        found = growth(COACH, energy, x) + lost
        assert found == pytest.approx(given, rel=1e-6, abs=1e-9 * lost)  # differences lose digits
        assert found == pytest.approx(drive - slip, abs=0.02 * slip)


def test_what_a_hunting_coach_gains_and_loses_is_paid_by_its_drive():
    response, energy, lost = run(COACH, {"y_w1": 8e-3, "y_w3": 5e-3}, 0.8)
    vehicle = numbers(COACH.assembly)
    powers = np.array([creep_powers(vehicle, x) for x in response.states.T])
    given, slip, drive = cumulative_simpson(powers.T, x=response.time, initial=0.0)
    assert given[-1] > 1000.0
    assert np.abs(energy - energy[0] - given + lost).max() < 1e-5 * given[-1]
    # slip and drive are those of the linearised kinematics, in which a wheel follows its rail
    assert np.abs(given - (drive - slip)).max() < 0.01 * drive[-1]
