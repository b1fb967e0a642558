"""CVODE (scikit-sundae) with a compiled right-hand side, Adams and BDF."""

from importlib.metadata import version

import numpy as np
from compiled import derivative
from job import read_job, sweep
from sksundae.cvode import CVODE


def main() -> None:
    job = read_job()
    f = derivative(job)

    def rhs(t, y, dy):
        dy[:] = f(t, y)

    def prepare(method, rtol, atol):
        solver = CVODE(rhs, method=method, rtol=rtol, atol=max(atol, 1e-300), max_num_steps=10**7)

        def run():
            solution = solver.solve(np.array([0.0, job.t_end]), job.start)
            if not solution.success:
                raise RuntimeError(solution.message)
            return solution.y[-1], solution.nfev

        return run, lambda: None

    for method in ("Adams", "BDF"):
        sweep(job, f"cvode {method}", version("scikit-sundae"), lambda r, a, m=method: prepare(m, r, a))


if __name__ == "__main__":
    main()
