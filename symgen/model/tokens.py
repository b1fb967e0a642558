"""Expression text cut into tokens and checked for grammar: what passes is arithmetic and known calls only."""

from __future__ import annotations

import keyword
import re
from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import ModelError, nearest
from .names import FUNCTION_ARITY, LONGEST_NAME, SENSOR_ARITY
from .units import ATOMS

LONGEST_TEXT = 20_000  # characters
MOST_TOKENS = 4_000  # Python's parser recurses once per operator of a sum, and stops below 3000
DEEPEST_NESTING = 60

TOKEN = re.compile(
    r"(?P<space>\s+)"
    r"|(?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z][A-Za-z0-9_]*(?:\.[A-Za-z][A-Za-z0-9_]*)*)"
    r"|(?P<text>\"[A-Za-z][A-Za-z0-9_.]*\"|'[A-Za-z][A-Za-z0-9_.]*')"
    r"|(?P<operator>\*\*|//|[<>]=?|[-+*/^(),])",
    re.ASCII,
)

WORDS = ("and", "or", "not")  # operators of conditions


@dataclass(frozen=True)
class Token:
    """A piece of an expression; `column` counts from 1 in the author's text."""

    kind: str
    text: str
    column: int


def tokenise(text: str) -> list[Token]:
    """Cut an expression into numbers, names and operators.

    Raises
    ------
    ModelError
        With the column of whatever has no place in an expression.
    """
    if len(text) > LONGEST_TEXT:
        raise ModelError(
            f"the expression is {len(text)} characters long; {LONGEST_TEXT} is the limit",
            hint="name its parts in [definitions]",
        )
    tokens: list[Token] = []
    position = 0
    while position < len(text):
        match = TOKEN.match(text, position)
        if match is None or match.group() == "//":
            _refuse_character(text, position)
        if match.lastgroup == "name" and len(match.group()) > LONGEST_NAME:
            raise ModelError(
                f"a name has more than {LONGEST_NAME} characters", column=position + 1, hint="shorten it"
            )
        if match.lastgroup != "space":
            kind = "operator" if match.group() in WORDS else match.lastgroup
            tokens.append(Token(kind, match.group(), position + 1))
        position = match.end()
    if len(tokens) > MOST_TOKENS:
        raise ModelError(
            f"the expression has {len(tokens)} numbers, names and operators; {MOST_TOKENS} is the limit",
            hint="name its parts in [definitions]",
        )
    return tokens


def _refuse_character(text: str, position: int, column: int | None = None) -> None:
    found = "//" if text.startswith("//", position) else text[position]
    hints = {
        "=": "an expression has no equals sign: what it equals is held at zero, or named by its key; conditions "
        "compare by <, <=, > and >=",
        "!": "conditions compare by <, <=, > and >=",
        "&": "conditions are joined by the words and, or",
        "|": "conditions are joined by the words and, or",
        "~": "the opposite of a condition is: not …",
        "//": "division is /",
        "[": "use round parentheses",
        "{": "use round parentheses",
        "_": "names begin with a letter",
        ".": "a decimal point needs digits beside it",
        '"': 'names stand in quotes in sensors only, such as reaction("pin")',
        "'": "names stand in quotes in sensors only, such as reaction('pin')",
    }
    shown = repr(found) if found.isprintable() else f"the character U+{ord(found):04X}"
    raise ModelError(
        f"{shown} has no place in an expression",
        column=column or position + 1,
        hint=hints.get(found, "it takes numbers, names, + - * / ^, parentheses and functions"),
    )


Arity = Mapping[str, tuple[int, int | None]]  # fewest and most arguments


def check_grammar(tokens: list[Token], length: int, tables: Mapping[str, int]) -> None:
    """Check that tokens form one expression: operands and operators in turn, functions known, all closed.

    Parameters
    ----------
    tokens : list of Token
    length : int
        Of the whole text, for the column of something missing at its end.
    tables : mapping of str to int
        The model's own functions: how many arguments they take.
    """
    arity = SENSOR_ARITY | FUNCTION_ARITY | {name: (n, n) for name, n in tables.items()}
    sensors = SENSOR_ARITY.keys() - tables.keys()
    # Each with its parenthesis, function, and number of arguments so far.
    open_calls: list[tuple[Token, Token | None, int]] = []
    want_operand, signs = True, 0
    for index, token in enumerate(tokens):
        following = tokens[index + 1] if index + 1 < len(tokens) else None
        before = tokens[index - 1] if index else None
        within = open_calls[-1][1] if open_calls else None
        names_alone = within is not None and within.text in sensors
        if names_alone:
            _check_sensor_argument(token, want_operand)
        elif token.kind == "text":
            _refuse_character(token.text, 0, token.column)
        if want_operand:
            signs = signs + 1 if token.text in ("+", "-", "not") else 0
            _check_operand(token, before, following, arity, names_alone)
            if token.text == "(":
                function = before if before is not None and before.kind == "name" else None
                open_calls.append((token, function, 1))
                _check_depth(len(open_calls), token)
            elif signs:
                _check_depth(signs, token)
            elif token.kind in ("number", "text") or following is None or following.text != "(":
                want_operand = False
        else:
            want_operand = _check_operator(token, before, open_calls, arity)
    if open_calls:
        raise ModelError(
            "this '(' is never closed", column=open_calls[-1][0].column, hint="close it, or leave it out"
        )
    if want_operand:
        what = f"something is missing after '{tokens[-1].text}'" if tokens else "the expression is empty"
        raise ModelError(
            what,
            column=length + 1 if tokens else 1,
            hint="add it, or take the operator away" if tokens else "write a number or a name",
        )


def _check_depth(depth: int, token: Token) -> None:
    if depth > DEEPEST_NESTING:
        raise ModelError(
            f"the expression is nested more than {DEEPEST_NESTING} deep",
            column=token.column,
            hint="name its parts in [definitions]",
        )


def _check_operand(
    token: Token, before: Token | None, following: Token | None, arity: Arity, names_alone: bool
) -> None:
    """`names_alone` tells that names are those of elements here, which may be called as functions are."""
    is_call = following is not None and following.text == "("
    if token.kind == "name":
        if keyword.iskeyword(token.text):
            raise ModelError(
                f"'{token.text}' is a reserved word of Python, not a name",
                column=token.column,
                hint="choose another name",
            )
        if is_call and token.text not in arity:
            raise ModelError(
                f"'{token.text}' is not a function",
                column=token.column,
                hint=_function_hint(token.text, arity),
            )
        if not is_call and not names_alone and token.text in arity and token.text not in SENSOR_ARITY:
            raise ModelError(
                f"'{token.text}' is a function", column=token.column, hint=f"write {token.text}(…)"
            )
    elif token.kind == "operator" and token.text not in ("+", "-", "(", "not"):
        place = f"after '{before.text}'" if before is not None else "at the start"
        raise ModelError(
            f"'{token.text}' {place}: a number or a name is missing",
            column=token.column,
            hint="add what is missing, or leave the operator out",
        )


def _check_sensor_argument(token: Token, want_operand: bool) -> None:
    if want_operand and token.kind not in ("name", "text"):
        raise ModelError(
            f"a sensor takes names, not '{token.text}'",
            column=token.column,
            hint='for example reaction("pin"), velocity("tip", "x")',
        )
    if not want_operand and token.text not in (",", ")"):
        raise ModelError(
            f"'{token.text}' has no place among the names that a sensor takes",
            column=token.column,
            hint="name the expression in [definitions], or close the parenthesis",
        )


def _function_hint(name: str, arity: Arity) -> str:
    known = arity.keys() - SENSOR_ARITY.keys()
    close = nearest(name, known, "functions")
    return close if close.startswith("did") else f"to multiply, write {name}*(…); {close}"


def _check_operator(
    token: Token, before: Token, open_calls: list[tuple[Token, Token | None, int]], arity: Arity
) -> bool:
    """Check what follows an operand; returns whether an operand comes next."""
    if before.kind == "number" and token.text in ATOMS:
        raise ModelError(
            f"'{before.text} {token.text}' is a number with a unit inside an expression: units stand "
            "behind pure numbers alone",
            column=token.column,
            hint=f'make it a parameter, as in h = "{before.text} {token.text}", and write its name; to multiply, '
            f"write {before.text}*{token.text}",
        )
    if token.kind != "operator" or token.text in ("(", "not"):
        raise ModelError(
            f"an operator is missing between '{before.text}' and '{token.text}'",
            column=token.column,
            hint=f"to multiply, write {before.text}*{token.text}",
        )
    if token.text == ")":
        if not open_calls:
            raise ModelError(
                "this ')' closes nothing", column=token.column, hint="open one before it, or leave it out"
            )
        _, function, count = open_calls.pop()
        if function is not None:
            _check_arity(function, count, arity)
        return False
    if token.text == ",":
        if not open_calls or open_calls[-1][1] is None:
            raise ModelError(
                "a comma has its place between the arguments of a function only",
                column=token.column,
                hint="the decimal sign is a point",
            )
        parenthesis, function, count = open_calls[-1]
        open_calls[-1] = (parenthesis, function, count + 1)
    return True


def _check_arity(function: Token, count: int, arity: Arity) -> None:
    fewest, most = arity[function.text]
    if count < fewest or (most is not None and count > most):
        if most is None or most == fewest:
            wanted = (
                f"{fewest} or more arguments" if most is None else f"{most} argument{'s' if most > 1 else ''}"
            )
        else:
            wanted = f"{fewest} to {most} names"
        raise ModelError(
            f"'{function.text}' takes {wanted}, not {count}",
            column=function.column,
            hint="look at its arguments",
        )
