"""The reciprocals of roots as LLVM IR, of the numbers in the lanes of a vector register.

A root and a division are the slowest operations on vectors that there are, and do not overlap with others of their
kind. Here the exponent is halved in the bits of the number, which is a seed to 3.5 % (the constant is that of
C. Lomont, "Fast inverse square root", 2003, for doubles), followed by two steps of third order and one of Newton's
method, whose products wait for each other, but not for those of another root. The last residual has the rounding of
x r in it, so that the error is below 0.52 units in the last place; a root and a division, rounded one by one, have up
to 1.0.
"""

from __future__ import annotations

from symgen.runtime.code.llvm_text import lanes_constant, lanes_suffix, lanes_type

_SEED = 0x5FE6EB50C7B537A9
# Beyond them, where no distance of a mechanism is, it is a root and a division.
_SMALLEST, _LARGEST = 1e-280, 1e280


def reciprocal_root(name: str, lanes: int) -> tuple[str, set[str]]:
    """Return the LLVM IR of `V name(V x)`, 1 / sqrt(x), and what it declares; the root is declared already."""
    kind, suffix = lanes_type(lanes), lanes_suffix(lanes)
    flags, bits = f"<{lanes} x i1>", f"<{lanes} x i64>"

    def number(value: float) -> str:
        return lanes_constant(value, lanes)

    def fused(to: str, a: str, b: str, c: str, function: str = "fmuladd") -> str:
        return f"{to} = call {kind} @llvm.{function}.{suffix}({kind} {a}, {kind} {b}, {kind} {c})"

    def residual(step: int, r: str, function: str) -> str:
        """How far x r^2 is from one."""
        t = f"%t{step}"
        return f"{t} = fmul {kind} %x, {r}\n%m{step} = fneg {kind} {t}\n" + fused(
            f"%e{step}", f"%m{step}", r, number(1.0), function
        )

    def third_order(step: int, r: str, to: str) -> str:
        return f"""{residual(step, r, "fmuladd")}
{fused(f"%p{step}", f"%e{step}", number(0.375), number(0.5))}
%s{step} = fmul {kind} {r}, %e{step}
{fused(to, f"%p{step}", f"%s{step}", r)}"""

    text = f"""define internal {kind} @{name}({kind} %x) alwaysinline nounwind {{
entry:
%bits = bitcast {kind} %x to {bits}
%half = lshr {bits} %bits, splat (i64 1)
%seed = sub {bits} splat (i64 {_SEED}), %half
%r0 = bitcast {bits} %seed to {kind}
{third_order(0, "%r0", "%r1")}
{third_order(1, "%r1", "%r2")}
{residual(2, "%r2", "fma")}
{fused("%low", "%x", "%r2", "%m2", "fma")}
%lost = fneg {kind} %low
{fused("%e", "%lost", "%r2", "%e2")}
%h = fmul {kind} %r2, {number(0.5)}
{fused("%r3", "%h", "%e", "%r2")}
%above = fcmp ogt {kind} %x, {number(_SMALLEST)}
%below = fcmp olt {kind} %x, {number(_LARGEST)}
%near = and {flags} %above, %below
%far = xor {flags} %near, splat (i1 true)
%some.bits = bitcast {flags} %far to i{lanes}
%some = icmp ne i{lanes} %some.bits, 0
br i1 %some, label %each, label %done
each:
%root = call {kind} @llvm.sqrt.{suffix}({kind} %x)
%plain = fdiv {kind} {number(1.0)}, %root
%mixed = select {flags} %near, {kind} %r3, {kind} %plain
br label %done
done:
%r = phi {kind} [%r3, %entry], [%mixed, %each]
ret {kind} %r
}}
"""
    return text, {
        f"declare {kind} @llvm.{fma}.{suffix}({kind}, {kind}, {kind})" for fma in ("fma", "fmuladd")
    }
