"""The explicit method of Bogacki and Shampine: 3(2)."""

import functools

from symgen.runtime.integrate.explicit.method import explicit_runge_kutta
from symgen.runtime.integrate.explicit.tableau import Control, ErkTableau, erk_tableau


@functools.cache
def bs32() -> ErkTableau:
    """Return Bogacki and Shampine's method of order 3(2) with dense output of order 3, cubic Hermite.

    Bogacki, Shampine, Appl. Math. Lett. 2 (1989) 321. The stability region reaches to -2.51 on the negative real axis.
    """
    a = [[], [1 / 2], [0, 3 / 4], [2 / 9, 1 / 3, 4 / 9]]
    error = [-5 / 72, 1 / 12, 1 / 9, -1 / 8]
    return erk_tableau(a, [*a[-1], 0], 3, error=[error], control=Control(3, stiff_bound=2.5))


RECORDS = explicit_runge_kutta(
    "bs32",
    bs32,
    order=3,
    dense_order=3,
    evaluations=3,
    purpose="motion at very low accuracy, forces that are not smooth",
    adaptive=True,
)
