"""Vertical forces that act where bodies have moved to: potential, balance of forces, and of power."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import railenv
from railenv.equations.coordinates import AT_REST, Running, Wrench
from railenv.equations.elements import Arm, End, at_centre, lean, opposite, relative, where_moved_to
from railenv.errors import ParameterError

TANGENT = Running(40.0, 0.0, 0.0)
ARMS = (Arm(0.3, 0.4, 0.7), Arm(-2.0, -0.2, -0.9))
COORDINATES = ("y", "z", "phi", "theta", "psi")
STIFFNESS, DAMPING, STEP = 3e5, 4e4, 1e-30


def ends(q, dq=(0.0,) * 10):
    """Return both ends for coordinates y, z, phi, theta, psi of A, then of B."""
    found = []
    for k, arm in enumerate(ARMS):
        own = slice(5 * k, 5 * k + 5)
        moved = dict(zip(COORDINATES, q[own], strict=True))
        moving = {f"d{c}": v for c, v in zip(COORDINATES, dq[own], strict=True)}
        found.append(End(arm, AT_REST._replace(**moved, **moving), TANGENT))
    return found


def stretch(q):
    """Vertical distance of the attachments, along an axis that leans as both bodies do on average.

    By turned arms, to second order, written out by itself.
    """
    tops = []
    for k, arm in enumerate(ARMS):
        y, z, phi, theta, psi = q[5 * k : 5 * k + 5]
        x = arm.z * theta - arm.y * psi
        across = y + arm.x * psi - arm.z * phi
        up = z + arm.y * phi - arm.x * theta - arm.z * (phi**2 + theta**2) / 2.0
        tops.append((x, across, up, phi, theta))
    (x_a, y_a, z_a, phi_a, theta_a), (x_b, y_b, z_b, phi_b, theta_b) = tops
    return z_b - z_a - (phi_a + phi_b) / 2.0 * (y_b - y_a) + (theta_a + theta_b) / 2.0 * (x_b - x_a)


def forces(q, dq):
    """Generalised forces of a vertical spring and damper on both bodies, by the elements' equations."""
    a, b = ends(q, dq)
    seen = lean(a, b, relative(a, b, 0.0, 0))
    force = STIFFNESS * seen.z + DAMPING * seen.dz
    found = []
    on_a = Wrench(force_z=force)
    for end, wrench, further in zip(
        (a, b), (on_a, opposite(on_a)), where_moved_to(a, b, seen, force), strict=True
    ):
        w, f = at_centre(end.arm, wrench), at_centre(end.arm, further)
        found += [w.force_y + f.force_y, w.force_z + f.force_z, w.roll + f.roll]
        found += [w.pitch + f.pitch, w.yaw + f.yaw]
    return np.array(found), force


def random(seed):
    rng = np.random.default_rng(seed)
    return 0.05 * rng.standard_normal(10), 0.3 * rng.standard_normal(10)


@pytest.mark.parametrize("seed", range(3))
def test_forces_of_a_spring_are_the_derivatives_of_its_energy(seed):
    q, _ = random(seed)
    found, _ = forces(q, np.zeros(10))
    expected = []
    for k in range(10):
        moved = q.astype(complex)
        moved[k] += 1j * STEP
        expected.append(-(STIFFNESS * stretch(moved) ** 2 / 2.0).imag / STEP)
    assert_allclose(found, expected, rtol=1e-10, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(3))
def test_power_of_a_damper_is_its_force_times_the_rate_of_its_stretch(seed):
    q, dq = random(seed)
    found, force = forces(q, dq)
    rate = stretch(q + 1j * STEP * dq).imag / STEP
    assert force == pytest.approx(STIFFNESS * stretch(q) + DAMPING * rate, rel=1e-10)
    assert found @ dq == pytest.approx(-force * rate, rel=1e-10)


def test_couple_of_weight_times_shift_goes_from_body_to_body():
    # a body of weight W a shift d aside: half of the couple turns each of the two bodies
    weight, shift = 1e5, 0.05
    a, b = (End(Arm(0.0, 0.0, 0.0), AT_REST._replace(y=y), TANGENT) for y in (0.0, shift))
    on_a, on_b = where_moved_to(a, b, lean(a, b, relative(a, b, 0.0, 0)), -weight)
    assert on_a.roll == on_b.roll == pytest.approx(-weight * shift / 2.0)
    assert (on_a.force_y, on_b.force_y) == (0.0, 0.0)


def test_body_that_rolls_about_its_centre_is_pushed_aside_by_springs_that_lean_with_it():
    weight, height, roll = 1e5, 0.8, 0.02
    frame = End(Arm(0.0, 0.0, 0.0), AT_REST, TANGENT)
    body = End(Arm(0.0, 0.0, -height), AT_REST._replace(phi=roll), TANGENT)
    _, on_body = where_moved_to(frame, body, lean(frame, body, relative(frame, body, 0.0, 0)), -weight)
    assert on_body.force_y == pytest.approx(-weight * roll / 2.0)
    # the weight stands half of the tops' shift aside, and the push below the centre takes that away
    assert on_body.roll == pytest.approx(weight * height * roll / 2.0)
    assert at_centre(body.arm, on_body).roll == pytest.approx(0.0, abs=1e-9)


def test_switch_is_true_or_false():
    assembly = railenv.Bogie(railenv.TABLE_1).assembly
    assert not assembly.shifting_loads
    assert railenv.Coach(railenv.HIGH_SPEED_COACH).assembly.shifting_loads
    fields = {"name": "x", "bodies": assembly.bodies, "elements": assembly.elements}
    with pytest.raises(ParameterError, match="shifting_loads is 1; it must be true or false"):
        railenv.Assembly(**fields, parameters=assembly.parameters, shifting_loads=1)
