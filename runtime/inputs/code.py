"""Machine code of a driven system: LLVM IR that writes the inputs at `t` into `p`, then calls the model's kernel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symgen.runtime.inputs.given import Pieces

# There is a block for each input in pieces: whether the piece in use is fixed, the number of pieces, where they are
# kept, and the piece in use, its knot and coefficients. In a run where no step reaches over a break, the piece is known
# beforehand, and the end of a step before a jump sees the value before it. Elsewhere the piece is searched for at the
# time of each call. Then comes a block for each continuous controller (its address, what it reads, outputs, what it
# gives); behind all blocks, the knots and coefficients of all pieces.

FIXED, COUNT, FIRST, KNOT, COEFFICIENTS = range(5)  # within the block of an input in pieces


@dataclass(frozen=True)
class PiecesPlace:
    """Of an input in pieces: its number, where its block begins, and its polynomials' degree."""

    number: int
    block: int
    degree: int

    @property
    def width(self) -> int:
        """Coefficients of a piece."""
        return self.degree + 1


@dataclass(frozen=True)
class FeedbackPlace:
    """Of a continuous controller: its inputs' numbers, what it reads, and where its cells are.

    Attributes
    ----------
    inputs : tuple of int
    reads : tuple of int
        As `controller.Signals` has it.
    address, signals, outputs, values : int
        Where its address, what it reads, the model's outputs and what it gives are kept.
    """

    inputs: tuple[int, ...]
    reads: tuple[int, ...]
    address: int
    signals: int
    outputs: int
    values: int


@dataclass(frozen=True)
class Places:
    """All blocks.

    Attributes
    ----------
    first_input : int
        The place of input 0 in `p`.
    n_inputs : int
    pieces : tuple of PiecesPlace
    feedback : tuple of FeedbackPlace
    end : int
        Where the knots of all pieces begin.
    """

    first_input: int
    n_inputs: int
    pieces: tuple[PiecesPlace, ...]
    feedback: tuple[FeedbackPlace, ...]
    end: int


def lay_out(
    n_parameters: int,
    n_inputs: int,
    n_precomputed: int,
    degrees: Sequence[tuple[int, int]],
    controllers: Sequence[tuple[tuple[int, ...], tuple[int, ...]]],
    n_outputs: int,
) -> Places:
    """Return the places for inputs in pieces, (number, degree) each, and controllers, (inputs, reads) each."""
    end = n_precomputed
    pieces, feedback = [], []
    for number, degree in degrees:
        pieces.append(PiecesPlace(number, end, degree))
        end += COEFFICIENTS + degree + 1
    for inputs, reads in controllers:
        outputs = end + 1 + len(reads)
        values = outputs + (n_outputs if any(place < 0 for place in reads) else 0)
        feedback.append(FeedbackPlace(inputs, reads, end, end + 1, outputs, values))
        end = values + len(inputs)
    return Places(n_parameters, n_inputs, tuple(pieces), tuple(feedback), end)


def fill(
    places: Places, longer: np.ndarray, all_pieces: Sequence[Pieces], addresses: Sequence[int]
) -> np.ndarray:
    """Return a precomputed `p` with the blocks and pieces behind it; pieces are searched for."""
    blocks = np.zeros(places.end - len(longer))
    tables, first = [], places.end
    for place, pieces in zip(places.pieces, all_pieces):
        block = place.block - len(longer)
        blocks[block + COUNT], blocks[block + FIRST] = len(pieces.knots), first
        tables += [pieces.knots, pieces.coefficients.ravel()]
        first += len(pieces.knots) * (1 + place.width)
    for place, address in zip(places.feedback, addresses):
        blocks.view(np.uint64)[place.address - len(longer)] = address
    return np.concatenate([longer, blocks, *tables])


def fix_piece(place: PiecesPlace, precomputed: np.ndarray, pieces: Pieces, t: float) -> None:
    """Put the piece that begins or holds at `t` into use, whatever the time of a call."""
    k = pieces.piece_at(t)
    precomputed[place.block + FIXED] = 1.0
    precomputed[place.block + KNOT] = pieces.knots[k]
    precomputed[place.block + COEFFICIENTS :][: place.width] = pieces.coefficients[k]


INPUTS_SYMBOL = "symgen_inputs"
TABLE = "symgen_driven_table"
_ARGUMENTS = "double %t, ptr %y, ptr %p, ptr %out"
_PASSED = "double %t, ptr %y, ptr %p, ptr %out"

_FIND = f"""define internal void @find(ptr %p, i64 %block, i64 %width, double %t) noinline nounwind {{
entry:
%fixed.in = add i64 %block, {FIXED}
%fixed.at = getelementptr double, ptr %p, i64 %fixed.in
%fixed = load double, ptr %fixed.at
%known = fcmp une double %fixed, 0.0
br i1 %known, label %done, label %search
search:
%count.in = add i64 %block, {COUNT}
%count.at = getelementptr double, ptr %p, i64 %count.in
%count.f = load double, ptr %count.at
%count = fptosi double %count.f to i64
%first.in = add i64 %block, {FIRST}
%first.at = getelementptr double, ptr %p, i64 %first.in
%first.f = load double, ptr %first.at
%first = fptosi double %first.f to i64
br label %halve
halve:
%low = phi i64 [0, %search], [%low.next, %look]
%high = phi i64 [%count, %search], [%high.next, %look]
%between = sub i64 %high, %low
%more = icmp ugt i64 %between, 1
br i1 %more, label %look, label %found
look:
%sum = add i64 %low, %high
%middle = lshr i64 %sum, 1
%look.in = add i64 %first, %middle
%look.at = getelementptr double, ptr %p, i64 %look.in
%look.knot = load double, ptr %look.at
%before = fcmp olt double %t, %look.knot
%low.next = select i1 %before, i64 %low, i64 %middle
%high.next = select i1 %before, i64 %middle, i64 %high
br label %halve
found:
%knot.in = add i64 %first, %low
%knot.at = getelementptr double, ptr %p, i64 %knot.in
%knot = load double, ptr %knot.at
%knot.to.in = add i64 %block, {KNOT}
%knot.to = getelementptr double, ptr %p, i64 %knot.to.in
store double %knot, ptr %knot.to
%row = mul i64 %low, %width
%past = add i64 %first, %count
%from = add i64 %past, %row
%to = add i64 %block, {COEFFICIENTS}
br label %copy
copy:
%k = phi i64 [0, %found], [%k.next, %copy]
%from.in = add i64 %from, %k
%from.at = getelementptr double, ptr %p, i64 %from.in
%value = load double, ptr %from.at
%to.in = add i64 %to, %k
%to.at = getelementptr double, ptr %p, i64 %to.in
store double %value, ptr %to.at
%k.next = add i64 %k, 1
%again = icmp ult i64 %k.next, %width
br i1 %again, label %copy, label %done
done:
ret void
}}
"""


def driven_symbol(function: str) -> str:
    """Return the name of the machine-code function that stands for a model's function."""
    return f"symgen_driven_{function}"


def driven_ir(places: Places, functions: Sequence[str]) -> str:
    """Return the LLVM IR of a driven system's kernels.

    `TABLE` holds the addresses that they call: of the model's `functions`, in their order, then of its `outputs`, of
    the path for the Jacobian, and of that path's context.
    """
    n = len(functions)
    parts = [f"@{TABLE} = global [{n + 3} x ptr] zeroinitializer, align 8\n"]
    if places.pieces:
        parts.append(_FIND)
    parts += [_write_inputs(places, n), _report_inputs(places)]
    for number, function in enumerate(functions):
        path = function == "residual_jacobian" and bool(places.feedback)
        parts.append(_path(function, n) if path else _driven(function, number))
    return "".join(parts)


def _driven(function: str, number: int) -> str:
    return f"""define void @{driven_symbol(function)}({_ARGUMENTS}) nounwind {{
call void @write_inputs({_PASSED})
{_from_table("kernel", number)}
tail call void %kernel({_PASSED})
ret void
}}
"""


def _path(function: str, n: int) -> str:
    """The Jacobian with what the controllers add to it, see `feedback_jacobian.py`."""
    return f"""define void @{driven_symbol(function)}({_ARGUMENTS}) nounwind {{
{_from_table("path", n + 1)}
{_from_table("context", n + 2)}
tail call void %path(ptr %context, {_PASSED})
ret void
}}
"""


def _from_table(name: str, number: int) -> str:
    return (
        f"%{name}.at = getelementptr ptr, ptr @{TABLE}, i64 {number}\n"
        f"%{name} = load ptr, ptr %{name}.at, align 8"
    )


def _write_inputs(places: Places, n: int) -> str:
    lines = [f"define internal void @write_inputs({_ARGUMENTS}) nounwind {{", "entry:"]
    for place in places.pieces:
        lines.append(f"call void @find(ptr %p, i64 {place.block}, i64 {place.width}, double %t)")
        lines += _polynomial(place, places.first_input)
    for place in places.feedback:
        lines += _controller(place, places.first_input, n)
    return "\n".join([*lines, "ret void", "}", ""])


def _report_inputs(places: Places) -> str:
    """The kernel that writes all inputs to `out`."""
    lines = [f"define void @{INPUTS_SYMBOL}({_ARGUMENTS}) nounwind {{", f"call void @write_inputs({_PASSED})"]
    for k in range(places.n_inputs):
        lines += [*_load(f"u{k}", "p", places.first_input + k), *_store(f"u{k}.out", f"%u{k}", "out", k)]
    return "\n".join([*lines, "ret void", "}", ""])


def _polynomial(place: PiecesPlace, first_input: int) -> list[str]:
    """The value of a piece by Horner's scheme."""
    tag = f"i{place.number}"
    lines = _load(f"{tag}.knot", "p", place.block + KNOT) if place.degree else []
    if place.degree:
        lines.append(f"%{tag}.s = fsub double %t, %{tag}.knot")
    for j in range(place.degree, -1, -1):
        lines += _load(f"{tag}.c{j}", "p", place.block + COEFFICIENTS + j)
    value = f"%{tag}.c{place.degree}"
    for j in range(place.degree - 1, -1, -1):
        lines += [
            f"%{tag}.m{j} = fmul double {value}, %{tag}.s",
            f"%{tag}.v{j} = fadd double %{tag}.m{j}, %{tag}.c{j}",
        ]
        value = f"%{tag}.v{j}"
    return [*lines, *_store(f"{tag}.to", value, "p", first_input + place.number)]


def _controller(place: FeedbackPlace, first_input: int, n: int) -> list[str]:
    """Gather what a controller reads, call it, and put what it gives in its inputs' places."""
    tag = f"f{place.inputs[0]}"
    lines: list[str] = []
    if any(k < 0 for k in place.reads):
        lines += [
            _from_table(f"{tag}.observe", n),
            *_at(f"{tag}.observed", "p", place.outputs),
            f"call void %{tag}.observe(double %t, ptr %y, ptr %p, ptr %{tag}.observed)",
        ]
    for k, read in enumerate(place.reads):
        source = ("y", read) if read >= 0 else ("p", place.outputs - 1 - read)
        lines += [
            *_load(f"{tag}.x{k}", *source),
            *_store(f"{tag}.x{k}.to", f"%{tag}.x{k}", "p", place.signals + k),
        ]
    lines += [
        *_at(f"{tag}.address", "p", place.address),
        f"%{tag}.function = load ptr, ptr %{tag}.address, align 8",
        *_at(f"{tag}.x", "p", place.signals),
        *_at(f"{tag}.u", "p", place.values),
        f"call void %{tag}.function(double %t, ptr %{tag}.x, ptr %p, ptr %{tag}.u)",
    ]
    for k, number in enumerate(place.inputs):
        lines += [
            *_load(f"{tag}.u{k}", "p", place.values + k),
            *_store(f"{tag}.u{k}.to", f"%{tag}.u{k}", "p", first_input + number),
        ]
    return lines


def _at(name: str, array: str, index: int) -> list[str]:
    return [f"%{name} = getelementptr double, ptr %{array}, i64 {index}"]


def _load(name: str, array: str, index: int) -> list[str]:
    return [*_at(f"{name}.at", array, index), f"%{name} = load double, ptr %{name}.at, align 8"]


def _store(name: str, value: str, array: str, index: int) -> list[str]:
    return [*_at(name, array, index), f"store double {value}, ptr %{name}, align 8"]
