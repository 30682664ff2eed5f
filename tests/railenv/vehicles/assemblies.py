"""Random vehicles with every kind of element, and what is known of them without the package's laws."""

import dataclasses
import itertools

import numpy as np

import railenv
from railenv.vehicles.elements import (
    Body,
    Damper,
    FrictionElement,
    LateralForce,
    RollBar,
    SeriesDamper,
    Spring,
    Stop,
    TractionRod,
    Wheelset,
    YawDamper,
    YawMoment,
)

COORDINATES = ("y", "z", "phi", "theta", "psi")
_V = railenv.TABLE_1
_STIFF = ("k_x", "k_y", "k_z", "k_roll", "k_pitch", "k_yaw")


def table(rng, x, y):
    """Return a rising characteristic from (0, 0) on, its points scattered about those given."""
    return tuple(np.asarray(x)), (0.0, *(y[1:] * rng.uniform(0.9, 1.1, len(y) - 1)))


def work(made, x):
    """Integral of a table from 0 to x, cell by cell."""
    inside = made.x[(made.x > min(0.0, x)) & (made.x < max(0.0, x))]
    ends = np.sort([0.0, x, *inside])
    nodes, weights = np.polynomial.legendre.leggauss(2)  # exact for cubics
    parts = [
        (b - a) / 2.0 * np.dot(weights, [made((a + b) / 2.0 + (b - a) / 2.0 * n) for n in nodes])
        for a, b in itertools.pairwise(ends)
    ]
    return np.sign(x) * sum(parts)


def spring(rng, name, between, **more):
    """Return a spring with every number it may have."""
    stiffness = {k: rng.uniform(1e5, 1e6) for k in _STIFF}
    damping = {c: rng.uniform(1e3, 1e4) for c in ("c_x", "c_y", "c_z")}
    return Spring(name=name, between=between, **stiffness, **damping, **more)


def bodies(rng):
    """Two wheelsets of Table 1's, a frame, and a body above it off the middle; both pitch."""
    wheel = {
        name: getattr(_V, name)
        for name in (f.name for f in dataclasses.fields(Wheelset))
        if hasattr(_V, name) and name not in ("name", "polach_adhesion", "polach_slip")
    }
    first = Wheelset(
        name="w1",
        x=rng.uniform(1.1, 1.4),
        mass=1800.0,
        roll_inertia=915.0,
        pitch_inertia=140.0,
        yaw_inertia=915.0,
        **wheel,
    )
    frame = Body(
        name="b",
        z=rng.uniform(0.3, 0.6),
        mass=3000.0,
        roll_inertia=2260.0,
        pitch_inertia=2710.0,
        yaw_inertia=3160.0,
    )
    above = Body(
        name="c",
        x=rng.uniform(-0.5, 0.5),
        z=rng.uniform(1.2, 1.6),
        mass=17e3,
        roll_inertia=4e4,
        pitch_inertia=1e6,
        yaw_inertia=1e6,
    )
    return first, first.like("w2", x=-1.25), frame, above


def everything(seed):
    """Return a vehicle with every kind of element; all seeds have the same structure."""
    rng = np.random.default_rng(seed)
    place = {"x": rng.uniform(-0.4, 0.4), "z": rng.uniform(0.7, 1.0)}
    force = np.array([0.0, 3e3, 8e3, 11e3])
    speed = [0.0, 0.01, 0.1, 0.3]
    stops = [0.002, 0.004, 0.006, 0.01]
    secondary = ("b", "c")
    elements = [
        *(spring(rng, f"primary_{w}", (w, "b"), pair=True, y=1.0, z=0.05) for w in ("w1", "w2")),
        spring(rng, "secondary", secondary, **place),
        spring(rng, "buffer", ("c", "ground"), z=1.0),
        Damper(name="vertical", between=secondary, axis="z", pair=True, y=1.1, c=2e4, **place),
        Damper(name="lateral", between=secondary, y=0.3, force=table(rng, speed, force), x=0.2, z=0.8),
        SeriesDamper(name="yaw", between=secondary, pair=True, y=1.35, k=8e6, c=2e5, z=0.4),
        SeriesDamper(
            name="across", between=secondary, axis="y", k=5e6, force=table(rng, speed, force), **place
        ),
        Stop(name="bump", between=secondary, force=table(rng, stops, force), **place),
        Stop(
            name="bounce",
            between=("w1", "b"),
            axis="z",
            pair=True,
            y=0.9,
            force=table(rng, stops, force),
        ),
        RollBar(name="bar", between=secondary, k=1e6, c=1e4, x=0.1),
        TractionRod(name="rod", between=secondary, k=5e6, c=5e4, y=0.2, z=0.35),
        FrictionElement(
            name="rub", between=secondary, axis="x", pair=True, y=0.8, force=2e3, width=0.01, z=0.9
        ),
        YawDamper(name="paper", between=("w2", "b"), y=0.978, c1=19e3, c2=514e3, c3=-3e6, c4=5e6),
        YawMoment(name="M", between=secondary),
        LateralForce(name="F", between=("b", "c"), x=0.3, z=0.7),
    ]
    return railenv.Assembly(
        name="everything", bodies=bodies(rng), elements=tuple(elements), wheelbase_curving=1.0
    )


def bare(assembly):
    """Return the same bodies with nothing between them but the inputs."""
    inputs = [e for e in assembly.elements if e.n_inputs]
    nothing = [Spring(name=f"null_{b}", between=(b, "ground"), k_x=0.0) for b in ("b", "c")]
    return dataclasses.replace(assembly, elements=(*nothing, *inputs))


def inertias(vehicle):
    """Mass or inertia that belongs to each coordinate, in the order of the states."""
    fields = {"y": "mass", "z": "mass", "phi": "roll", "theta": "pitch", "psi": "yaw"}
    found = []
    for body in vehicle.bodies:
        for c in vehicle.coordinates[body.name]:
            field = fields[c]
            found.append(getattr(body, "mass" if field == "mass" else f"{field}_inertia"))
    return np.array(found)


def forces_between(assembly, x, u, run):
    """Generalised forces of the elements on the coordinates: by the model with and without them."""
    whole, free = railenv.Assembled(assembly), railenv.Assembled(bare(assembly))
    n = len(free.state_names) // 2
    acted = np.array(whole.plain_rhs(x.tolist(), u.tolist(), *run[:3]))
    alone = np.array(free.plain_rhs(x[: 2 * n].tolist(), u.tolist(), *run[:3]))
    return (acted[n : 2 * n] - alone[n:]) * inertias(numbers(assembly)), acted


def numbers(assembly):
    return assembly.with_numbers({**assembly.values, **assembly.tables})


def random_state(assembly, rng, size=1.0):
    """Displacements of millimetres (the wheels loaded), rates of centimetres a second."""
    n = sum(map(len, assembly.coordinates.values()))
    own = len(assembly.state_names) - 2 * n
    q, dq = rng.uniform(-1.0, 1.0, (2, n))
    return np.concatenate([4e-3 * size * q, 0.1 * size * dq, 2e-3 * size * rng.uniform(-1, 1, own)])


# -------------------------------------------------- points, energy and losses, by themselves


def cross(a, b):
    """Cross product; far quicker for one vector than that of NumPy."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def point(vehicle, name, x, place):
    """Displacement and velocity of a point of a body: its centre's, and the turn about that."""
    n = sum(map(len, vehicle.coordinates.values()))
    if name == "ground":
        return np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    first, moves = 0, []
    for body, own in vehicle.coordinates.items():
        if body == name:
            for part in (x[:n], x[n : 2 * n]):
                value = dict(zip(own, part[first : first + len(own)], strict=True))
                moves.append(
                    (
                        np.array([0.0, value["y"], value["z"]]),
                        np.array([value["phi"], value.get("theta", 0.0), value["psi"]]),
                    )
                )
        first += len(own)
    body = vehicle.body(name)
    arm = np.asarray(place) - [body.x, 0.0, body.z]
    (u, turn), (du, dturn) = moves
    return u + cross(turn, arm), du + cross(dturn, arm), turn, dturn


def stretches(vehicle, e, x):
    """Displacement, velocity, turn and its rate of B against A, at each place of an element.

    Where loads shift, the vertical displacement is that to second order of the middle between both
    sides: :func:`sinking`.
    """
    middle = vehicle.body(e.between[0]).x if e.x is None else e.x
    further = sinking(vehicle, e, x, middle) if vehicle.shifting_loads else (0.0, 0.0)
    found = []
    for side in (+1, -1) if e.pair else (1,):
        ends = [point(vehicle, name, x, (middle, side * e.y, e.z)) for name in e.between]
        moved = [b - a for a, b in zip(*ends, strict=True)]
        for part, more in zip(moved, further, strict=False):
            part[2] += more
        found.append(moved)
    return found


def sinking(vehicle, e, x, middle):
    """Second order of the vertical stretch of an element and its rate, by turned arms.

    The arms turn with their bodies, and the vertical is the mean of both bodies' own.
    """
    n = sum(map(len, vehicle.coordinates.values()))
    place = np.array([middle, 0.0 if e.pair else e.y, e.z])

    def second(q):
        moved = np.concatenate([q, np.zeros(len(x) - n)])
        tops, turns = [], []
        for name in e.between:
            u, _, turn, _ = point(vehicle, name, moved, place)
            body = vehicle.body(name)
            height = 0.0 if body is None else e.z - body.z
            tops.append((u[0], u[1], -height * (turn[0] ** 2 + turn[1] ** 2) / 2.0))
            turns.append(turn)
        (x_a, y_a, sunk_a), (x_b, y_b, sunk_b) = tops
        roll, pitch = (turns[0][:2] + turns[1][:2]) / 2.0
        return sunk_b - sunk_a - roll * (y_b - y_a) + pitch * (x_b - x_a)

    step = 1e-30
    return second(x[:n]), second(x[:n] + 1j * step * x[n : 2 * n]).imag / step


def energy_and_loss(assembly, x):
    """Energy stored in all elements (J), and what they turn into heat (W), on tangent track."""
    return energy_and_loss_of(numbers(assembly), assembly.elements, x)


def energy_and_loss_of(vehicle, parts, x):
    """Return the same of an assembly's numbers and of the elements as they are declared."""
    n = 2 * sum(map(len, vehicle.coordinates.values()))
    stored = lost = 0.0
    for e, part in zip(vehicle.elements, parts, strict=True):
        q, n = x[n : n + e.n_states], n + e.n_states
        for k, (d, v, turn, dturn) in enumerate(stretches(vehicle, e, x)):
            axis = "xyz".index(e.axis) if e.axis else 0
            along, speed = d[axis], v[axis]
            if part.kind == "spring":
                stored += 0.5 * np.dot([e.k_x, e.k_y, e.k_z], d**2)
                stored += 0.5 * np.dot([e.k_roll, e.k_pitch, e.k_yaw], turn**2)
                lost += np.dot([e.c_x, e.c_y, e.c_z], v**2)
            elif part.kind == "damper":
                lost += speed * (e.c * speed if e.force is None else e.force(speed))
            elif part.kind == "series_damper":
                f = e.k * (along - q[k])
                stored += 0.5 * f * f / e.k
                lost += f * (f / e.c if e.force is None else e.force(f))
            elif part.kind == "stop":
                stored += work(e.force, along)
            elif part.kind == "roll_bar":
                stored += 0.5 * e.k * turn[0] ** 2
                lost += e.c * dturn[0] ** 2
            elif part.kind == "traction_rod":
                stored += 0.5 * e.k * d[0] ** 2
                lost += e.c * v[0] ** 2
            elif part.kind == "friction":
                lost += e.force * speed**2 / np.hypot(speed, e.width)
            elif part.kind == "yaw_damper":
                s = e.y * dturn[2]
                lost += abs(s) * np.polyval([e.c4, e.c3, e.c2, e.c1, 0.0], abs(s))
    return stored, lost
