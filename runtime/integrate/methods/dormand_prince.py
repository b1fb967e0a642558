"""The explicit methods of Dormand and Prince: 5(4), and 8(5,3)."""

import functools

from symgen.runtime.integrate.explicit.method import explicit_runge_kutta
from symgen.runtime.integrate.explicit.tableau import Control, ErkTableau, erk_tableau
from symgen.runtime.integrate.method import resolve


@functools.cache
def dopri5() -> ErkTableau:
    """Return Dormand and Prince's method of order 5(4) with dense output of order 4.

    Dormand, Prince, J. Comp. Appl. Math. 6 (1980) 19; Hairer, Nørsett, Wanner (1993), table II.5.2, and the dense
    output of dopri5.f.
    """
    a = [
        [],
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
    error = [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40]
    dense = [
        -12715105075 / 11282082432,
        0,
        87487479700 / 32700410799,
        -10690763975 / 1880347072,
        701980252875 / 199316789632,
        -1453857185 / 822651844,
        69997945 / 29380423,
    ]
    return erk_tableau(
        a, [*a[-1], 0], 5, error=[error], dense=[dense], control=Control(5, stiff_bound=3.25, beta=0.04)
    )  # fmt: skip


def dop853() -> ErkTableau:
    """Return Dormand and Prince's method of order 8(5,3)."""
    return resolve("symgen.runtime.integrate.explicit.dop853:dop853")()


RECORDS = (
    *explicit_runge_kutta(
        "dopri5",
        dopri5,
        order=5,
        dense_order=4,
        evaluations=6,
        purpose="smooth motion at low accuracy",
        adaptive=True,
    ),
    *explicit_runge_kutta(
        "dop853",
        dop853,
        order=8,
        dense_order=7,
        evaluations=12,
        purpose="smooth motion of large models; forces with `abs`, `min`, `max`; what `auto` takes otherwise",
        adaptive=True,
        suits_forms=True,
    ),
)
