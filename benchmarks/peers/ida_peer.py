"""IDA (scikit-sundae) on scenes with constraints: index 1, with the exact Jacobian, and stabilised index 2 (GGL)."""

from importlib.metadata import version

import numpy as np
from implicit import ggl, index_1
from job import read_job, send, sweep
from sksundae.ida import IDA

_UNCONTROLLED = 1e6  # tolerance of μ, and of λ at index 2, whose errors belong to no state


def prepare(job, equations, rtol, atol):
    """Return what runs IDA at a tolerance."""
    tolerances = np.full(len(equations.start), max(atol, 1e-300))
    given = {}
    if equations.jacobian is not None:
        given["jacfn"] = lambda t, y, slope, res, c, out: equations.jacobian(t, y, slope, c, out)
    else:
        tolerances[equations.algebraic] = _UNCONTROLLED
    solver = IDA(
        equations.residual,
        rtol=rtol,
        atol=tolerances,
        algebraic_idx=equations.algebraic,
        max_num_steps=10**7,
        **given,
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
        try:
            equations = form(job)
        except ValueError as error:
            send(f"ida {name}", package, says=str(error))
            continue
        sweep(job, f"ida {name}", package, lambda r, a, e=equations: prepare(job, e, r, a))


if __name__ == "__main__":
    main()
