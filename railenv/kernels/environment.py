"""Control steps of environments, joined to an equipped model's kernels (see loader.PROGRAMS).

A fleet of environments is an array of blocks of L lanes: ``w`` is the model's buffer, ``e`` the buffer
of what an environment adds (rows below). Lanes beyond ``count`` fill up the last block; they are
integrated and not looked at.
"""

# ruff: noqa: F821, D401, PLR0124, SIM300
# mypy: ignore-errors

# --- rows of e, each row * L + lane ---
E_STEP = 0  # control steps since the reset
E_DISTANCE = 1  # m
E_CURVATURE = 2  # of the circular curve, 1/m
E_CANT = 3  # of the circular curve, rad
E_PLAN = 4  # 4 rows: start and end of the clothoid in, start and end of the clothoid out, m
E_OFFSET = 8  # where on the line of irregularities the run starts, m
E_LEVEL = 9  # factor of the irregularities, 0 for none
E_FORCE2 = 10  # sum over steps of the squared specific force about the steady one
E_PEAK = 11  # its largest magnitude
E_EFFORT2 = 12  # sum over steps of the mean squared share of the limit
E_GRAVITY = 13  # m/s^2
N_GUIDED = len(GUIDED)
GUIDED = np.array(GUIDED, dtype=np.int64).reshape(-1, 3)  # states y, psi, dy of each wheelset
RAILS = np.array(RAILS, dtype=np.int64).reshape(-1, 3)  # inputs align, vert, cross; -1: none
E_CLEARANCE = 14  # of each wheelset, m
E_WAVENUMBER = E_CLEARANCE + N_GUIDED  # of its kinematic hunting, rad/m
E_AHEAD = E_WAVENUMBER + N_GUIDED  # its place along the vehicle, m
E_LIMIT = E_AHEAD + N_GUIDED  # of each actuator, N m or N
E_BIAS = E_LIMIT + N_ACTUATORS  # sensor biases, accelerometer and gyro of each sensed body
E_REFERENCE = E_BIAS + 2 * N_SENSED  # REFERENCES values at each of NODES shares of the curve
NODES = 9
REFERENCES = 2 * N_GUIDED + N_SENSED  # y of each wheelset, psi of each, specific forces
E_LIFTED = E_REFERENCE + NODES * REFERENCES  # m run with each wheel off the rail
N_WHEELS = 2 * N_FORCES  # wheels whose forces are known, left and right of each wheelset
E_SUMS = E_LIFTED + N_WHEELS  # sums of Y and Q of the wheels over the window
E_WINDOWS = E_SUMS + 2 * N_WHEELS  # windows of as many rows as the longest needs, then the delay line

N_PLANT = len(STATES) - 2 * N_ACTUATORS - 2 * N_SENSED
C_SPEED, C_CURVATURE, C_CANT = LAYOUT.c, LAYOUT.c + 1, LAYOUT.c + 2
O_FIRST = LAYOUT.o  # specific forces
O_FORCES = O_FIRST + N_SENSED  # Y, Q of the wheels
RAMP = 20.0  # m over which irregularities fade in at the start of a run
DERAILED_RATIO, DERAILED_WINDOW, DERAILED_OFFSET = 0.8, 2.0, 0.03  # Nadal's limit; m; m
RING_SIGNALS = N_GUIDED + N_FORCES + 1  # y of wheelsets, their sums of Y, force of the first sensor
TERMS = 7  # reward; hunting, excursion, ride, effort; derailed; reason


@inline
def _share(x):
    """0 below 0, 1 above 1, x between."""
    return real(0.0) if x < real(0.0) else (real(1.0) if x > real(1.0) else x)


@jit
def set_track(w, e, distance_ahead, lines, spacing):
    """Set curvature, cant and irregularities for a point ahead of the fleet's present position."""
    for lane in range(L):
        s = e[E_DISTANCE * L + lane] + distance_ahead * w[C_SPEED * L + lane]
        into = _share((s - e[E_PLAN * L + lane]) / (e[(E_PLAN + 1) * L + lane] - e[E_PLAN * L + lane]))
        out = _share(
            (s - e[(E_PLAN + 2) * L + lane]) / (e[(E_PLAN + 3) * L + lane] - e[(E_PLAN + 2) * L + lane])
        )
        w[C_CURVATURE * L + lane] = (into - out) * e[E_CURVATURE * L + lane]
        w[C_CANT * L + lane] = (into - out) * e[E_CANT * L + lane]
    samples = lines.shape[1]
    for lane in range(L):
        level = e[E_LEVEL * L + lane]
        if level == real(0.0):
            continue
        s = e[E_DISTANCE * L + lane] + distance_ahead * w[C_SPEED * L + lane]
        level *= _share(s / real(RAMP))
        for i in range(N_GUIDED):
            if RAILS[i, 0] < 0:
                continue
            position = (e[E_OFFSET * L + lane] + s + e[(E_AHEAD + i) * L + lane]) / spacing
            cell = int(math.floor(position))
            part = position - cell
            here, there = cell % samples, (cell + 1) % samples
            for kind in range(3):
                value = lines[kind, here] + part * (lines[kind, there] - lines[kind, here])
                w[(U + RAILS[i, kind]) * L + lane] = level * value


@jit
def advance(w, e, h, steps, lines, spacing):
    """Integrate some RK4 steps along the track; conditions of a step are those at its middle."""
    for _ in range(steps):
        set_track(w, e, real(0.5) * h, lines, spacing)
        rk4_step(w, h)
        for lane in range(L):
            e[E_DISTANCE * L + lane] += h * w[C_SPEED * L + lane]


@jit
def set_commands(w, e, delay_row, slots, age):
    """Apply the commands given ``age`` control steps ago."""
    for lane in range(L):
        slot = (int(e[E_STEP * L + lane]) + slots - age) % slots
        for a in range(N_ACTUATORS):
            w[(U + a) * L + lane] = e[(delay_row + a * slots + slot) * L + lane]


@inline
def _reference(e, lane, share, k):
    """One of the references at a share of the curve, linear between nodes."""
    position = share * real(NODES - 1)
    i = min(int(position), NODES - 2)
    low = e[(E_REFERENCE + i * REFERENCES + k) * L + lane]
    high = e[(E_REFERENCE + (i + 1) * REFERENCES + k) * L + lane]
    return low + (position - real(i)) * (high - low)


@inline
def _curve_share(w, e, lane):
    """Share of the circular curve's curvature (or cant) that the track has at the fleet's position."""
    if e[E_CURVATURE * L + lane] != real(0.0):
        return w[C_CURVATURE * L + lane] / e[E_CURVATURE * L + lane]
    if e[E_CANT * L + lane] != real(0.0):
        return w[C_CANT * L + lane] / e[E_CANT * L + lane]
    return real(0.0)


@inline
def _bounded(x):
    """A term of the reward between 0 and 1, 1/2 where x is 1; 1 for what is not a number."""
    return x / (real(1.0) + x) if x >= real(0.0) and x < real(1e300) else real(1.0)


@jit
def assess(w, e, lane, env, longest, window, weights, terms, ring):
    """Reward, derailment and running totals of one environment after a control step."""
    share = _curve_share(w, e, lane)
    speed = w[C_SPEED * L + lane]
    k = int(e[E_STEP * L + lane])
    excursion = hunting = real(0.0)
    largest = real(0.0)
    for i in range(N_GUIDED):
        delta = e[(E_CLEARANCE + i) * L + lane]
        wave = e[(E_WAVENUMBER + i) * L + lane]
        y = w[GUIDED[i, 0] * L + lane]
        if RAILS[i, 0] >= 0:
            y -= w[(U + RAILS[i, 0]) * L + lane]
        off = (y - _reference(e, lane, share, i)) / delta
        psi = w[GUIDED[i, 1] * L + lane] - _reference(e, lane, share, N_GUIDED + i)
        rate = w[GUIDED[i, 2] * L + lane] / (speed * wave * delta)
        turn = psi / (wave * delta)
        excursion += off * off / real(N_GUIDED)
        hunting += real(0.5) * (rate * rate + turn * turn) / real(N_GUIDED)
        largest = max(largest, abs(y)) if y == y else real(1e300)
        ring[env, k % ring.shape[1], i] = off * delta
    ride = real(0.0)
    for i in range(N_SENSED):
        force = w[(O_FIRST + i) * L + lane] - _reference(e, lane, share, 2 * N_GUIDED + i)
        ride = max(ride, abs(force))
        if i == 0:
            ring[env, k % ring.shape[1], N_GUIDED + N_FORCES] = force
    effort = real(0.0)
    for a in range(N_ACTUATORS):
        moment = w[(N_PLANT + 2 * a) * L + lane] / e[(E_LIMIT + a) * L + lane]
        effort += min(moment * moment, real(1.0)) / real(N_ACTUATORS)
    # guiding forces: Nadal's ratio over 2 m, lifted wheels, sum of each axle
    n = int(window[env])
    nadal = lifted = real(0.0)
    travelled = speed * weights[5]
    for wheel in range(N_WHEELS):
        Y = w[(O_FORCES + 2 * wheel) * L + lane]
        Q = w[(O_FORCES + 2 * wheel + 1) * L + lane]
        row = (E_LIFTED + wheel) * L + lane
        e[row] = e[row] + travelled if Q <= real(0.0) else real(0.0)
        lifted = max(lifted, e[row])
        # the mean over 2 m of Y over that of Q: a wheel that is light for a moment does not climb
        for part in range(2):
            force = Q if part else Y
            slot = (E_WINDOWS + (2 * wheel + part) * longest + k % n) * L + lane
            e[(E_SUMS + 2 * wheel + part) * L + lane] += force - e[slot]
            e[slot] = force
        total_Y = e[(E_SUMS + 2 * wheel) * L + lane]
        total_Q = e[(E_SUMS + 2 * wheel + 1) * L + lane]
        if total_Q > real(0.0):
            nadal = max(nadal, total_Y / total_Q)
    for i in range(N_FORCES):
        left = w[(O_FORCES + 4 * i) * L + lane]
        right = w[(O_FORCES + 4 * i + 2) * L + lane]
        ring[env, k % ring.shape[1], N_GUIDED + i] = left - right
    e[E_FORCE2 * L + lane] += ride * ride
    e[E_PEAK * L + lane] = max(e[E_PEAK * L + lane], ride)
    e[E_EFFORT2 * L + lane] += effort
    reason = 0
    if not largest <= real(DERAILED_OFFSET):
        reason = 3
    elif lifted >= real(DERAILED_WINDOW):
        reason = 2
    elif k >= n - 1 and nadal > real(DERAILED_RATIO):
        reason = 1
    terms[env, 1] = _bounded(hunting)
    terms[env, 2] = _bounded(excursion)
    terms[env, 3] = _bounded((ride / weights[6]) ** 2)
    terms[env, 4] = effort if effort == effort else real(1.0)
    terms[env, 5] = real(1.0) if reason else real(0.0)
    terms[env, 6] = real(reason)
    total = weights[4] * terms[env, 5]
    for i in range(4):
        total += weights[i] * terms[env, 1 + i]
    terms[env, 0] = -total


@inline
def _scramble(z):
    """A well-mixed 64-bit number from a counter (splitmix64)."""
    z = z + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@inline
def _uniform(z):
    return (float(z >> np.uint64(11)) + 0.5) * (1.0 / 9007199254740992.0)


@inline
def _normal(seed, counter):
    """A standard normal number of a seed and a counter (Box and Muller)."""
    first = _scramble(seed ^ _scramble(np.uint64(2 * counter)))
    second = _scramble(seed ^ _scramble(np.uint64(2 * counter + 1)))
    return math.sqrt(-2.0 * math.log(_uniform(first))) * math.cos(6.283185307179586 * _uniform(second))


@inline
def _observed(value, scale, bound):
    """A scaled observation within its bounds; what is not a number shows as the bound."""
    x = value / scale
    return min(max(x, -bound), bound) if x == x else bound


@jit
def read_sensors(w, e, lane, env, seeds, noise, out):
    """Readings with noise and bias: accelerometer and gyro of each sensed body."""
    base = N_PLANT + 2 * N_ACTUATORS
    k = int(e[E_STEP * L + lane])
    for i in range(2 * N_SENSED):
        error = noise[i % 2] * _normal(seeds[env], 2 * N_SENSED * k + i)
        out[i] = w[(base + i) * L + lane] + e[(E_BIAS + i) * L + lane] + error


@jit
def observe(w, e, lane, env, seeds, noise, scales, bound, full, delay_row, slots, obs):
    """Write the observation of one environment."""
    j = 0
    if full:
        for i in range(NX):
            obs[env, j] = _observed(w[i * L + lane], scales[j], bound)
            j += 1
        k = int(e[E_STEP * L + lane])
        for a in range(N_ACTUATORS):  # commands given and not yet arrived, the latest first
            for age in range(1, slots):
                slot = (k + slots - age) % slots
                command = e[(delay_row + a * slots + slot) * L + lane]
                obs[env, j] = _observed(command, e[(E_LIMIT + a) * L + lane], bound)
                j += 1
    else:
        readings = np.empty(2 * N_SENSED)
        read_sensors(w, e, lane, env, seeds, noise, readings)
        for i in range(2 * N_SENSED):
            obs[env, j] = _observed(readings[i], scales[j], bound)
            j += 1
    speed = w[C_SPEED * L + lane]
    deficiency = (
        speed * speed * w[C_CURVATURE * L + lane] / e[E_GRAVITY * L + lane] - w[C_CANT * L + lane]
    )
    obs[env, j] = _observed(speed, scales[j], bound)
    obs[env, j + 1] = _observed(deficiency, scales[j + 1], bound)
    if full:
        obs[env, j + 2] = _observed(w[C_CANT * L + lane], scales[j + 2], bound)


@jit
def control_step(w, e, first, count, actions, plan, real_plan, arrays):
    """Advance the environments of one block by one control period.

    plan: (steps before, steps after the command changes, slots of the delay line, full observation,
    longest window of Y and Q);
    real_plan: (step before, step after, spacing of the line, bound of observations).
    """
    lines, window, weights, noise, scales, seeds, obs, terms, ring = arrays
    before, after, slots, full, longest = plan
    h_before, h_after, spacing, bound = real_plan
    delay_row = E_WINDOWS + 2 * N_WHEELS * longest
    for lane in range(L):
        slot = int(e[E_STEP * L + lane]) % slots
        for a in range(N_ACTUATORS):
            command = actions[first + lane, a] if lane < count else real(0.0)
            command = min(max(command, real(-1.0)), real(1.0))
            e[(delay_row + a * slots + slot) * L + lane] = command * e[(E_LIMIT + a) * L + lane]
    if before:
        set_commands(w, e, delay_row, slots, slots - 1)
        advance(w, e, h_before, before, lines, spacing)
    set_commands(w, e, delay_row, slots, slots - 2)
    advance(w, e, h_after, after, lines, spacing)
    set_track(w, e, real(0.0), lines, spacing)
    signals(w)
    for lane in range(count):
        assess(w, e, lane, first + lane, longest, window, weights, terms, ring)
        e[E_STEP * L + lane] += real(1.0)
        observe(w, e, lane, first + lane, seeds, noise, scales, bound, full, delay_row, slots, obs)


@jit
def control_steps(blocks, extras, actions, plan, real_plan, arrays):
    """Advance a fleet by one control period, on one thread."""
    for b in range(blocks.shape[0]):
        count = min(L, actions.shape[0] - b * L)
        control_step(blocks[b], extras[b], b * L, count, actions, plan, real_plan, arrays)


@parallel_jit
def control_steps_parallel(blocks, extras, actions, plan, real_plan, arrays):
    """Advance a fleet by one control period, on all threads."""
    for b in prange(blocks.shape[0]):
        count = min(L, actions.shape[0] - b * L)
        control_step(blocks[b], extras[b], b * L, count, actions, plan, real_plan, arrays)


@jit
def observe_one(w, e, lane, env, plan, real_plan, arrays):
    """Place one environment on its track and write its observation, at a reset."""
    lines, _, _, noise, scales, seeds, obs, _, _ = arrays
    _, _, slots, full, longest = plan
    _, _, spacing, bound = real_plan
    set_track(w, e, real(0.0), lines, spacing)
    observe(w, e, lane, env, seeds, noise, scales, bound, full, E_WINDOWS + 2 * N_WHEELS * longest, slots, obs)
