"""The stages of dop853, written out: tiny models spend more time in loops over coefficients than in their physics."""

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted


@jitted(distinct_arrays=True)
def dop853_stages(method, rhs, t, h, y, p, k, y_stage):
    """Fill rows 1 to 11 of `k`; row 0 is given, and `y_stage` is left at the argument of row 11.

    The same as `explicit.erk_stages` with the zeros of the tableau left out.
    """
    a, c, n = method.a, method.c, y.shape[0]
    a0 = h * a[1, 0]
    for i in range(n):
        y_stage[i] = y[i] + (a0 * k[0, i])
    call_kernel(rhs, t + c[1] * h, y_stage, p, k[1])
    a0, a1 = h * a[2, 0], h * a[2, 1]
    for i in range(n):
        y_stage[i] = y[i] + (a0 * k[0, i] + a1 * k[1, i])
    call_kernel(rhs, t + c[2] * h, y_stage, p, k[2])
    a0, a2 = h * a[3, 0], h * a[3, 2]
    for i in range(n):
        y_stage[i] = y[i] + (a0 * k[0, i] + a2 * k[2, i])
    call_kernel(rhs, t + c[3] * h, y_stage, p, k[3])
    a0, a2, a3 = h * a[4, 0], h * a[4, 2], h * a[4, 3]
    for i in range(n):
        y_stage[i] = y[i] + (a0 * k[0, i] + a2 * k[2, i] + a3 * k[3, i])
    call_kernel(rhs, t + c[4] * h, y_stage, p, k[4])
    a0, a3, a4 = h * a[5, 0], h * a[5, 3], h * a[5, 4]
    for i in range(n):
        y_stage[i] = y[i] + (a0 * k[0, i] + a3 * k[3, i] + a4 * k[4, i])
    call_kernel(rhs, t + c[5] * h, y_stage, p, k[5])
    a0, a3, a4, a5 = h * a[6, 0], h * a[6, 3], h * a[6, 4], h * a[6, 5]
    for i in range(n):
        y_stage[i] = y[i] + (a0 * k[0, i] + a3 * k[3, i] + a4 * k[4, i] + a5 * k[5, i])
    call_kernel(rhs, t + c[6] * h, y_stage, p, k[6])
    a0, a3, a4, a5, a6 = h * a[7, 0], h * a[7, 3], h * a[7, 4], h * a[7, 5], h * a[7, 6]
    for i in range(n):
        y_stage[i] = y[i] + (a0 * k[0, i] + a3 * k[3, i] + a4 * k[4, i] + a5 * k[5, i] + a6 * k[6, i])
    call_kernel(rhs, t + c[7] * h, y_stage, p, k[7])
    a0, a3, a4, a5, a6, a7 = h * a[8, 0], h * a[8, 3], h * a[8, 4], h * a[8, 5], h * a[8, 6], h * a[8, 7]
    for i in range(n):
        y_stage[i] = y[i] + (
            a0 * k[0, i] + a3 * k[3, i] + a4 * k[4, i] + a5 * k[5, i] + a6 * k[6, i] + a7 * k[7, i]
        )
    call_kernel(rhs, t + c[8] * h, y_stage, p, k[8])
    a0, a3, a4, a5, a6, a7, a8 = (
        h * a[9, 0],
        h * a[9, 3],
        h * a[9, 4],
        h * a[9, 5],
        h * a[9, 6],
        h * a[9, 7],
        h * a[9, 8],
    )
    for i in range(n):
        y_stage[i] = y[i] + (
            a0 * k[0, i]
            + a3 * k[3, i]
            + a4 * k[4, i]
            + a5 * k[5, i]
            + a6 * k[6, i]
            + a7 * k[7, i]
            + a8 * k[8, i]
        )
    call_kernel(rhs, t + c[9] * h, y_stage, p, k[9])
    a0, a3, a4, a5, a6, a7, a8, a9 = (
        h * a[10, 0],
        h * a[10, 3],
        h * a[10, 4],
        h * a[10, 5],
        h * a[10, 6],
        h * a[10, 7],
        h * a[10, 8],
        h * a[10, 9],
    )
    for i in range(n):
        y_stage[i] = y[i] + (
            a0 * k[0, i]
            + a3 * k[3, i]
            + a4 * k[4, i]
            + a5 * k[5, i]
            + a6 * k[6, i]
            + a7 * k[7, i]
            + a8 * k[8, i]
            + a9 * k[9, i]
        )
    call_kernel(rhs, t + c[10] * h, y_stage, p, k[10])
    a0, a3, a4, a5, a6, a7, a8, a9, a10 = (
        h * a[11, 0],
        h * a[11, 3],
        h * a[11, 4],
        h * a[11, 5],
        h * a[11, 6],
        h * a[11, 7],
        h * a[11, 8],
        h * a[11, 9],
        h * a[11, 10],
    )
    for i in range(n):
        y_stage[i] = y[i] + (
            a0 * k[0, i]
            + a3 * k[3, i]
            + a4 * k[4, i]
            + a5 * k[5, i]
            + a6 * k[6, i]
            + a7 * k[7, i]
            + a8 * k[8, i]
            + a9 * k[9, i]
            + a10 * k[10, i]
        )
    call_kernel(rhs, t + c[11] * h, y_stage, p, k[11])


@jitted(distinct_arrays=True)
def dop853_new_state(b, h, y, k, y_new):
    """Write the state at the end of the step to `y_new`."""
    b0, b5, b6, b7, b8, b9, b10, b11 = (
        h * b[0],
        h * b[5],
        h * b[6],
        h * b[7],
        h * b[8],
        h * b[9],
        h * b[10],
        h * b[11],
    )
    for i in range(y.shape[0]):
        y_new[i] = y[i] + (
            b0 * k[0, i]
            + b5 * k[5, i]
            + b6 * k[6, i]
            + b7 * k[7, i]
            + b8 * k[8, i]
            + b9 * k[9, i]
            + b10 * k[10, i]
            + b11 * k[11, i]
        )


@jitted(distinct_arrays=True)
def dop853_error(error, k, n, fifth, third):
    """Write the two error estimates, without their factor h, to `fifth[:n]` and `third[:n]`."""
    e, d = error[0], error[1]
    for i in range(n):
        fifth[i] = (
            e[0] * k[0, i]
            + e[5] * k[5, i]
            + e[6] * k[6, i]
            + e[7] * k[7, i]
            + e[8] * k[8, i]
            + e[9] * k[9, i]
            + e[10] * k[10, i]
            + e[11] * k[11, i]
        )
        third[i] = (
            d[0] * k[0, i]
            + d[5] * k[5, i]
            + d[6] * k[6, i]
            + d[7] * k[7, i]
            + d[8] * k[8, i]
            + d[9] * k[9, i]
            + d[10] * k[10, i]
            + d[11] * k[11, i]
        )
