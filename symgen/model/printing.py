"""Expressions to text that the expression parser reads back."""

from __future__ import annotations

from symgen.runtime.graph.functions import CONDITIONS

from ..errors import ModelError
from . import algebra
from .algebra import postorder
from .expression_tree import TABLE, kind
from .tokens import LONGEST_TEXT

# How tightly the outermost operation of a text binds.
JOINED, COMPARISON, SUM, PRODUCT, POWER, ATOM = range(6)
Piece = tuple[str, int]


def to_text(root: algebra.Expr, limit: int = LONGEST_TEXT) -> str:
    """Print an expression.

    Raises
    ------
    ModelError
        If the text would be longer than `limit` characters.
    """
    memo: dict[int, Piece] = {}
    for node in postorder([root]):
        piece = _print(node, [memo[id(x)] for x in node.args])
        if len(piece[0]) > limit:
            raise ModelError(
                f"the expression is longer than {limit} characters when written out",
                hint="name its parts with Model.definition",
            )
        memo[id(node)] = piece
    return memo[id(root)][0]


def shortened(root: algebra.Expr, limit: int = 80) -> str:
    """An expression for an error message, or what kind of thing it is where it is long."""
    try:
        return to_text(root, limit)
    except ModelError:
        return f"a {kind(root) or type(root).__name__}"


def _print(node: algebra.Expr, args: list[Piece]) -> Piece:
    what = kind(node)
    if what == "symbol":
        return node.name, ATOM
    if what == "number":
        return _number(node)
    if what == "constant":
        if node is algebra.E:
            return "exp(1)", ATOM
        return ("pi", ATOM) if node is algebra.pi else (repr(float(node)), ATOM)
    if what == "sum":
        return _sum(args), SUM
    if what == "product":
        return _product(node, args)
    if what == "power":
        return _power(node, args)
    if what == "real":
        return args[0]
    if what == "cot":
        return f"1/tan({args[0][0]})", PRODUCT
    if what in CONDITIONS:
        return _condition(what, args)
    if what == TABLE:
        return f"{node.func.__name__}({', '.join(text for text, _ in args)})", ATOM
    if what is None:
        return getattr(node, "kind", type(node).__name__), ATOM  # a SymPy object's, which no model can have
    return f"{what}({', '.join(text for text, _ in args)})", ATOM


def _condition(sign: str, args: list[Piece]) -> Piece:
    if sign in ("<", "<="):
        return f" {sign} ".join(text for text, _ in args), COMPARISON
    inside = [_wrapped(piece, COMPARISON) for piece in args]
    return f" {sign} ".join(inside) if len(inside) > 1 else f"{sign} {inside[0]}", JOINED


def _number(node: algebra.Number) -> Piece:
    if isinstance(node, algebra.Integer):
        text, level = str(int(node.p)), ATOM
    elif isinstance(node, algebra.Rational):
        text, level = f"{int(node.p)}/{int(node.q)}", PRODUCT
    else:
        text, level = repr(float(node)), ATOM
    return text, SUM if text.startswith("-") else level


def _wrapped(piece: Piece, least: int) -> str:
    text, level = piece
    return text if level >= least else f"({text})"


def _sum(args: list[Piece]) -> str:
    text = args[0][0]
    for term, _ in args[1:]:
        text += f" - {term[1:]}" if term.startswith("-") else f" + {term}"
    return text


def _product(node: algebra.Mul, args: list[Piece]) -> Piece:
    above, below, sign = [], [], ""
    for x, piece in zip(node.args, args, strict=True):
        if isinstance(x, algebra.Rational):
            sign = "" if (x.p < 0) == bool(sign) else "-"
            above += [str(abs(int(x.p)))] if abs(x.p) != 1 else []
            below += [str(int(x.q))] if x.q != 1 else []
        elif isinstance(x, algebra.Float) and x < 0:
            sign = "" if sign else "-"
            above.append(repr(-float(x)))
        elif isinstance(x, algebra.Pow) and x.exp.is_Number and x.exp.is_negative:
            below.append(_wrapped(_inverse(piece), POWER))
        else:
            above.append(_wrapped(piece, POWER))
    text = sign + "*".join(above or ["1"]) + "".join(f"/{x}" for x in below)
    return text, SUM if sign else PRODUCT


def _inverse(piece: Piece) -> Piece:
    """The text of 1/x, where `piece` is that of a power x = b^(-e)."""
    text, _ = piece
    return (text[2:], POWER) if text.startswith("1/") else (text, PRODUCT)


def _power(node: algebra.Expr, args: list[Piece]) -> Piece:
    base, exponent = args
    if node.exp == algebra.HALF:
        return f"sqrt({base[0]})", ATOM
    if node.exp.is_Number and node.exp.is_negative:
        positive = _number(-node.exp)
        inverse = _wrapped(base, ATOM)
        if node.exp == -algebra.HALF:
            inverse = f"sqrt({base[0]})"
        elif node.exp != -1:
            inverse += f"^{_wrapped(positive, ATOM)}"
        return f"1/{inverse}", PRODUCT
    return f"{_wrapped(base, ATOM)}^{_wrapped(exponent, ATOM)}", POWER
