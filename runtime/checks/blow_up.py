"""A run that blew up: when, which coordinate first, how fast, and whether its step could have followed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.entry import HealthCheck
from symgen.runtime.checks.stability import stable_step
from symgen.runtime.checks.time_scales import time_scales
from symgen.runtime.failures import state_names

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution

_GROWN = 100.0  # times the size that it had in the first tenth of the run
_BALANCE = 0.1  # error of the energy, in parts of the largest
_JUMPS = 5.0  # times, in the last tenth of a run
_LARGEST = 200  # rates


def blow_up(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    """Yield one objection where a coordinate or rate outgrew what it was; nothing where a run failed otherwise."""
    sizes, usual = _sizes(solution)
    frame = first_outgrown(solution)
    if frame is None or not (_lost_its_balance(solution) or _ends_abruptly(sizes)):
        return
    which = int(np.argmax(sizes[frame] / usual))
    name, t = state_names(solution.system)[which], float(solution.t[frame])
    factor = float(sizes[frame, which] / usual[which])
    says = f"{name} outgrew its size at the start of the run {factor:.2g} times at t = {t:.6g} s, before all others"
    yield HealthCheck("blow-up", False, factor, _GROWN, f"{says}; {_speed(solution, method, frame // 2)}")


def _lost_its_balance(solution: Solution) -> bool:
    return not solution.energy.max_error <= _BALANCE


def _ends_abruptly(sizes: np.ndarray) -> bool:
    """Whether something grew far in the last tenth: a singularity, and not a start from rest."""
    before = sizes[: max(1, 9 * len(sizes) // 10)].max(axis=0)
    return not np.all(np.isfinite(sizes[-1])) or bool(
        np.any(sizes[-1] > _JUMPS * np.maximum(before, 1e-3 * before.max(initial=0.0)))
    )


def first_outgrown(solution: Solution) -> int | None:
    """Return the first frame at which something outgrew what it was; None where nothing did."""
    sizes, usual = _sizes(solution)
    grown = (sizes > _GROWN * usual).any(axis=1)
    return int(np.argmax(grown)) if grown.any() else None


def _sizes(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Return magnitudes of the states, infinite for NaN, and those of the first tenth of the run."""
    with np.errstate(invalid="ignore", over="ignore"):
        sizes = np.nan_to_num(np.abs(solution.states), nan=np.inf)
    before = sizes[: max(1, len(sizes) // 10)]
    usual = np.max(np.where(np.isfinite(before), before, 0.0), axis=0)
    # What was at rest is held against the others of its kind.
    nq = solution.system.nq
    for part in (slice(0, nq), slice(nq, None)):
        usual[part] = np.maximum(usual[part], 1e-3 * usual[part].max(initial=0.0))
    return sizes, np.where(usual > 0.0, usual, 1.0)


def _speed(solution: Solution, method: Method, frame: int) -> str:
    q, v = solution.q[frame], solution.v[frame]
    if solution.system.nv > _LARGEST or not np.all(np.isfinite([*q, *v])):
        return "take smaller steps, or look for a singularity"
    scales = time_scales(solution.system, solution.p, float(solution.t[frame]), q, v)
    if scales.fastest <= 0.0:
        return "no force changed with the state before it: look for a singularity in time"
    text = f"the time scale before it was {1.0 / scales.fastest:.3g} s"
    if not solution.step:
        return f"{text}: look for a singularity, or a force of the wrong sign"
    stable = stable_step(method, scales.eigenvalues)
    where = "above" if solution.step > stable else "below"
    limit = (
        f"{where} the limit of stability of {stable:.3g} s"
        if np.isfinite(stable)
        else "which no stability limits"
    )
    return f"{text}, and the step is {solution.step:.3g} s, {limit}"
