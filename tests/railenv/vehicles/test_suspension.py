"""Suspension: what follows from one potential and one dissipation function, whatever the numbers."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import railenv
from railenv.equations.coordinates import AT_REST, Running, Wrench, motions, total
from railenv.equations.elements import Relative, at_centre, opposite, yaw_damper, yaw_damper_force
from railenv.equations.motion import seen_by
from tests.railenv.vehicles.assemblies import everything, numbers

VEHICLES = [railenv.TABLE_1, railenv.HIGH_SPEED_COACH]
TANGENT = Running(50.0, 0.0, 0.0)
DOF = 12  # y, z, phi, psi of the leading wheelset, the trailing wheelset and the frame
STEP = 1e-30  # of complex-step derivatives, which do not cancel

vehicles = pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.name)


def element_forces(assembly, chosen, q, dq, run=TANGENT):
    """Generalised forces on the coordinates of an assembly from those elements that are chosen."""
    moving = motions([*q, *dq], assembly.coordinates)
    acting = {body.name: [Wrench()] for body in assembly.bodies}
    for e in filter(chosen, assembly.elements):
        a, b, seen = seen_by(assembly, e, moving, run)
        on_a, _ = e.law(e, seen, [0.0] * e.n_states, [0.0])
        for name, arm, wrench in zip(e.between, (a.arm, b.arm), (on_a, opposite(on_a)), strict=True):
            if name != "ground":
                acting[name].append(at_centre(arm, wrench))
    fields = dict(zip(("y", "z", "phi", "theta", "psi"), Wrench._fields[1:], strict=True))
    sums = {name: total(wrenches) for name, wrenches in acting.items()}
    own = assembly.coordinates
    return np.array([getattr(sums[name], fields[c]) for name in own for c in own[name]])


def between_bodies(e):
    return "ground" not in e.between and not e.n_inputs


def primary_forces(q, dq, p, run=TANGENT):
    """Generalised primary suspension forces on the 12 coordinates of the bogie."""
    return element_forces(p.assembly, between_bodies, q, dq, run)


def all_forces(q, dq, p, run=TANGENT):
    """Primary and secondary suspension forces together."""
    return element_forces(p.assembly, lambda e: not e.n_inputs, q, dq, run)


def matrices(forces, p):
    """Stiffness and damping matrix about rest, by complex step."""
    n = sum(map(len, p.assembly.coordinates.values()))
    zero = [0.0] * n
    K, C = np.empty((n, n)), np.empty((n, n))
    for j in range(n):
        unit = [complex(0.0, STEP * (i == j)) for i in range(n)]
        K[:, j] = [-complex(f).imag / STEP for f in forces(unit, zero, p)]
        C[:, j] = [-complex(f).imag / STEP for f in forces(zero, unit, p)]
    return K, C


def numbers_of(vehicle):
    """Parameters of a vehicle, and its bogie with them."""
    values = vehicle.parameters()
    assembly = railenv.Bogie(vehicle).assembly.with_numbers(values)
    return SimpleNamespace(**values, assembly=assembly)


def rigid_motions(p):
    """Motions of the bogie as one rigid body: lateral, vertical, roll about the axles' line, yaw."""
    L, h = p.half_wheelbase, p.frame_height
    lateral, vertical, roll, yaw = np.zeros((4, 3, 4))
    lateral[:, 0] = 1.0
    vertical[:, 1] = 1.0
    roll[:, 2] = 1.0
    roll[2, 0] = -h  # the frame's centre lies h above the axles
    yaw[:, 3] = 1.0
    yaw[:, 0] = L, -L, 0.0
    return [m.ravel() for m in (lateral, vertical, roll, yaw)]


def random_motion(rng):
    q, dq = rng.uniform(-1.0, 1.0, (2, DOF))
    return 0.02 * q, 0.5 * dq


# ------------------------------------------------------------------- stiffness and damping


@vehicles
@pytest.mark.parametrize("forces", [primary_forces, all_forces])
def test_stiffness_and_damping_matrices_are_symmetric_and_positive_semidefinite(vehicle, forces):
    for matrix in matrices(forces, numbers_of(vehicle)):
        size = np.abs(matrix).max()
        assert size > 1e3
        assert_allclose(matrix, matrix.T, rtol=0, atol=1e-13 * size)
        assert np.linalg.eigvalsh(matrix).min() > -1e-13 * size


def test_suspension_matrices_of_the_cooperrider_bogie_are_symmetric_and_positive_definite():
    # from the model's own right-hand side, with the wheels' forces next to nothing
    p = railenv.COOPERRIDER.replace(creep_coefficient=1e-6, flange_stiffness=0.0)
    A, _ = railenv.CooperriderBogie(p).jacobian(np.zeros(14), speed=50.0)
    bodies = [p.wheelset_mass, p.wheelset_yaw_inertia] * 2
    mass = np.array([*bodies, p.frame_mass, p.frame_yaw_inertia, p.frame_roll_inertia])
    K, C = (-mass[:, None] * A[7:, part] for part in (np.s_[:7], np.s_[7:]))
    for matrix in (K, C):
        assert_allclose(matrix, matrix.T, rtol=0, atol=1e-12 * np.abs(matrix).max())
        assert np.linalg.eigvalsh(matrix).min() > -1e-9 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(K).min() > 1e3  # the secondary suspension holds it to the body


@vehicles
def test_primary_suspension_resists_exactly_the_motions_that_are_not_rigid(vehicle):
    p = numbers_of(vehicle)
    K, C = matrices(primary_forces, p)
    for matrix in (K, C):
        for motion in rigid_motions(p):
            assert_allclose(matrix @ motion, 0.0, atol=1e-13 * np.abs(matrix).max())
    # 12 coordinates less 4 rigid motions: two lateral, vertical, roll and yaw deflections
    assert np.linalg.matrix_rank(K, tol=1e-9 * np.abs(K).max()) == 8


@vehicles
def test_rigid_motion_with_any_rates_gives_no_primary_force(vehicle):
    p = numbers_of(vehicle)
    rng = np.random.default_rng(2)
    modes = np.array(rigid_motions(p))
    for _ in range(20):
        q, dq = rng.uniform(-1.0, 1.0, (2, 4)) @ modes
        deflected = q + 0.1 * np.eye(DOF)[0]
        scale = np.abs(primary_forces(deflected, dq, p)).max()
        assert scale > 1e3
        assert_allclose(primary_forces(q, dq, p), 0.0, atol=1e-12 * scale)


@vehicles
def test_secondary_suspension_holds_the_frame_against_a_body_at_rest(vehicle):
    p = numbers_of(vehicle)
    K, C = matrices(all_forces, p)
    Kp, Cp = matrices(primary_forces, p)
    bs2 = p.secondary_arm**2
    stiffness = [
        2.0 * p.secondary_lateral_stiffness,
        0.0,  # the static load is given, so nothing holds the frame up but the primary springs
        2.0 * bs2 * p.secondary_vertical_stiffness,
        2.0 * bs2 * p.secondary_longitudinal_stiffness,
    ]
    damping = [
        2.0 * p.secondary_lateral_damping,
        2.0 * p.secondary_vertical_damping,
        2.0 * bs2 * p.secondary_vertical_damping,
        2.0 * bs2 * p.secondary_longitudinal_damping,
    ]
    # the difference of large numbers: rounding of the sums remains
    assert_allclose(K - Kp, np.diag([0.0] * 8 + stiffness), rtol=0, atol=1e-13 * np.abs(K).max())
    assert_allclose(C - Cp, np.diag([0.0] * 8 + damping), rtol=0, atol=1e-13 * np.abs(C).max())


# -------------------------------------------------------------------- action = reaction


@vehicles
@pytest.mark.parametrize("curving", [False, True])
def test_primary_forces_balance_about_a_common_point(vehicle, curving):
    p = numbers_of(vehicle.replace(wheelbase_curving=curving))
    run = Running(50.0, 1.0 / 800.0, 0.1)
    rng = np.random.default_rng(3)
    for _ in range(50):
        forces = primary_forces(*random_motion(rng), p, run).reshape(3, 4)
        scale = np.abs(forces).max()
        F_y, F_z, M_x, M_z = forces.T
        x = np.array([p.half_wheelbase, -p.half_wheelbase, 0.0])
        z = np.array([0.0, 0.0, p.frame_height])
        assert_allclose(F_y.sum(), 0.0, atol=1e-13 * scale)
        assert_allclose(F_z.sum(), 0.0, atol=1e-13 * scale)
        assert_allclose((M_x - z * F_y).sum(), 0.0, atol=1e-13 * scale)
        assert_allclose((M_z + x * F_y).sum(), 0.0, atol=1e-13 * scale)


@pytest.mark.parametrize("curving", [False, True])
def test_suspension_and_primary_actuators_leave_the_momentum_of_the_whole_model_alone(
    bogie, operations, curving
):
    # The model's own right-hand side, so that what the equations of motion do with the forces is
    # tested too. Table 1 has no secondary suspension: every force left out below is internal.
    model = bogie.replace(wheelbase_curving=curving)
    springs = [n for n in model.parameters if n.startswith(("primary_", "yaw_damper_"))]
    springs.remove("primary_arm")
    without = model.replace(**dict.fromkeys(springs, 0.0))
    v = model.vehicle
    moments = np.array([name.startswith("M_w") for name in model.input_names])
    mass = [v.wheelset_mass, v.wheelset_mass, v.frame_mass]
    roll = [v.wheelset_roll_inertia, v.wheelset_roll_inertia, v.frame_roll_inertia]
    yaw = [v.wheelset_yaw_inertia, v.wheelset_yaw_inertia, v.frame_yaw_inertia]
    x = np.array([v.half_wheelbase, -v.half_wheelbase, 0.0])
    z = np.array([0.0, 0.0, v.frame_height])
    for o in operations(model, 20, seed=4):
        acted = model.rhs(o.x, o.u, **o.conditions)
        free = without.rhs(o.x, np.where(moments, 0.0, o.u), **o.conditions)
        F_y, F_z, M_x, M_z = (
            (acted - free)[DOF:].reshape(3, 4) * np.array([mass, mass, roll, yaw]).T
        ).T
        scale = np.abs(acted[DOF:]).max() * v.frame_mass
        assert np.abs(F_y).max() > 10.0
        assert np.abs(M_z).max() > 10.0
        for component in (F_y, F_z, M_x - z * F_y, M_z + x * F_y):
            assert_allclose(component.sum(), 0.0, atol=1e-12 * scale)


# ------------------------------------------------------------------------- passivity


@vehicles
def test_passive_suspension_never_gains_energy(vehicle):
    p = numbers_of(vehicle)
    K, _ = matrices(all_forces, p)
    rng = np.random.default_rng(5)
    largest = -np.inf
    for _ in range(300):
        q, dq = random_motion(rng)
        supplied = all_forces(q, dq, p) @ dq
        stored = -(K @ q) @ dq  # rate at which the springs give back what they store
        dissipated = supplied - stored
        largest = max(largest, dissipated)
        assert dissipated <= 1e-12 * abs(stored)
    assert largest < -1.0  # every one of these motions has to lose some energy


@vehicles
def test_slow_motion_gains_no_energy_either(vehicle):
    # At small rates the yaw damper's linear term rules, which a wrong sign would turn into a motor.
    p = numbers_of(vehicle)
    rng = np.random.default_rng(6)
    for _ in range(100):
        dq = 1e-6 * rng.uniform(-1.0, 1.0, DOF)
        assert all_forces(np.zeros(DOF), dq, p) @ dq < 0.0


# ------------------------------------------------------------------------- yaw damper


def papers_damper():
    """Numbers of Table 1's yaw damper."""
    assembly = numbers_of(railenv.TABLE_1).assembly
    return next(e for e in assembly.elements if e.name == "damper_w1")


@pytest.mark.parametrize(("speed", "force"), [(0.1, 4.45e3), (0.3, 9.58e3)])
def test_yaw_damper_gives_the_papers_forces(speed, force):
    assert yaw_damper_force(speed, papers_damper()) == pytest.approx(force, abs=5.0)


def test_yaw_damper_is_odd_and_rises_monotonically():
    e = papers_damper()
    speeds = np.linspace(0.0, 0.5, 2001)
    forces = np.array([yaw_damper_force(v, e) for v in speeds])
    assert forces[0] == 0.0
    assert (np.diff(forces) > 0.0).all()
    assert_allclose([yaw_damper_force(-v, e) for v in speeds], -forces, rtol=1e-15)


def test_yaw_damper_resists_the_wheelsets_own_yaw_rate():
    e = papers_damper()
    turning = {"w1": AT_REST._replace(dpsi=0.1)}
    *_, seen = seen_by(numbers_of(railenv.TABLE_1).assembly, e, turning, TANGENT)
    assert isinstance(seen, Relative)
    moment = yaw_damper(e, seen, [], [])[0].yaw
    assert moment == pytest.approx(-e.y * yaw_damper_force(e.y * 0.1, e))
    assert moment < 0.0


# ---------------------------------------------------------- vehicles with every element


@pytest.mark.parametrize("seed", range(4))
def test_every_element_has_a_symmetric_positive_semidefinite_stiffness_and_damping(seed):
    p = SimpleNamespace(assembly=numbers(everything(seed)))
    for e in p.assembly.elements:
        if e.n_inputs:
            continue

        def forces(q, dq, p, e=e):
            return element_forces(p.assembly, lambda other: other is e, q, dq)

        K, C = matrices(forces, p)
        assert np.abs([K, C]).max() > 1e2 or e.name in ("bump", "bounce")
        for matrix in (K, C):
            size = np.abs(matrix).max() or 1.0
            assert_allclose(matrix, matrix.T, rtol=0, atol=1e-12 * size)
            assert np.linalg.eigvalsh(matrix).min() > -1e-12 * size


@pytest.mark.parametrize("seed", range(4))
def test_rigid_motion_of_a_whole_vehicle_stretches_no_element(seed):
    assembly = numbers(everything(seed))
    rng = np.random.default_rng(seed)
    shift, turn = rng.uniform(-1.0, 1.0, 3) * 0.01, rng.uniform(-1.0, 1.0, 3) * 0.01
    # about x and z only: wheelsets do not pitch, and bodies have no place along the track
    shift[0] = turn[1] = 0.0
    q = []
    for body in assembly.bodies:
        y, z = (shift + np.cross(turn, [body.x, 0.0, body.z]))[1:]
        value = {"y": y, "z": z, "phi": turn[0], "theta": 0.0, "psi": turn[2]}
        q += [value[c] for c in assembly.coordinates[body.name]]
    moved, still = q, [0.0] * len(q)
    one = [0.01 * (i == 0) for i in range(len(q))]
    scale = np.abs(element_forces(assembly, between_bodies, one, still)).max()
    for here, rate in ((moved, still), (still, moved)):
        found = element_forces(assembly, between_bodies, here, rate)
        assert_allclose(found, 0.0, atol=1e-11 * scale)


# ------------------------------------------------------------------ wheelbase on a curve


@vehicles
def test_rigid_bogie_on_a_curve_deflects_no_primary_spring_with_wheelbase_curving(vehicle):
    # The frame stands on the track and along it; its axles lie on a straight line, from which the
    # circle of the track turns away to the right (a positive curvature has its outer rail left).
    p = numbers_of(vehicle.replace(wheelbase_curving=True))
    radius = 2000.0
    q = np.zeros((3, 4))
    for i, s in enumerate((+1, -1)):
        angle = np.arcsin(s * p.half_wheelbase / radius)
        q[i, 0] = radius * (1.0 - np.cos(angle))
        q[i, 3] = angle
    forces = primary_forces(q.ravel(), np.zeros(DOF), p, Running(50.0, 1.0 / radius, 0.0))
    straight = primary_forces(q.ravel(), np.zeros(DOF), p, TANGENT)
    # what is left is of the order (L/R)^2, for the equations keep the first order of the curvature
    assert np.abs(straight).max() > 10.0
    assert np.abs(forces).max() < 1e-6 * np.abs(straight).max()


def test_wheelbase_curving_changes_nothing_on_tangent_track_and_is_off_in_the_papers_vehicles():
    q, dq = random_motion(np.random.default_rng(7))
    on, off = (
        primary_forces(q, dq, numbers_of(railenv.TABLE_1.replace(wheelbase_curving=switch)))
        for switch in (True, False)
    )
    assert_allclose(on, off, rtol=0, atol=0)
    off = {v.name for v in railenv.PRESETS if not v.wheelbase_curving}
    assert off == {"TABLE_1", "TABLE_1_PRINTED_LOADS"}
