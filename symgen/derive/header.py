"""The header of a generated module: all that the run time needs to know about a model besides its functions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from ..model.description import Body, Constraint, Description, Event, Input, Parameter, Rate
from ..model.sensors import has_sensed_outputs
from ..version import __version__
from .limits import limit_records
from .starts import has_formulas
from .structure import FLAGS, Movement, structure
from .variables import Variables, with_rates
from .windings import winding_records

if TYPE_CHECKING:
    from .derivation import Derivation

ABI = 1


def header(d: Description, derivation: Derivation, source: str, operations: dict[str, int]) -> dict[str, Any]:
    """The `MODEL` dictionary of the ABI (docs/abi.md)."""
    records = own_records(d)
    return {
        "abi": ABI,
        "generator": f"symgen {__version__}",
        "source": source,
        **{key: records.pop(key) for key in ("name", "description", "nq", "nv", "nh", "nn")},
        "nw": 0 if derivation.conservative else 1,
        "coordinates": records.pop("coordinates"),
        "quaternions": [k for k, _ in derivation.x.quaternions],
        **records,
        "structure": structure(derivation).flags,
        "operations": operations,
        "run": dict(d.run),
        **dependence(derivation.dependent),
        **_balances(d),
        **({"sensed": True} if has_sensed_outputs(d) else {}),
        **({"starts": True} if has_formulas(d) else {}),
        **limit_records(d),
        **_states(d, with_rates(d).rates),
    }


def own_records(d: Description) -> dict[str, Any]:
    """What the header says of a description alone: names, sizes, and what there is one by one."""
    rates, movement = with_rates(d).rates, Movement(d)
    return {
        "name": d.name,
        "description": d.description,
        "nq": len(d.coordinates),
        "nv": len(rates),
        "nh": len(d.constraints),
        "nn": len(d.velocity_constraints),
        "coordinates": [_value(c.name, c.unit, c.start, c.guess) for c in d.coordinates],
        "rates": [_value(r.name, r.unit, r.start, r.guess) for r in rates],
        "parameters": [_parameter(p) for p in d.parameters],
        "inputs": [_input(u) for u in d.inputs],
        "constants": [_value_alone(c.name, c.unit, c.value) for c in d.constants if not c.of_place],
        "constraints": [_constraint(c, d) for c in (*d.constraints, *d.velocity_constraints)],
        "outputs": [{"name": name, "unit": d.units_of_outputs.get(name, "")} for name, _ in d.outputs],
        "events": [_event(e) for e in d.events],
        "bodies": [_body(b, movement) for b in d.bodies],
        **winding_records(d),
    }


def robot_header(
    d: Description, x: Variables, source: str, operations: dict[str, int], made: dict[str, list[str]]
) -> dict[str, Any]:
    """The `MODEL` dictionary of a module that has functions for robot programs, and not those that runs need."""
    return {
        "abi": ABI,
        "generator": f"symgen {__version__}",
        "source": source,
        "name": d.name,
        "description": d.description,
        "nq": len(d.coordinates),
        "nv": len(d.rates),
        **dict.fromkeys(("nh", "nn", "nw"), 0),
        "coordinates": [_value(c.name, c.unit, c.start, c.guess) for c in d.coordinates],
        "quaternions": [k for k, _ in x.quaternions],
        "rates": [_value(r.name, r.unit, r.start, r.guess) for r in d.rates],
        "parameters": [_parameter(p) for p in d.parameters],
        "inputs": [_value_alone(u.name, u.unit, u.default) for u in d.inputs],
        "constants": [_value_alone(c.name, c.unit, c.value) for c in d.constants if not c.of_place],
        **{key: [] for key in ("constraints", "outputs", "events", "bodies")},
        "structure": dict.fromkeys(FLAGS, False) | {"conservative": True},
        "operations": operations,
        "run": {},
        "robot": made,
    }


def dependence(rows: Iterable[int]) -> dict[str, list[int]]:
    """The constraints that `rhs` and `project` leave to the others, if there are any."""
    found = sorted(rows)
    return {"dependent": found} if found else {}


def _balances(d: Description) -> dict[str, dict[str, int]]:
    """The constraints that are balances of coordinates without inertia, by these; they have no force."""
    places = {c.name: k for k, c in enumerate((*d.constraints, *d.velocity_constraints))}
    found = {name: places[f"{name}_balance"] for name in d.balanced if f"{name}_balance" in places}
    return {"balances": found} if found else {}


def _states(d: Description, rates: tuple[Rate, ...]) -> dict[str, list]:
    """Which rates are first-order states, and which velocity constraints change with them."""
    found = [k for k, r in enumerate(rates) if r.state]
    if not found:
        return {}
    others = {r.name for r in rates if not r.state} | {c.name for c in d.coordinates} | {"t"}
    others |= {f"{x.name}_{component}" for x in (*d.points, *d.axes) for component in "xyz"}
    movement = Movement(d, others)
    made = {f"{name}_balance" for name in d.balanced}  # what is in these is not looked for
    moved = [c.name for c in d.velocity_constraints if c.name in made or movement.of([c.expression])]
    return {"states": found, **({"constraints_of_states": moved} if moved else {})}


def _body(b: Body, movement: Movement) -> dict[str, Any]:
    shape = b.shape
    record: dict[str, Any] = {
        "name": b.name,
        "planar": b.planar,
        "shape": shape.kind if shape else "",
        "sizes": len(shape.sizes) if shape else 0,
        "mesh": shape.mesh if shape else "",
    }
    if shape and shape.parts:
        record["parts"] = list(shape.parts)
    if b.color:
        record["color"] = b.color
    return record | {"stretches": True} if shape and movement.of(shape.sizes) else record


def _constraint(c: Constraint, d: Description) -> dict[str, Any]:
    record = {"name": c.name, "kind": c.kind}
    unit = d.units_of_multipliers.get(c.name)
    return record | {"multiplier": unit} if unit else record


def _event(e: Event) -> dict[str, Any]:
    record = {"name": e.name, "direction": e.direction, "action": e.action}
    return record | {"says": e.says} if e.says else record


def _input(u: Input) -> dict[str, Any]:
    record = _value_alone(u.name, u.unit, u.default)
    if u.times:
        record["table"] = {"kind": u.kind, "t": list(u.times), "values": list(u.values)}
    if u.polynomial:
        record["polynomial"] = list(u.polynomial)
    if u.rate_of:
        record["rate_of"] = u.rate_of
    return record


def _parameter(p: Parameter) -> dict[str, Any]:
    return _value_alone(p.name, p.unit, p.value) | {"doc": p.doc}


def _value_alone(name: str, unit: str | None, value: float) -> dict[str, Any]:
    return {"name": name, "unit": unit or "", "value": float(value)}


def _value(name: str, unit: str | None, enforced: float | None, guess: float) -> dict[str, Any]:
    value = guess if enforced is None else enforced
    return {"name": name, "unit": unit or "", "value": float(value), "enforced": enforced is not None}
