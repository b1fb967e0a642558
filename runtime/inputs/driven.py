"""A system whose inputs follow time or a controller: the model's kernels, called with the inputs of that instant."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from symgen.runtime.abi import ENTRIES
from symgen.runtime.code.bridge import KERNEL_PROTOTYPE
from symgen.runtime.inputs.code import (
    COEFFICIENTS,
    INPUTS_SYMBOL,
    KNOT,
    TABLE,
    driven_ir,
    driven_symbol,
    fill,
    fix_piece,
    lay_out,
)
from symgen.runtime.inputs.controller import CompiledFeedback, Signals
from symgen.runtime.inputs.given import Pieces
from symgen.runtime.inputs.samples import Sampler
from symgen.runtime.lazy import Late
from symgen.runtime.system import System

engine = Late("symgen.runtime.code.engine")
numba_setup = Late("symgen.runtime.code.numba_setup")
feedback_code = Late("symgen.runtime.inputs.feedback")

_PATH = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p
)
# Taken over from the model besides what it is made with: what its parameters may be, and what works them out.
_TAKEN_OVER = frozenset(("_make_values_of_runs", "_values_of_runs", "_compiled_setup"))


@dataclass(frozen=True)
class Feedback:
    """A continuous controller: the numbers of its inputs, what it reads, and its machine code."""

    inputs: tuple[int, ...]
    signals: Signals
    code: CompiledFeedback


@dataclass(frozen=True, eq=False)
class DrivenKernel:
    """A function of the model with the inputs of the instant, called as a `symgen.runtime.kernel.Kernel` is.

    Attributes
    ----------
    name : str
    precomputed_address : int
        For a `p` from `DrivenSystem.precomputed`, in which the inputs' places are written by every call.
    out_size : int
    source : symgen.runtime.kernel.KernelSource
        Of the model's own function.
    """

    name: str
    precomputed_address: int
    out_size: int
    source: Any = field(repr=False)
    _system: DrivenSystem = field(repr=False)

    def __call__(self, t: float, y: Any, p: Any, out: np.ndarray | None = None) -> np.ndarray:
        """Evaluate the function; arguments are those of `Kernel`, the inputs in `p` are not read."""
        y = np.ascontiguousarray(y, dtype=float)
        out = np.zeros(self.out_size) if out is None else out
        with self._system._lock:
            precomputed = self._system.remembered(np.ascontiguousarray(p, dtype=float))
            KERNEL_PROTOTYPE(self.precomputed_address)(
                float(t), y.ctypes.data, precomputed.ctypes.data, out.ctypes.data
            )
            self._system.refuse_faults()
        return out

    def rows(self, times: np.ndarray, states: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Evaluate the function at several states, shape (n, out_size)."""
        return np.array([self(t, y, p) for t, y in zip(times, states)]).reshape(len(times), self.out_size)


class DrivenSystem(System):
    """A model with inputs over time, used as any `System`; its other inputs are constants in `p`.

    Parameters
    ----------
    base : System
    pieces : mapping of int to Pieces
        Tables and polynomials by the number of their input.
    samplers : sequence of Sampler
        Their inputs hold between calls; what they said so far is part of this system.
    feedback : sequence of Feedback
    notes : sequence of str
        What a run says of its inputs: `input_notes`.

    Attributes
    ----------
    base : System
        The model, with constant inputs.
    places : symgen.runtime.inputs.code.Places
    samplers, feedback : tuple
    """

    def __init__(
        self,
        base: System,
        pieces: Mapping[int, Pieces],
        samplers: Sequence[Sampler] = (),
        feedback: Sequence[Feedback] = (),
        notes: Sequence[str] = (),
    ):
        own = self.__dict__
        taken_over = base._of_model | _TAKEN_OVER
        own.update({key: value for key, value in base.__dict__.items() if key in taken_over})
        own.update(
            base=base,
            samplers=tuple(samplers),
            feedback=tuple(feedback),
            _kernels={},
            _precomputed={},
            input_notes=tuple(notes),
        )
        own["_pieces"] = dict(sorted(pieces.items()))
        own["structure"] = {
            **base.structure,
            "time_dependent": True,
            "velocity_dependent": base.structure["velocity_dependent"] or bool(feedback),
        }
        sampled = [(number, 0) for sampler in samplers for number in sampler.inputs]
        own["places"] = lay_out(
            len(base.parameters),
            len(base.inputs),
            base.n_precomputed,
            [(number, x.degree) for number, x in own["_pieces"].items()] + sampled,
            [(x.inputs, x.signals.places) for x in feedback],
            len(base.outputs),
        )
        first = len(base.parameters)
        own["_polynomials"] = {
            first + x.number: (x.block + KNOT, x.block + COEFFICIENTS, x.degree) for x in self.places.pieces
        }
        own["n_precomputed"] = len(self.precomputed(base.parameter_values()))
        own["_wrapped"] = [
            name for name in base.source.names()
            if base.has(name) and (base.inputs_read(name) or (feedback and name == "residual_jacobian"))
        ]  # fmt: skip
        if "residual_jacobian" in own["_wrapped"] and not feedback:
            own["_wrapped"].append("residual_jacobian" + ENTRIES)

    def __reduce__(self):
        raise TypeError(f"the inputs of model {self.name!r} over time cannot be pickled: pickle its parts")

    @property
    def n_rewritten(self) -> int:
        """Where the pieces of all inputs begin, see `System.n_rewritten`."""
        return self.places.end

    @property
    def input_polynomials(self) -> dict[int, tuple[int, int, int]]:
        """For Taylor series: place of an input in `p` -> places of the knot and first coefficient, and the degree."""
        return self._polynomials

    @property
    def controllers(self) -> list[Sampler | Feedback]:
        """All of them, sampled ones first."""
        return [*self.samplers, *self.feedback]

    @property
    def has_feedback(self) -> bool:
        """Whether controllers act at every instant."""
        return bool(self.feedback)

    @property
    def is_repeatable(self) -> bool:
        """Whether tables and polynomials are all that acts; see `System.is_repeatable`."""
        return not self.controllers

    def refuse_faults(self) -> None:
        """Raise `InputFault` if a continuous controller has raised an error since the last time."""
        for controller in self.feedback:
            names = [self.inputs[k]["name"] for k in controller.inputs]
            controller.code.refuse_faults(names, controller.signals)

    @property
    def input_descriptions(self) -> dict[str, str]:
        """What inputs over time are, in words, by name."""
        names = [record["name"] for record in self.inputs]
        words = {names[k]: _description(pieces) for k, pieces in self._pieces.items()}
        words |= {names[k]: "sampled controller" for sampler in self.samplers for k in sampler.inputs}
        return words | {names[k]: "controller" for controller in self.feedback for k in controller.inputs}

    @property
    def closed(self) -> DrivenSystem:
        """The same with stops and frictions as constraints, see `System.closed`."""
        if "_closed" not in self.__dict__:
            self.__dict__["_closed"] = DrivenSystem(
                self.base.closed, self._pieces, self.samplers, self.feedback
            )
        return self.__dict__["_closed"]

    def as_recorded(self) -> DrivenSystem:
        """Return the same with what sampled controllers said held as tables; nothing of it is called again."""
        said = {
            number: sampler.pieces(k) for sampler in self.samplers for k, number in enumerate(sampler.inputs)
        }
        return DrivenSystem(self.base, {**self._pieces, **said}, (), self.feedback)

    def anew(self) -> DrivenSystem:
        """Return the same with sampled controllers that have not been called yet."""
        return DrivenSystem(
            self.base, self._pieces, [sampler.anew() for sampler in self.samplers], self.feedback
        )

    @property
    def all_pieces(self) -> list[Pieces]:
        """Tables, polynomials and what was sampled so far, in the order of `places.pieces`."""
        sampled = (sampler.pieces(k) for sampler in self.samplers for k in range(len(sampler.inputs)))
        return [*self._pieces.values(), *sampled]

    @property
    def largest_inputs(self) -> dict[str, float]:
        """The largest coefficient of each table and polynomial, by the name of its input."""
        named = zip(self.places.pieces, self.all_pieces)
        return {
            self.inputs[x.number]["name"]: float(np.abs(pieces.coefficients).max()) for x, pieces in named
        }

    def precomputed(self, p: np.ndarray) -> np.ndarray:
        """Return a new `p` for kernels' `precomputed_address`; pieces are searched for at the time of each call."""
        addresses = [x.code.address for x in self.feedback]
        return fill(
            self.places, np.asarray(self.base.precomputed(p), dtype=float), self.all_pieces, addresses
        )

    def worked_out(self, p: np.ndarray) -> np.ndarray:
        """Return the part of `precomputed` in front of the inputs."""
        return self.base.precomputed(p)

    def precomputed_rows(self, p: np.ndarray) -> np.ndarray:
        """Return `precomputed` of each row of `p`."""
        return np.array([self.precomputed(row) for row in p])

    def precomputed_between(self, p: np.ndarray, t0: float, t1: float) -> np.ndarray:
        """Return a precomputed `p` in which the pieces that hold between two neighbouring breaks are fixed."""
        precomputed = self.precomputed(p)
        for place, pieces in zip(self.places.pieces, self.all_pieces):
            fix_piece(place, precomputed, pieces, 0.5 * (t0 + t1))
        return precomputed

    def input_breaks(self, t0: float, t1: float) -> np.ndarray:
        """Return the times [s] between `t0` and `t1`, exclusive, at which a piece of an input ends."""
        times = np.unique(np.concatenate([[], *(pieces.breaks for pieces in self.all_pieces)]))
        return times[(times > t0) & (times < t1)]

    def remembered(self, p: np.ndarray) -> np.ndarray:
        """Return `precomputed(p)`, kept for the next call with the same `p`; under the system's lock."""
        key = (p.tobytes(), tuple(len(sampler.times) for sampler in self.samplers))
        if self.__dict__.get("_remembered", (None, None))[0] != key:
            self.__dict__["_remembered"] = (key, self.precomputed(p))
        return self.__dict__["_remembered"][1]

    def has(self, function: str) -> bool:
        """Whether there is this function; "inputs" gives all inputs."""
        return function == "inputs" or self.base.has(function)

    def kernel(self, function: str) -> Any:
        """Return a function with the inputs of the instant; those that read none are the model's own."""
        if function != "inputs" and function not in self._wrapped:
            return self.base.kernel(function)
        with self._lock:
            if function not in self._kernels:
                self._kernels[function] = self._driven_kernel(function)
        return self._kernels[function]

    def _driven_kernel(self, function: str) -> DrivenKernel:
        code, table = self._code()
        if function == "inputs":
            return DrivenKernel(function, code.address(INPUTS_SYMBOL), len(self.inputs), None, self)
        kernel = self.base.kernel(function)
        if function == "residual_jacobian" and self.feedback:
            self._connect_path(table)
        else:
            table[self._wrapped.index(function)] = kernel.precomputed_address
        return DrivenKernel(
            function, code.address(driven_symbol(function)), kernel.out_size, kernel.source, self
        )

    def _code(self) -> tuple[Any, Any]:
        """Return the machine code of all driven kernels, and the table of addresses that they call."""
        if "_driven_code" not in self.__dict__:
            ir = driven_ir(self.places, self._wrapped)
            code = engine.MachineCode()
            code.add(
                engine.object_code(engine.cache_key(ir), "inputs", INPUTS_SYMBOL, lambda _: (ir, 0)),
                INPUTS_SYMBOL,
            )
            table = (ctypes.c_uint64 * (len(self._wrapped) + 3)).from_address(code.address(TABLE))
            if any(place.outputs != place.values for place in self.places.feedback):
                table[len(self._wrapped)] = self.base.kernel("outputs").precomputed_address
            self.__dict__["_driven_code"] = (code, table)
        return self.__dict__["_driven_code"]

    def _connect_path(self, table: Any) -> None:
        """Let the driven Jacobian call the path that adds what the controllers do to it."""
        path = feedback_code
        context = np.zeros(path.N_CONTEXT + len(self.inputs), dtype=np.int64)
        context[path.JACOBIAN] = self.base.kernel("residual_jacobian").precomputed_address
        context[path.RESIDUAL] = self.base.kernel("residual").precomputed_address
        context[path.INPUTS] = self.kernel("inputs").precomputed_address
        context[path.N], context[path.ROWS] = self.nq + self.nv, self.nv + self.m
        context[path.NP], context[path.FIRST_INPUT] = self.n_precomputed, self.places.first_input
        context[path.N_INPUTS] = len(self.inputs)
        for place in self.places.feedback:
            context[path.N_CONTEXT + np.array(place.inputs)] = 1
        if numba_setup.DISABLE_JIT:
            function = _PATH(self._jacobian_in_python)
            address = ctypes.cast(function, ctypes.c_void_p).value
        else:
            function = feedback_code.jacobian_path
            address = function.address
        table[len(self._wrapped) + 1], table[len(self._wrapped) + 2] = address, context.ctypes.data
        self.__dict__["_path"] = (function, context)

    def _jacobian_in_python(self, context: int, t: float, y: int, p: int, out: int) -> None:
        rows = self.nv + self.m
        width = self.nq + self.nv + rows
        lengths = (width, self.n_precomputed, rows * width)
        arrays = [
            np.ctypeslib.as_array((ctypes.c_double * n).from_address(x)) for x, n in zip((y, p, out), lengths)
        ]
        feedback_code.driven_jacobian(self.__dict__["_path"][1], t, *arrays)


def _description(pieces: Pieces) -> str:
    n = len(pieces.knots)
    return f"{n} pieces over time" if n > 1 else f"polynomial of degree {pieces.degree} in time"
