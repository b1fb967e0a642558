"""Dense output: Hairer's nested form for all methods but `taylor`, whose series are used as they are."""

from symgen.runtime.code.jitted import jitted

N_DENSE = 8


@jitted
def evaluate_series(theta, series, n_terms, n, out):
    """Write Σ θ^k series[k] over `n_terms` rows into `out[:n]` (Horner)."""
    for i in range(n):
        out[i] = series[n_terms - 1, i]
    for k in range(n_terms - 2, -1, -1):
        for i in range(n):
            out[i] = out[i] * theta + series[k, i]


@jitted
def evaluate_dense(theta, dense, n_terms, n, out):
    """Write y(θ) = d0 + θ (d1 + (1-θ)(d2 + θ (d3 + ...))) into `out[:n]`; d0 + θ (d1 + θ (d2 + ...)) for a series.

    Hairer, Nørsett, Wanner, Solving ODEs I (1993), II.6 and CONTD8 of dop853.f.

    Parameters
    ----------
    theta : float
        Place in the step, 0 to 1.
    dense : ndarray, shape (8, n)
        Coefficients d0, d1, ... of the step.
    n_terms : int
        How many rows of `dense` are used; negative for a power series in θ.
    n : int
        Number of components.
    out : ndarray, shape (n,)
    """
    if n_terms < 0:
        evaluate_series(theta, dense, -n_terms, n, out)
        return
    for i in range(n):
        out[i] = dense[n_terms - 1, i]
    for j in range(n_terms - 2, -1, -1):
        factor = theta if j % 2 == 0 else 1.0 - theta
        for i in range(n):
            out[i] = out[i] * factor + dense[j, i]


@jitted
def hermite_dense(y0, y1, f0, f1, h, n, dense):
    """Fill the first 4 rows of `dense` with the cubic Hermite interpolant of a step.

    Parameters
    ----------
    y0, y1 : ndarray, shape (n,)
        States at both ends.
    f0, f1 : ndarray, shape (n,)
        Derivatives at both ends.
    h : float [s]
    n : int
    dense : ndarray, shape (8, n)
        Overwritten in place.
    """
    for i in range(n):
        rise = y1[i] - y0[i]
        bend = h * f0[i] - rise
        dense[0, i] = y0[i]
        dense[1, i] = rise
        dense[2, i] = bend
        dense[3, i] = rise - h * f1[i] - bend
