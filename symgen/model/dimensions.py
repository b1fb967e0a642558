"""Physical dimensions of expressions, as far as the units that the user gave determine them.

A bare number may carry a unit that was not written (`-0.1*dot(x)` is a damping force): as a term, or as a
factor, it fits any dimension. Only factors that no one means as a measured quantity, 1/2 or 2/3 or pi, count
as pure numbers and keep the dimension of their product known.

The check of units: sums are homogeneous; energies, forces, masses and lengths are what they must be.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from types import MappingProxyType

from symgen.runtime.graph.functions import CONDITIONS, IN_MODELS

from ..errors import ModelError
from . import algebra
from .algebra import postorder
from .description import Constraint, Coordinate, Description
from .exact import python_number
from .expression_tree import TABLE, kind
from .forms import form_of, note
from .functions import VALUE
from .gravity import HERE
from .items import Item, definition_items, items, unit_dimension
from .printing import shortened
from .sensors import sensor_dimensions
from .sources import Sources
from .units import (
    DIMENSIONLESS,
    ENERGY,
    FORCE,
    LENGTH,
    POWER,
    TIME,
    Dimension,
    dimension_text,
    over,
    times,
    to_power,
    unit_text,
)

NUMBER = "number"  # a bare number: fits any dimension
Size = Dimension | str | None  # None: not known, fits any dimension too
LARGEST_PURE = 100  # numerator and denominator of a ratio such as 2/5 or 1/12


def infer(root: algebra.Expr, names: Mapping[str, Size], decimals: frozenset = frozenset()) -> Size:
    """The dimension of an expression.

    Parameters
    ----------
    root : algebra.Expr
    names : mapping of str to Size
        Dimensions of the names, definitions included.
    decimals : frozenset of algebra.Rational
        Numbers that were written as decimals.

    Raises
    ------
    ModelError
        If two known, different dimensions are added or compared, or a function takes a dimension.
    """
    if isinstance(root, algebra.Symbol):
        return names.get(root.name)
    formed = form_of(root)
    if formed is None:
        return _looked_through(root, names, decimals)
    form, own = formed
    key = (decimals, *map(names.get, own))
    if key not in form.sizes:
        note(form.sizes, key, _looked_through(root, names, decimals))
    return form.sizes[key]


def _looked_through(root: algebra.Expr, names: Mapping[str, Size], decimals: frozenset) -> Size:
    memo: dict[int, Size] = {}
    for node in postorder([root]):
        sizes = [memo[id(x)] for x in node.args]
        memo[id(node)] = _size(node, kind(node), sizes, names, decimals)
    return memo[id(root)]


def _size(
    node: algebra.Expr, what: str | None, sizes: list[Size], names: Mapping[str, Size], decimals: frozenset
) -> Size:
    if what == "symbol":
        return names.get(node.name)
    if what in ("number", "constant"):
        return NUMBER
    if what == "sum":
        return _same(node.args, sizes, "added")
    if what == "product":
        return _product(node, sizes, decimals)
    if what == "power":
        return _power(node, *sizes)
    if what == "dot":
        return over(sizes[0], TIME) if isinstance(sizes[0], tuple) else sizes[0]
    if what == TABLE:
        return _of_table(node, sizes, names)
    entry = IN_MODELS.get(what) or CONDITIONS.get(what)
    rule = entry.dimension if entry else "kept" if what == "real" else "pure"
    if rule == "kept":
        return sizes[0]
    if rule in ("compared", "ratio"):
        size = _same(node.args, sizes, "compared")
        return size if rule == "compared" else DIMENSIONLESS
    if rule == "chosen":
        return _same(node.args[1:], sizes[1:], "branches of one choice")
    return DIMENSIONLESS if rule == "any" else _function(node, what, sizes[0])


def _of_table(node: algebra.Expr, sizes: list[Size], names: Mapping[str, Size]) -> Size:
    *wanted, value = names.get(f"{node.func.table}(", (None,))
    for size, expected, argument in zip(sizes, wanted, node.args, strict=False):
        if isinstance(size, tuple) and expected is not None and size != expected:
            raise ModelError(
                f"units do not match: '{shortened(argument)}' is in {dimension_text(size)}, and the table "
                f"'{node.func.table}' takes {dimension_text(expected)}",
                hint="look at the units of the parameters in it, and at the table's",
            )
    if node.func.role == VALUE or value is None or wanted[0] is None:
        return value if node.func.role == VALUE else None
    return times(value, wanted[0])


def _same(parts: Sequence[algebra.Expr], sizes: list[Size], verb: str) -> Size:
    known = [(size, x) for size, x in zip(sizes, parts, strict=True) if isinstance(size, tuple)]
    if not known:
        return NUMBER if all(size == NUMBER for size in sizes) else None
    first, term = known[0]
    for size, other in known[1:]:
        if size is not first and size != first:
            raise ModelError(
                f"units do not match: '{shortened(term)}' in {dimension_text(first)} and "
                f"'{shortened(other)}' in {dimension_text(size)} cannot be {verb}",
                hint=_look(term, other),
            )
    return first


def _look(*terms: algebra.Expr) -> str:
    """Where to look for what is wrong with units: at parameters, and at a fraction that is no measured quantity."""
    hint = "look at the units of the parameters in it"
    for term in terms:
        for factor in algebra.Mul.make_args(term):
            if isinstance(factor, algebra.Rational) and factor.q > 1:
                return (
                    f"{hint}; {abs(factor.p)}/{factor.q} is a pure number, and a decimal would fit any unit"
                )
    return hint


def _product(node: algebra.Mul, sizes: list[Size], decimals: frozenset) -> Size:
    if None in sizes:
        return None
    known = [size for size in sizes if isinstance(size, tuple)]
    if not known:
        return NUMBER
    result = functools.reduce(times, known)
    carriers = [x for size, x in zip(sizes, node.args, strict=True) if size == NUMBER]
    return result if all(_is_pure(x, decimals) for x in carriers) else None


def _is_pure(x: algebra.Expr, decimals: frozenset) -> bool:
    if not isinstance(x, algebra.Rational):
        return isinstance(x, algebra.NumberSymbol) or x in (1, -1)
    p, q = abs(x.p), x.q
    if q == 1:
        return p == 1
    return p <= LARGEST_PURE and q <= LARGEST_PURE and (p, q) not in _fractions(decimals)


@functools.lru_cache(maxsize=16)
def _fractions(numbers: frozenset) -> frozenset:
    """Numerators and denominators, which take less time to compare and to hash than numbers."""
    return frozenset((x.p, x.q) for x in numbers if isinstance(x, algebra.Rational))


def _power(node: algebra.Expr, base: Size, exponent: Size) -> Size:
    if isinstance(exponent, tuple) and exponent != DIMENSIONLESS:
        raise ModelError(
            f"the exponent '{shortened(node.exp)}' has a unit: {dimension_text(exponent)}",
            hint="divide by a unit, so that it is a pure number",
        )
    if not isinstance(base, tuple) or base == DIMENSIONLESS:
        return base
    if not node.exp.is_Number:
        return None
    return to_power(base, Fraction(python_number(node.exp)).limit_denominator(1000))


def _function(node: algebra.Expr, what: str, size: Size) -> Size:
    # sin(t) and exp(-t) leave out a rate of 1/s, as bare numbers leave out their units.
    if isinstance(size, tuple) and size not in (DIMENSIONLESS, TIME):
        raise ModelError(
            f"'{what}' takes a pure number or an angle, "
            f"but '{shortened(node.args[0])}' is in {dimension_text(size)}",
            hint="divide by a quantity of that unit",
        )
    return DIMENSIONLESS


@dataclass(frozen=True)
class Sizes:
    """What a check of units found.

    Attributes
    ----------
    names : mapping of str to Size
        Dimensions of names, definitions included.
    expressions : mapping of (str, str) to Dimension
        Dimensions of expressions by table and key, as far as they are known.
    """

    names: Mapping[str, Size]
    expressions: Mapping[tuple[str, str], Dimension]


def check_units(d: Description, sources: Sources) -> Sizes:
    """Check the dimensions of all expressions; a model without units is not checked, and nothing is known of it."""
    declared = (*d.parameters, *d.constants, *d.coordinates, *d.inputs)
    everything = [*definition_items(d), *items(d)]
    given = [x for x in declared if not isinstance(x, Coordinate) or not (x.joint or x.integral)]
    has_units = any(x.unit is not None for x in (*given, *(r for r in d.rates if r.state)))
    if not has_units and not any(s.unit is not None for x in everything for s in sources.of(x.table, x.key)):
        return Sizes({}, {})
    names: dict[str, Size] = {x.name: unit_dimension(x.unit) for x in declared}
    names["t"] = TIME
    names |= {r.name: unit_dimension(r.unit) for r in d.rates if r.coordinate != r.name}
    names |= {f"{p.name}_{c}": LENGTH for p in d.points for c in "xyz"}
    names |= {
        f"{x.name}(": tuple(map(unit_dimension, x.units)) for x in d.tables
    }  # of arguments, then of the value
    here = d.field is not None or any(x.height is not None for x in (*d.pairs, *d.rolling))
    names |= dict.fromkeys(HERE, LENGTH) if here else {}
    for s in d.springs:
        names |= {s.measured: DIMENSIONLESS, s.exerted: ENERGY} if s.angle is not None else {}
        names |= {s.measured: LENGTH, s.exerted: FORCE} if s.places else {}
    names |= sensor_dimensions(d, names)
    found: dict[tuple[str, str], Dimension] = {}
    for item in everything:
        size = _check_item(item, names, sources)
        if item.table == "definitions" and sources.of(item.table, item.key):
            names[item.key] = size
        if isinstance(size, tuple):
            found[item.table, item.key] = size
    _check_speeds_in_a_plane(d, names, sources)
    _check_rubbing(d, names, sources)
    return Sizes(names, found)


def _check_speeds_in_a_plane(d: Description, names: Mapping[str, Size], sources: Sources) -> None:
    """Whether both speeds of each friction in a plane, given as such or by coordinates, are of one dimension."""
    for f in d.frictions:
        along, *across = (infer(speed, names) for speed in f.speeds)
        for size in across:
            if isinstance(along, tuple) and isinstance(size, tuple) and along != size:
                raise sources.error(
                    f"friction.{f.name}",
                    "speeds",
                    "units do not match: both are components of one sliding velocity, and one is in "
                    f"{dimension_text(along)}, the other in {dimension_text(size)}",
                    hint="multiply the rate of an angle by a radius",
                )


def _check_rubbing(d: Description, names: dict[str, Size], sources: Sources) -> None:
    """Whether what is said of frictions and bristles fits the speeds that they act against."""
    for f in d.frictions:
        speed = infer(f.speed, names)
        if not isinstance(speed, tuple):
            continue
        table = f"friction.{f.name}"
        sizes = dict.fromkeys(("smooth", "creep"), speed)
        if not f.normal:
            sizes |= dict.fromkeys(("force", "torque", "static"), over(POWER, speed))
        for key, size in sizes.items():
            _check_size(table, key, size, names, sources)
    for b in d.bristles:
        speed = infer(b.speed, names)
        if not isinstance(speed, tuple):
            continue
        force, table = over(POWER, speed), f"bristles.{b.name}"
        sizes = {"coulomb": force, "static": force, "stribeck": speed} | dict.fromkeys(
            ("damping", "viscous"), over(force, speed)
        )
        for key, size in {**sizes, "stiffness": over(force, times(speed, TIME))}.items():
            _check_size(table, key, size, names, sources)


def with_units_of_results(d: Description, sizes: Sizes) -> Description:
    """Return the description with the units of outputs and multipliers, as far as they follow from what was given."""
    if not sizes.names:
        return d
    outputs = {name: sizes.expressions.get(("outputs", name)) for name, _ in d.outputs}
    constraints = {c.name: _size_of_constraint(c, "constraints", sizes) for c in d.constraints}
    velocity = {c.name: _size_of_constraint(c, "velocity_constraints", sizes) for c in d.velocity_constraints}
    multipliers = {name: size and over(ENERGY, size) for name, size in constraints.items()}
    multipliers |= {name: size and over(POWER, size) for name, size in velocity.items()}
    outputs, multipliers = (
        MappingProxyType({name: unit_text(size) for name, size in found.items() if size})
        for found in (outputs, multipliers)
    )
    return replace(d, units_of_outputs=outputs, units_of_multipliers=multipliers)


def _size_of_constraint(c: Constraint, table: str, sizes: Sizes) -> Dimension | None:
    """The dimension of a constraint; ready-made ones are written out in points and coordinates."""
    known = sizes.expressions.get((table, c.name))
    if known is not None:
        return known
    try:
        size = infer(c.expression, sizes.names)
    except ModelError:
        return None
    return size if isinstance(size, tuple) else None


def _hint(size: Dimension, expected: Dimension, expression: algebra.Expr) -> str:
    if size == DIMENSIONLESS and expected != DIMENSIONLESS:
        such = f"such as 1 {unit_text(expected)}"
        return f"numbers beside a function have no unit: multiply by a parameter or constant that has one, {such}"
    return _look(expression)


def _check_item(item: Item, names: dict[str, Size], sources: Sources) -> Size:
    return _check_size(item.table, item.key, item.dimension, names, sources)


def _check_size(
    table: str, key: str, expected: Dimension | None, names: dict[str, Size], sources: Sources
) -> Size:
    """Return the dimension of what was given at an address; it is an error if it is not the one that is expected."""
    size: Size = None
    for source in sources.of(table, key):
        try:
            size = source.unit.dimension if source.unit else infer(source.expression, names, source.decimals)
        except ModelError as error:
            raise sources.locate(error, table, key, source) from None
        if expected is not None and isinstance(size, tuple) and size != expected:
            error = ModelError(
                f"units do not match: this is in {dimension_text(size)}, "
                f"and {dimension_text(expected)} is expected",
                hint=_hint(size, expected, source.expression),
            )
            raise sources.locate(error, table, key, source)
    return size
