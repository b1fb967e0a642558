"""Exudyn: a multibody code in C++, on its own models of the scenes."""

from dataclasses import replace

import numpy as np
from exudyn_model import exudyn
from exudyn_models import build
from job import read_job, send, sweep

METHODS = ("DOPRI5", "RK67", "GeneralizedAlpha")
CONSTRAINED_METHODS = ("GeneralizedAlpha", "TrapezoidalIndex2")
ADAPTIVE = "DOPRI5"
LEAST_STEPS, MOST_HALVINGS = 16, 20
LEAST_RTOL = 0.9e-14  # at tighter ones its steps stay at their least size, and a run takes minutes
SPARSE_FROM = 40  # unknowns
START_UP = 1e-9  # [s]: a run so short is what every call spends before and after its steps
REDUNDANT_START_UP = 1e-7  # [s]: full pivoting fails in shorter ones


def settings(model, t_end, steps=1, rtol=1e-8, atol=1e-10, adaptive=False):
    """Return Exudyn's settings of a run that writes no file."""
    values = exudyn.SimulationSettings()
    values.solution.file.write = values.solution.sensors.active = False
    time = values.timeIntegration
    time.verboseMode = 0
    time.endTime, time.numberOfSteps, time.minimumStepSize = t_end, steps, 1e-12
    time.automaticStepSize = time.adaptiveStep = adaptive
    time.relativeTolerance, time.absoluteTolerance = rtol, atol
    data, solvers = model.mbs.systemData, exudyn.LinearSolverType
    unknowns = len(data.GetODE2Coordinates()) + len(data.GetAECoordinates())
    values.linearSolver.solverType = solvers.EigenSparse if unknowns > SPARSE_FROM else solvers.EXUdense
    if model.redundant:
        values.linearSolver.solverType = solvers.EigenDense
        values.linearSolver.ignoreSingularJacobian = True
    if adaptive:
        time.stepSizeMaxIncrease = 5.0
        time.initialStepSize = min(t_end, 1e-3)
    return values


def integrate(model, method, given):
    """Return the end state (q, v)."""
    solver = getattr(exudyn.DynamicSolverType, method)
    if not model.mbs.SolveDynamic(given, solverType=solver, storeSolver=False):
        raise RuntimeError("no success")
    data = model.mbs.systemData
    return np.concatenate(model.state(data.GetODE2Coordinates(), data.GetODE2Coordinates_t())), 0


def main() -> None:
    job = read_job()
    version = exudyn.__version__
    model = build(job)
    if model is None:
        send("exudyn", version, says="this scene has no model of Exudyn's here")
        return

    def prepare_adaptive(rtol, atol):
        given, nothing = (settings(model, t, 1, rtol, atol, adaptive=True) for t in (job.t_end, START_UP))
        return lambda: integrate(model, ADAPTIVE, given), lambda: integrate(model, ADAPTIVE, nothing)

    def prepare_fixed(method, step):
        given = settings(model, job.t_end, round(job.t_end / step))
        nothing = settings(model, REDUNDANT_START_UP if model.redundant else START_UP)
        return lambda: integrate(model, method, given), lambda: integrate(model, method, nothing)

    reachable = replace(job, tolerances=job.tolerances[job.tolerances >= LEAST_RTOL])
    per_halving = job.effort["per_decade"]
    counts = np.round(LEAST_STEPS * 2.0 ** (np.arange(MOST_HALVINGS * per_halving) / per_halving))
    steps = replace(job, tolerances=job.t_end / counts)
    for method in CONSTRAINED_METHODS if model.constrained else METHODS:
        if method == ADAPTIVE:
            sweep(reachable, f"exudyn {method}", version, prepare_adaptive)
        else:
            sweep(steps, f"exudyn {method}", version, lambda step, _, m=method: prepare_fixed(m, step))


if __name__ == "__main__":
    main()
