"""Numeric values of expressions, as far as they are known before a run.

Directions and angles that are known when a model is described.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from symgen.runtime.graph.functions import CONDITIONS

from . import algebra, exact
from .algebra import postorder
from .expression_tree import TABLE, kind
from .forms import form_of, note

OPERATIONS = (
    exact.MATH
    | {name: condition.value for name, condition in CONDITIONS.items()}
    | {"cot": lambda x: 1.0 / math.tan(x), "real": lambda x: x}
)


class NotFinite(Exception):
    """A part of an expression has no finite real value; `node` is that part."""

    def __init__(self, node: algebra.Expr) -> None:
        super().__init__(node)
        self.node = node


Value = float | None | NotFinite


def evaluate(
    root: algebra.Expr, values: Mapping[str, float | None], known: dict[int, Value] | None = None
) -> float | None:
    """The value of an expression where names have `values`; None where it depends on an unknown one.

    Parameters
    ----------
    root : algebra.Expr
    values : mapping of str to float or None
    known : dict of int to Value, optional
        Of parts, by identity, at these values; grows. Whoever hands it in keeps the expressions.

    Raises
    ------
    NotFinite
        If a part whose operands are known is infinite or not real.
    """
    if isinstance(root, algebra.Symbol):
        return values.get(root.name)
    formed = form_of(root)
    if formed is None:
        return _looked_through(root, values, known)
    form, names = formed
    key = tuple(map(values.get, names))
    if 0.0 in key:  # of either sign
        return _looked_through(root, values, known)
    if key not in form.values:
        note(form.values, key, _looked_through(root, values, known))
    return form.values[key]


def _looked_through(
    root: algebra.Expr, values: Mapping[str, float | None], known: dict[int, Value] | None
) -> float | None:
    memo: dict[int, Value] = {} if known is None else known
    for node in postorder([root], known=memo):
        memo[id(node)] = _value(node, [memo[id(x)] for x in node.args], values)
    value = memo[id(root)]
    if isinstance(value, NotFinite):
        raise value
    return value


def _value(node: algebra.Expr, operands: list[Value], values: Mapping[str, float | None]) -> Value:
    what = kind(node)
    if what == "symbol":
        return values.get(node.name)
    if what == "where" and isinstance(operands[0], float):  # the part that is not chosen need have no value
        return operands[1 if operands[0] else 2]
    fault = next((x for x in operands if isinstance(x, NotFinite)), None)
    if fault is not None:
        return fault
    if None in operands or what in ("dot", TABLE):
        return None
    try:
        return _finite(node, what, operands)
    except NotFinite as found:
        return found


def _finite(node: algebra.Expr, what: str | None, operands: list[float]) -> float:
    try:
        value = _apply(node, what, operands)
    except (OverflowError, ValueError, ZeroDivisionError):
        raise NotFinite(node) from None
    if isinstance(value, complex) or not math.isfinite(value):
        raise NotFinite(node)
    return value


def _apply(node: algebra.Expr, what: str | None, operands: list[float]) -> float:
    if what in ("number", "constant"):
        return float(node)
    if what == "sum":
        return sum(operands)
    if what == "product":
        return math.prod(operands)
    if what == "power":
        return math.pow(*operands)
    if what is None:
        raise ValueError(node)
    return OPERATIONS[what](*operands)


Direction = tuple[float, float, float]
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
ROUND_OFF = 1e-15  # of a length that is meant to be 1
QUARTER_TURN_TOLERANCE = 5e-8  # rad; 1.5707963 and -3.1415927 are quarter turns, 1.5708 is not


def normalised(values: Sequence[float]) -> tuple[float, ...] | None:
    """The unit vector along `values`; the same to the last bit where it is one already, None for zeros."""
    largest = max(map(abs, values))
    if largest == 0 or not math.isfinite(largest):
        return None
    if abs(math.hypot(*values) - 1) <= ROUND_OFF:
        return tuple(x + 0.0 for x in values)
    scaled = [x / largest for x in values]
    length = math.hypot(*scaled)
    return tuple(x / length + 0.0 for x in scaled)


def dot_product(a: Sequence[float], b: Sequence[float]) -> float:
    """Scalar product."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross_product(a: Direction, b: Direction) -> Direction:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def perpendicular(axis: Direction) -> Direction:
    """A unit vector perpendicular to a unit vector: the y axis made so where `axis` is x or z."""
    nearest = min((Y, Z, X), key=lambda e: abs(dot_product(e, axis)))
    along = dot_product(nearest, axis)
    return normalised([e - along * a for e, a in zip(nearest, axis, strict=True)])


def perpendiculars(axis: Direction) -> tuple[Direction, Direction]:
    """Two unit vectors that complete a unit vector to a right-handed frame."""
    first = perpendicular(axis)
    return first, tuple(x + 0.0 for x in cross_product(axis, first))


def exact_angle(angle: algebra.Expr, constants: Mapping[str, float]) -> algebra.Expr:
    """An angle whose sine and cosine vanish exactly where they are meant to.

    A number within `QUARTER_TURN_TOLERANCE` of a multiple of pi/2 becomes that multiple of pi, as robots'
    descriptions write right angles with few digits; any other expression is returned as it is.
    """
    try:
        value = evaluate(angle, constants)
    except NotFinite:  # the check of values says where
        return angle
    turns = None if value is None else quarter_turns(value)
    return angle if turns is None else algebra.Rational(turns, 2) * algebra.pi


def quarter_turns(angle: float) -> int | None:
    """How many quarter turns an angle [rad] is meant to be, if its digits leave no other meaning."""
    turns = round(angle / (math.pi / 2))
    return turns if abs(angle - turns * (math.pi / 2)) <= QUARTER_TURN_TOLERANCE else None
