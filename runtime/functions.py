"""The functions of a model: as machine code, as plain Python, for a user's own Numba code."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from symgen.runtime.abi import ENTRIES, array_sizes
from symgen.runtime.code import stand_ins
from symgen.runtime.code.function_text import FunctionText
from symgen.runtime.errors import UnknownNameError, nearest
from symgen.runtime.kernel import Kernel, KernelSource, compile_kernel
from symgen.runtime.lazy import Late
from symgen.runtime.names import acceleration_labels, rate_labels

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from symgen.runtime.code.engine import MachineCode
    from symgen.runtime.graph.form import Form

compact = Late("symgen.runtime.code.compact")
engine = Late("symgen.runtime.code.engine")
numba_link = Late("symgen.runtime.code.numba_link")


class ModelFunctions:
    """What `System` knows about its functions; kernels are compiled when they are first used."""

    def has(self, function: str) -> bool:
        """Whether the model has this function of the ABI."""
        known = self._known_functions
        if function not in known:
            source = self.source
            known[function] = function in source.names() and array_sizes(source.header, function) is not None
        return known[function]

    def kernel(self, function: str) -> Kernel:
        """Return a function of the model as machine code, compiled or read from the cache on first use.

        Parameters
        ----------
        function : str
            A name of the ABI, such as "rhs", or one of a matrix with "_entries" behind it, see `entry_places`.

        Returns
        -------
        symgen.runtime.kernel.Kernel

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
        if stand_ins.at_once:
            kernel.settle()
        return kernel

    @property
    def compiled(self) -> tuple[str, ...]:
        """The functions that are machine code by now, by name."""
        return tuple(sorted(self._kernels))

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
        """Return the same text compiled by Numba, an oracle for the kernel; arrays that are too short are refused."""
        source = self._kernel_source(function)
        return numba_link.checked(source.njit_function(), source)

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
            Raises ValueError where one of them is shorter than what the function reads or writes: `f.n_y`,
            `f.n_p` and `f.n_out` values, which its docstring says too.

        Examples
        --------
        SciPy's `solve_ivp` takes states and gives their derivatives; `out` holds more behind them:

        >>> f = system.numba("rhs")
        >>> n, n_out = system.nq + system.nv, f.n_out
        >>> @numba.njit
        ... def derivatives(t, y, p):
        ...     out = np.empty(n_out)
        ...     f(t, y, p, out)
        ...     return out[:n]
        >>> found = solve_ivp(derivatives, (0, 1), [0.2, 0.0], args=(system.parameter_values(),))
        """
        return numba_link.linked_function(self._kernel_source(function))

    def machine_code(self) -> MachineCode:
        """Return the place of this model's machine code; made on first use."""
        with self._lock:
            if "_machine_code" not in self.__dict__:
                self.__dict__["_machine_code"] = engine.MachineCode()
            return self.__dict__["_machine_code"]

    def form(self, function: str) -> Form:
        """Return a function's form, read on first use: what passes work on (docs/forms.md)."""
        return self.function_text(function).form

    def inputs_read(self, function: str) -> set[int]:
        """Return the numbers of the inputs that a function reads."""
        first = len(self.parameters)
        if (
            function in self.source.late
        ):  # no derivative reads more than the residual, and asking would derive it
            function = "residual"
        return {k - first for k in self.source.facts(function).inputs if k < first + len(self.inputs)}

    def function_text(self, function: str) -> FunctionText:
        """Return a function's text with the lengths of its arrays, as it is lowered."""
        return self._kernel_source(function).code

    def _kernel_source(self, function: str) -> KernelSource:
        if function.endswith(ENTRIES) and function not in self.source.functions:
            return self._entries_source(function.removesuffix(ENTRIES))[0]
        code = self.source.function(function)
        if code is None:
            raise UnknownNameError(self._no_function(function))
        n_hoisted, offset = self._hoisted.get(function, (0, 0))
        return KernelSource(code, n_hoisted, offset, self)

    def entry_places(self, function: str) -> np.ndarray:
        """Return where in the matrix that a function writes those entries stand that `<function>_entries` writes.

        That kernel takes the same arguments, and writes what is no structural zero to an array of this length.
        """
        return self._entries_source(function)[1]

    def _entries_source(self, function: str) -> tuple[KernelSource, np.ndarray]:
        found = self.__dict__.setdefault("_entries", {})
        if function not in found:
            whole = self._kernel_source(function)
            code, places = compact.compact(whole.code)
            found[function] = replace(whole, code=code), places
        return found[function]

    def _no_function(self, function: str) -> str:
        if function in ("project", "gamma", "constraint_residual", "constraint_jacobian") and not self.m:
            return f"model {self.name!r} has no function {function!r}: it has no constraints"
        known = [name for name in self.source.names() if self.has(name)]
        return f"model {self.name!r} has no function {function!r}: {nearest(function, known)}"

    def describe_y(self, function: str) -> str:
        """Say what `function` reads as `y`, for messages: 'theta, dot(theta)'."""
        names = [record["name"] for record in self.coordinates]
        names += rate_labels(self.coordinates, self.rates)
        if function.startswith("inverse_dynamics") or function == "regressor":
            names += acceleration_labels(self.coordinates, self.rates)
        elif function.startswith("forward_dynamics"):
            names += [f"tau({label})" for label in rate_labels(self.coordinates, self.rates)]
        elif function in ("residual", "residual_jacobian", "solve"):
            names += acceleration_labels(self.coordinates, self.rates)
            names += [f"lambda({record['name']})" for record in self.constraints]
        return _short(names)

    def describe_p(self) -> str:
        """Say what `p` holds, for messages."""
        return _short([*self._p_index, *self.settings])


def _short(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 8 else ", ".join((*names[:6], "…", names[-1]))
