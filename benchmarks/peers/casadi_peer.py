"""CasADi's IDAS on scenes with constraints at index 1, its expressions made by running the residual on symbols."""

import casadi
import numpy as np
from job import read_job, send, sweep
from traced import FUNCTIONS, called


def problem(job):
    """Return the differential-algebraic equations: x = (q, v), z = (a, λ)."""
    system = job.system
    names = {name: getattr(casadi, name) for name in FUNCTIONS if hasattr(casadi, name)}
    names |= {"select": casadi.if_else, "lt": lambda a, b: a < b, "lte": lambda a, b: a <= b}
    names |= {"fabs": casadi.fabs, "pow": lambda a, b: a**b, "copysign": casadi.copysign}
    t, x, z = (casadi.SX.sym(*of) for of in (("t",), ("x", job.n), ("z", system.nv + system.m)))
    q, v = [x[i] for i in range(system.nq)], [x[system.nq + i] for i in range(system.nv)]
    inside = [*q, *v, *(z[i] for i in range(system.nv + system.m))]
    residual = called(job, "residual", names, t, inside, system.nv + system.m)
    moved = v
    if system.quaternions:
        n = called(job, "kinematics", names, t, [*q, *v], system.nq * system.nv + system.nq**2)
        moved = [sum(n[i * system.nv + j] * v[j] for j in range(system.nv)) for i in range(system.nq)]
    ode = casadi.vertcat(*moved, *(z[i] for i in range(system.nv)))
    return {"t": t, "x": x, "z": z, "ode": ode, "alg": casadi.vertcat(*residual)}


def main() -> None:
    job = read_job()
    if not job.system.m:
        send("casadi", casadi.__version__, says="this scene has no constraints")
        return
    row = np.asarray(job.system.kernel("rhs")(0.0, job.start, job.p))
    if not np.all(np.isfinite(row)):
        send(
            "casadi",
            casadi.__version__,
            says="the constraints depend on each other: there is no unique start",
        )
        return
    system, equations = job.system, problem(job)
    z0 = np.concatenate([row[system.nq : job.n], row[system.ny : system.ny + system.m]])

    def prepare(rtol, atol):
        options = {"reltol": rtol, "abstol": max(atol, 1e-300), "max_num_steps": 10**7, "print_stats": False}
        solver = casadi.integrator("solver", "idas", equations, 0.0, job.t_end, options)

        def run():
            return np.asarray(solver(x0=job.start, z0=z0)["xf"]).ravel(), 0

        return run, lambda: None

    sweep(job, "casadi IDAS", casadi.__version__, prepare)


if __name__ == "__main__":
    main()
