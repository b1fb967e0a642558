"""Kernels of constrained models that survive dependent constraints: the straight-line code, guarded.

The guard is a trampoline in machine code (`guard_code.py`) with the ABI's signature. What it turns to where the
straight-line code fails, `robust_path`, is the same for all models, and compiled when a run first needs it.
"""

from __future__ import annotations

import collections
import ctypes
import functools
import threading
import warnings
from typing import Any

import numpy as np

from symgen.runtime.code import engine
from symgen.runtime.code.jitted import DISABLE_JIT
from symgen.runtime.constraints import branch, refinement, robust_path
from symgen.runtime.constraints import guard_code as at
from symgen.runtime.constraints.curve import curve_size
from symgen.runtime.constraints.dependence import usual_rank
from symgen.runtime.constraints.guard_code import guard_ir
from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.constraints.row_weights import n_weights, row_weights
from symgen.runtime.positions import Positions
from symgen.runtime.record import record
from symgen.runtime.size import is_large
from symgen.runtime.system import System

_LOST_DIGITS = 1e-9  # of the largest term
_NEARBY = 1e-3
_SPEEDS = (1.0, 1e3, 1e-3)  # characteristic sizes in a second
_ANY_ROW_IS_LARGE = 1e300  # weights by which only a row of zeros is small
_PATHS = {
    "rhs": robust_path.robust_rhs,
    "project": robust_path.robust_project,
    "refined": refinement.refined_rhs,
}
_USED = ("mass_matrix", "forces", "constraint_jacobian", "gamma", "constraint_residual", "energy", "rhs")
_MOST_REMEMBERED = 16  # states at which a run began
_KERNEL = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
_lock = threading.Lock()


def robust_rhs_address(system: System) -> tuple[int, Any]:
    """Return the address of a `rhs` that survives dependent constraints, and what must be kept alive with it.

    It takes a precomputed `p` (`System.precomputed`) and writes the same row. Where the straight-line pivot ratio is
    below 1e-6 or not a number, accelerations and multipliers come from a pivoted factorisation; multipliers that are
    not unique are those of least norm, and the pivot ratio in the row is 0. See `robust_path.robust_rhs` for the power.
    Where the ratio is below 1e-2, they are refined (`refinement.py`).
    """
    if not system.m or is_large(system):  # the path for dependent constraints factorises full matrices
        kernel = system.kernel("rhs")
        return kernel.precomputed_address, kernel
    lease = lease_guard(system)
    lease.take_all_constraints()
    return lease.rhs, lease


def robust_project_address(system: System) -> tuple[int, Any]:
    """Return the address of a `project` that survives dependent constraints, and what it needs alive."""
    if not system.m or is_large(system):  # the path for dependent constraints factorises full matrices
        kernel = system.kernel("project")
        return kernel.precomputed_address, kernel
    lease = lease_guard(system)
    lease.take_all_constraints()
    return lease.project, lease


class Lease:
    """The use of a guard, which has buffers and a flag and so serves one run at a time; it ends with this object.

    Attributes
    ----------
    rhs, project : int
        Addresses.
    residual_size : float
        How much the constraint that changes most changes over what counts as large near the start of a run; 1 where
        that is not known.
    """

    residual_size = 1.0

    def __init__(self, system: System, free: collections.deque, guard: _Guard):
        self._system, self._free, self._guard = system, free, guard
        self.rhs, self.project = guard.rhs, guard.project

    def expect(self, p: np.ndarray, t: float, q: np.ndarray) -> None:
        """Say where a run starts: how large the rows of G are near there tells when one vanishes.

        Straight-line code that leaves out constraints is of use only where these depend on the others.
        """
        system, found = self._system, expectation(self._system, p, t, q)
        if len(found.weights):
            per_residual = found.weights[system.m * system.nv :][: system.m]
            self.residual_size = float(1.0 / per_residual.min())
        self._guard.expect(found.weights, found.near_singular, found.unfit, found.rank)

    def forget(self) -> None:
        """Take every row of G for as large as it gets, as a guard does that is leased anew."""
        self._guard.forget()

    def take_all_constraints(self) -> None:
        """Give the multipliers of least norm, also where straight-line code leaves constraints out."""
        if self._system.dependent:
            self._guard.always_slow()

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The context of the guard (`branch.py`), its weights, and its curve (`curve.py`).

        Whoever writes there says what `expect` says, and forgets the curve.
        """
        return self._guard.arrays

    @property
    def memory(self) -> np.ndarray:
        """What the guard carries from call to call, a copy; set it to go on where another guard has left off."""
        return self._guard.memory

    @memory.setter
    def memory(self, values: np.ndarray) -> None:
        self._guard.memory = values

    def __del__(self) -> None:
        self._free.append(self._guard)


def lease_guard(system: System) -> Lease:
    """Return a guard of a system with constraints that nobody else uses."""
    with _lock:
        # Kept with the system: the guards refer to it, so a weak dictionary would never let go of either.
        free = vars(system).setdefault("_guards", collections.deque())
    try:
        guard = free.pop()
    except IndexError:
        guard = _Guard(system)
        # A lease may die in a pass of the garbage collector, which must not take the guard and its code with it.
        vars(system).setdefault("_all_guards", []).append(guard)
    guard.forget()
    return Lease(system, free, guard)


def _may_be_a_curve(system: System) -> bool:
    """Whether the positions that constraints allow may be a curve that stays where it is: these alone tell."""
    stays = not (system.switched or system.structure["time_dependent"])
    return stays and system.nq == system.nv and system.nh == system.m >= system.nv - 1


class _Guard:
    """Trampolines, and all that they point to."""

    def __init__(self, system: System):
        self._kernels = {key: system.kernel(key) for key in (*_USED, "project")}
        self._context = self._make_context(system)
        n = n_weights(system)
        self._carried = np.zeros(n + (curve_size(system.nq) if n and _may_be_a_curve(system) else 0))
        self._weights, self._curve = self._carried[:n], self._carried[n:]
        self._rows = np.zeros(system.m * system.nv if len(self._weights) else 0)
        self._order = np.zeros(system.m, dtype=np.int64)
        self._work = np.zeros(0)
        self._n_work = int(_plain(branch.work_size)(system.nq, system.nv, system.nh, system.m, system.nw))
        ir = guard_ir(system, len(self._context), len(self._carried), self._n_work)
        code = engine.object_code(engine.cache_key(ir), "guard", "guard", lambda _: (ir, 0))
        self._code = engine.MachineCode()
        self.rhs = self._code.add(code, "guarded_rhs")
        self.project = self._code.address("guarded_project")
        self._stand_ins = [_KERNEL(functools.partial(self._first_call, name)) for name in at.PATHS]
        self._fill_table()

    def _make_context(self, system: System) -> np.ndarray:
        places = np.array(system.quaternions, dtype=np.int64)
        context = np.append(np.zeros(branch.N_CONTEXT, dtype=np.int64), places)
        for index, key in enumerate(_USED):
            context[index] = self._kernels[key].precomputed_address
        sizes = (system.nq, system.nv, system.nh, system.m, system.nw, system.n_precomputed)
        context[branch.NQ : branch.TIME_DEPENDENT] = sizes
        context[branch.TIME_DEPENDENT] = system.structure["time_dependent"]
        context[branch.N_QUATERNIONS] = len(places)
        return context

    def _fill_table(self) -> None:
        slots = ctypes.c_uint64 * at.N_SLOTS
        self._table = slots.from_address(self._code.address(at.TABLE))
        for slot, name in ((at.RHS, "rhs"), (at.PROJECT, "project"), (at.JACOBIAN, "constraint_jacobian")):
            self._table[slot] = self._kernels[name].precomputed_address
        for (_, slot, _), stand_in in zip(at.PATHS.values(), self._stand_ins):
            self._table[slot] = ctypes.cast(stand_in, ctypes.c_void_p).value
        for slot, array in (
            (at.CONTEXT, self._context), (at.WEIGHTS, self._carried), (at.ORDER, self._order), (at.ROWS, self._rows)
        ):  # fmt: skip
            self._table[slot] = array.ctypes.data

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The context, the weights, and the curve of the branch (`curve.py`), empty where it is none."""
        return self._context, self._weights, self._curve

    def forget(self) -> None:
        """Take every row of G for as large as it gets, and know no curve."""
        self._weights[:], self._curve[:] = _ANY_ROW_IS_LARGE, 0.0
        self._context[[branch.NEAR_SINGULAR, branch.ILL_CONDITIONED, branch.USUAL_RANK]] = 0

    def always_slow(self) -> None:
        """Send every call down the path for dependent constraints."""
        self._context[[branch.NEAR_SINGULAR, branch.ILL_CONDITIONED]] = 1

    def expect(self, weights: np.ndarray, near_singular: bool, ill_conditioned: bool, rank: int) -> None:
        """Take the sizes of rows by `weights`, from `row_weights`, and the rank of G where it is not singular."""
        self._weights[:], self._curve[:] = weights, 0.0
        self._context[branch.USUAL_RANK] = rank
        self._context[branch.ILL_CONDITIONED] = ill_conditioned
        self._context[branch.NEAR_SINGULAR] = near_singular or ill_conditioned

    @property
    def memory(self) -> np.ndarray:
        """The weights of rows, the curve of the branch, and whether a singular configuration was near."""
        return np.append(self._carried, float(self._context[branch.NEAR_SINGULAR]))

    @memory.setter
    def memory(self, values: np.ndarray) -> None:
        self._carried[:], self._context[branch.NEAR_SINGULAR] = values[:-1], int(values[-1])

    def _first_call(self, name: str, t: float, y: int, p: int, out: int) -> None:
        """Stand in for the compiled path until it is first needed."""
        lengths = self._kernels["project" if name == "project" else "rhs"].source.lengths
        n_y = int(self._context[branch.NQ] + self._context[branch.NV])
        arrays = _array(y, n_y), _array(p, int(self._context[branch.NP])), _array(out, lengths.out)
        try:
            if not len(self._work):
                self._work = np.zeros(self._n_work)
                self._table[at.WORK] = self._work.ctypes.data
            path = _PATHS[name]
            arguments = (self._context, t, *arrays, self._carried, self._order, self._work)
            if not DISABLE_JIT:
                native, slot, called = at.PATHS[name]
                self._table[native] = path.compiled(*arguments).address
                self._table[slot] = self._code.address(called)
            path(*arguments)
        except Exception as error:
            # Nothing may be raised through machine code: not-a-number tells the integrator.
            warnings.warn(
                f"the path for dependent constraints failed: {error!r}", RuntimeWarning, stacklevel=2
            )
            arrays[2][:] = np.nan


@record(eq=False)
class Expectation:
    """What a state says of the constraints where a run begins.

    Attributes
    ----------
    weights : ndarray
        Of rows, see `row_weights`.
    near_singular : bool
        Whether one of them is near 0.
    rank : int
        Of G, see `usual_rank`; 0 where switches say which constraints hold.
    depends_as_derived : bool
        Whether the constraints that straight-line code leaves out follow from the others.
    is_ill_conditioned : bool
    """

    weights: np.ndarray
    near_singular: bool
    rank: int
    depends_as_derived: bool
    is_ill_conditioned: bool

    @property
    def unfit(self) -> bool:
        """Whether straight-line code is unfit."""
        return self.is_ill_conditioned or not self.depends_as_derived


def expectation(system: System, p: np.ndarray, t: float, q: np.ndarray) -> Expectation:
    """Return what a state says of the constraints; that of the last few states is kept.

    The loops of a run, those that try methods out, the choice of the method and companions all begin at one state.
    """
    known = vars(system).setdefault("_expected", {})
    key = t, q.tobytes(), p.tobytes()
    found = known.get(key)
    if found is None:
        if len(known) >= _MOST_REMEMBERED:
            known.clear()
        found = known[key] = _expected(system, p, t, q)
    return found


def _expected(system: System, p: np.ndarray, t: float, q: np.ndarray) -> Expectation:
    weights, smallest = row_weights(system, p, t, q)
    rank = 0 if system.switched else usual_rank(system, p, t, q)
    depends = not system.dependent or rank == system.m - len(system.dependent)
    ill = is_ill_conditioned(system, p, t, q)
    return Expectation(weights, bool(smallest < at.NEAR_LIMIT), rank, depends, ill)


def is_ill_conditioned(system: System, p: np.ndarray, t: float, q: np.ndarray) -> bool:
    """Whether the straight-line accelerations miss G a = γ: an inertia is tiny beside what constraints tie it to.

    They should meet it off the constraints as well; a state at random has digits to lose. Constraints with a switch are
    off here: what stops hold entirely has no acceleration to compare with.
    """
    if system.switched:
        p = p.copy()
        p[list(system.switched.values())] = 0.0
    nearby = Positions(system).retract(q, nearby_step(system.nv))
    directions = _random(system.nv)[1]
    if not _misses(system, p, t, np.concatenate([nearby, 0.0 * directions])):
        return False  # as nearly always: how fast is fast need not be found out
    # Forces that nearly balance leave accelerations as small as round-off. With some rates they do not; where rates
    # make no forces, as in gears that begin to slip, a little later and with slightly other parameters they do not.
    rates = Constraints(system, p, t).characteristic_sizes(q) * directions
    if not all(_misses(system, p, t, np.concatenate([nearby, speed * rates])) for speed in _SPEEDS):
        return False
    return _misses(
        system, _nearby_parameters(system, p), t + _NEARBY * (1.0 + abs(t)), np.concatenate([nearby, rates])
    )


def _nearby_parameters(system: System, p: np.ndarray) -> np.ndarray:
    """Parameters and inputs that differ a little, each in its own way; switches are as they were."""
    p, n = p.copy(), system.n_settable
    p[:n] *= 1.0 + _NEARBY * np.random.default_rng(20240229).uniform(-1.0, 1.0, n)
    return p


def nearby_step(nv: int) -> np.ndarray:
    """Return the step to a state at random, near enough to be as singular, and off the constraints."""
    return _NEARBY * _random(nv)[0]


@functools.lru_cache(maxsize=16)
def _random(nv: int) -> np.ndarray:
    return np.random.default_rng(20240229).uniform(-1.0, 1.0, (2, nv))


def _misses(system: System, p: np.ndarray, t: float, y: np.ndarray) -> bool:
    """Whether the straight-line accelerations at (q, v) miss G a = γ of the constraints that they are solved with."""
    constraints = Constraints(system, p, t)
    kept = [k for k in range(system.m) if k not in system.dependent]
    a = system.kernel("rhs")(t, y, p)[system.nq : system.nq + system.nv]
    jacobian = (constraints.sparse_jacobian if is_large(system) else constraints.jacobian)(y[: system.nq])
    jacobian, gamma = jacobian[kept], system.kernel("gamma")(t, y, p)[kept]
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(jacobian @ a - gamma)
        return bool(np.any(off > _LOST_DIGITS * (np.abs(jacobian) @ np.abs(a) + np.abs(gamma))))


def _plain(function: Any) -> Any:
    return getattr(function, "py_func", function)


def _array(address: int, length: int) -> np.ndarray:
    if not length:
        return np.zeros(0)
    return np.ctypeslib.as_array((ctypes.c_double * length).from_address(address))
