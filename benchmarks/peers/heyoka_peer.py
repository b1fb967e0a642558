"""heyoka's Taylor integrator, its expressions made by running the generated right-hand side on symbols."""

import time

import heyoka  # before anything that loads LLVM
from job import read_job, sweep
from traced import FUNCTIONS, derivative

COMPACT_FROM = 1500  # operations; larger systems are compiled as loops, or it takes minutes
COMPILE_SECONDS = 60.0  # for all tolerances together


def symbolic(function):
    """Return a function of symbols that also takes numbers."""
    return lambda *values: function(*(heyoka.expression(value) for value in values))


def equations(job):
    """Return the pairs (variable, derivative)."""
    functions = {name: getattr(heyoka, name) for name in FUNCTIONS if hasattr(heyoka, name)}
    functions |= {name: symbolic(getattr(heyoka, name)) for name in ("select", "lt", "lte")}
    variables = heyoka.make_vars(*(f"y{i}" for i in range(job.n)))
    variables = [variables] if job.n == 1 else list(variables)
    values = derivative(job, functions)(heyoka.time, variables)
    return [(variable, heyoka.expression(value)) for variable, value in zip(variables, values, strict=True)]


def main() -> None:
    job = read_job()
    pairs = equations(job)
    compact = job.system.operations["rhs"] > COMPACT_FROM
    compiled = {"seconds": 0.0}

    def prepare(rtol, atol):
        if compiled["seconds"] > COMPILE_SECONDS:
            raise TimeoutError(f"compiling took {compiled['seconds']:.0f} s for the tolerances before")
        began = time.perf_counter()
        integrator = heyoka.taylor_adaptive(pairs, job.start.copy(), tol=rtol, compact_mode=compact)
        compiled["seconds"] += time.perf_counter() - began

        def run(t_end=job.t_end):
            integrator.state[:] = job.start
            integrator.time = 0.0
            outcome = integrator.propagate_until(t_end)[0]
            if outcome != heyoka.taylor_outcome.time_limit:
                raise RuntimeError(str(outcome))
            return integrator.state.copy(), 0

        return run, lambda: run(0.0)

    sweep(job, "heyoka", heyoka.__version__, prepare)


if __name__ == "__main__":
    main()
