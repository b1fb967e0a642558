"""diffrax on JAX: the generated right-hand side, traced once and compiled by XLA in double precision."""

import operator
import os

# One thread, as every other peer has; XLA reads this when it is loaded.
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

import diffrax
import jax
import jax.numpy as jnp
from job import read_job, send, sweep
from traced import FUNCTIONS, derivative

SOLVERS = {"Dopri8": diffrax.Dopri8, "Tsit5": diffrax.Tsit5}
MOST_STEPS = 1_000_000
MOST_OPERATIONS = 10_000  # XLA compiles half a minute for half as many


def compiled(job, solver):
    """Return a compiled function (start, rtol, atol, t_end) -> (end state, whether it got there)."""
    names = {name: getattr(jnp, name) for name in FUNCTIONS}
    f = derivative(job, {**names, "select": jnp.where, "lt": operator.lt, "lte": operator.le})
    term = diffrax.ODETerm(lambda t, y, _: jnp.array(f(t, [y[i] for i in range(job.n)])))

    @jax.jit
    def integrate(start, rtol, atol, t_end):
        # A PI controller within the bounds that diffrax's documentation recommends; takes fewer steps than its default.
        controller = diffrax.PIDController(rtol=rtol, atol=atol, pcoeff=0.3, icoeff=0.4)
        solution = diffrax.diffeqsolve(
            term, solver, 0.0, t_end, None, start, saveat=diffrax.SaveAt(t1=True),
            stepsize_controller=controller, max_steps=MOST_STEPS, throw=False, adjoint=diffrax.ForwardMode(),
        )  # fmt: skip
        return solution.ys[0], solution.result == diffrax.RESULTS.successful

    return integrate


def main() -> None:
    job = read_job()
    operations = job.system.operations["rhs"]
    if operations > MOST_OPERATIONS:
        says = f"{operations} operations without a loop are too many to compile"
        send("diffrax", diffrax.__version__, says=says)
        return
    jax.config.update("jax_enable_x64", True)
    # Time of another thread that still runs is not counted yet when its process is asked.
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    for name, solver in SOLVERS.items():
        integrate = compiled(job, solver())

        def prepare(rtol, atol, integrate=integrate):
            def run(t_end=job.t_end):
                state, success = integrate(job.start, rtol, atol, t_end)
                if not success:  # waits for the result
                    raise RuntimeError("the step size fell to nothing, or there were too many steps")
                return state, 0

            return run, lambda: run(0.0)

        sweep(job, f"diffrax {name}", diffrax.__version__, prepare)


if __name__ == "__main__":
    main()
