"""Taylor series."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import Method, resolve

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System

_USUAL_ORDER = 16


def taylor(order: int = 0) -> Method:
    """Return the method `taylor`; its order is chosen by the tolerance unless one is given."""

    def coefficients(system: System) -> Any:
        addresses = resolve("symgen.runtime.taylor.kernel:taylor_addresses")(system)
        n_rows = resolve("symgen.runtime.taylor.kernel:N_ROWS")
        return resolve("symgen.runtime.integrate.taylor:TaylorSeries")(*addresses, n_rows, order)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(resolve("symgen.runtime.integrate.taylor:taylor_work_size")(coefficients.n_rows, sizes))

    def over_choices(coefficients: Any) -> Any:
        places = resolve("symgen.runtime.taylor.kernel:PLACES")
        return coefficients._replace(n_places=places)

    def refusal(system: System) -> str:
        return resolve("symgen.runtime.taylor.kernel:taylor_refusal")(system)

    return Method(
        name="taylor", order=order or _USUAL_ORDER, dense_order=(order or _USUAL_ORDER) - 1, adaptive=True,
        family="symgen.runtime.integrate.taylor:advance_taylor",
        coefficients=coefficients, work_size=work_size, evaluations=20.0,
        purpose="smooth motion, above all at tight tolerances; what `auto` takes where it can",
        series=True, orders=(8, 28), scales_energy=True, refusal=refusal, over_choices=over_choices,
    )  # fmt: skip


RECORDS = (taylor(),)
