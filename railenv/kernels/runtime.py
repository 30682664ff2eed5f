"""Elementary functions and integrators that complete every model's generated kernels.

This file is a text that :mod:`railenv.kernels.loader` joins with a header (L, real, the compiling
decorators) and a model's generated kernels; it is not imported as it stands.
"""

# ruff: noqa: E402, F821
# mypy: ignore-errors


@intrinsic
def _fma(typingcontext, a, b, c):
    """Return a*b + c with one rounding, the same in every lane on every processor."""

    def codegen(context, builder, signature, arguments):
        return builder.fma(*arguments)

    return a(a, a, a), codegen


@inline
def _quadrant(x):
    """Nearest whole number to x / (pi/2), by adding and taking away a number without fractions."""
    return _fma(x, real(0.6366197723675814), ROUNDER) - ROUNDER


@inline
def _reduced(x, n):
    """Subtract n * pi/2 from x, with pi/2 in three parts (Cody and Waite)."""
    r = _fma(-n, real(1.570796310901641845703125), x)
    r = _fma(-n, real(1.589325471229585673428e-8), r)
    return _fma(-n, real(6.12323399573676614e-17), r)


@inline
def _odd(n):
    """1 where the whole number n is odd, else 0."""
    half = n * real(0.5)
    return abs(half - ((half + ROUNDER) - ROUNDER)) * real(2.0)


@inline
def _tan(x):
    """Tangent without a branch or a library call, so that lanes vectorise (Cephes' rational)."""
    n = _quadrant(x)
    r = _reduced(x, n)
    z = r * r
    p = _fma(real(-13093.693918138379), z, real(1153516.6483858742))
    p = _fma(p, z, real(-17956525.19764849))
    q = z + real(13681.296347069295)
    q = _fma(q, z, real(-1320892.3444021097))
    q = _fma(q, z, real(25008380.18233579))
    q = _fma(q, z, real(-53869575.59294546))
    top = _fma(r * z, p, r * q)  # tan r = r + r z p/q
    odd = _odd(n) > real(0.5)
    return (-q if odd else top) / (top if odd else q)


@inline
def _sin_polynomial(r):
    z = r * r
    s = _fma(real(1.5896230157654656e-10), z, real(-2.5050747762857807e-8))
    s = _fma(s, z, real(2.7557313621385722e-6))
    s = _fma(s, z, real(-1.984126982958954e-4))
    s = _fma(s, z, real(8.333333333322118e-3))
    s = _fma(s, z, real(-0.16666666666666666))
    return _fma(r * z, s, r)


@inline
def _cos_polynomial(r):
    z = r * r
    c = _fma(real(-1.1358536521387682e-11), z, real(2.08757008419747317e-9))
    c = _fma(c, z, real(-2.7557314179273977e-7))
    c = _fma(c, z, real(2.4801587288851704e-5))
    c = _fma(c, z, real(-1.3888888888873056e-3))
    c = _fma(c, z, real(4.1666666666666595e-2))
    return _fma(z * z, c, _fma(real(-0.5), z, real(1.0)))


@inline
def _sin_shifted(x, quarters):
    """Return sin(x + quarters * pi/2)."""
    n = _quadrant(x)
    r = _reduced(x, n)
    m = n + quarters
    value = _cos_polynomial(r) if _odd(m) > real(0.5) else _sin_polynomial(r)
    upper = m - _odd(m)  # even; a multiple of 4 where the sine is positive
    return -value if _odd(upper * real(0.5)) > real(0.5) else value


@inline
def _sin(x):
    return _sin_shifted(x, real(0.0))


@inline
def _cos(x):
    return _sin_shifted(x, real(1.0))


# --- kernels go here ---

from railenv.kernels.layout import Layout

LAYOUT = Layout(len(STATES), len(INPUTS), len(PARAMETERS), len(CELLS), N_SIGNALS, len(PARAMETER_CELLS))
NX = LAYOUT.n_states
U = LAYOUT.u
DX = LAYOUT.dx
X0 = LAYOUT.work
ACC = LAYOUT.work + NX
J = LAYOUT.j
Q = LAYOUT.q


@jit
def rk4_step(w, h):
    """One step of the classical Runge-Kutta method, inputs and conditions held; h in s."""
    n = NX * L
    half, sixth = real(0.5) * h, h / real(6.0)
    rhs(w)
    for i in range(n):
        w[X0 * L + i] = w[i]
        w[ACC * L + i] = w[DX * L + i]
        w[i] = _fma(half, w[DX * L + i], w[X0 * L + i])
    rhs(w)
    for i in range(n):
        w[ACC * L + i] = _fma(real(2.0), w[DX * L + i], w[ACC * L + i])
        w[i] = _fma(half, w[DX * L + i], w[X0 * L + i])
    rhs(w)
    for i in range(n):
        w[ACC * L + i] = _fma(real(2.0), w[DX * L + i], w[ACC * L + i])
        w[i] = _fma(h, w[DX * L + i], w[X0 * L + i])
    rhs(w)
    for i in range(n):
        w[i] = _fma(sixth, w[ACC * L + i] + w[DX * L + i], w[X0 * L + i])


@jit
def rk4_hold(w, h, steps):
    """Integrate some steps with inputs and conditions held."""
    for _ in range(steps):
        rk4_step(w, h)


@jit
def rk4_record(w, h, stride, out):
    """Integrate with inputs and conditions held, storing every stride-th state in a row of out.

    The first row is the initial state. Returns the number of rows stored before a state was no longer
    finite.
    """
    n = NX * L
    for i in range(n):
        out[0, i] = w[i]
    for row in range(1, out.shape[0]):
        for _ in range(stride):
            rk4_step(w, h)
        total = real(0.0)
        for i in range(n):
            out[row, i] = w[i]
            total += w[i] * real(0.0)
        if total != real(0.0):
            return row
    return out.shape[0]


@jit
def rk4_driven(w, h, stride, drive, out):
    """Like rk4_record, with inputs and conditions that vary: scalar kernels only (L = 1).

    Row i of drive holds them (u, then c) at the time i h/2, so that every stage of a step sees its
    own values and the method keeps its order.
    """
    half, sixth = real(0.5) * h, h / real(6.0)
    width = drive.shape[1]
    for i in range(NX):
        out[0, i] = w[i]
    k = 0
    for row in range(1, out.shape[0]):
        for _ in range(stride):
            for i in range(width):
                w[U + i] = drive[2 * k, i]
            rhs(w)
            for i in range(NX):
                w[X0 + i] = w[i]
                w[ACC + i] = w[DX + i]
                w[i] = _fma(half, w[DX + i], w[X0 + i])
            for i in range(width):
                w[U + i] = drive[2 * k + 1, i]
            rhs(w)
            for i in range(NX):
                w[ACC + i] = _fma(real(2.0), w[DX + i], w[ACC + i])
                w[i] = _fma(half, w[DX + i], w[X0 + i])
            rhs(w)
            for i in range(NX):
                w[ACC + i] = _fma(real(2.0), w[DX + i], w[ACC + i])
                w[i] = _fma(h, w[DX + i], w[X0 + i])
            for i in range(width):
                w[U + i] = drive[2 * k + 2, i]
            rhs(w)
            for i in range(NX):
                w[i] = _fma(sixth, w[ACC + i] + w[DX + i], w[X0 + i])
            k += 1
        total = real(0.0)
        for i in range(NX):
            out[row, i] = w[i]
            total += w[i] * real(0.0)
        if total != real(0.0):
            return row
    return out.shape[0]


@jit
def dense_jacobian(w, rows, columns, out):
    """Scatter the Jacobian at the buffer's state into a dense zeroed array; scalar kernels only."""
    jacobian(w)
    for k in range(rows.shape[0]):
        out[rows[k], columns[k]] = w[J + k]


@jit
def _solve(A, b):
    """Solve A x = b by elimination with row pivoting; A and b are used up. False where singular."""
    n = A.shape[0]
    for i in range(n):
        pivot = i
        for r in range(i + 1, n):
            if abs(A[r, i]) > abs(A[pivot, i]):
                pivot = r
        if not abs(A[pivot, i]) > 0.0:
            return False
        if pivot != i:
            for c in range(i, n):
                A[i, c], A[pivot, c] = A[pivot, c], A[i, c]
            b[i], b[pivot] = b[pivot], b[i]
        for r in range(i + 1, n):
            factor = A[r, i] / A[i, i]
            if factor != 0.0:
                for c in range(i + 1, n):
                    A[r, c] -= factor * A[i, c]
                b[r] -= factor * b[i]
    for i in range(n - 1, -1, -1):
        for c in range(i + 1, n):
            b[i] -= A[i, c] * b[c]
        b[i] /= A[i, i]
    return True


@jit
def newton_equilibrium(w, rows, columns, scale, A, b):
    """Newton's method from the buffer's state to an equilibrium; True where it converges."""
    for _ in range(12):
        rhs(w)
        jacobian(w)
        A[:] = 0.0
        for k in range(rows.shape[0]):
            if columns[k] < NX:
                A[rows[k], columns[k]] = w[J + k]
        for i in range(NX):
            b[i] = w[DX + i]
        if not _solve(A, b):
            return False
        size = 0.0
        for i in range(NX):
            w[i] -= b[i]
            size = max(size, abs(b[i]) / scale[i])
        if not size < 1e3:
            return False
        if size < 1e-8:
            return True
    return False


@jit
def follow_curve(w, rows, columns, scale, curvature, cant, out):
    """Equilibria at equal shares of a curve from none to all of it, rows of out; scalar kernels only.

    The buffer holds the speed and the equilibrium on tangent track. Shares are halved where Newton's
    method from the extrapolated state does not converge or ends far from it. Returns the number of rows
    found.
    """
    nodes = out.shape[0] - 1
    A, b = np.empty((NX, NX)), np.empty(NX)
    here, before, guess = np.empty(NX), np.empty(NX), np.empty(NX)
    share, back = 0.0, 0.0
    for i in range(NX):
        out[0, i] = here[i] = before[i] = w[i]
    for node in range(1, nodes + 1):
        target, step = node / nodes, 1.0 / nodes
        while share < target:
            ahead = target if step > target - share - 1e-12 else share + step
            stretch = (ahead - share) / back if back > 0.0 else 0.0
            for i in range(NX):
                guess[i] = here[i] + stretch * (here[i] - before[i])
                w[i] = guess[i]
            w[U + len(INPUTS) + 1] = ahead * curvature
            w[U + len(INPUTS) + 2] = ahead * cant
            good = newton_equilibrium(w, rows, columns, scale, A, b)
            if good:
                miss = change = 0.0
                for i in range(NX):
                    miss = max(miss, abs(w[i] - guess[i]) / scale[i])
                    change = max(change, abs(w[i] - here[i]) / scale[i])
                good = miss < 0.2 or miss < 0.5 * change
            if not good:
                step *= 0.5
                if step < 1e-4:
                    return node
                continue
            for i in range(NX):
                before[i], here[i] = here[i], w[i]
            back, share = ahead - share, ahead
            step = min(2.0 * step, 1.0 / nodes)
        for i in range(NX):
            out[node, i] = here[i]
    return nodes + 1


@jit
def dense_parameter_jacobian(w, rows, columns, out):
    """Scatter the derivatives by the parameters into a dense zeroed array; scalar kernels only."""
    parameter_jacobian(w)
    for k in range(rows.shape[0]):
        out[rows[k], columns[k]] = w[Q + k]


@inline
def _slopes(w, period, cells, directions, m, k):
    """Compute derivatives k of the slope (per period) for derivatives m of the state.

    Columns of m: initial state, period, then one parameter for each column of ``directions``, which
    holds the derivatives of inputs and conditions with respect to it.
    """
    rhs(w)
    jacobian(w)
    width = m.shape[1]
    k[:] = 0.0
    for e in range(cells.shape[1]):
        row, column, value = cells[0, e], cells[1, e], period * w[J + e]
        if column < NX:
            for j in range(width):
                k[row, j] += value * m[column, j]
        else:
            for j in range(directions.shape[1]):
                k[row, NX + 1 + j] += value * directions[column - NX, j]
    for i in range(NX):
        k[i, NX] += w[DX + i]


@inline
def _parameter_slopes(w, period, cells, directions, k):
    """Add to the slopes what comes from the parameters of the equations."""
    parameter_jacobian(w)
    for e in range(cells.shape[1]):
        row, column = cells[0, e], cells[1, e]
        for j in range(directions.shape[1]):
            k[row, NX + 1 + j] += period * w[Q + e] * directions[column, j]


@inline
def _stage(w, stage, h, period, x, dx, m0, m, acc, k):
    """Finish one of the four stages of a Runge-Kutta step of the state and of its derivatives."""
    weight = 1.0 if stage in (0, 3) else 2.0
    ahead = 1.0 if stage == 2 else 0.5
    for i in range(NX):
        slope = period * w[DX + i]
        dx[i] = weight * slope + (dx[i] if stage else 0.0)
        w[i] = x[i] + (ahead * h * slope if stage < 3 else h / 6.0 * dx[i])
        for j in range(m.shape[1]):
            acc[i, j] = weight * k[i, j] + (acc[i, j] if stage else 0.0)
            m[i, j] = m0[i, j] + (ahead * h * k[i, j] if stage < 3 else h / 6.0 * acc[i, j])


@jit
def rk4_sensitivity(w, period, mesh, cells, directions, m, states):
    """Integrate over one period, with the exact derivatives of every step; scalar kernels only.

    Steps end at the fractions ``mesh`` of the period, the first of them 0. Row i of ``states`` becomes
    the state at mesh[i]; m becomes the derivatives of the last state with respect to the first one, the
    period and parameters (see _slopes). They are those of the discrete steps, not of the flow.
    """
    m[:] = 0.0
    for i in range(NX):
        m[i, i] = 1.0
        states[0, i] = w[i]
    acc, k, dx = np.empty_like(m), np.empty_like(m), np.empty(NX)
    m0 = np.empty_like(m)
    for step in range(mesh.shape[0] - 1):
        h = mesh[step + 1] - mesh[step]
        m0[:] = m
        for stage in range(4):
            _slopes(w, period, cells, directions, m, k)
            _stage(w, stage, h, period, states[step], dx, m0, m, acc, k)
        for i in range(NX):
            states[step + 1, i] = w[i]


@jit
def rk4_parameter_sensitivity(w, period, mesh, cells, directions, pcells, pdirections, m, states):
    """Like rk4_sensitivity, with derivatives by parameters of the equations too (pdirections)."""
    m[:] = 0.0
    for i in range(NX):
        m[i, i] = 1.0
        states[0, i] = w[i]
    acc, k, dx = np.empty_like(m), np.empty_like(m), np.empty(NX)
    m0 = np.empty_like(m)
    for step in range(mesh.shape[0] - 1):
        h = mesh[step + 1] - mesh[step]
        m0[:] = m
        for stage in range(4):
            _slopes(w, period, cells, directions, m, k)
            _parameter_slopes(w, period, pcells, pdirections, k)
            _stage(w, stage, h, period, states[step], dx, m0, m, acc, k)
        for i in range(NX):
            states[step + 1, i] = w[i]


@jit
def rhs_blocks(blocks):
    """Evaluate the right-hand side of every block of L lanes."""
    for b in range(blocks.shape[0]):
        rhs(blocks[b])


@jit
def rk4_blocks(blocks, h, steps):
    """Integrate blocks of L lanes, one after the other on one thread."""
    for b in range(blocks.shape[0]):
        rk4_hold(blocks[b], h, steps)


@parallel_jit
def rk4_blocks_parallel(blocks, h, steps):
    """Integrate blocks of L lanes on all threads."""
    for b in prange(blocks.shape[0]):
        rk4_hold(blocks[b], h, steps)
