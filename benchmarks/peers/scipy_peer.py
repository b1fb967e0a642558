"""SciPy's solve_ivp with a compiled right-hand side."""

import numpy as np
import scipy
from compiled import derivative
from job import read_job, sweep
from scipy.integrate import solve_ivp

METHODS = ("DOP853", "Radau", "LSODA")


def main() -> None:
    job = read_job()
    compiled = derivative(job)

    def f(t, y):
        return compiled(t, np.ascontiguousarray(y))  # Radau's differences pass columns

    def prepare(method, rtol, atol):
        def run():
            solution = solve_ivp(f, (0.0, job.t_end), job.start, method=method, rtol=rtol, atol=atol)
            if not solution.success:
                raise RuntimeError(solution.message)
            return solution.y[:, -1], solution.nfev

        return run, lambda: None

    for method in METHODS:
        sweep(job, f"scipy {method}", scipy.__version__, lambda r, a, m=method: prepare(m, r, a))


if __name__ == "__main__":
    main()
