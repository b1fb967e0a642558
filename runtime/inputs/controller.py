"""Controllers: inputs that follow from what sensors see, at every instant or sampled at a period."""

from __future__ import annotations

import contextlib
import ctypes
import sys
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.code.bridge import KERNEL_PROTOTYPE
from symgen.runtime.errors import nearest
from symgen.runtime.inputs.given import InputFault
from symgen.runtime.lazy import Late
from symgen.runtime.names import rate_labels

if TYPE_CHECKING:
    from symgen.runtime.system import System

numba_setup = Late("symgen.runtime.code.numba_setup")


@dataclass(frozen=True)
class Controller:
    """A function that gives one input, or several, from time and what it reads.

    Parameters
    ----------
    function : callable
        `function(t, x)`, with `t` a float [s] and `x` a float64 array of what the controller reads. It returns a
        number; for several inputs (`inputs={("F", "G"): Controller(…)}`) a tuple or an array of as many. With
        `memory` it is `function(t, x, memory)`.
    period : float, optional [s]
        Sampled: the function is called at t_start, t_start + period, …, and what it returns holds until the next
        call. It is called as it is, in plain Python. Without a period it acts at every instant: it is compiled by
        Numba (or comes as a `numba.njit` function), called inside every evaluation of the equations of motion, and
        must depend on `t` and `x` alone.
    reads : sequence of str, optional
        Names of coordinates, rates (`dot(x)`) and outputs, in the order of `x`; all coordinates and rates by default.
    noise : float, sequence or mapping of str to float, optional
        Standard deviation of the Gaussian noise on what a sampled controller reads: for all, for each, or by name.
    seed : int
        Of the noise: the same seed gives the same noise, whatever steps are taken.
    memory : array_like, optional
        What a sampled controller keeps from call to call, such as the integral of a PI controller: it finds a copy
        of this array at the start of every run, and changes it in place.
    """

    function: Callable[..., Any]
    period: float | None = None
    reads: Sequence[str] | None = None
    noise: float | Sequence[float] | Mapping[str, float] | None = None
    seed: int = 0
    memory: Any = None

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise InputFault(f"a controller of a {type(self.function).__name__}: give a function of (t, x)")
        if self.period is None:
            for name in ("noise", "memory"):
                if getattr(self, name) is not None:
                    raise InputFault(f"a controller with {name} must be sampled: give it a period")
            return
        if not (np.isfinite(self.period) and self.period > 0.0):
            raise InputFault(
                f"the period of a controller is {self.period}: give a positive number of seconds"
            )


@dataclass(frozen=True)
class Signals:
    """What a controller reads, as places: of (q, v) where it is not negative, else -1 - place among the outputs."""

    names: tuple[str, ...]
    places: tuple[int, ...]

    @property
    def outputs(self) -> tuple[int, ...]:
        """Places among the outputs."""
        return tuple(-1 - place for place in self.places if place < 0)


def find_signals(system: System, reads: Sequence[str] | None) -> Signals:
    """Return where what a controller reads is found."""
    states = [record["name"] for record in system.coordinates]
    states += rate_labels(system.coordinates, system.rates)
    hidden = {states[i] for i in system.integrals}
    places = {name: -1 - k for k, record in enumerate(system.outputs) for name in [record["name"]]}
    places |= {name: k for k, name in enumerate(states) if name not in hidden}
    names = tuple([name for name in states if name not in hidden] if reads is None else reads)
    for name in names:
        if name not in places:
            raise InputFault(
                f"a controller reads {name!r}, which is no coordinate, rate or output of model {system.name!r}: "
                f"{nearest(name, places)}"
            )
    return Signals(names, tuple(places[name] for name in names))


def deviations(controller: Controller, signals: Signals) -> np.ndarray | None:
    """Return the standard deviation of the noise on each signal, or None where there is none."""
    noise, names = controller.noise, signals.names
    if noise is None:
        return None
    if isinstance(noise, Mapping):
        for name in noise:
            if name not in names:
                raise InputFault(
                    f"noise on {name!r}, which the controller does not read: {nearest(name, names)}"
                )
        noise = [noise.get(name, 0.0) for name in names]
    try:
        values = np.full(len(names), float(noise)) if np.ndim(noise) == 0 else np.array(noise, dtype=float)
        fits = values.shape == (len(names),) and values.dtype == float
    except (TypeError, ValueError):
        fits = False
    if not fits:
        raise InputFault(f"noise must be a number, or {len(names)} of them: one for each signal")
    if not (np.isfinite(values).all() and (values >= 0.0).all()):
        raise InputFault(f"noise is {controller.noise}: standard deviations are finite and not negative")
    return values


_compiled: weakref.WeakSet[CompiledFeedback] = weakref.WeakSet()


class CompiledFeedback:
    """A continuous controller as machine code `void f(double t, const double *x, const double *p, double *u)`.

    Where the function raises, or reads beyond `x`, the code keeps that call, and writes nan to `u` from then on. So one
    object serves one run at a time.

    Attributes
    ----------
    address : int
        Valid as long as this object lives.
    """

    def __init__(self, controller: Controller, n_signals: int, n_inputs: int):
        self._faulty = np.zeros(2 + n_signals)  # whether there was such a call; its t and x
        make = _python_callback if numba_setup.DISABLE_JIT else _compile
        self._code, self._function = make(controller.function, n_inputs, self._faulty)
        _compiled.add(self)
        _keep_quiet()
        plain = isinstance(self._code, ctypes._CFuncPtr)
        self.address = ctypes.cast(self._code, ctypes.c_void_p).value if plain else self._code.address

    @property
    def is_faulty(self) -> bool:
        """Whether a call has not come to its end."""
        return bool(self._faulty[0])

    def refuse_faults(self, inputs: Sequence[str], signals: Signals) -> None:
        """Raise the error of the first call that failed since the last time, if there was one.

        Raises
        ------
        InputFault
        """
        if not self.is_faulty:
            return
        t, x = float(self._faulty[1]), self._faulty[2:].copy()
        self._faulty[0] = 0.0
        try:
            result = self._function(t, x)
            if np.size(result) == len(inputs):
                return
            why = f"returned {result!r:.60}"
        except Exception as error:
            why = said_by(error)
        raise InputFault(
            f"the controller of {', '.join(map(repr, inputs))} {why} at t = {t:.9g} s; its x holds {len(x)} "
            f"value{'s' * (len(x) != 1)}{': ' * bool(len(x))}{', '.join(signals.names)}"
        )


def said_by(error: Exception) -> str:
    """Say that a user's function raised `error`, in one line."""
    text = " ".join(str(error).split())
    return f"raised {type(error).__name__}" + (f" ({text[:200]})" if text else "")


def _compile(function: Callable[..., Any], n_inputs: int, faulty: np.ndarray) -> tuple[Any, Callable]:
    import numba
    from numba import carray, cfunc, types
    from numba.core.errors import NumbaError

    from symgen.runtime.inputs.memory import pointer_to

    options = {"nopython": True, "error_model": "numpy"}
    if isinstance(function, numba.core.dispatcher.Dispatcher):
        options, function = dict(function.targetoptions), function.py_func
    act = numba.jit(**{**options, "boundscheck": True})(function)
    several, n_signals, place = n_inputs > 1, len(faulty) - 2, faulty.ctypes.data

    def call(t, x, p, out):
        # A call that raises does not come to its end, and so leaves its mark: no other is made then. (Handling
        # exceptions here would take Numba three times as long to compile.)
        noted, signals = carray(pointer_to(place), (n_signals + 2,), np.float64), carray(x, (n_signals,))
        for k in range(n_inputs):
            out[k] = np.nan
        if noted[0] != 0.0:
            return
        noted[0], noted[1] = 1.0, t
        for k in range(n_signals):
            noted[2 + k] = signals[k]
        u = act(t, signals)
        if several:
            if len(u) != n_inputs:
                raise ValueError("another number of inputs")
            for k in range(n_inputs):
                out[k] = u[k]
        else:
            out[0] = u
        noted[0] = 0.0

    doubles = types.CPointer(types.float64)
    try:
        # What the function calls is checked as well.
        with _bounds_checked():
            code = cfunc(types.void(types.float64, doubles, doubles, doubles), error_model="numpy")(call)
        return code, act
    except NumbaError as error:
        name = getattr(function, "__name__", "function")
        reason = _reason(str(error))
        raise InputFault(
            f"Numba cannot compile the controller {name!r} ({reason}): it may use numbers, NumPy arrays and functions "
            "of math only, and returns a number (or as many as it has inputs); or give it a period, then it is called "
            "as plain Python"
        ) from None


def _keep_quiet() -> None:
    """Let Python print nothing about what is raised in a controller's machine code: it is raised again, as an error."""
    before = sys.unraisablehook
    if getattr(before, "knows_controllers", False):
        return

    def hook(unraisable: Any) -> None:
        if not (isinstance(unraisable.object, str) and any(code.is_faulty for code in _compiled)):
            before(unraisable)

    hook.knows_controllers = True
    sys.unraisablehook = hook


@contextlib.contextmanager
def _bounds_checked() -> Iterator[None]:
    from numba import config

    before, config.BOUNDSCHECK = config.BOUNDSCHECK, 1
    try:
        yield
    finally:
        config.BOUNDSCHECK = before


def _reason(text: str) -> str:
    """The line of Numba's message that says what is wrong."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    telling = [
        line for line in lines if not line.startswith(("Failed in", "During", "File", "<", "-", ">>>", "["))
    ]
    return (telling or lines or ["no reason given"])[0][:200]


def _python_callback(function: Callable[..., Any], n_inputs: int, faulty: np.ndarray) -> tuple[Any, Callable]:
    """The same without a compiler, for runs with NUMBA_DISABLE_JIT."""
    function = getattr(function, "py_func", function)
    n_signals = len(faulty) - 2

    def call(t, x, p, out):
        signals = (
            np.ctypeslib.as_array((ctypes.c_double * n_signals).from_address(x)) if n_signals else np.zeros(0)
        )
        inputs = np.ctypeslib.as_array((ctypes.c_double * n_inputs).from_address(out))
        try:
            inputs[:] = function(t, signals.copy())
        except Exception:
            inputs[:] = np.nan
            if not faulty[0]:
                faulty[0], faulty[1], faulty[2:] = 1.0, t, signals

    return KERNEL_PROTOTYPE(call), function
