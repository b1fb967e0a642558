"""numbalsoda's DOP853 and LSODA: compiled code that calls a compiled right-hand side, started from compiled code."""

from importlib.metadata import version

import numpy as np
from job import read_job, send, sweep
from numba import carray, cfunc, njit
from numbalsoda import dop853, lsoda, lsoda_sig


def right_hand_side(job):
    """Return a C function (t, y, dy, data), and data: parameters, then room for a whole row of `rhs`."""
    rhs, n, n_p, n_row = job.system.numba("rhs"), job.n, job.system.n_p, job.system.n_row

    @cfunc(lsoda_sig)
    def f(t, y, dy, data):
        values = carray(data, (n_p + n_row,))
        row = values[n_p:]
        rhs(t, carray(y, (n,)), values[:n_p], row)
        for i in range(n):
            dy[i] = row[i]

    return f, np.concatenate([job.p, np.zeros(n_row)])


def compiled(solver):
    """Return a compiled function that runs the solver, or does nothing."""

    @njit
    def integrate(address, y0, times, data, rtol, atol, idle):
        if idle:
            return y0.copy(), True
        states, success = solver(address, y0, times, data=data, rtol=rtol, atol=atol)
        return states[-1], success

    return integrate


def main() -> None:
    job = read_job()
    if not np.all(np.isfinite(np.asarray(job.system.kernel("rhs")(0.0, job.start, job.p)))):
        # Its methods would try ever smaller steps without end.
        says = "the constraints depend on each other: the index-1 equations have no unique solution"
        send("numbalsoda", version("numbalsoda"), says=says)
        return
    f, data = right_hand_side(job)
    times = np.array([0.0, job.t_end])
    for name, solver in (("dop853", dop853), ("lsoda", lsoda)):
        integrate = compiled(solver)

        def prepare(rtol, atol, integrate=integrate):
            def run(idle=False):
                state, success = integrate(f.address, job.start, times, data, rtol, atol, idle)
                if not success:
                    raise RuntimeError("no success")
                return state, 0

            return run, lambda: run(True)

        sweep(job, f"numbalsoda {name}", version("numbalsoda"), prepare)


if __name__ == "__main__":
    main()
