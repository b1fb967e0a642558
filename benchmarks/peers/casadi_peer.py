"""CasADi's IDAS on scenes with constraints at index 1, its expressions made by running the residual on symbols."""

import casadi
import numpy as np
from implicit import start_of
from job import read_job, send, sweep
from traced import FUNCTIONS, called

_QUICKEST_STEP = 1e-5  # [s]: bounds the steps of a run that gets nowhere


def problem(job, rows):
    """Return the differential-algebraic equations: x = (q, v), z = (a, λ), of the constraints in `rows` only."""
    system = job.system
    names = {name: getattr(casadi, name) for name in FUNCTIONS if hasattr(casadi, name)}
    names |= {"select": casadi.if_else, "lt": lambda a, b: a < b, "lte": lambda a, b: a <= b}
    names |= {"fabs": casadi.fabs, "pow": lambda a, b: a**b, "copysign": casadi.copysign}
    t, x, z = (casadi.SX.sym(*of) for of in (("t",), ("x", job.n), ("z", system.nv + len(rows))))
    q, v = [x[i] for i in range(system.nq)], [x[system.nq + i] for i in range(system.nv)]
    multipliers = [0.0] * system.m
    for k, row in enumerate(rows):
        multipliers[row] = z[system.nv + k]
    inside = [*q, *v, *(z[i] for i in range(system.nv)), *multipliers]
    residual = called(job, "residual", names, t, inside, system.nv + system.m)
    residual = [*residual[: system.nv], *(residual[system.nv + row] for row in rows)]
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
    rows, accelerations, multipliers = start_of(job)
    equations, z0 = problem(job, rows), np.concatenate([accelerations, multipliers])

    def prepare(rtol, atol):
        options = {"reltol": rtol, "abstol": max(atol, 1e-300), "print_stats": False}
        options |= {
            "suppress_algebraic": True,
            "max_num_steps": int(job.effort["longest_run"] / _QUICKEST_STEP),
        }
        solver = casadi.integrator("solver", "idas", equations, 0.0, job.t_end, options)

        def run():
            return np.asarray(solver(x0=job.start, z0=z0)["xf"]).ravel(), 0

        return run, lambda: None

    sweep(job, "casadi IDAS", casadi.__version__, prepare)


if __name__ == "__main__":
    main()
