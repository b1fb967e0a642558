"""A model at run time: what its module's header says, and its kernels, compiled when they are first used."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from symgen.runtime.abi import CLOSED, JUMP, OF_CLOSED, closed_header, setting_names
from symgen.runtime.code.bridge import evaluate_rows
from symgen.runtime.errors import RuntimeModelError, UnknownNameError, nearest
from symgen.runtime.functions import ModelFunctions
from symgen.runtime.graph.layouts import LIMITS
from symgen.runtime.kernel import Setup, compile_setup
from symgen.runtime.lazy import Late
from symgen.runtime.module_source import ModuleSource
from symgen.runtime.names import integral_places

# Most runs are given numbers.
limits = Late("symgen.runtime.limits")
quantities = Late("symgen.runtime.quantities")

_MOST_PRECOMPUTED = 4  # values of all parameters, of which what depends on them is kept


class System(ModelFunctions):
    """A model as data, constant after loading; `symgen.runtime.front.System` has doors to what is done with it.

    Attributes
    ----------
    name, description, file : str
    nq, nv, nh, nn, nw : int
        Numbers of coordinates, rates, holonomic and velocity constraints; 1 if the state carries the work.
    m : int
        nh + nn, the number of multipliers.
    ny : int
        nq + nv + nw, the length of the state that integrators carry.
    n_precomputed : int
        The length of a precomputed `p`.
    n_precomputations : int
        How often hoisted work was done so far.
    n_row : int
        The length of a row that `rhs` writes.
    coordinates, rates, parameters, inputs, constants, constraints, outputs, events, bodies : tuple of dict
        The header's records, see docs/abi.md.
    subsystems : tuple of dict
        For each kind of independent subsystem: indices of each one's coordinates, rates and constraints.
    sensed : bool
        Whether `outputs` reads accelerations and reactions behind the state.
    sequential_impacts : bool
        Whether stops that touch are struck one after another.
    switches : tuple of dict
        Its stops, then its frictions that stick and slip.
    settings : tuple of str
        Names of the numbers at the end of `p` that say which of them hold; runs set them.
    switched : dict of int to int
        For each constraint that can be switched off, where in `p` its switch is; empty but in the `closed` form.
    dependent : tuple of int
        Constraints that followed from the others where the model was derived: `rhs`, `project` and series leave them
        out, and the multipliers of `rhs` are zero for them.
    quaternions : tuple of int
        Where in q each unit quaternion (w, x, y, z) begins.
    states, integrals : tuple of int
        Where in v the first-order states are, and where in q their integrals over time, which nothing depends on.
    constraints_of_states : tuple of str
        Velocity constraints that depend on states.
    balances : dict of str to int
        Coordinates without inertia, and the constraints that hold the forces on them in balance, without any force.
    start : dict or None
        What holds where runs begin besides the constraints, as the header says it.
    structure, operations, run_defaults : dict
        The header's `structure`, `operations` and `run`.
    source : ModuleSource
        The module's text.
    """

    def __init__(self, source: ModuleSource):
        header = source.header
        set_ = super().__setattr__
        set_("source", source)
        set_("file", source.file)
        for key in ("name", "description", "nq", "nv", "nh", "nn", "nw", "structure", "operations"):
            set_(key, header[key])
        set_("run_defaults", header["run"])
        for key in ("coordinates", "rates", "parameters", "inputs", "constants", "constraints"):
            set_(key, tuple(header[key]))
        for key in ("outputs", "events", "bodies"):
            set_(key, tuple(header[key]))
        set_("quaternions", tuple(header.get("quaternions", ())))
        set_("states", tuple(header.get("states", ())))
        set_("integrals", integral_places(header))
        set_("constraints_of_states", tuple(header.get("constraints_of_states", ())))
        set_("dependent", tuple(header.get("dependent", ())))
        set_("subsystems", tuple(header.get("subsystems", ())))
        m = self.nh + self.nn
        set_("m", m)
        set_("ny", self.nq + self.nv + self.nw)
        set_("n_row", self.ny + m + (m > 0))
        set_("switches", tuple(header.get("switches", ())))
        set_("start", header.get("start"))
        set_("balances", header.get("balances", {}))
        set_("sensed", header.get("sensed", False))
        set_("sequential_impacts", header.get("impacts") == "sequential")
        values = [float(record["value"]) for record in (*self.parameters, *self.inputs)]
        set_("settings", tuple(setting_names(header)))
        switched = header.get("switched", {})
        set_("switched", {row: len(values) + k for row, k in switched.items()})
        values += [0.0] * len(self.settings)
        set_("_p", np.array(values))
        names = [record["name"] for record in (*self.parameters, *self.inputs)]
        set_("_p_index", {name: index for index, name in enumerate(names)})
        set_("_followed", {u["name"]: u["rate_of"] for u in self.inputs if "rate_of" in u})
        set_("_p_units", {record["name"]: record["unit"] for record in (*self.parameters, *self.inputs)})
        hoisted, end = {}, len(values)
        for name, count in header.get("hoisted", {}).items():
            if name.startswith(CLOSED):
                continue
            hoisted[name] = (count, end)
            end += count
        set_("_hoisted", hoisted)
        set_("n_precomputed", end)
        set_("_kernels", {})
        set_("_precomputed", {})
        set_("_known_functions", {})
        set_("n_precomputations", 0)
        set_("_lock", threading.RLock())
        set_("_of_model", frozenset((*vars(self), "_of_model")))  # all else is kept from what was asked of it

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a System is constant: {name!r} cannot be set")

    def __repr__(self) -> str:
        return f"<System {self.name!r}: {self.nq} coordinates, {self.nv} rates, {self.m} constraints>"

    def __reduce__(self):
        return System, (self.source,)

    @property
    def n_rewritten(self) -> int:
        """How many of the first numbers of a precomputed `p` may change during a run: not the pieces of inputs."""
        return self.n_precomputed

    @property
    def input_polynomials(self) -> Mapping[int, tuple[int, int, int]]:
        """Inputs over time, see `symgen.runtime.inputs.driven.DrivenSystem`: here all are constants."""
        return {}

    @property
    def has_feedback(self) -> bool:
        """Whether controllers act at every instant."""
        return False

    @property
    def is_repeatable(self) -> bool:
        """Whether what depends on the model, `p` and the start may be kept: nothing in it acts by what it has seen."""
        return True

    @property
    def input_descriptions(self) -> Mapping[str, str]:
        """What inputs over time are, in words, by name."""
        return {}

    @property
    def n_p(self) -> int:
        """The length of `p`: parameters, inputs, and the settings of switches."""
        return len(self._p)

    def parameter_values(self, overrides: Mapping[str, float | str] | None = None) -> np.ndarray:
        """Return `p`: the model's parameters and inputs, some of them with other values.

        Parameters
        ----------
        overrides : mapping of str to float or str, optional
            In SI, or quantities such as "50 cm".

        Returns
        -------
        p : ndarray, shape (n_p,)
        """
        p = self._p.copy()
        for name, value in (overrides or {}).items():
            if name not in self._p_index:
                raise UnknownNameError(self._not_settable(name))
            if isinstance(value, str):
                value = quantities.in_si(value, self._p_units[name], name)
            if not math.isfinite(value):
                raise RuntimeModelError(f"{name!r} is {value}: give a finite number")
            if value and name in self._followed:
                raise RuntimeModelError(
                    f"{name!r} is the rate of the input {self._followed[name]!r} and follows from it: give that one"
                )
            p[self._p_index[name]] = float(value)
        return p

    def vetted_by(self, make: Callable[[], Any]) -> System:
        """Return this system, whose runs with other parameters are looked at by the checks of its description.

        Parameters
        ----------
        make : callable
            Gives a `symgen.model.values_of_runs.ValuesOfRuns` where there is such a run.
        """
        self.__dict__["_make_values_of_runs"] = make
        return self

    @property
    def values_of_runs(self) -> Any:
        """What refuses values of parameters in runs; None where the description is not at hand."""
        if "_values_of_runs" not in self.__dict__:
            make = self.__dict__.get("_make_values_of_runs")
            self.__dict__["_values_of_runs"] = make and make()
        return self.__dict__["_values_of_runs"]

    def remark(self, constraint: str) -> str:
        """Return where a constraint has no meaning, as far as the description is at hand and says so."""
        return self.values_of_runs.remark(constraint) if self.values_of_runs is not None else ""

    def refuse_values(self, p: np.ndarray) -> None:
        """Raise RuntimeModelError where the model allows no such parameters.

        Its description says so in its own words where it is at hand, and else the limits in its module.
        """
        n = len(self.parameters)
        if np.array_equal(p[:n], self._p[:n]):
            return
        if self.values_of_runs is not None:
            names = (record["name"] for record in self.parameters)
            fault = self.values_of_runs.fault(dict(zip(names, p[:n].tolist(), strict=True)))
        else:
            fault = self.beyond_limits(p[None]).get(0, "")
        if fault:
            raise RuntimeModelError(fault)

    def beyond_limits(self, parameters: np.ndarray) -> dict[int, str]:
        """Return which rows of parameters are beyond the limits in the model's module, and why.

        Parameters
        ----------
        parameters : ndarray, shape (n, n_p)
        """
        header = self.source.header
        if not header.get(LIMITS):
            return {}
        kernel, y = self.kernel(LIMITS), np.zeros(self.nq + self.nv)
        rows = [kernel(0.0, y, p) for p in np.ascontiguousarray(parameters, dtype=float)]
        return limits.faults(header, np.array(rows))

    def place_of_parameter(self, name: str) -> int:
        """Return where in `p` a parameter or input is."""
        if name not in self._p_index:
            raise UnknownNameError(self._not_settable(name))
        return self._p_index[name]

    def _not_settable(self, name: str) -> str:
        for constant in self.constants:
            if constant["name"] == name:
                return (
                    f"{name!r} is a constant of model {self.name!r}, folded into its code; it cannot be set: "
                    "make it a parameter, or change it in the model and derive again"
                )
        if any(coordinate["name"] == name for coordinate in self.coordinates):
            return f"{name!r} is a coordinate of model {self.name!r}: set its start or rate instead"
        return f"model {self.name!r} has no parameter or input {name!r}: {nearest(name, self._p_index)}"

    @property
    def n_settable(self) -> int:
        """The number of parameters and inputs: where in `p` the settings of stops and frictions begin."""
        return len(self._p_index)

    @property
    def settings_of_switches(self) -> slice:
        """Where in `p` the settings of stops and frictions are."""
        return slice(self.n_settable, len(self._p) - len(self.jumps))

    @property
    def n_settings_of_switches(self) -> int:
        """How many there are: what a recording has of each frame. Branches of forces follow from the state."""
        places = self.settings_of_switches
        return places.stop - places.start

    @property
    def jumps(self) -> list[int]:
        """Which of the events are places at which a force goes over to another branch; see `symgen/derive/jumps.py`."""
        return [k for k, event in enumerate(self.events) if event["action"] == JUMP]

    def with_settings(self, p: np.ndarray) -> np.ndarray:
        """Return `p` of parameters and inputs alone with all stops open and no friction behind them."""
        return np.concatenate([p, np.zeros(len(self.settings))]) if self.settings else p

    @property
    def closed(self) -> System:
        """The same model with its stops and frictions as constraints that `p` switches on and off."""
        if "_closed" not in self.__dict__:
            names = {name: CLOSED + name for name in OF_CLOSED}
            closed = System(self.source.renamed(closed_header(self.source.header), names))
            self.__dict__.setdefault("_closed", closed)
        return self.__dict__["_closed"]

    def precomputed(self, p: np.ndarray) -> np.ndarray:
        """Return `p` with all that depends on it alone worked out behind it, for kernels' `precomputed_address`.

        Do it again after a change of `p`. The last few are kept: a run and its checks ask for them several times.

        Parameters
        ----------
        p : ndarray, shape (n_p,)

        Returns
        -------
        ndarray, shape (n_precomputed,)
        """
        p = np.ascontiguousarray(p, dtype=float)
        if not self._hoisted:
            return p
        key, known = p.tobytes(), self._precomputed
        longer = known.get(key)
        if longer is None:
            longer = np.concatenate([p, np.zeros(self.n_precomputed - self.n_p)])
            self.update_precomputed(longer)
            with self._lock:
                if len(known) >= _MOST_PRECOMPUTED:
                    del known[next(iter(known))]
                known[key] = longer
                self.__dict__["n_precomputations"] += 1
        return longer.copy()

    def worked_out(self, p: np.ndarray) -> np.ndarray:
        """Return the part of `precomputed` that follows from `p`: all, but for pieces of inputs over time."""
        return self.precomputed(p)

    def precomputed_rows(self, p: np.ndarray) -> np.ndarray:
        """Return `precomputed` of each row of `p`, shape (n, n_p), of which only those of the last call are kept."""
        key, (known, rows) = p.tobytes(), self.__dict__.get("_last_rows", (None, None))
        if key == known:
            return rows.copy()
        rows = np.zeros((len(p), self.n_precomputed))
        rows[:, : self.n_p] = p
        if self._hoisted:
            times, made = np.zeros(len(p)), np.zeros((len(p), self.n_precomputed - self.n_p))
            own = np.ascontiguousarray(p, dtype=float)
            evaluate_rows(self.setup_address, times, times[:, None], own, made)
            rows[:, self.n_p :] = made
        self.__dict__["_last_rows"] = key, rows
        return rows.copy()

    @property
    def setup_address(self) -> int:
        """Address of the code `f(t, unused, p, out)` of `update_precomputed`, `out` behind `p`; 0 without such work."""
        return self._setup().address if self._hoisted else 0

    def update_precomputed(self, precomputed: np.ndarray) -> None:
        """Work out in place what depends on `p` alone, after something in it, at the beginning, changed."""
        if self._hoisted:
            self._setup()(precomputed, self.n_p)

    def _setup(self) -> Setup:
        """The function that works out what depends on `p` alone, compiled when it is first needed."""
        if "_compiled_setup" not in self.__dict__:
            with self._lock:  # a recording evaluates kernels beside the run
                if "_compiled_setup" not in self.__dict__:
                    sources = [self._kernel_source(name) for name in self._hoisted]
                    self.__dict__["_compiled_setup"] = compile_setup(sources)
        return self.__dict__["_compiled_setup"]

    def precomputed_between(self, p: np.ndarray, t0: float, t1: float) -> np.ndarray:
        """Return `precomputed(p)` for times between two neighbouring `input_breaks` [s]."""
        return self.precomputed(p)

    def input_breaks(self, t0: float, t1: float) -> Sequence[float]:
        """Return the times [s] between `t0` and `t1` at which inputs over time are not smooth."""
        return ()

    def initial_state(
        self, p: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the model's start values, before assembly.

        Parameters
        ----------
        p : ndarray, shape (n_p,), optional
            Parameters and inputs; the model's own without it. Starts that are expressions follow them.

        Returns
        -------
        q, v : ndarray, shape (nq,) and (nv,)
        q_enforced, v_enforced : ndarray of bool
            Which of them assembly must keep.
        """
        values, enforced = self._start_values
        values = values.copy()
        if p is not None and self.source.header.get("starts"):
            values = self.kernel("starts")(0.0, values, np.ascontiguousarray(p, dtype=float))
        return (
            values[: self.nq],
            values[self.nq :],
            enforced[: self.nq].copy(),
            enforced[self.nq :].copy(),
        )

    @functools.cached_property
    def events_may_jump(self) -> bool:
        """Whether a function of the model's own events has a choice or a step in it."""
        if len(self.events) == len(self.switches):
            return False
        form = self.function_text("events").form
        return any(form.nodes.op[node] in ("select", "floor") for node in form.nodes.reachable(form.roots()))

    @functools.cached_property
    def _start_values(self) -> tuple[np.ndarray, np.ndarray]:
        """The model's start values, and which of them assembly must keep, coordinates first."""
        records = (*self.coordinates, *self.rates)
        values = np.array([float(record["value"]) for record in records])
        return values, np.array([record["enforced"] for record in records], dtype=bool)
