"""Advice as lines of text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.integrate.methods import METHODS

if TYPE_CHECKING:
    from symgen.runtime.checks.advice import Advice

_NAMED_DAMPING = 1e-3


def advice_lines(advice: Advice) -> list[str]:
    """Return what an advice says, the fastest time scale first."""
    lines = [f"fastest time scale: {_scale(advice)}"]
    if advice.origin is not None:
        lines.append(f"it belongs to: {advice.origin.says()}")
    if advice.turning > advice.fastest:
        period = 2.0 * np.pi / advice.turning
        lines.append(f"fastest turn: {advice.turning:.4g} rad/s, one in {period:.3g} s")
    if advice.decay > 0.0:
        lines.append(f"fastest decay: {advice.decay:.4g} 1/s, fastest other motion: {advice.motion:.4g} 1/s")
    if advice.fastest > 0.0 and advice.slowest > 0.0:
        lines.append(
            f"stiffness ratio: {advice.stiffness_ratio:.3g} (fastest over slowest motion, {advice.slowest:.3g} 1/s)"
        )
    if np.isfinite(advice.rule_step):
        n_steps = round((advice.t_end - advice.t_first) / advice.rule_step)
        lines.append(
            f"rule: {advice.steps_per_period} steps a period, a step of {advice.rule_step:.3g} s, "
            f"{n_steps} steps for {advice.t_end - advice.t_first:g} s"
        )
    lines += _limits(advice)
    lines.append(f"recommended method: {advice.method}, because {advice.reason}; {advice.cost.says()}")
    if advice.constraints != "none":
        lines.append(f"recommended constraint form: {advice.constraints}, which {advice.constraints_reason}")
    if METHODS[advice.method].adaptive:
        lines.append(
            f"recommended tolerance: rtol {advice.rtol:g}; run `symgen check` to see what it is worth at the end"
        )
        lines.append("recommended step: none to choose, the method adapts it; with a fixed step instead:")
    lines += _fixed(advice)
    lines.append(f"one evaluation of the equations takes {1e9 * advice.evaluation:.3g} ns")
    return [*lines, *_choice(advice)]


def _scale(advice: Advice) -> str:
    if advice.fastest <= 0.0:
        return "nothing moves by itself: any step is stable"
    period = 2.0 * np.pi / advice.fastest
    damped = (
        f", damping ratio {advice.damping_ratio:.3g}"
        if advice.damping_ratio > _NAMED_DAMPING
        else ", undamped"
    )
    return (
        f"{1.0 / advice.fastest:.3g} s, a period of {period:.3g} s (rate {advice.fastest:.4g} 1/s at "
        f"t = {advice.t_fastest:.4g} s{damped})"
    )


def _limits(advice: Advice) -> list[str]:
    if not advice.limits:
        return []
    lines = ["stability limits of explicit methods on that motion, undamped and with its damping:"]
    for limit in advice.limits:
        undamped, damped = (
            f"{h:.3g} s" if h > 0.0 else "never stable" for h in (limit.undamped, limit.damped)
        )
        lines.append(f"  {limit.method}: {undamped}, {damped}")
    return lines


def _fixed(advice: Advice) -> list[str]:
    lines = []
    for entry in advice.fixed_steps:
        limit = f"stable up to {entry.stable:.3g} s" if np.isfinite(entry.stable) else "no stability limit"
        lines.append(
            f"  {entry.method}: step {entry.step:.3g} s, {limit}; {entry.reason}; {entry.cost.says()}"
        )
    return lines


def _choice(advice: Advice) -> list[str]:
    choice = advice.choice
    if choice is None:
        return []
    step = f", step {choice.step:g} s" if choice.step is not None else ""
    verdict = "pass" if choice.ok else "not suited"
    return [f"your choice, {choice.method}{step}: {verdict}: " + "; ".join(choice.reasons)]
