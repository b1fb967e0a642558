"""IDA (scikit-sundae) on scenes with constraints: index 1, and stabilised index 2 (GGL), with compiled Jacobians."""

from importlib.metadata import version

import numpy as np
from implicit import ggl, index_1
from job import read_job, send, sweep
from sksundae.ida import IDA

_QUICKEST_STEP = 1e-5  # [s]: bounds the steps of a run that gets nowhere


def prepare(job, equations, rtol, atol):
    """Return what runs IDA at a tolerance."""
    solver = IDA(
        equations.residual,
        rtol=rtol,
        atol=equations.tolerances(atol),
        algebraic_idx=equations.algebraic,
        max_num_steps=int(job.effort["longest_run"] / _QUICKEST_STEP),
        jacfn=lambda t, y, slope, residual, c, out: equations.jacobian(t, y, slope, c, out),
    )

    def run():
        solution = solver.solve(np.array([0.0, job.t_end]), equations.start, equations.slope)
        if not solution.success:
            raise RuntimeError(solution.message)
        return solution.y[-1], solution.nfev

    return run, lambda: None


def main() -> None:
    job, package = read_job(), version("scikit-sundae")
    if not job.system.m:
        send("ida", package, says="this scene has no constraints")
        return
    for name, form in (("index 1", index_1), ("GGL", ggl)):
        equations = form(job)
        sweep(job, f"ida {name}", package, lambda r, a, e=equations: prepare(job, e, r, a))


if __name__ == "__main__":
    main()
