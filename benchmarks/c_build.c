/* Elementary functions and integrator of the C build, as in railenv/kernels/texts/integrators.pyk.

   A text that benchmarks/c_build.py puts a header before (L, NX and rows of the buffer) and a model's
   right-hand side into; it does not compile as it stands. */

#define INLINE static inline __attribute__((always_inline))
#define ROUNDER 6755399441055744.0 /* 1.5 * 2^52 */

INLINE double _fma(double a, double b, double c) { return __builtin_fma(a, b, c); }

INLINE double _quadrant(double x) { return _fma(x, 0.6366197723675814, ROUNDER) - ROUNDER; }

INLINE double _reduced(double x, double n)
{
    double r = _fma(-n, 1.570796310901641845703125, x);
    r = _fma(-n, 1.589325471229585673428e-8, r);
    return _fma(-n, 6.12323399573676614e-17, r);
}

INLINE double _odd(double n)
{
    double half = n * 0.5;
    return __builtin_fabs(half - ((half + ROUNDER) - ROUNDER)) * 2.0;
}

INLINE double _tan(double x)
{
    double n = _quadrant(x);
    double r = _reduced(x, n);
    double z = r * r;
    double p = _fma(-13093.693918138379, z, 1153516.6483858742);
    p = _fma(p, z, -17956525.19764849);
    double q = z + 13681.296347069295;
    q = _fma(q, z, -1320892.3444021097);
    q = _fma(q, z, 25008380.18233579);
    q = _fma(q, z, -53869575.59294546);
    double top = _fma(r * z, p, r * q);
    int odd = _odd(n) > 0.5;
    return (odd ? -q : top) / (odd ? top : q);
}

INLINE double _sin_polynomial(double r)
{
    double z = r * r;
    double s = _fma(1.5896230157654656e-10, z, -2.5050747762857807e-8);
    s = _fma(s, z, 2.7557313621385722e-6);
    s = _fma(s, z, -1.984126982958954e-4);
    s = _fma(s, z, 8.333333333322118e-3);
    s = _fma(s, z, -0.16666666666666666);
    return _fma(r * z, s, r);
}

INLINE double _cos_polynomial(double r)
{
    double z = r * r;
    double c = _fma(-1.1358536521387682e-11, z, 2.08757008419747317e-9);
    c = _fma(c, z, -2.7557314179273977e-7);
    c = _fma(c, z, 2.4801587288851704e-5);
    c = _fma(c, z, -1.3888888888873056e-3);
    c = _fma(c, z, 4.1666666666666595e-2);
    return _fma(z * z, c, _fma(-0.5, z, 1.0));
}

INLINE double _sin_shifted(double x, double quarters)
{
    double n = _quadrant(x);
    double r = _reduced(x, n);
    double m = n + quarters;
    double value = _odd(m) > 0.5 ? _cos_polynomial(r) : _sin_polynomial(r);
    double upper = m - _odd(m);
    return _odd(upper * 0.5) > 0.5 ? -value : value;
}

INLINE double _sin(double x) { return _sin_shifted(x, 0.0); }
INLINE double _cos(double x) { return _sin_shifted(x, 1.0); }

/* --- right-hand side goes here --- */

static void rk4_step(double *restrict w, double h)
{
    double *restrict x = w, *restrict dx = w + DX * L, *restrict x0 = w + X0 * L;
    double *restrict acc = w + ACC * L;
    double half = 0.5 * h, sixth = h / 6.0;
    rhs(w);
    for (int i = 0; i < NX * L; i++) {
        x0[i] = x[i];
        acc[i] = dx[i];
        x[i] = _fma(half, dx[i], x0[i]);
    }
    rhs(w);
    for (int i = 0; i < NX * L; i++) {
        acc[i] = _fma(2.0, dx[i], acc[i]);
        x[i] = _fma(half, dx[i], x0[i]);
    }
    rhs(w);
    for (int i = 0; i < NX * L; i++) {
        acc[i] = _fma(2.0, dx[i], acc[i]);
        x[i] = _fma(h, dx[i], x0[i]);
    }
    rhs(w);
    for (int i = 0; i < NX * L; i++)
        x[i] = _fma(sixth, acc[i] + dx[i], x0[i]);
}

void rk4_blocks(double *w, long blocks, double h, long steps)
{
    for (long b = 0; b < blocks; b++)
        for (long k = 0; k < steps; k++)
            rk4_step(w + b * WIDTH * L, h);
}

void rhs_blocks(double *w, long blocks)
{
    for (long b = 0; b < blocks; b++)
        rhs(w + b * WIDTH * L);
}
