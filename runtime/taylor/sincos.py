"""Sine and cosine of one angle in a few nanoseconds: the start of every step of a model with angles.

The angle is reduced by multiples of pi/2 in two parts (Cody and Waite), exactly, since a fused multiply-add does not
round the product; the sums are ordered as in fdlibm (k_sin.c, k_cos.c). The error is below one unit in the last place
(near zeros, below 1e-32 of the angle). Angles beyond LARGEST go to the C library.

What grows in a long run is not that error but its mean over neighbouring angles: steps through the same angles add it
up, and rounding does not. So polynomials (least squares at Chebyshev points, one coefficient rounded after another),
their first coefficients in two parts and the effect of the reduction's remainder are good to 1e-19.
"""

from __future__ import annotations

from symgen.runtime.code.llvm_text import constant

LARGEST = 1e9
_TWO_OVER_PI = 0.6366197723675814
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17)
# sin r = r + r^3 (-1/6 + low + z (...)), cos r = 1 - z / 2 + z^2 (1/24 + low + z (...)), z = r^2.
_SIXTH, _TWENTY_FOURTH = -1.0 / 6.0, 1.0 / 24.0
_SINE = (
    -9.25185853854297e-18, 8.333333333333326e-03, -1.9841269841256514e-04, 2.7557319214276e-06,
    -2.5052104836656676e-08, 1.6058349582757788e-10, -7.577615464024097e-13,
)  # fmt: skip
_COSINE = (
    2.3129646346357427e-18, -1.3888888888888883e-03, 2.480158730157719e-05, -2.755731921723773e-07,
    2.0876754691387034e-09, -1.1470322202837172e-11, 4.739136935687501e-14,
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
    sixth, twenty_fourth = constant(_SIXTH), constant(_TWENTY_FOURTH)
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
%zz = fmul double %z, %z
%v = fmul double %z, %r
{_polynomial("sp", _SINE)}
{_polynomial("cp", _COSINE)}
%hz = fmul double %z, 0.5
%w = fsub double 1.0, %hz
%cosine.near = call double @llvm.fmuladd.f64(double %zz, double {twenty_fourth}, double %w)
%sp.near = call double @llvm.fmuladd.f64(double %z, double {constant(_SINE[1])}, double {sixth})
%sine.near = call double @llvm.fmuladd.f64(double %v, double %sp.near, double %r)
%s1 = fmul double %tail, %cosine.near
%s2 = call double @llvm.fmuladd.f64(double %v, double %sp, double %s1)
%s3 = call double @llvm.fmuladd.f64(double %v, double {sixth}, double %s2)
%sine = fadd double %r, %s3
%w1 = fsub double 1.0, %w
%w2 = fsub double %w1, %hz
%c1 = fmul double %tail, %sine.near
%c2 = fsub double %w2, %c1
%c3 = call double @llvm.fmuladd.f64(double %zz, double %cp, double %c2)
%c4 = call double @llvm.fmuladd.f64(double %zz, double {twenty_fourth}, double %c3)
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
    """A polynomial in z: its even and odd powers apart, which halves the time."""
    lines = []
    for start, part in enumerate((f"{name}.even", f"{name}.odd")):
        own = coefficients[start::2]
        before = constant(own[-1])
        for number in range(len(own) - 2, -1, -1):
            to = f"%{part}{number}"
            lines.append(
                f"{to} = call double @llvm.fmuladd.f64(double {before}, double %zz, double {constant(own[number])})"
            )
            before = to
    even, odd = f"%{name}.even0", f"%{name}.odd0"
    lines.append(f"%{name} = call double @llvm.fmuladd.f64(double {odd}, double %z, double {even})")
    return "\n".join(lines)
