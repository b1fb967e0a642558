"""ABI 1: which functions a generated module has, and how long their arrays are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from symgen.runtime.graph.layouts import BASE_PARAMETERS, FRAME_FUNCTIONS, LIMITS, settings_of
from symgen.runtime.graph.spelling import RESET, reset_function

ABI = 1

_ALWAYS = ("rhs", "mass_matrix", "forces", "energy", "residual", "residual_jacobian")
_WITH_CONSTRAINTS = ("constraint_residual", "constraint_jacobian", "gamma")
_OF_START = ("start_conditions", "start_jacobian")
CLOSED = "closed_"
JUMP = "jump"  # the action of an event at which a force goes over to another branch
ENTRIES = "_entries"  # behind the name of a function: the same, with structural zeros left out
# Functions that leave structural zeros out.
SPARSE = frozenset(
    (
        "mass_matrix", "residual_jacobian", "constraint_jacobian", "kinematics", "marks", "rhs_by_state",
        "rhs_by_parameters", "start_jacobian",
    )
)  # fmt: skip
_SPARSE_OF_ROBOTS = frozenset(
    (
        "inverse_dynamics_derivatives", "forward_dynamics_derivatives", "coriolis_matrix", "momentum_matrix",
        "regressor",
    )
)  # fmt: skip
SWITCHED = (
    "rhs", "residual", "residual_jacobian", "constraint_residual", "constraint_jacobian", "gamma", "project", "events",
)  # fmt: skip
OF_CLOSED = (*SWITCHED, "solve")  # that the closed form may have; some have no solve of their own
# Numbers that the function `switches` writes for each: gap, restitution; sliding speed, level, largest while sticking
# (the speed below which it gives way where friction is smooth).
N_WATCHED = {"stop": 2, "friction": 3}

# Numbers that the function `marks` writes for each kind: places [m], directions, radii [m], forces [N], torques [N m].
MARKS = {
    "pin": 6, "slide": 6, "ball": 3, "gear": 7, "point": 3, "ground": 3, "bar": 6, "link": 6, "spring": 6, "damper": 6,
    "rail": 6, "force": 6, "torque": 3, "reaction": 3, "tension": 6, "plane": 9, "surface": 9,
}  # fmt: skip

# Numbers that the function `shapes` writes for each kind of solid of a body that is made of such: sizes, the middle,
# the directions of its first and third axis.
SOLIDS = {"box": 12, "ellipsoid": 12, "sphere": 10, "cylinder": 11, "tube": 12, "cone": 11, "capsule": 11}


def is_sparse(header: Mapping[str, Any], function: str) -> bool:
    """Whether a function leaves structural zeros out."""
    if function.removeprefix(CLOSED) in SPARSE:
        return True
    return "robot" in header and (function in _SPARSE_OF_ROBOTS or function.startswith("jacobian_"))


def required_functions(header: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of the functions that a module with this header has."""
    if "robot" in header:
        yield from header["robot"]["functions"]
        return
    late = header.get("late", ())
    yield from (name for name in _ALWAYS if name not in late)
    if header["nh"] + header["nn"]:
        yield from _WITH_CONSTRAINTS
    if header["nh"] + header["nn"] or header.get("quaternions"):
        yield "project"
    if header["nq"] != header["nv"]:
        yield "kinematics"
    if header.get("solve"):
        yield "solve"
    of_records = {
        "bodies": "poses",
        "outputs": "outputs",
        "events": "events",
        "marks": "marks",
        "windings": "windings",
        LIMITS: LIMITS,
    }
    yield from (name for key, name in of_records.items() if header.get(key))
    if n_surfaces(header):
        yield "heights"
    if any(body["sizes"] for body in header["bodies"]):
        yield "shapes"
    for event in header["events"]:
        if event["action"] == "reset":
            yield reset_function(event["name"])
    if header.get("starts"):
        yield "starts"
    if header.get("start"):
        yield from _OF_START
    if header.get("jacobian"):
        yield "rhs_by_state"
        if header["parameters"] or header["inputs"]:
            yield "rhs_by_parameters"
    if header.get("time_terms"):
        yield "time_terms"
    if header.get("switches"):
        yield "switches"
        yield from (CLOSED + name for name in SWITCHED if CLOSED + name not in late)


def setting_names(header: Mapping[str, Any]) -> list[str]:
    """Return the names of the numbers behind the inputs in `p`.

    Which stops are closed and which frictions stick, then the branches of forces that jump (1, -1, or 0: none).
    """
    held = [
        f"{key}({switch['name']})" for switch in header.get("switches", ()) for key in settings_of(switch)
    ]
    return held + [f"branch({event['name']})" for event in header["events"] if event["action"] == JUMP]


def closed_header(header: Mapping[str, Any]) -> dict[str, Any]:
    """Return the header of the model whose stops and frictions are constraints, each with a switch.

    Stops follow the holonomic constraints, frictions the velocity constraints. `switched` says by which setting (its
    number) each of them is switched, by the number of the constraint.
    """
    nh, constraints, hoisted = header["nh"], header["constraints"], header.get("hoisted", {})
    kinds = {"stop": "holonomic", "friction": "velocity"}
    of = {
        kind: [{"name": s["name"], "kind": name} for s in header["switches"] if s["kind"] == kind]
        for kind, name in kinds.items()
    }
    own = {name.removeprefix(CLOSED): n for name, n in hoisted.items() if name.startswith(CLOSED)}
    without = (*OF_CLOSED, *_OF_START)
    shared = {name: n for name, n in hoisted.items() if name not in without and not name.startswith(CLOSED)}
    operations = header["operations"]
    names = setting_names(header)
    rows = [nh + k for k in range(len(of["stop"]))]
    rows += [nh + len(of["stop"]) + header["nn"] + k for k in range(len(of["friction"]))]
    switching = [names.index(f"{settings_of(s)[0]}({s['name']})") for s in header["switches"]]
    return {
        **{key: value for key, value in header.items() if key != "start"},
        "switched": dict(zip(rows, switching, strict=True)),
        "nh": nh + len(of["stop"]),
        "nn": header["nn"] + len(of["friction"]),
        "constraints": [*constraints[:nh], *of["stop"], *constraints[nh:], *of["friction"]],
        "structure": {**header["structure"], "separable": False},
        "hoisted": {**shared, **own},
        "operations": {
            **operations,
            **{n: operations[CLOSED + n] for n in OF_CLOSED if CLOSED + n in operations},
        },
    }


def array_sizes(header: Mapping[str, Any], function: str) -> tuple[int, int] | None:
    """Return how many values `function` reads from `y` and writes to `out`; None if it is unknown."""
    if function.startswith(CLOSED) and header.get("switches"):
        return array_sizes(closed_header(header), function.removeprefix(CLOSED))
    nq, nv, nh, nw = header["nq"], header["nv"], header["nh"], header["nw"]
    if "robot" in header:
        return _sizes_of_robot(header, function)
    m = nh + header["nn"]
    state, extended = nq + nv, nq + nv + nv + m
    sizes = {
        "rhs": (state, state + nw + m + (m > 0)),
        "rhs_by_state": (state, state * state),
        "rhs_by_parameters": (state, state * (len(header["parameters"]) + len(header["inputs"]))),
        "mass_matrix": (state, nv * nv),
        "forces": (state, nv),
        "energy": (state, 2),
        "residual": (extended, nv + m),
        "residual_jacobian": (extended, (nv + m) * extended),
        "solve": (extended, nv + m + m),
        "constraint_residual": (state, nh + m),
        "constraint_jacobian": (state, m * nv),
        "gamma": (state, m),
        "project": (state, state + nh + m),
        "kinematics": (state, nq * nv + nq * nq),
        "poses": (state, 12 * len(header["bodies"])),
        "shapes": (state, sum(body["sizes"] for body in header["bodies"])),
        "outputs": (
            extended + len(header.get("switches", ())) if header.get("sensed") else state,
            len(header["outputs"]),
        ),
        "events": (state, len(header["events"])),
        "starts": (state, state),
        **_sizes_of_start(header, extended),
        "time_terms": (state, header.get("time_terms", 0)),
        "marks": (state, sum(mark["numbers"] for mark in header.get("marks", ()))),
        "heights": (2, n_surfaces(header)),
        "windings": (state, sum(len(winding["bounds"]) for winding in header.get("windings", ()))),
        LIMITS: (state, sum(limit.get("numbers", 1) for limit in header.get(LIMITS, ()))),
        "switches": (state, sum(N_WATCHED[switch["kind"]] for switch in header.get("switches", ()))),
    }
    if function in sizes:
        return sizes[function]
    if function.startswith(RESET) and any(
        function == reset_function(event["name"]) for event in header["events"]
    ):
        return state, state
    return None


def n_surfaces(header: Mapping[str, Any]) -> int:
    """Return how many surfaces are drawn whose heights the function `heights` says."""
    return sum(mark["kind"] == "surface" for mark in header.get("marks", ()))


def start_sizes(header: Mapping[str, Any]) -> dict[str, int]:
    """Return how many numbers of each kind `start_conditions` writes, in their order."""
    start, m = header["start"], header["nh"] + header["nn"]
    balance = start["balance"]
    return {
        "position": header["nh"], "velocity": m, "equation": len(start["equations"]), "gap": len(start["closed"]),
        "closing": len(start["closed"]), "motion": header["nv"] * balance, "held": m * balance,
        "opening": len(start["closed"]) * balance,
    }  # fmt: skip


def _sizes_of_start(header: Mapping[str, Any], extended: int) -> dict[str, tuple[int, int]]:
    if not header.get("start"):
        return {}
    n_y, n = extended + len(header.get("switches", ())), sum(start_sizes(header).values())
    return {
        "start_conditions": (n_y, n),
        "start_jacobian": (n_y, n * (n_y + len(header["start"]["find"]))),
    }


def _sizes_of_robot(header: Mapping[str, Any], function: str) -> tuple[int, int] | None:
    nv, made = header["nv"], header["robot"]
    if function not in made["functions"]:
        return None
    state = header["nq"] + nv
    n_base = len(made["base_parameters"])
    sizes = {
        "inverse_dynamics": (state + nv, nv),
        "inverse_dynamics_derivatives": (state + nv, nv * 2 * nv),
        "forward_dynamics": (state + nv, nv),
        "forward_dynamics_derivatives": (state + nv, nv * 3 * nv),
        "mass_matrix": (state, nv * nv),
        "coriolis_matrix": (state, nv * nv),
        "gravity": (state, nv),
        "energy": (state, 2),
        "centre_of_mass": (state, 3),
        "momentum": (state, 6),
        "momentum_matrix": (state, 6 * nv),
        "regressor": (state + nv, nv * n_base),
        BASE_PARAMETERS: (state, n_base),
        "equilibrium_torques": (state, len(made["actuators"])),
    }
    if function in sizes:
        return sizes[function]
    widths = dict(zip(FRAME_FUNCTIONS, (12, 6 * nv, 6 * nv, 6), strict=True))
    for frame in made["frames"]:
        for prefix, width in widths.items():
            if function == prefix + frame:
                return state, width
    return None
