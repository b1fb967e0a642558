"""The result of a run as JSON, numbers with 17 significant digits."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.health import health_of
from symgen.runtime.names import motion_records

if TYPE_CHECKING:
    from symgen.runtime.solution import Sample, Solution

_STATS = ("steps", "rejected", "rhs", "jacobians", "factorisations")
_SECONDS = ("derive", "compile", "run", "log")


def write_result(
    solution: Solution, path: str | os.PathLike[str], seconds: Mapping[str, float] | None = None
) -> None:
    """Write `result` to a file.

    Parameters
    ----------
    solution : Solution
    path : path-like
    seconds : mapping of str to float, optional
        Wall times to add: derive, compile, run, log.
    """
    Path(path).write_text(to_json(result(solution, seconds)) + "\n", encoding="utf-8")


def result(solution: Solution, seconds: Mapping[str, float] | None = None) -> dict[str, Any]:
    """Return the result as a dictionary; its form is that of `symgen run --json`."""
    system = solution.system
    last = _state(
        solution,
        solution.q[-1],
        solution.v[-1],
        solution.accelerations[-1],
        solution.multipliers[-1],
        solution.outputs[-1],
        solution.contact_forces[-1] if system.switches else None,
    )
    compiling = sum(solution.seconds.get(stage, 0.0) for stage in ("prepare", "compile"))
    times = {**solution.seconds, "compile": compiling, **(seconds or {})}
    energy, residual = solution.energy, solution.constraint_residual
    return {
        "model": system.name,
        **_found(solution),
        "method": solution.method,
        "constraints": solution.constraints,
        "status": solution.status,
        "t": float(solution.t[-1]),
        **last,
        "events": [{"name": event.name, "t": event.t} for event in solution.events],
        "samples": [_sample(solution, sample) for sample in solution.samples],
        "energy": {"initial": energy.initial, "final": energy.final, "max_error": energy.max_error},
        "constraint_residual": {"position": residual.max_position, "velocity": residual.max_velocity},
        "stats": {**dict.fromkeys(_STATS, 0), **solution.stats},
        "seconds": {stage: times.get(stage, 0.0) for stage in _SECONDS},
        "health": [entry.to_dict() for entry in health_of(solution)],
        "notes": list(solution.notes),
        **({"message": solution.message} if solution.message else {}),
    }


def _found(solution: Solution) -> dict[str, dict[str, float]]:
    """The parameters that the model's start looks for, as the run had them."""
    places = (solution.system.start or {}).get("find", ())
    if not places:
        return {}
    return {"found": {solution.system.parameters[k]["name"]: float(solution.p[k]) for k in places}}


def _state(
    solution: Solution, q, v, acceleration, multipliers, outputs, contact_forces
) -> dict[str, dict[str, float]]:
    system = solution.system
    touching = {} if contact_forces is None else {"contact_forces": _named(system.switches, contact_forces)}
    return {
        "coordinates": {
            c["name"]: float(q[i]) for i, c in motion_records(system.coordinates, system.integrals)
        },
        "rates": _named(system.rates, v),
        "accelerations": _named(system.rates, acceleration),
        "multipliers": _named(system.constraints, multipliers),
        "outputs": _named(system.outputs, outputs),
        **touching,
    }


def _named(records: Sequence[dict[str, Any]], values: np.ndarray) -> dict[str, float]:
    return {record["name"]: float(value) for record, value in zip(records, values, strict=True)}


def _sample(solution: Solution, sample: Sample) -> dict[str, Any]:
    state = _state(
        solution,
        sample.q,
        sample.v,
        sample.acceleration,
        sample.multipliers,
        sample.outputs,
        sample.contact_forces,
    )
    return {"t": float(sample.t), **state, "energy": float(sample.energy)}


def to_json(value: Any) -> str:
    """Return JSON with one key of the outermost dictionary per line.

    Numbers have 17 significant digits, so that they read back bit for bit; inf and nan, which JSON has not,
    become null.
    """
    if isinstance(value, dict) and value:
        lines = (f"{json.dumps(str(key))}: {''.join(_pieces(part))}" for key, part in value.items())
        return "{" + ",\n ".join(lines) + "}"
    return "".join(_pieces(value))


def _pieces(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        yield "{"
        for i, (key, part) in enumerate(value.items()):
            yield f"{', ' if i else ''}{json.dumps(str(key))}: "
            yield from _pieces(part)
        yield "}"
    elif isinstance(value, list | tuple | np.ndarray):
        yield "["
        for i, part in enumerate(value):
            yield ", " if i else ""
            yield from _pieces(part)
        yield "]"
    elif isinstance(value, bool | np.bool_) or value is None or isinstance(value, str):
        yield json.dumps(bool(value) if isinstance(value, np.bool_) else value, ensure_ascii=False)
    elif isinstance(value, int | np.integer):
        yield str(int(value))
    else:
        yield _number(float(value))


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "null"
    text = f"{value:.17g}"
    # A whole number stays a float for readers that tell the two apart.
    return text if any(mark in text for mark in ".e") else f"{text}.0"
