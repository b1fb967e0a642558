"""Positions with unit quaternions: how rates move them, and rotation vectors as coordinates within a step.

The derivative of a quaternion is q' = q (0, w) / 2, with w the angular velocity in body axes; every other
coordinate's is its rate. Behind the events' directions `sizes` holds where each quaternion begins in q, and NQ at
the end; NQ - NV of them, since each has three rates for its four coordinates. A quaternion that begins at `i`
and has `k` others before it has the rates `i - k`, `i - k + 1` and `i - k + 2`.
"""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import add_compensated

_SMALL = 1e-2  # square of an angle below which series are exact to round-off


@jitted
def n_quaternions(sizes):
    """Return how many quaternions q holds."""
    return sizes[at.NQ] - sizes[at.NV]


@jitted
def quaternion_at(sizes, k):
    """Return where quaternion `k` begins in q; NQ for the one behind the last."""
    return sizes[at.N_SIZES + sizes[at.NE] + k]


@jitted
def scale_to_unit(sizes, q):
    """Scale all quaternions of q to unit length, in place."""
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        length = math.sqrt(q[i] * q[i] + q[i + 1] * q[i + 1] + q[i + 2] * q[i + 2] + q[i + 3] * q[i + 3])
        for j in range(i, i + 4):
            q[j] /= length


@jitted
def keep_lengths(sizes, q, rest):
    """Take off the compensated sums `q` + `rest` what rounding has added to the lengths of quaternions.

    Scaling `q` would leave `rest` without a meaning, and round orientations at every step.
    """
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        excess = q[i] * q[i] + q[i + 1] * q[i + 1] + q[i + 2] * q[i + 2] + q[i + 3] * q[i + 3] - 1.0
        for j in range(i, i + 4):
            add_compensated(-0.5 * excess * q[j], j, q, rest)


@jitted
def rotate(q, i, a, b, c, out):
    """Write the quaternion `q[i:i+4]`, turned by the rotation vector (a, b, c) [rad] in body axes, to `out[i:i+4]`."""
    squared = 0.25 * (a * a + b * b + c * c)
    half = math.sqrt(squared)
    cosine = math.cos(half)
    sinc = 0.5 * (math.sin(half) / half if squared > 0.0 else 1.0)
    a, b, c = sinc * a, sinc * b, sinc * c
    w, x, y, z = q[i], q[i + 1], q[i + 2], q[i + 3]
    out[i] = w * cosine - x * a - y * b - z * c
    out[i + 1] = x * cosine + w * a + y * c - z * b
    out[i + 2] = y * cosine + w * b + z * a - x * c
    out[i + 3] = z * cosine + w * c + x * b - y * a


@jitted
def rotation_between(q, rotated, i):
    """Return the rotation vector [rad] that turns the quaternion `q[i:i+4]` to that of `rotated`, for small ones."""
    w, x, y, z = q[i], q[i + 1], q[i + 2], q[i + 3]
    s, a, b, c = rotated[i], rotated[i + 1], rotated[i + 2], rotated[i + 3]
    return (
        2.0 * (w * a - s * x - y * c + z * b),
        2.0 * (w * b - s * y - z * a + x * c),
        2.0 * (w * c - s * z - x * b + y * a),
    )


@jitted
def retract(sizes, q, scale, rates, first, out):
    """Write q moved by `scale` times `rates[first:first+NV]`: quaternions are turned, the others shifted.

    Parameters
    ----------
    q, out : ndarray
        Their first NQ entries; they may be the same array.
    """
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            out[i] = q[i] + scale * rates[first + i - k]
        if end < sizes[at.NQ]:
            j = first + end - k
            rotate(q, end, scale * rates[j], scale * rates[j + 1], scale * rates[j + 2], out)
        start = end + 4


@jitted
def quaternion_rate(q, i, a, b, c):
    """Return the derivative of the quaternion `q[i:i+4]` at the angular velocity (a, b, c) in body axes."""
    w, x, y, z = 0.5 * q[i], 0.5 * q[i + 1], 0.5 * q[i + 2], 0.5 * q[i + 3]
    return -x * a - y * b - z * c, w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a


@jitted
def chart_rate(a, b, c, u, v, w):
    """Return the derivative of the rotation vector θ = (a, b, c) at the angular velocity ω = (u, v, w).

    θ' = ω + θ×ω / 2 + (1 - |θ|/2 cot(|θ|/2)) / |θ|² θ×(θ×ω), for a rotation that is followed by θ: Iserles,
    Munthe-Kaas, Nørsett, Zanna, Acta Numerica 9 (2000) 215, appendix B, with body axes in place of space axes.
    """
    squared = a * a + b * b + c * c
    if squared < _SMALL:
        third = 1.0 / 12.0 + squared * (1.0 / 720.0 + squared * (1.0 / 30240.0 + squared / 1209600.0))
    else:
        half = 0.5 * math.sqrt(squared)
        third = (1.0 - half / math.tan(half)) / squared
    x, y, z = b * w - c * v, c * u - a * w, a * v - b * u
    return (
        u + 0.5 * x + third * (b * z - c * y),
        v + 0.5 * y + third * (c * x - a * z),
        w + 0.5 * z + third * (a * y - b * x),
    )


@jitted
def chart_variation(a, b, c, x, y, z):
    """Return the small rotation in body axes that a change (x, y, z) of the rotation vector θ = (a, b, c) makes.

    The inverse of `chart_rate`: δ - (1 - cos|θ|) / |θ|² θ×δ + (|θ| - sin|θ|) / |θ|³ θ×(θ×δ).
    """
    squared = a * a + b * b + c * c
    if squared < _SMALL:
        second = 0.5 - squared * (1.0 / 24.0 - squared * (1.0 / 720.0 - squared / 40320.0))
        third = 1.0 / 6.0 - squared * (1.0 / 120.0 - squared * (1.0 / 5040.0 - squared / 362880.0))
    else:
        angle = math.sqrt(squared)
        second = (1.0 - math.cos(angle)) / squared
        third = (angle - math.sin(angle)) / (angle * squared)
    u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
    return (
        x - second * u + third * (b * w - c * v),
        y - second * v + third * (c * u - a * w),
        z - second * w + third * (a * v - b * u),
    )


@jitted
def rotated(a, b, c, x, y, z):
    """Return the vector (x, y, z), turned by the rotation vector θ = (a, b, c).

    Rodrigues: x + sin|θ| / |θ| θ×x + (1 - cos|θ|) / |θ|² θ×(θ×x).
    """
    half = 0.5 * math.sqrt(a * a + b * b + c * c)
    sinc = math.sin(half) / half if half > 0.0 else 1.0
    first, second = sinc * math.cos(half), 0.5 * sinc * sinc
    u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
    return (
        x + first * u + second * (b * w - c * v),
        y + first * v + second * (c * u - a * w),
        z + first * w + second * (a * v - b * u),
    )


@jitted
def solve_rotation(g, a, b, c, x, y, z):
    """Return s of g s + ω×s / 2 = (x, y, z) for the angular velocity ω = (a, b, c); `g` may be complex.

    To first order θ' = ω + δω + θ×ω / 2, so this is g - ∂θ'/∂θ, which Newton's matrices need.
    """
    a, b, c = 0.5 * a, 0.5 * b, 0.5 * c
    along = (a * x + b * y + c * z) / g
    below = g * g + (a * a + b * b + c * c)
    return (
        (g * x - (b * z - c * y) + along * a) / below,
        (g * y - (c * x - a * z) + along * b) / below,
        (g * z - (a * y - b * x) + along * c) / below,
    )


@jitted
def by_rotation(q, i, w, x, y, z):
    """Return derivatives by the rotation vector at `q[i:i+4]` from those, (w, x, y, z), by the quaternion."""
    qw, qx, qy, qz = 0.5 * q[i], 0.5 * q[i + 1], 0.5 * q[i + 2], 0.5 * q[i + 3]
    return (
        qw * x + qz * y - qy * z - qx * w,
        qw * y + qx * z - qz * x - qy * w,
        qw * z + qy * x - qx * y - qz * w,
    )
