"""Dense output of the one-stage implicit methods."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, quaternion_rate


@jitted
def one_stage_dense(method, sizes, h, y0, y1, dense):
    """Fill `dense` with the method's own interpolant: v linear, q linear (Euler) or the integral of v."""
    nq = sizes[at.NQ]
    for i in range(sizes[at.NY]):
        dense[0, i] = y0[i]
        dense[1, i] = y1[i] - y0[i]
        dense[2, i] = 0.0
    if method.n_dense == 3:
        start = 0
        for k in range(n_quaternions(sizes) + 1):
            end = quaternion_at(sizes, k)
            for i in range(start, end):
                dense[2, i] = -0.5 * h * dense[1, nq + i - k]
            if end < nq:
                bend_quaternion(h, y0, y1, end, nq + end - k, dense[2])
            start = end + 4


@jitted
def bend_quaternion(h, y0, y1, i, j, bend):
    """Write half the change of h q' over the step for the quaternion at `i`, whose rates are at `j`."""
    w0, x0, y_0, z0 = quaternion_rate(y0, i, y0[j], y0[j + 1], y0[j + 2])
    w1, x1, y_1, z1 = quaternion_rate(y1, i, y1[j], y1[j + 1], y1[j + 2])
    bend[i], bend[i + 1] = 0.5 * h * (w0 - w1), 0.5 * h * (x0 - x1)
    bend[i + 2], bend[i + 3] = 0.5 * h * (y_0 - y_1), 0.5 * h * (z0 - z1)
