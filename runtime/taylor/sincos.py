"""Sine and cosine of one angle in a few nanoseconds: the start of every step of a model with angles.

The angle is reduced by multiples of pi/2 in two parts (Cody and Waite), exactly, since a fused multiply-add does not
round the product; the polynomials are those of fdlibm (k_sin.c, k_cos.c). The error is below one unit in the last
place (near zeros, below 1e-32 of the angle). Angles beyond LARGEST go to the C library.
"""

from __future__ import annotations

from runtime.code.llvm_text import constant

LARGEST = 1e9
_TWO_OVER_PI = 0.6366197723675814
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17)
_SINE = (
    -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
    2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10,
)  # fmt: skip
_COSINE = (
    4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
    -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11,
)  # fmt: skip

DECLARATIONS = (
    "declare double @llvm.fma.f64(double, double, double)",
    "declare double @llvm.rint.f64(double)",
    "declare double @llvm.fabs.f64(double)",
    "declare double @llvm.sin.f64(double)",
    "declare double @llvm.cos.f64(double)",
    "declare double @llvm.fmuladd.f64(double, double, double)",
)


def sincos_function(name: str) -> str:
    """Return the LLVM IR of `void name(double x, ptr pair)`, which writes the sine and the cosine."""
    high, low = (constant(value) for value in _HALF_PI)
    return f"""define internal void @{name}(double %x, ptr noalias %pair) noinline nounwind {{
entry:
%second = getelementptr inbounds double, ptr %pair, i64 1
%size = call double @llvm.fabs.f64(double %x)
%near = fcmp ole double %size, {constant(LARGEST)}
br i1 %near, label %reduce, label %library
library:
%s.library = call double @llvm.sin.f64(double %x)
%c.library = call double @llvm.cos.f64(double %x)
store double %s.library, ptr %pair, align 8
store double %c.library, ptr %second, align 8
ret void
reduce:
%turns = fmul double %x, {constant(_TWO_OVER_PI)}
%n = call double @llvm.rint.f64(double %turns)
%m = fneg double %n
%rest = call double @llvm.fma.f64(double %m, double {high}, double %x)
%r = call double @llvm.fma.f64(double %m, double {low}, double %rest)
%gone = fsub double %rest, %r
%tail = call double @llvm.fma.f64(double %m, double {low}, double %gone)
%z = fmul double %r, %r
{_polynomial("sp", _SINE[1:])}
{_polynomial("cp", _COSINE)}
%v = fmul double %z, %r
%vp = fmul double %v, %sp
%half.tail = fmul double %tail, 0.5
%s1 = fsub double %half.tail, %vp
%s2 = fmul double %z, %s1
%s3 = fsub double %s2, %tail
%v1 = fmul double %v, {constant(_SINE[0])}
%s4 = fsub double %s3, %v1
%sine = fsub double %r, %s4
%hz = fmul double %z, 0.5
%w = fsub double 1.0, %hz
%w1 = fsub double 1.0, %w
%w2 = fsub double %w1, %hz
%zz = fmul double %z, %z
%c1 = fmul double %zz, %cp
%c2 = fmul double %r, %tail
%c3 = fsub double %c1, %c2
%c4 = fadd double %w2, %c3
%cosine = fadd double %w, %c4
%quadrant = fptosi double %n to i64
%odd.bit = and i64 %quadrant, 1
%odd = icmp ne i64 %odd.bit, 0
%s.size = select i1 %odd, double %cosine, double %sine
%c.size = select i1 %odd, double %sine, double %cosine
%s.sign = shl i64 %quadrant, 62
%up = add i64 %quadrant, 1
%c.sign = shl i64 %up, 62
%s.bit = and i64 %s.sign, -9223372036854775808
%c.bit = and i64 %c.sign, -9223372036854775808
%s.bits = bitcast double %s.size to i64
%c.bits = bitcast double %c.size to i64
%s.signed = xor i64 %s.bits, %s.bit
%c.signed = xor i64 %c.bits, %c.bit
store i64 %s.signed, ptr %pair, align 8
store i64 %c.signed, ptr %second, align 8
ret void
}}
"""


def _polynomial(name: str, coefficients: tuple[float, ...]) -> str:
    lines, before = [], constant(coefficients[-1])
    for number, coefficient in enumerate(coefficients[-2::-1]):
        to = f"%{name}" if number == len(coefficients) - 2 else f"%{name}{number}"
        lines.append(
            f"{to} = call double @llvm.fmuladd.f64(double {before}, double %z, double {constant(coefficient)})"
        )
        before = to
    return "\n".join(lines)
