"""What RATTLE asks of a model: the kernels that it calls, and momenta p = M(q) v."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.integrate import layout as at
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.system import System

_ROUND_OFF = 1e-9


def rattle_kernels(system: System) -> dict[int, tuple[int, Any]]:
    """Return the kernels that only some models need: index in `addresses` -> address, owner."""
    wanted = {}
    if not system.structure["constant_mass"]:
        wanted[at.RESIDUAL_JACOBIAN] = "residual_jacobian"
    if system.m:
        wanted[at.CONSTRAINT_RESIDUAL] = "constraint_residual"
        wanted[at.CONSTRAINT_JACOBIAN] = "constraint_jacobian"
    kernels = {index: system.kernel(name) for index, name in wanted.items()}
    return {index: (kernel.precomputed_address, kernel) for index, kernel in kernels.items()}


def rattle_refusal(system: System) -> str:
    """Return why RATTLE cannot integrate a model, and what can; an empty string where it can."""
    held = {record["name"] for record in system.constraints}
    follows = [switch["name"] for switch in system.switches if held & set(switch.get("normal", ()))]
    if follows:
        return (
            "takes forces of constraints as impulses of a step, which friction in proportion to reactions "
            f"({', '.join(follows)}) cannot follow: use implicit_midpoint, gauss8 or dop853 with projection"
        )
    if system.nn:
        names = [c["name"] for c in system.constraints if c["kind"] == "velocity"]
        return (
            f"keeps momenta along holonomic constraints, but {names[0]!r} holds velocities: "
            "use implicit_midpoint, gauss8 or dop853 with projection"
        )
    if not _is_quadratic(system):
        return (
            "needs a kinetic energy that is quadratic in the rates and does not depend on time by itself: "
            "use gauss8 or dop853"
        )
    return ""


def _is_quadratic(system: System) -> bool:
    """Whether T = vᵀM(q)v / 2 and M does not depend on v and t, at a place that nothing singles out."""
    nv, p = system.nv, system.parameter_values()
    q = np.array([record["value"] for record in system.coordinates])
    q += 0.01 * (1.0 + np.abs(q)) * np.sin(1.0 + np.arange(system.nq))
    q = Positions(system).normalised(q)
    for t, seed in ((0.0, 2.0), (0.37, 5.0)):
        v = np.cos(seed + 1.7 * np.arange(nv))
        mass = system.kernel("mass_matrix")(t, np.concatenate([q, v]), p).reshape(nv, nv)
        at_rest = system.kernel("mass_matrix")(0.0, np.concatenate([q, 0.0 * v]), p).reshape(nv, nv)
        kinetic = system.kernel("energy")(t, np.concatenate([q, v]), p)[0]
        scale = np.abs(v) @ np.abs(mass) @ np.abs(v)
        if not (
            np.abs(mass - at_rest).max(initial=0.0) <= _ROUND_OFF * np.abs(mass).max(initial=0.0)
            and abs(kinetic - 0.5 * v @ mass @ v) <= _ROUND_OFF * scale
        ):
            return False
    return True
