"""The kernel with every order written out: for small models, whose products of series would not fill SIMD lanes."""

from __future__ import annotations

from runtime.taylor.code import PASSED, Code
from runtime.taylor.plan import Plan
from runtime.taylor.steps import FIRST_STEP, Steps

READ_LAST = """%order.at = load double, ptr %out, align 8
%order = fptosi double %order.at to i64
%last = sub i64 %order, 2"""


class _Unrolled(Steps):
    def finished(self, k: int) -> None:
        """Return from the kernel where this was the last order wanted."""
        if k >= 0:
            label = f"order{k}"
            self.code.line(f"%last{k} = icmp sle i64 %k, {k}")
            self.code.line(f"br i1 %last{k}, label %done, label %{label}")
            self.code.line(f"{label}:")


def unrolled_kernel(plan: Plan, symbol: str, n_y: int, max_order: int, n_rows: int) -> tuple[str, int]:
    """Return the LLVM IR of the kernel for all orders up to `max_order`, and its number of operations."""
    code = Code(symbol)
    code.begin_piece()
    steps = _Unrolled(code, plan, n_y, n_rows)
    for k in range(FIRST_STEP, max_order - 1):
        steps.step(k)
    main = [READ_LAST]
    for number, piece in enumerate(code.pieces):
        if piece.first_order is not None:
            main += [
                f"%go{number} = icmp sge i64 %last, {piece.first_order}",
                f"br i1 %go{number}, label %piece{number}, label %done",
                f"piece{number}:",
            ]
        main.append(f"call void @{piece.name}({PASSED}, i64 %last)")
    return code.text("\n".join([*main, "br label %done", "done:", "ret void"])), code.operations
