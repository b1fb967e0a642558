"""scipy_dae on scenes with constraints: Radau IIA of order 5 and BDF, on index 1 and on stabilised index 2 (GGL)."""

from importlib.metadata import version

import numpy as np
from implicit import ggl, index_1
from job import read_job, send, sweep
from scipy_dae.integrate import solve_dae

_UNCONTROLLED = 1e6


def prepare(job, equations, stabilised, method, rtol, atol):
    """Return what runs a method at a tolerance."""
    tolerances = np.full(len(equations.start), atol)
    if stabilised:
        tolerances[equations.algebraic] = _UNCONTROLLED

    def residual(t, y, slope):
        out = np.empty(len(y))
        equations.residual(t, np.ascontiguousarray(y), np.ascontiguousarray(slope), out)
        return out

    given = {"rtol": rtol, "atol": tolerances, "method": method}
    if equations.jacobian is not None:

        def jacobian(t, y, slope):
            n = len(y)
            at_slope, at_both = np.empty((n, n)), np.empty((n, n))
            equations.jacobian(t, y, slope, 0.0, at_both)
            equations.jacobian(t, y, slope, 1.0, at_slope)
            return at_both, at_slope - at_both

        given["jac"] = jacobian

    def run():
        solution = solve_dae(residual, (0.0, job.t_end), equations.start, equations.slope, **given)
        if not solution.success:
            raise RuntimeError(solution.message)
        return solution.y[:, -1], solution.nfev

    return run, lambda: None


def main() -> None:
    job, package = read_job(), version("scipy_dae")
    if not job.system.m:
        send("scipy_dae", package, says="this scene has no constraints")
        return
    for name, form in (("index 1", index_1), ("GGL", ggl)):
        try:
            equations = form(job)
        except ValueError as error:
            send(f"scipy_dae {name}", package, says=str(error))
            continue
        for method in ("Radau", "BDF"):
            stabilised = form is ggl
            make = lambda r, a, m=method, e=equations, s=stabilised: prepare(job, e, s, m, r, a)  # noqa: E731
            sweep(job, f"scipy_dae {method} {name}", package, make)


if __name__ == "__main__":
    main()
