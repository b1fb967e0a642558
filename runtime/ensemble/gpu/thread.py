"""One member from its start to its end, as a thread does it: the loop of a method for one model.

The steps are those that lanes take (`ensemble/dop853.py` and its like), written for a lane that is alone. What lanes
read from a table is known here when the code is written, or is an argument: sizes are numbers, functions are called by
their names, and arrays are local ones, which become registers where loops over them can be unrolled.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from symgen.runtime.ensemble.lanes import (
    CODE,
    INTERVAL_ANEW,
    INTERVAL_END,
    INTERVAL_LONGEST,
    INTERVAL_NEXT,
    Lanes,
    go_to_frame,
    note_residuals,
    start_members,
)
from symgen.runtime.ensemble.slots import COLUMN, COLUMNS, NAMES, NUMBERS
from symgen.runtime.ensemble.writer import ADDRESS, INTEGER, LANES, NUMBER, Code, Rows, Value, Variable

# Arrays of all members, a row for each, as they are here: a thread reads and writes its own once, which costs less than
# turning them around, so that neighbours lie together, would.
POINTERS = ("start", "parameters", "end", "results", "frames", "frame_times")
# p_step: how far apart members' parameters are; 0 where all have the same.
INTEGERS = ("n_members", "p_step", "n_frames", "max_steps", "order")
KEPT = COLUMNS[: COLUMN["h"]]  # columns of results that are known afterwards
ARGUMENTS = {
    **dict.fromkeys(POINTERS, "ptr"), **dict.fromkeys(INTEGERS, "i64"), **dict.fromkeys(sorted(NUMBERS), "double"),
}  # fmt: skip
MEMBER = "symgen_member"
_WHOLE = {"add": operator.add, "sub": operator.sub, "mul": operator.mul}
_POINTED_TO = ("k", "k_other")  # arrays that change places


class ThreadCode(Code):
    """The function `void name(i64 member, ARGUMENTS)` while it is written.

    Parameters
    ----------
    unrolled : bool
        Whether loops over a known number of passes are to be unrolled.
    """

    def __init__(self, name: str, unrolled: bool) -> None:
        super().__init__(name, 1)
        self._unrolled = unrolled
        self._places: dict[str, Value] = {}
        self._metadata: list[str] = []

    def text(self) -> str:
        listed = ", ".join(
            [
                "i64 %member",
                *(f"{kind}{' noalias' * (kind == 'ptr')} %{name}" for name, kind in ARGUMENTS.items()),
            ]
        )
        body = "\n".join(["entry:", *self._entry, *self._lines, "ret void"])
        metadata = "\n".join(self._metadata)
        return f"define void @{self.name}({listed}) nounwind {{\n{body}\n}}\n{metadata}\n"

    def array(self, length: int, kind: str = LANES) -> Value:
        """Make a local array; returns its address."""
        align = self.align_of(kind)
        return self.at_entry(f"alloca [{max(length, 1)} x {self.type_of(kind)}], align {align}")

    def clear(self, address: Value, length: int) -> None:
        """Fill a local array with zeros: functions do not write what is always zero."""
        self.declared.add("declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)")
        self._lines.append(
            f"call void @llvm.memset.p0.i64(ptr align 8 {address.text}, i8 0, i64 {8 * max(length, 1)}, i1 false)"
        )

    def may_change_places(self, name: str, address: Value) -> None:
        """Let an array be known by an address that `set_slot` sets."""
        self._places[name] = self.at_entry("alloca ptr, align 8")
        self.store(address, self._places[name])

    def slot(self, index: int, kind: str) -> Value:
        name = NAMES[index]
        return self.load(self._places[name], kind) if name in self._places else self.integer(0)

    def set_slot(self, index: int, value: Value) -> None:
        if NAMES[index] in self._places:
            self.store(value, self._places[NAMES[index]])

    def arithmetic(self, operation: str, a: Any, b: Any) -> Value:
        texts = [x.text if isinstance(x, Value) else str(x) for x in (a, b)]
        kinds = {x.kind for x in (a, b) if isinstance(x, Value)}
        if kinds == {INTEGER} and operation in _WHOLE and all(text.lstrip("-").isdigit() for text in texts):
            return self.integer(_WHOLE[operation](*map(int, texts)))  # lengths of loops are seen to be known
        return super().arithmetic(operation, a, b)

    @contextmanager
    def each(self, end: int | Value, start: int | Value = 0) -> Iterator[Value]:
        last = self.integer(end)
        if not self._unrolled or last.text[0] == "%":
            with super().each(end, start) as here:
                yield here
            return
        counter = Variable(self, self.integer(start))
        head, body, done = (self._label(word) for word in ("head", "body", "done"))
        self._jump(head)
        self._begin(head)
        here = counter.value
        self._branch(here < last, body, done)
        self._begin(body)
        yield here
        counter.value = here + 1
        number = 2 * len(self._metadata) + 1
        self._lines.append(f"br label %{head}, !llvm.loop !{number}")
        self._metadata.append(
            f'!{number} = distinct !{{!{number}, !{number + 1}}}\n!{number + 1} = !{{!"llvm.loop.unroll.full"}}'
        )
        self._begin(done)


def function_member(
    sizes: Mapping[str, int], lengths: Mapping[str, int], kernels: Mapping[str, str], begin: Callable[[Lanes], Value],
    attempt: Callable[[Lanes, Value], Value], *, unrolled: bool, with_frames: bool,
) -> ThreadCode:  # fmt: skip
    """Return the function that runs one member.

    Parameters
    ----------
    sizes : mapping of str to int
        Sizes of the model, by the names in `slots`.
    lengths : mapping of str to int
        Of the local arrays.
    kernels : mapping of str to str
        Names of the model's functions.
    begin, attempt : callable
        What a method begins with, and one step.
    unrolled : bool
    with_frames : bool
        Whether there may be frames; without them their code is left out.
    """
    code = ThreadCode(MEMBER, unrolled)
    arguments = {
        name: Value(code, f"%{name}", {"ptr": ADDRESS, "i64": INTEGER, "double": NUMBER}[kind])
        for name, kind in ARGUMENTS.items()
    }
    known: dict[str, Value | Rows] = {name: code.integer(size) for name, size in sizes.items()}
    known |= {name: arguments[name] for name in (*NUMBERS, "max_steps", "order", "n_frames")}
    # No steps are logged; models with events are left to lanes.
    known |= {
        "n_members": code.integer(1),
        **dict.fromkeys(("log_size", "n_events", "event_log_size", "n_switches"), code.integer(0)),
    }
    if not with_frames:
        known["n_frames"] = code.integer(0)
    for name in CODE:
        known[name] = Value(code, f"@{kernels[name]}" if name in kernels else "null", ADDRESS)
    for name, length in lengths.items():
        address = code.array(length)
        code.clear(address, length)
        known[name] = Rows(code, address)
        if name in _POINTED_TO:
            code.may_change_places(name, address)
    member = Value(code, "%member", INTEGER)
    for name, length in (
        ("start", sizes["ny"]), ("end", sizes["ny"]), ("results", len(KEPT)),
        ("frames", arguments["n_frames"] * sizes["ny"]), ("parameters", arguments["p_step"]),
    ):  # fmt: skip
        known[name] = Rows(code, arguments[name], NUMBER).behind(member * length)
    known["frame_times"] = Rows(code, arguments["frame_times"], NUMBER)
    known["quaternions"] = Rows(code, Value(code, "@symgen_quaternions", ADDRESS), INTEGER)
    for name, kind in (
        ("step_log", NUMBER), ("event_log", NUMBER), ("directions", NUMBER), ("places", NUMBER),
        ("actions", INTEGER), ("resets", ADDRESS),
    ):  # fmt: skip
        known[name] = Rows(code, Value(code, "null", ADDRESS), kind)
    for name in ("member_of_lane", "frame_of_lane"):
        known[name] = Rows(code, code.array(1, INTEGER), INTEGER)
        known[name][0] = code.integer(0)
    lanes = Lanes(code, known, with_breaks=False)
    _run(lanes, sizes, begin, attempt)
    return code


def _run(
    lanes: Lanes,
    sizes: Mapping[str, int],
    begin: Callable[[Lanes], Value],
    attempt: Callable[[Lanes, Value], Value],
) -> None:
    """Write the run of a member, as `lanes.function_begin`, `function_run` and `function_store` do it."""
    code = lanes.code
    _copy(lanes.start, lanes.y.single(), sizes["ny"])
    _copy(lanes.parameters, lanes.p.single(), sizes["n_precomputed"])
    nowhere = float("inf")
    for row, value in (
        (INTERVAL_END, nowhere), (INTERVAL_NEXT, nowhere), (INTERVAL_ANEW, 0.0), (INTERVAL_LONGEST, lanes.h_max)
    ):  # fmt: skip
        lanes.interval[row] = value
    start_members(lanes, begin)
    go_to_frame(lanes, code.integer(0), code.integer(0))
    with code.forever() as leave:
        done = attempt(lanes, lanes.own("active") > 0.5)
        leave(code.any(done))
    note_residuals(lanes, code.flags(True))
    _copy(lanes.y.single(), lanes.end, sizes["ny"])
    _copy(lanes.numbers.single(), lanes.results, len(KEPT))


def _copy(source: Rows, target: Rows, n: int) -> None:
    with source.code.each(n) as i:
        target[i] = source[i]
