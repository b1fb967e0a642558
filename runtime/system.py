"""A model at run time: what its module's header says, and its kernels, compiled when they are first used."""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from runtime.abi import array_sizes
from runtime.code.grammar import FunctionText, Lengths
from runtime.errors import UnknownNameError, nearest
from runtime.kernel import Kernel, KernelSource, compile_kernel
from runtime.module import ModuleSource, read_module
from runtime.names import acceleration_labels, rate_labels

if TYPE_CHECKING:
    from collections.abc import Callable

    from runtime.code.engine import MachineCode
    from runtime.solution import Solution


def load(path_or_text: str | os.PathLike[str]) -> System:
    """Load a generated module from a file or its text. Nothing in it is executed; nothing is compiled yet.

    Parameters
    ----------
    path_or_text : path-like or str
        A text is told from a path by its line breaks.

    Returns
    -------
    System

    Raises
    ------
    runtime.errors.ModuleError
        It is not a module of this ABI.
    """
    return System(read_module(path_or_text))


class System:
    """A model, constant after loading.

    Attributes
    ----------
    name, description, file : str
    nq, nv, nh, nn, nw : int
        Numbers of coordinates, rates, holonomic and velocity constraints; 1 if the state carries the work.
    m : int
        nh + nn, the number of multipliers.
    ny : int
        nq + nv + nw, the length of the state that integrators carry.
    n_prepared : int
        The length of a prepared `p`.
    n_row : int
        The length of a row that `rhs` writes.
    coordinates, rates, parameters, inputs, constants, constraints, outputs, events, bodies : tuple of dict
        The header's records, see docs/architecture.md.
    subsystems : tuple of dict
        For each kind of independent subsystem: indices of each one's coordinates, rates and constraints.
    quaternions : tuple of int
        Where in q each unit quaternion (w, x, y, z) begins.
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
        set_("subsystems", tuple(header.get("subsystems", ())))
        m = self.nh + self.nn
        set_("m", m)
        set_("ny", self.nq + self.nv + self.nw)
        set_("n_row", self.ny + m + (m > 0))
        values = [float(record["value"]) for record in (*self.parameters, *self.inputs)]
        set_("_p", np.array(values))
        names = [record["name"] for record in (*self.parameters, *self.inputs)]
        set_("_p_index", {name: index for index, name in enumerate(names)})
        hoisted, end = {}, len(values)
        for name, count in header.get("hoisted", {}).items():
            hoisted[name] = (count, end)
            end += count
        set_("_hoisted", hoisted)
        set_("n_prepared", end)
        set_("_kernels", {})
        set_("_lock", threading.RLock())

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a System is constant: {name!r} cannot be set")

    def __repr__(self) -> str:
        return f"<System {self.name!r}: {self.nq} coordinates, {self.nv} rates, {self.m} constraints>"

    def __reduce__(self):
        return System, (self.source,)

    @property
    def n_p(self) -> int:
        """The length of `p`: parameters and inputs."""
        return len(self._p)

    def parameter_values(self, overrides: Mapping[str, float] | None = None) -> np.ndarray:
        """Return `p`: the model's parameters and inputs, some of them with other values.

        Parameters
        ----------
        overrides : mapping of str to float, optional
            In the units in which the model states them.

        Returns
        -------
        p : ndarray, shape (n_p,)
        """
        p = self._p.copy()
        for name, value in (overrides or {}).items():
            if name not in self._p_index:
                raise UnknownNameError(self._not_settable(name))
            p[self._p_index[name]] = float(value)
        return p

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

    def prepared(self, p: np.ndarray) -> np.ndarray:
        """Return `p` with all that depends on it alone worked out behind it, for kernels' `prepared_address`.

        Do it again after a change of `p`.

        Parameters
        ----------
        p : ndarray, shape (n_p,)

        Returns
        -------
        ndarray, shape (n_prepared,)
        """
        p = np.ascontiguousarray(p, dtype=float)
        if not self._hoisted:
            return p
        if "_setup" not in self.__dict__:
            from runtime.kernel import compile_setup

            with self._lock:
                sources = [self._kernel_source(name) for name in self._hoisted]
                self.__dict__["_setup"] = compile_setup(sources)
        longer = np.concatenate([p, np.zeros(self.n_prepared - self.n_p)])
        self._setup(longer, self.n_p)
        return longer

    def initial_state(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the model's start values, before assembly.

        Returns
        -------
        q, v : ndarray, shape (nq,) and (nv,)
        q_enforced, v_enforced : ndarray of bool
            Which of them assembly must keep.
        """
        return (
            np.array([float(record["value"]) for record in self.coordinates]),
            np.array([float(record["value"]) for record in self.rates]),
            np.array([record["enforced"] for record in self.coordinates], dtype=bool),
            np.array([record["enforced"] for record in self.rates], dtype=bool),
        )

    def has(self, function: str) -> bool:
        """Whether the model has this function of the ABI."""
        return function in self.source.functions and array_sizes(self.source.header, function) is not None

    def kernel(self, function: str) -> Kernel:
        """Return a function of the model as machine code, compiled or read from the cache on first use.

        Parameters
        ----------
        function : str
            A name of the ABI, such as "rhs".

        Returns
        -------
        runtime.kernel.Kernel

        Raises
        ------
        UnknownNameError
            The model has no such function; the message names the nearest.
        """
        kernel = self._kernels.get(function)
        if kernel is None:
            with self._lock:
                kernel = self._kernels.get(function)
                if kernel is None:
                    kernel = self._kernels[function] = compile_kernel(self._kernel_source(function))
        return kernel

    def python_function(self, function: str) -> Callable:
        """Return the function as plain Python: for a debugger, and as an oracle.

        Its text has passed the grammar's check, and it sees no names but those of the grammar.

        Parameters
        ----------
        function : str

        Returns
        -------
        callable
            `f(t, y, p, out)` writes `out` in place.
        """
        return self._kernel_source(function).python_function()

    def njit_function(self, function: str) -> Callable:
        """Return the same text compiled by Numba, an oracle for the kernel."""
        import runtime.code.numba_setup  # noqa: F401

        return self._kernel_source(function).njit_function()

    def numba(self, function: str) -> Callable:
        """Return `f(t, y, p, out)` for calls from your own `numba.njit` code, at a kernel's speed.

        Its code becomes part of your function's, so `cache=True` works; but like all of Numba's caching it
        does not notice when the model changes: clear the cache then.

        Parameters
        ----------
        function : str

        Returns
        -------
        callable
            `t` a float, `y`, `p` and `out` C-contiguous float64 arrays of one dimension; writes `out` in place.
        """
        from runtime.code.numba_link import linked_function

        return linked_function(self._kernel_source(function))

    def run(self, **options: Any) -> Solution:
        """Integrate the model; the options are those of `runtime.solve.solve`."""
        from runtime.solve import solve

        return solve(self, **options)

    def machine_code(self) -> MachineCode:
        """Return the place of this model's machine code; made on first use."""
        if "_machine_code" not in self.__dict__:
            from runtime.code.engine import MachineCode

            self.__dict__["_machine_code"] = MachineCode()
        return self.__dict__["_machine_code"]

    def _kernel_source(self, function: str) -> KernelSource:
        sizes = array_sizes(self.source.header, function)
        if sizes is None or function not in self.source.functions:
            raise UnknownNameError(self._no_function(function))
        text, line = self.source.functions[function], self.source.lines[function]
        lengths = Lengths(sizes[0], self.n_p, sizes[1])
        tables = {name: entries for name, entries in self.source.tables.items() if f"{name}[" in text}
        code = FunctionText(function, text, lengths, tables, self.file, line)
        n_hoisted, offset = self._hoisted.get(function, (0, 0))
        return KernelSource(code, n_hoisted, offset, self)

    def _no_function(self, function: str) -> str:
        if function in ("project", "gamma", "constraint_residual", "constraint_jacobian") and not self.m:
            return f"model {self.name!r} has no function {function!r}: it has no constraints"
        known = [name for name in self.source.functions if self.has(name)]
        return f"model {self.name!r} has no function {function!r}: {nearest(function, known)}"

    def describe_y(self, function: str) -> str:
        """Say what `function` reads as `y`, for messages: 'theta, dot(theta)'."""
        names = [record["name"] for record in self.coordinates]
        names += rate_labels(self.coordinates, self.rates)
        if function in ("residual", "residual_jacobian"):
            names += acceleration_labels(self.coordinates, self.rates)
            names += [f"lambda({record['name']})" for record in self.constraints]
        return _short(names)

    def describe_p(self) -> str:
        """Say what `p` holds, for messages."""
        return _short(list(self._p_index))


def _short(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 8 else ", ".join((*names[:6], "…", names[-1]))
