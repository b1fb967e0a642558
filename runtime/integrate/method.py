"""What a method of integration is: its record."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.record import record

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System

# Of an implicit method: the iterations usual in it, and as much again for linear algebra.
EVALUATIONS_PER_STAGE = 8


@record(kw_only=True)
class Method:
    """A method of integration and what it can do; the code behind it is imported when it is used.

    Whoever asks what a method can do asks its record: there are no lists of names elsewhere.

    Attributes
    ----------
    name : str
    other_names : tuple of str
        What else the same method is called.
    order : int
    dense_order : int
        Of the dense output.
    adaptive : bool
        Chooses its own steps; otherwise it takes steps of one given length.
    family : str
        `module:function` of the step loop, see docs/step-loops.md.
    coefficients : callable
        System -> the named tuple that the loop takes as `method`.
    work_size : callable
        (coefficients, sizes) -> length of the array `work`.
    orders : tuple of int, optional
        Least and largest order of a method that chooses its order.
    evaluations : float
        Of `rhs` in a step, or of what costs as much.
    purpose : str
        What it is for, in a few words: tables of methods say so. Methods of one purpose share a row there.
    kernels : tuple of str
        Functions of the model that it calls, beyond `rhs`.
    form : str
        In which form it treats constraints: "projection", or one of `forms.FORMS`.
    suits_form : bool
        Is taken where only its form was asked for.
    stiff : bool
        Its step is not limited by the stability of fast, damped motions.
    growth : callable, optional
        (z, damping) -> by what factors one step of these lengths z makes x'' = -x - 2 damping x' grow, of x'' = -x' for
        damping 1 (`growth.py`). Methods that have it are explicit: stability limits their steps, `advise` says to what,
        and a run of adaptive steps is looked at for stiffness. None: steps are not limited so.
    symplectic : bool
        On conservative motion without constraints, or in its own form of these.
    series : bool
        Its steps are Taylor series: a single one may be as long as the motion is a polynomial, whatever the steps
        before it were, and none leads over a place where the motion has no series.
    multistep : bool
        Its steps are made of the motion before them as well, which a jump of the accelerations makes worthless.
    scales_energy : bool
        Can scale rates to the energy of the start (`projection.py`).
    passes_dependence : bool
        Lets go of constraints that come to depend on each other, and stops there only if no motion leads on.
    steps_per_period : int
        Of the fastest motion, where a fixed step is left open: as many at least (`steps_in_a_period`).
    oscillation_error : float
        Of methods of fixed step: what an undamped oscillation of rate w is off by, in phase or in parts of its
        amplitude, per radian and (step w)^order, for short steps.
    aimed_steps : float
        Of fixed step: for as many steps friction in a plane keeps its direction before it stops the sliding. Methods
        whose accelerations lag do not follow one that turns in a few steps.
    needs_plain_rates : bool
        Works only where the rates are dq/dt (nq == nv): not with quaternions.
    refusal : callable
        System -> why the method cannot integrate it, and what can; an empty string where it can.
    versions : callable, optional
        System -> the kernels that the loop is to call instead of those of every method: index in `addresses` -> address
        and what keeps its code alive.
    tail : callable, optional
        System -> what the loop carries behind the precomputed `p`.
    over_choices : callable, optional
        Coefficients -> those with which it looks for choices of the state that no branch in `p` holds: of a method that
        else makes each choice at the start of a step.
    sparse : Method, optional
        The same method with sparse matrices, for large models.
    """

    name: str
    order: int
    dense_order: int
    adaptive: bool
    family: str
    coefficients: Callable[[System], Any]
    work_size: Callable[[Any, np.ndarray], int]
    evaluations: float
    purpose: str
    other_names: tuple[str, ...] = ()
    orders: tuple[int, int] | None = None
    kernels: tuple[str, ...] = ()
    form: str = "projection"
    suits_form: bool = False
    stiff: bool = False
    growth: Callable[[np.ndarray, float], np.ndarray] | None = None
    symplectic: bool = False
    series: bool = False
    multistep: bool = False
    scales_energy: bool = False
    passes_dependence: bool = False
    steps_per_period: int = 50
    oscillation_error: float = 0.0
    aimed_steps: float = 1.0
    needs_plain_rates: bool = False
    refusal: Callable[[System], str] = lambda system: ""
    versions: Callable[[System], dict[int, tuple[int, Any]]] | None = None
    tail: Callable[[System], np.ndarray] | None = None
    over_choices: Callable[[Any], Any] | None = None
    sparse: Method | None = None

    def advance(self) -> Callable:
        """Return the step loop."""
        return resolve(self.family)


@functools.cache
def resolve(place: str) -> Any:
    """Return what is at a place `module:name`, imported now."""
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


def stabilised(method: Method, gains: tuple[float, float] = (1.0, 1.5)) -> Method:
    """Return the method with Baumgarte's stabilisation of constraints.

    Parameters
    ----------
    gains : tuple of float
        h² and h times the gains of Baumgarte's force, which is held over a step. In a step it multiplies the drift
        (Φ, h dΦ/dt) by a matrix; the default is for exact steps, and gives it the eigenvalues 0, 0, so that drift is
        gone after two.
    """

    def versions(system: System) -> dict[int, tuple[int, Any]]:
        return resolve("symgen.runtime.constraints.baumgarte:baumgarte_versions")(system)

    def tail(system: System) -> np.ndarray:
        return resolve("symgen.runtime.constraints.baumgarte:baumgarte_tail")(system, gains)

    return replace(
        method, form="baumgarte", versions=versions, tail=tail, scales_energy=False, passes_dependence=False,
        suits_form=False,
    )  # fmt: skip


def unheld(method: Method) -> Method:
    """Return a stabilised method without its stabilisation: equations of index 1, and nothing that takes drift back."""

    def versions(system: System) -> dict[int, tuple[int, Any]]:
        return resolve("symgen.runtime.constraints.baumgarte:unheld_versions")(system)

    return replace(method, form="none", versions=versions, tail=None)
