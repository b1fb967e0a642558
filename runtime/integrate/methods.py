"""The integration methods by name: what each is, what it needs, and which compiled loop runs it."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from runtime.errors import RuntimeModelError, nearest

if TYPE_CHECKING:
    from runtime.system import System


@dataclass(frozen=True)
class Method:
    """An integration method; the code behind it is imported when it is used.

    Attributes
    ----------
    name : str
    order : int
    dense_order : int
        Of the dense output.
    adaptive : bool
        Chooses its own steps; otherwise it takes steps of one given length.
    family : str
        `module:function` of the step loop, see docs/architecture.md.
    coefficients : callable
        System -> the named tuple that the loop takes as `method`.
    work_size : callable
        (coefficients, sizes) -> length of the array `work`.
    kernels : tuple of str
        Functions of the model that it calls, beyond `rhs`.
    needs_plain_rates : bool
        Works only where the rates are dq/dt (nq == nv).
    stiff : bool
        Its step is not limited by the stability of fast, damped motions.
    """

    name: str
    order: int
    dense_order: int
    adaptive: bool
    family: str
    coefficients: Callable[[System], Any]
    work_size: Callable[[Any, np.ndarray], int]
    kernels: tuple[str, ...] = ()
    needs_plain_rates: bool = False
    stiff: bool = False

    def advance(self) -> Callable:
        """Return the step loop."""
        return _resolve(self.family)


def _resolve(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


def _explicit(name: str, order: int, dense_order: int, adaptive: bool) -> Method:
    def tableau(system: System) -> Any:
        return _resolve(f"runtime.integrate.tableaus:{name}")()

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("runtime.integrate.explicit:erk_work_size")(coefficients.n_rows, sizes))

    family = "runtime.integrate.explicit:advance_erk"
    return Method(name, order, dense_order, adaptive, family, tableau, work_size)


def _symplectic(name: str, order: int, verlet: bool) -> Method:
    def scheme(system: System) -> Any:
        reuse = verlet and not (system.structure["velocity_dependent"] or system.nw or system.m)
        return _resolve("runtime.integrate.symplectic:SymplecticScheme")(int(verlet), int(reuse))

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("runtime.integrate.symplectic:symplectic_work_size")(sizes))

    family = "runtime.integrate.symplectic:advance_semi_implicit"
    return Method(name, order, 3, False, family, scheme, work_size, needs_plain_rates=True)


def _implicit(name: str, order: int) -> Method:
    def stage(system: System) -> Any:
        return _resolve(f"runtime.integrate.implicit:{name.upper()}")

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("runtime.integrate.implicit:implicit_work_size")(sizes))

    family = "runtime.integrate.implicit:advance_implicit"
    kernels = ("residual_jacobian",)
    return Method(
        name, order, order, False, family, stage, work_size, kernels, needs_plain_rates=True, stiff=True
    )


def _radau5() -> Method:
    def coefficients(system: System) -> Any:
        return _resolve("runtime.integrate.radau5_coefficients:radau5")()

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("runtime.integrate.radau5_stages:radau_work_size")(sizes))

    family = "runtime.integrate.radau5:advance_radau5"
    kernels = ("residual_jacobian",)
    return Method(
        "radau5", 5, 3, True, family, coefficients, work_size, kernels, needs_plain_rates=True, stiff=True
    )


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        _explicit("euler", 1, 3, adaptive=False),
        _symplectic("semi_implicit_euler", 1, verlet=False),
        _symplectic("verlet", 2, verlet=True),
        _explicit("rk4", 4, 3, adaptive=False),
        _explicit("dopri5", 5, 4, adaptive=True),
        _explicit("dop853", 8, 7, adaptive=True),
        _implicit("implicit_euler", 1),
        _implicit("implicit_midpoint", 2),
        _radau5(),
    )
}


def find_method(name: str) -> Method:
    """Return the method called `name`.

    Raises
    ------
    RuntimeModelError
        There is none; the message names the nearest.
    """
    if name not in METHODS:
        raise RuntimeModelError(
            f"there is no integration method {name!r}: {nearest(name, ['auto', *METHODS])}"
        )
    return METHODS[name]
