"""Savings of a run: what steps do not have to do."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from savings.measure import Row, bundled, by_turns, compared, difference, runs
from symgen.link import derive as system_of
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.runtime import Solution, System, solve
from symgen.runtime.batches import accelerations_and_multipliers, evaluate
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.integrate.radau.work import HAVE_JACOBIAN
from symgen.runtime.loop_arrays import LoopArrays


def jacobians() -> Iterator[Row]:
    """Jacobians and factors kept while Newton's iterations converge fast; without, each step forgets them."""
    for name, t_end in (("stiff_bushing_pendulum", 5.0), ("spring_chain", 1.0), ("humanoid_tree", 0.2)):
        system = bundled(name)

        def step_by_step(forget: bool, system=system, t_end=t_end) -> np.ndarray:
            q, v, _, _ = system.initial_state()
            arrays = LoopArrays(
                system, METHODS["radau5"], system.parameter_values(), 0.0, np.concatenate([q, v]),
                frame_times=np.array([0.0]), rtol=1e-6, atol=1e-9,
            )  # fmt: skip
            while arrays.t < t_end:
                arrays.advance(t_end, 1)
                if forget:
                    arrays.counters[HAVE_JACOBIAN] = 0
            return arrays.y[: system.nq + system.nv].copy()

        ends = step_by_step(False), step_by_step(True)
        seconds = by_turns(lambda f=step_by_step: f(False), lambda f=step_by_step: f(True), repeats=5)
        yield Row(f"{name}, radau5", "Jacobians and factors kept", *seconds, difference(*ends))


def frames() -> Iterator[Row]:
    """Frames read off the dense output, not landed on."""
    system, times = bundled("double_pendulum"), list(np.linspace(0.0, 10.0, 2001))
    for method in ("dop853", "taylor"):
        options = {"method": method, "rtol": 1e-10, "atol": 1e-12, "t_end": 10.0}
        read_off, landed_on = {"fps": 200.0, **options}, {"at": times, "fps": 1.0, **options}
        (fast, slow), seconds = runs((system, read_off), (system, landed_on), repeats=3)
        landed = np.array([[*sample.q, *sample.v] for sample in slow.samples])
        same = difference(np.hstack([fast.q, fast.v]), landed)
        yield Row(f"double_pendulum, {method}", "2000 frames interpolated", *seconds, same)


def observed() -> Iterator[Row]:
    """Multipliers, outputs and energies where somebody looks, not at each step."""
    system, options = bundled("slider_crank"), {"method": "dop853", "t_end": 200.0, "fps": 1.0}
    solution = solve(system, **options)
    many = np.resize(solution.states, (solution.stats["steps"], solution.states.shape[1]))
    times = np.resize(solution.t, len(many))

    def look() -> Solution:
        looked = solve(system, **options)
        accelerations_and_multipliers(system, looked.p, times, many)
        for function in ("outputs", "energy", "constraint_residual"):
            evaluate(system, function, looked.p, times, many)
        return looked

    seconds = by_turns(lambda: solve(system, **options), look)
    yield Row(
        "slider_crank", "multipliers, outputs, energies not in steps", *seconds, compared(solution, look())
    )


def watched(name: str) -> System:
    """A bundled model with an event that never happens."""
    model = load_model(find(name), {})
    model.event("never", "t + 1")
    return system_of(model)


def events() -> Iterator[Row]:
    """No search for events where there are none."""
    for method in ("dop853", "taylor"):
        options = {"method": method, "t_end": 100.0, "fps": 1.0}
        solutions, seconds = runs(
            (bundled("double_pendulum"), options), (watched("double_pendulum"), options), repeats=5
        )
        yield Row(f"double_pendulum, {method}", "no search for events", *seconds, compared(*solutions))


CASES = (jacobians, frames, observed, events)
