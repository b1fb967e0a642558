"""Run a batch of members in lanes: arrays in, arrays out; the machine code does the rest without Python's lock."""

from __future__ import annotations

import math

import numpy as np

from symgen.runtime.choose import SERIES
from symgen.runtime.code.host import has_wide_registers
from symgen.runtime.ensemble import radau
from symgen.runtime.ensemble.arrays import Table, aligned
from symgen.runtime.ensemble.dense_lu import GIVE
from symgen.runtime.ensemble.events import N_BLOCKS, PLACES, SWITCHES
from symgen.runtime.ensemble.intervals import Breaks, one_interval
from symgen.runtime.ensemble.lanes import DRIVEN, N_INTERVAL
from symgen.runtime.ensemble.machine import COMPOSED, IMPLICIT, RATTLE, lane_kernel, lane_loop, lane_series
from symgen.runtime.ensemble.slots import COLUMNS
from symgen.runtime.events_in_code import ACTIONS
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate import plain_events
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.integrate.semi_implicit import SymplecticScheme
from symgen.runtime.integrate.taylor import (
    CREEPS,
    CREEPS_AT_MOST,
    CREEPS_OF_ROUND_OFF,
    EPS,
    ROUND_OFF_RTOL,
    SHARE,
    SHARE_WITH_TAIL,
)
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import DIRECTIONS
from symgen.runtime.record import record
from symgen.runtime.step_costs import order_of
from symgen.runtime.system import System
from symgen.runtime.taylor.kernel import N_ROWS

rattle = Late("symgen.runtime.ensemble.rattle")

LANES = 8  # within 13 % of the best elsewhere
# Where a register holds eight numbers, operations on one wait for results while those on another one go on, as long as
# a model's numbers fit into registers: 3 to 18 % of the time (benchmarks.md). By the operations of `rhs`.
_TWICE_AS_MANY = {"taylor": 600, "dop853": 300, "rk4": 300, "verlet": 300}
_FEWEST_FOR_MANY = 256  # members
_SHORTEST_STEP = 1e-150  # [s]: squares of the steps must not underflow
_N_DENSE = 8
_N_STAGES = 16
_EVENTS_LOGGED = 1 << 14  # of a member that is run again


@record
class BatchSettings:
    """How members are run: what all of them have in common.

    Attributes
    ----------
    method : str
    t_start, t_end : float [s]
    rtol, atol : float
    step : float [s]
        Of a fixed-step method.
    order : int
        Of series; 0: by the tolerance.
    projection_tol : float
        As `layout.PROJECTION_TOL`.
    longest : (float, float, float)
        H_MAX, H_BASE, H_SHARE, see `layout`.
    longest_held : (float, float)
        H_BASE, H_SHARE while a stop is closed, or a friction sticks.
    scale_energy : bool
    frame_times : ndarray, shape (F,) [s]
    max_steps : int
    lanes : int
    log_size : int
        Of the log of steps, which one lane alone keeps.
    series : System, optional
        Of which series are taken: the model with inputs over time.
    breaks : Breaks, optional
        Where steps have to end, and inputs over time; without them nothing stops members, and inputs are constant.
    """

    method: str
    t_start: float
    t_end: float
    rtol: float
    atol: float
    frame_times: np.ndarray
    step: float = 0.0
    projection_tol: float = 1e-12
    longest: tuple[float, float, float] = (np.inf, np.inf, 0.0)
    longest_held: tuple[float, float] = (np.inf, 0.0)
    scale_energy: bool = False
    max_steps: int = 1 << 52
    lanes: int = LANES
    log_size: int = 0
    order: int = 0
    series: System | None = None
    breaks: Breaks | None = None


@record
class BatchResult:
    """What members have come to.

    Attributes
    ----------
    end : ndarray, shape (n, ny)
        (q, v) and work at the end, or where the member stopped.
    columns : ndarray, shape (n, len(COLUMNS))
        See `slots.COLUMNS`.
    frames : ndarray, shape (n, F, ny)
        Not a number behind the place where a member stopped.
    """

    end: np.ndarray
    columns: np.ndarray
    frames: np.ndarray

    def column(self, name: str) -> np.ndarray:
        """Return one of the columns."""
        return self.columns[:, COLUMNS.index(name)]


def lanes_for(system: System, method: str, n: int) -> int:
    """Return how many lanes `n` members of a model take; their numbers do not depend on it."""
    is_short = system.operations.get("rhs", 0) <= _TWICE_AS_MANY.get(method, -1)
    hides = is_short and n >= _FEWEST_FOR_MANY and not system.events and has_wide_registers()
    return 2 * LANES if hides else LANES


def stage_tolerances(n_stages: int, rtol: float, atol: float) -> tuple[float, float, float]:
    """The tolerances of a Radau method's error estimate, and of Newton's method, as `radau.error.set_tolerances`."""
    power = (n_stages + 1.0) / (2.0 * n_stages)
    own = 0.1 * rtol**power if rtol > 0.0 else 0.0
    own_atol = atol * (own / rtol) if rtol > 0.0 else 0.1 * atol**power
    return own, own_atol, max(10.0 * EPS / max(own, EPS), min(0.03, own ** (1.0 / power - 1.0)))


def one_evaluation(system: System, method: str) -> bool:
    """Whether a step of Verlet's method evaluates the model once."""
    scheme = find_method(method).coefficients(system)
    return isinstance(scheme, SymplecticScheme) and bool(scheme.reuse)


def give_of(system: System) -> float:
    """How far constraints give way in matrices of Newton's method: where some follow from others."""
    return GIVE if system.dependent else 0.0


RESULTS = ("end", "columns", "frames")
_ACTIONS = {**ACTIONS, "stop": SWITCHES, "friction": SWITCHES}


@record(eq=False)
class Carried:
    """What members of models with stops or friction have when they take a lane, and have come to when they leave it.

    Attributes
    ----------
    columns : ndarray, shape (n, len(COLUMNS))
    frames : ndarray, shape (n, F, ny)
    first_frame : ndarray of int64, shape (n,)
        Their next one.
    widths, lowest : ndarray, shape (n, number of switches)
        How far below zero each switch counts as zero; the least of its function at the ends of steps.
    """

    columns: np.ndarray
    frames: np.ndarray
    first_frame: np.ndarray
    widths: np.ndarray
    lowest: np.ndarray


class LaneBatch:
    """Runs batches of members of one model in lanes; each thread needs its own.

    Parameters
    ----------
    system : System
    settings : BatchSettings

    Raises
    ------
    symgen.runtime.code.lower.NoLanes
        The model's functions can only be had for one member at a time.
    """

    def __init__(self, system: System, settings: BatchSettings) -> None:
        self.system, self.settings = system, settings
        lanes = settings.lanes
        self._loop = lane_loop(settings.method, lanes, with_quaternions=bool(system.quaternions))
        self.table = table = Table()
        n = system.nq + system.nv
        n_logged = settings.log_size and _EVENTS_LOGGED * bool(system.events and not system.switches)
        self.event_log = np.zeros((n_logged, plain_events.FIRST_STATE + 2 * n))
        projects = bool(system.m or system.quaternions) and settings.method not in RATTLE
        n_project = n + system.nh + system.m if projects else 0
        names = {"rhs": "rhs", "energy": "energy"}
        names |= {"project": "project"} if projects else {}
        names |= {"residual": "constraint_residual"} if system.m else {}
        names |= {"events": "events"} if system.events else {}
        table.set_integers(**{slot: lane_kernel(system, name, lanes) for slot, name in names.items()})
        n_record, n_k, n_newton = system.n_row, _N_STAGES * system.n_row, 0
        if settings.method in IMPLICIT:
            n_newton = self._prepare_newton()
        if settings.method in RATTLE:
            n_newton = self._prepare_rattle()
        if settings.method in COMPOSED:
            n_newton = self._prepare_composition()
        if settings.method == SERIES:
            n_record, n_k = self._prepare_series(), N_ROWS * system.ny + 1
        self._n_record = n_record
        table.set_integers(
            setup=system.setup_address, ny=system.ny, n=n, nq=system.nq, n_row=system.n_row, n_p=system.n_p,
            n_precomputed=system.n_precomputed, nh=system.nh, m=system.m, n_project=n_project,
            n_quaternions=len(system.quaternions), n_frames=len(settings.frame_times),
            max_steps=settings.max_steps, watch_energy=1, scale_energy=int(settings.scale_energy),
            log_size=settings.log_size, n_record=n_record, one_evaluation=int(one_evaluation(system, settings.method)),
            n_events=len(system.events), event_log_size=len(self.event_log),
            n_switches=len(system.switches),
        )  # fmt: skip
        breaks = settings.breaks
        driven = breaks.driven if breaks is not None else np.zeros((0, DRIVEN), dtype=np.int64)
        table.set_integers(n_driven=len(driven), n_interval=N_INTERVAL + int((1 + driven[:, 2]).sum()))
        h_max, h_base, h_share = settings.longest
        table.set_numbers(
            t_start=settings.t_start, t_end=settings.t_end, rtol=settings.rtol, atol=settings.atol, h_max=h_max,
            h_base=h_base, h_share=h_share, h_min=_SHORTEST_STEP, projection_tol=settings.projection_tol,
            step=settings.step,
        )  # fmt: skip
        rows = {
            "y": system.ny, "y_new": system.ny, "y_stage": system.ny, "k": n_k, "k_other": n_k, "lost": system.ny,
            "p": breaks.n_long if breaks is not None else system.n_precomputed, "interval": N_INTERVAL,
            "projected": n_project, "energies": 2, "residuals": system.nh + system.m,
            "dense": _N_DENSE * system.ny, "numbers": len(COLUMNS), "carry": system.ny, "slope": system.ny,
            "y_before": n, "watched": N_BLOCKS * len(system.events), "newton": n_newton,
        }  # fmt: skip
        table.set_arrays({name: aligned(length * lanes) for name, length in rows.items()})
        self.step_log = np.zeros((settings.log_size, 2))
        table.set_arrays(
            {
                "quaternions": np.array(system.quaternions, dtype=np.int64),
                "frame_times": np.ascontiguousarray(settings.frame_times, dtype=float),
                "member_of_lane": np.zeros(lanes, dtype=np.int64),
                "frame_of_lane": np.zeros(lanes, dtype=np.int64),
                "interval_of_lane": np.zeros(lanes, dtype=np.int64),
                "driven": driven,
                "step_log": self.step_log,
                **self._events(),
            }
        )

    def _events(self) -> dict[str, np.ndarray]:
        """Return what lanes need to know of events."""
        events, lanes = self.system.events, self.settings.lanes
        resets = [
            lane_kernel(self.system, f"reset_{event['name']}", lanes) if event["action"] == "reset" else 0
            for event in events
        ]
        return {
            "event_log": self.event_log,
            "directions": np.array([DIRECTIONS[event["direction"]] for event in events], dtype=float),
            "places": np.array(PLACES),
            "actions": np.array([_ACTIONS[event["action"]] for event in events], dtype=np.int64),
            "resets": np.array(resets, dtype=np.uint64),
        }

    def _prepare_newton(self) -> int:
        """Set what implicit methods need; returns how many rows they work in."""
        system, settings = self.system, self.settings
        n_stages = (find_method(settings.method).order + 1) // 2
        rtol, atol, bound = stage_tolerances(n_stages, settings.rtol, settings.atol)
        self.table.set_integers(
            jacobian=lane_kernel(system, "residual_jacobian", settings.lanes), n_kept=len(radau.STATE)
        )
        self.table.set_numbers(stage_rtol=rtol, stage_atol=atol, newton_bound=bound, give=give_of(system))
        return radau.work_length(n_stages, system.nq, system.nv, system.m, system.ny)

    def _prepare_rattle(self) -> int:
        """Set what RATTLE needs; returns how many rows it works in."""
        system, lanes = self.system, self.settings.lanes
        method = find_method(self.settings.method).coefficients(system)
        names = ["mass_matrix", "forces", *(["constraint_jacobian"] if system.m else [])]
        kernels = {name: lane_kernel(system, name, lanes) for name in names}
        if not method.constant_mass:
            kernels["jacobian"] = lane_kernel(system, "residual_jacobian", lanes)
        self.table.set_integers(
            **kernels,
            n_kept=len(rattle.STATE),
            constant_mass=int(method.constant_mass),
        )
        self.table.set_numbers(give=give_of(system))
        self._set_parts(np.append(method.steps, 0.0), method.times)
        return rattle.work_length(system.nq, system.nv, system.m, system.nh)

    def _prepare_composition(self) -> int:
        """Set what compositions of Verlet steps need; returns how many rows they work in."""
        method, ny = find_method(self.settings.method).coefficients(self.system), self.system.ny
        self.table.set_integers(n_kept=ny)
        self._set_parts(np.append(method.drifts, 0.0), method.kicks, method.times)
        return ny

    def _set_parts(self, *columns: np.ndarray) -> None:
        """Set the numbers of each step of a composition, and of what is behind the last one."""
        parts = np.ascontiguousarray(np.column_stack(columns))
        self.table.set_integers(n_parts=len(parts) - 1)
        self.table.set_arrays({"parts": parts})

    def _prepare_series(self) -> int:
        """Set what Taylor series need; returns how many numbers of each member's first series are kept."""
        system, settings = self.system, self.settings
        address, costs = lane_series(settings.series or system, settings.lanes)
        order = settings.order or order_of(costs, settings.rtol)
        has_tail = system.ny - system.nq > 1
        left_out = max(settings.rtol, 1e-17) * (1.0 if settings.rtol > ROUND_OFF_RTOL else 1e-3)
        turns = SHARE * max(settings.atol + settings.rtol, ROUND_OFF_RTOL)
        self.table.set_integers(series=address, order=order, has_tail=int(has_tail))
        self.table.set_numbers(
            log_left_out=math.log2(left_out * (SHARE_WITH_TAIL if has_tail else SHARE)),
            log_of_turns=math.log2(turns),
            creeps=max(CREEPS, min(CREEPS_AT_MOST, CREEPS_OF_ROUND_OFF * math.sqrt(EPS / settings.rtol))),
        )
        return (order + 1) * system.ny

    @property
    def order(self) -> int:
        """The order of series; 0 with other methods."""
        return self.table.integer("order")

    @property
    def n_events_logged(self) -> int:
        """Rows of `event_log` that are filled."""
        return self.table.integer("n_events_logged")

    def stop(self) -> None:
        """Let `run`, in another thread, return at once; what it returns is of no use."""
        self.table.set_integers(stop=1)

    def run(
        self, parameters: np.ndarray, start: np.ndarray, numbers: np.ndarray | None = None,
        carried: Carried | None = None,
    ) -> BatchResult:  # fmt: skip
        """Run members from their starts to the end.

        Parameters
        ----------
        parameters : ndarray, shape (n, n_p)
        start : ndarray, shape (n, nq + nv), or (n, ny)
            Consistent with the constraints.
        numbers : ndarray of int, shape (n,), optional
            Those of the members, which say what noise they have; 0, 1, … by default.
        carried : Carried, optional
            With which they go on from where they are, to the end or to the next switch; it is written over.
        """
        system, n = self.system, len(start)
        if self.settings.breaks is None:
            intervals = one_interval(n, self.settings.longest[0])
        else:
            intervals = self.settings.breaks.of(np.arange(n) if numbers is None else numbers, parameters)
        states = np.zeros((n, system.ny))
        states[:, : start.shape[1]] = start
        given = np.ascontiguousarray(parameters, dtype=float)
        if carried is None:
            carried = new_members(n, system, self.settings)
            self.table.set_integers(resumes=0)
        else:
            self.table.set_integers(resumes=1)
        result = BatchResult(np.zeros((n, system.ny)), carried.columns, carried.frames)
        held = {
            "start": states, "parameters": given, "precomputed": np.zeros((n, system.n_precomputed)),
            "derivative": np.zeros((n, self._n_record)), "results": result.columns, "end": result.end,
            "frames": result.frames, "intervals": intervals.rows, "first_interval": intervals.first,
            "first_frame": carried.first_frame, "widths": carried.widths, "lowest": carried.lowest,
        }  # fmt: skip
        self.table.set_arrays(held)
        self.table.set_integers(n_members=n, next=0, n_logged=0, stop=0, n_events_logged=0)
        if n:
            self._loop.begin(self.table.address)
            self._loop.run(self.table.address)
        repeat_ends(result, self.settings)
        if any(event["action"] == "terminate" for event in system.events):
            stay_at_ends(result, self.settings)
        return result


def new_members(n: int, system: System, settings: BatchSettings) -> Carried:
    """Return what `n` members carry that have not begun."""
    switches = len(system.switches)
    columns = np.zeros((n, len(COLUMNS)))
    columns[:, COLUMNS.index("t")], columns[:, COLUMNS.index("pivot")] = settings.t_start, np.inf
    return Carried(
        columns, np.full((n, len(settings.frame_times), system.ny), np.nan), np.zeros(n, dtype=np.int64),
        np.zeros((n, switches)), np.full((n, switches), np.inf),
    )  # fmt: skip


def repeat_ends(result: BatchResult, settings: BatchSettings) -> None:
    """Let frames at the end be the ends.

    A frame is projected once more: with constraints that moves its last bit, and members' ends would depend on whether
    frames are kept.
    """
    times = settings.frame_times
    if len(times) and times[-1] == settings.t_end:
        reached = result.column("status") == at.REACHED_STOP
        result.frames[reached, -1] = result.end[reached]


def stay_at_ends(result: BatchResult, settings: BatchSettings) -> None:
    """Let frames behind the end of a run that an event ends show where it stays."""
    reached = result.column("status") == at.REACHED_STOP
    behind = reached[:, None] & (settings.frame_times > result.column("t")[:, None])
    result.frames[behind] = result.end[np.nonzero(behind)[0]]
