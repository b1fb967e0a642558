"""Runs that are right, and beside which something has to be said all the same: none may be called doubtful.

Some of these were among the broken runs once: a damping below zero, a step far below what accuracy needs, an edited
Jacobian with which Newton's iterations converge. Their results agree with references: what is said of them is advice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from .case import Case
from .models import bundled, edited, fixture, pair, point, rod

if TYPE_CHECKING:
    from symgen.runtime import System

_TIGHT = {"method": "dop853", "rtol": 1e-12, "atol": 1e-14}


def cases() -> Iterator[Case]:
    """Yield all, by kind."""
    for kind, group in _KINDS.items():
        for name, system, t_end, options, check, word, *reference in group():
            yield _case(kind, name, system, t_end, options, check, word, {**_TIGHT, **dict(*reference)})


def _case(
    kind: str,
    name: str,
    system: Callable[[], System],
    t_end: float,
    options: dict[str, Any],
    check: str,
    word: str,
    reference: dict[str, Any],
) -> Case:
    shared = {key: value for key, value in options.items() if key in ("parameters", "start", "rate")}
    return Case(
        kind, name, lambda: system().run(t_end=t_end, max_steps=2_000_000, **options), check, word,
        short=kind in _SHORT, reference=lambda: system().run(t_end=t_end, **shared, **reference),
    )  # fmt: skip


def _negative_damping():
    dop853 = {"method": "dop853"}
    yield (
        "sliding against drag",
        lambda: point("-c*dot(x)", "k*x^2/2", c=-0.2, k=5.0), 20.0, dop853, "negative damping", "'c'",
    )  # fmt: skip
    yield (
        "a drag that feeds, in its formula",
        lambda: point("0.3*dot(x)*abs(dot(x))", "5*x^2/2"), 20.0, dop853, "negative damping", "",
    )  # fmt: skip
    yield (
        "cart-pole",
        lambda: bundled("cart_pole"), 10.0, {**dop853, "parameters": {"b": -0.5}}, "negative damping", "'b'",
    )  # fmt: skip


def _negative_stiffness():
    yield (
        "a mass on a spring",
        lambda: point("0", "k*x^2/2", k=-20.0), 4.0, {"method": "dop853"}, "negative stiffness", "'k'",
    )  # fmt: skip
    yield (
        "down a hill", lambda: point("0", "-x^2/2"), 10.0, {"method": "auto"}, "negative stiffness", "",
    )  # fmt: skip
    yield (
        "two masses, gauss8",
        lambda: pair(1.0, -30.0), 3.0, {"method": "gauss8", "step": 0.005}, "negative stiffness", "'k_coupling'",
    )  # fmt: skip


def _stiffness_that_cost_steps():
    implicit = {"method": "radau9", "rtol": 1e-11, "atol": 1e-13}
    yield (
        "bushing, dop853",
        lambda: bundled("stiff_bushing_pendulum"), 1.0, {"method": "dop853"}, "stiffness", "bushing", implicit,
    )  # fmt: skip
    yield (
        "quarter car, dopri5",
        lambda: bundled("quarter_car"), 5.0, {"method": "dopri5", "rtol": 1e-6}, "stiffness", "bushing", implicit,
    )  # fmt: skip


def _wrong_jacobian():
    def wrong():
        return edited("double_pendulum", "residual_jacobian", 0, "-1.0*{}")

    for method, step in (("radau5", None), ("bdf", None), ("gauss8", 0.02), ("implicit_midpoint", 0.002)):
        options = {"method": method, **({"step": step} if step else {})}
        yield f"double pendulum, {method}", wrong, 2.0, options, "jacobian", ""


def _redundant_joints():
    options = {"method": "dop853"}
    yield (
        "one rod twice",
        lambda: fixture("redundant_pendulum"), 1.0, {**options, "start": {"x": 0.3}}, "redundant constraints",
        "rod_again",
    )  # fmt: skip
    yield (
        "a rod in other words",
        lambda: rod('again = "sqrt(x^2 + y^2) - l"'), 1.0, options, "redundant constraints", "again",
    )  # fmt: skip


_KINDS = {
    "negative damping": _negative_damping,
    "negative stiffness": _negative_stiffness,
    "stiffness that cost steps": _stiffness_that_cost_steps,
    "wrong Jacobian, right motion": _wrong_jacobian,
    "redundant joints": _redundant_joints,
}
_SHORT = ("negative damping", "negative stiffness", "redundant joints")
