"""What RATTLE asks of a model: the kernels that it calls, and momenta p = M(q) v."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.composition import composition
from symgen.runtime.integrate.loop import copy
from symgen.runtime.integrate.nested_basis import fit_rows, rows_of_derivative
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.system import System


_ENDS = [(1, 0.0), (1, 1.0), (2, 0.0), (2, 1.0)]


class Rattle(NamedTuple):
    """A symmetric composition of RATTLE steps.

    Attributes
    ----------
    steps : ndarray, shape (s,)
        Their lengths, in units of h.
    times : ndarray, shape (s + 1,)
        Where they begin and end, from 0 to 1.
    constant_mass : int
        1 where M does not depend on positions: momenta then need no derivatives of it.
    bends : ndarray, shape (4, 4)
        From (h v0 - Δq, h v1 - Δq, h² a0, h² a1) to rows 2 to 5 of the positions' dense output.
    rates : ndarray, shape (5, 4)
        From these to rows 2 to 6 of h times the velocities.
    """

    steps: np.ndarray
    times: np.ndarray
    constant_mass: int
    bends: np.ndarray
    rates: np.ndarray


def rattle(order: int, constant_mass: bool) -> Rattle:
    """Return the composition of order 2 (RATTLE itself), 4 or 6."""
    if order == 2:
        steps, times = np.array([1.0]), np.array([0.0, 1.0])
    else:
        steps, _, times = composition(order)[:3]
    rates = np.ascontiguousarray(rows_of_derivative()[2:7, 2:6])
    return Rattle(steps, times, int(constant_mass), np.ascontiguousarray(fit_rows(_ENDS)), rates)


# Counters of this family: whether work holds M, G and ∂M/∂q of the current positions, and guesses for the next step.
HAVE_START, HAVE_GUESS = range(16, 18)

# `numbers` of the work arrays: the smallest correction so far and how often none was smaller; the step of the guesses,
# and that kept while frames are written.
SMALLEST, STALLS, H_GUESS, H_KEPT = range(4)
N_NUMBERS = 4

# Rows of `vectors`: the mean rate of the step; the rate that derivatives are taken at; the momentum and the push
# h/2 (L_q + Q) at one end; half the change of the rate in the last step; what is kept while frames are written.
MEAN, PROBE, MOMENTUM, PUSH, HALF_CHANGE, KEPT_PROBE, KEPT_CHANGE = range(7)
N_VECTORS = 7
# Blocks of `masses` and `slopes`, for the start and the end of the step, and of `slopes` for -∂(M v)/∂q.
START, END, TURN = range(3)
KEPT = 2  # in `impulses`
# Rows of `states`.
TRIAL, Y_OLD, Y_SUB, REST, KEPT_REST, TRAVEL = range(6)
N_STATES = 6


class RattleWork(NamedTuple):
    """Work arrays of `advance_rattle`, with k = nv + m rates and multipliers.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    states : ndarray, shape (N_STATES, NY)
        A state that kernels are called with, that at the start of the step, that which the composition has come to,
        what rounding dropped from its positions, and from those that are kept while frames are written, and what the
        mean rate changes of positions.
    vectors : ndarray, shape (N_VECTORS, nv)
    impulses : ndarray, shape (3, m)
        Half the step times the multipliers, at the start and at the end; those kept while frames are written.
    masses : ndarray, shape (2, nv * nv)
        M at the start and at the end.
    slopes : ndarray, shape (3, nv, nv)
        -∂residual/∂q with a = 0 at the start and at the end; -∂(M v)/∂q.
    gradients : ndarray, shape (2, m * nv)
        G at the start and at the end.
    arguments, derivative : ndarray
        What the kernel `residual_jacobian` reads and writes.
    residual : ndarray, shape (nh + m,)
    matrix, factors : ndarray, shape (k, k)
    right : ndarray, shape (k, 1)
    pivots : ndarray of int64, shape (k,)
    scale : ndarray, shape (k,)
    row : ndarray, shape (N_ROW,)
        The rhs row of the new state.
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    states: np.ndarray
    vectors: np.ndarray
    impulses: np.ndarray
    masses: np.ndarray
    slopes: np.ndarray
    gradients: np.ndarray
    arguments: np.ndarray
    derivative: np.ndarray
    residual: np.ndarray
    matrix: np.ndarray
    factors: np.ndarray
    right: np.ndarray
    pivots: np.ndarray
    scale: np.ndarray
    row: np.ndarray
    scratch: np.ndarray


@jitted
def rattle_work_size(sizes):
    """Length of `work` for `advance_rattle`."""
    nv, m = sizes[at.NV], sizes[at.NM]
    k = nv + m
    n_arguments = sizes[at.NQ] + nv + k
    own = (
        N_NUMBERS + N_STATES * sizes[at.NY] + N_VECTORS * nv + 3 * m + 5 * nv * nv + 2 * m * nv + n_arguments
    )
    own += k * n_arguments + sizes[at.NH] + m + 2 * k * k + 3 * k + sizes[at.N_ROW]
    return own + finish_scratch_size(sizes)


@jitted
def rattle_work(sizes, work):
    """Divide `work`, of length `rattle_work_size(sizes)`, into a `RattleWork`."""
    nv, m, ny = sizes[at.NV], sizes[at.NM], sizes[at.NY]
    k = nv + m
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    states, rest = rest[: N_STATES * ny].reshape((N_STATES, ny)), rest[N_STATES * ny :]
    vectors, rest = rest[: N_VECTORS * nv].reshape((N_VECTORS, nv)), rest[N_VECTORS * nv :]
    impulses, rest = rest[: 3 * m].reshape((3, m)), rest[3 * m :]
    masses, rest = rest[: 2 * nv * nv].reshape((2, nv * nv)), rest[2 * nv * nv :]
    slopes, rest = rest[: 3 * nv * nv].reshape((3, nv, nv)), rest[3 * nv * nv :]
    gradients, rest = rest[: 2 * m * nv].reshape((2, m * nv)), rest[2 * m * nv :]
    n_arguments = sizes[at.NQ] + nv + k
    arguments, rest = rest[:n_arguments], rest[n_arguments:]
    derivative, rest = rest[: k * n_arguments], rest[k * n_arguments :]
    residual, rest = rest[: sizes[at.NH] + m], rest[sizes[at.NH] + m :]
    matrix, rest = rest[: k * k].reshape((k, k)), rest[k * k :]
    factors, rest = rest[: k * k].reshape((k, k)), rest[k * k :]
    right, rest = rest[:k].reshape((k, 1)), rest[k:]
    pivots, rest = rest[:k].view(np.int64), rest[k:]
    scale, rest = rest[:k], rest[k:]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    return RattleWork(
        numbers, states, vectors, impulses, masses, slopes, gradients, arguments, derivative, residual, matrix,
        factors, right, pivots, scale, row, rest,
    )  # fmt: skip


@jitted
def keep_guess(w):
    """Keep what the next step starts from, while other steps are taken."""
    copy(w.vectors[PROBE], w.vectors[KEPT_PROBE])
    copy(w.vectors[HALF_CHANGE], w.vectors[KEPT_CHANGE])
    copy(w.impulses[START], w.impulses[KEPT])
    copy(w.states[REST], w.states[KEPT_REST])
    w.numbers[H_KEPT] = w.numbers[H_GUESS]


@jitted
def restore_guess(w):
    """Undo what has changed since `keep_guess`."""
    copy(w.vectors[KEPT_PROBE], w.vectors[PROBE])
    copy(w.vectors[KEPT_CHANGE], w.vectors[HALF_CHANGE])
    copy(w.impulses[KEPT], w.impulses[START])
    copy(w.states[KEPT_REST], w.states[REST])
    w.numbers[H_GUESS] = w.numbers[H_KEPT]


_ROUND_OFF = 1e-9


def rattle_kernels(system: System) -> dict[int, tuple[int, Any]]:
    """Return the kernels that only some models need: index in `addresses` -> address, owner."""
    wanted = {}
    if not system.structure["constant_mass"]:
        wanted[at.RESIDUAL_JACOBIAN] = "residual_jacobian"
    if system.m:
        wanted[at.CONSTRAINT_RESIDUAL] = "constraint_residual"
        wanted[at.CONSTRAINT_JACOBIAN] = "constraint_jacobian"
    kernels = {index: system.kernel(name) for index, name in wanted.items()}
    return {index: (kernel.precomputed_address, kernel) for index, kernel in kernels.items()}


def rattle_refusal(system: System) -> str:
    """Return why RATTLE cannot integrate a model, and what can; an empty string where it can."""
    held = {record["name"] for record in system.constraints}
    follows = [switch["name"] for switch in system.switches if held & set(switch.get("normal", ()))]
    if follows:
        return (
            "takes forces of constraints as impulses of a step, which friction in proportion to reactions "
            f"({', '.join(follows)}) cannot follow: use implicit_midpoint, gauss8 or dop853 with projection"
        )
    if system.nn:
        names = [c["name"] for c in system.constraints if c["kind"] == "velocity"]
        return (
            f"keeps momenta along holonomic constraints, but {names[0]!r} holds velocities: "
            "use implicit_midpoint, gauss8 or dop853 with projection"
        )
    if not _is_quadratic(system):
        return (
            "needs a kinetic energy that is quadratic in the rates and does not depend on time by itself: "
            "use gauss8 or dop853"
        )
    return ""


def _is_quadratic(system: System) -> bool:
    """Whether T = vᵀM(q)v / 2 and M does not depend on v and t, at a place that nothing singles out."""
    nv, p = system.nv, system.parameter_values()
    q = np.array([record["value"] for record in system.coordinates])
    q += 0.01 * (1.0 + np.abs(q)) * np.sin(1.0 + np.arange(system.nq))
    q = Positions(system).normalised(q)
    for t, seed in ((0.0, 2.0), (0.37, 5.0)):
        v = np.cos(seed + 1.7 * np.arange(nv))
        v[list(system.states)] = 0.0
        mass = system.kernel("mass_matrix")(t, np.concatenate([q, v]), p).reshape(nv, nv)
        at_rest = system.kernel("mass_matrix")(0.0, np.concatenate([q, 0.0 * v]), p).reshape(nv, nv)
        kinetic = system.kernel("energy")(t, np.concatenate([q, v]), p)[0]
        scale = np.abs(v) @ np.abs(mass) @ np.abs(v)
        if not (
            np.abs(mass - at_rest).max(initial=0.0) <= _ROUND_OFF * np.abs(mass).max(initial=0.0)
            and abs(kinetic - 0.5 * v @ mass @ v) <= _ROUND_OFF * scale
        ):
            return False
    return True
