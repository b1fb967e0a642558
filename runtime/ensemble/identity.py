"""What an ensemble is, in words and numbers: whether what a file holds is another one, and in what it differs."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.ensemble.version import fingerprint
from symgen.runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from symgen.runtime.ensemble.plan import Plan

_LONG = 200  # letters of what is said in full; of more, a hash


def identity(plan: Plan) -> dict[str, str]:
    """Return what decides every number of an ensemble, by what it is."""
    single, options, settings = plan.single, plan.options, plan.settings
    said = {
        "model": f"{plan.system.name} ({plan.system.source.text_hash[:12]})",
        "version of symgen": fingerprint(),
        "method": plan.method, "order of series": settings.order if settings else 0,
        "steps in lanes at most": settings.max_steps if settings else 0, "treatment of constraints": plan.treatment,
        "number of members": plan.members.n, "seed": plan.members.seed, "design": options.design,
        "what varies": [(c.name, c.place, _plain(c.values)) for c in plan.members.columns],
        "parameters": plan.p.tolist(), "inputs": {k: _plain(x) for k, x in (options.inputs or {}).items()},
        "start": sorted((single.start or {}).items()), "rate": sorted((single.rate or {}).items()),
        "t_start": single.t_start, "t_end": single.t_end, "rtol": single.rtol, "atol": single.atol,
        "step": single.step, "frames": plan.frame_times.tolist(), "keep": repr(options.keep),
        "reduce": _reductions(options.reduce), "max_steps": single.max_steps,
        "device": options.device,  # it decides in what parts statistics are merged
        "energy_scaling": settings is None or settings.scale_energy,
    }  # fmt: skip
    return {name: _short(repr(value)) for name, value in said.items()}


def refuse_another(plan: Plan, stored: Mapping[str, Any], where: str) -> None:
    """Refuse to go on with what another ensemble has come to.

    Raises
    ------
    RuntimeModelError
        Names what differs.
    """
    own = identity(plan)
    known = stored if isinstance(stored, Mapping) else {}
    differs = [name for name, value in own.items() if known.get(name) != value]
    if not differs:
        return
    said = "; ".join(
        f"{name}: {_brief(known.get(name))} there, {_brief(own[name])} here" for name in differs[:4]
    )
    raise RuntimeModelError(
        f"{where} holds another ensemble ({said}): give the same, or begin anew with another file"
    )


def _brief(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}…"


def _short(text: str) -> str:
    return text if len(text) <= _LONG else f"{text[:40]}… ({hashlib.sha256(text.encode()).hexdigest()})"


def _plain(values: Any) -> str:
    if isinstance(values, np.ndarray):
        return hashlib.sha256(values.tobytes()).hexdigest()
    parts = [values.times, values.values] if hasattr(values, "times") and hasattr(values, "values") else []
    return repr([_plain(np.asarray(x)) for x in parts]) if parts else repr(values)


def _reductions(given: Any) -> list[str]:
    found = []
    for name, wanted in (given or {}).items():
        statistics = [x for x in wanted if not callable(x)] if isinstance(wanted, (list, tuple)) else wanted
        found.append(f"{name}: {'a function' if callable(statistics) else statistics!r}")
    return found
