"""scipy_dae on scenes with constraints: Radau IIA and BDF, on index 1 and on stabilised index 2 (GGL)."""

import time
from importlib.metadata import version

import numpy as np
from implicit import ggl, index_1
from job import TooLong, read_job, send, sweep
from scipy_dae.integrate import solve_dae

METHODS = {"Radau5": {"method": "Radau", "stages": 3}, "Radau9": {"method": "Radau", "stages": 5}}
METHODS |= {"BDF": {"method": "BDF"}}


def prepare(job, equations, options, rtol, atol):
    """Return what runs a method at a tolerance."""
    n, longest = len(equations.start), job.effort["longest_run"]
    ends = [np.inf]

    def residual(t, y, slope):
        if time.perf_counter() > ends[0]:
            raise TooLong(longest)
        out = np.empty(n)
        equations.residual(t, np.ascontiguousarray(y), np.ascontiguousarray(slope), out)
        return out

    def jacobian(t, y, slope):
        at_slope, at_both = np.empty((n, n)), np.empty((n, n))
        equations.jacobian(t, y, slope, 0.0, at_both)
        equations.jacobian(t, y, slope, 1.0, at_slope)
        return at_both, at_slope - at_both

    given = {"rtol": rtol, "atol": equations.tolerances(atol), "jac": jacobian, **options}

    def run():
        ends[0] = time.perf_counter() + longest
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
        equations = form(job)
        for method, options in METHODS.items():
            make = lambda r, a, e=equations, o=options: prepare(job, e, o, r, a)  # noqa: E731
            sweep(job, f"scipy_dae {method} {name}", package, make)


if __name__ == "__main__":
    main()
