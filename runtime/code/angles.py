"""Which angles of a function have their sines and cosines found side by side, in a vector register.

A call of the C library takes as long as a dozen other operations, and clears all registers. Angles that follow from the
time, the state and parameters by sums and products are there before anything else, so that those of a chain's links or
of an arm's joints need not be taken one by one.
"""

from __future__ import annotations

import itertools

from symgen.runtime.graph.form import ELEMENT, HELD, Form, Name, Write

# Of fewer, what goes into a vector and comes out of it takes as long as it gains.
_FEWEST, _WIDEST = 3, 8
_PLAIN = ("add", "sub", "mul", "neg")


def side_by_side(form: Form) -> dict[int, tuple[int, ...]]:
    """Return, for each such angle of a function, the angles that are taken together with it, in order of appearance."""
    found = list(_angles(form))
    if len(found) < _FEWEST:
        return {}
    n_groups = -(-len(found) // _WIDEST)
    ends = [len(found) * k // n_groups for k in range(n_groups + 1)]
    groups = [tuple(found[first:end]) for first, end in itertools.pairwise(ends)]
    return {angle: group for group in groups for angle in group}


def _angles(form: Form) -> dict[int, None]:
    """The angles outside of loops that nothing but sums and products lie before."""
    nodes, plain = form.nodes, {}
    angles: dict[int, None] = {}
    roots = [x.node for x in form.body if type(x) is Name or type(x) is Write]
    for node in nodes.reachable(roots):  # operands come first
        op, args = nodes.op[node], nodes.args[node]
        if op == "var":
            plain[node] = args[0] not in (HELD, ELEMENT)
        else:
            plain[node] = op == "const" or (op in _PLAIN and all(plain[x] for x in nodes.operands(node)))
        if op in ("sin", "cos") and plain[args[0]]:
            angles[args[0]] = None
    return angles
