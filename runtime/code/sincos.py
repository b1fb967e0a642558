"""Sine and cosine as LLVM IR, of a number or of a vector of numbers, to the same bits.

The angle is reduced by multiples of pi/2 in two parts (Cody and Waite), exactly, since a fused multiply-add does not
round the product; the sums are ordered as in fdlibm (k_sin.c, k_cos.c). The error is below one unit in the last place
(near zeros, below 1e-32 of the angle). Angles beyond LARGEST go to the C library.

What grows in a long run is not that error but its mean over neighbouring angles: steps through the same angles add it
up, and rounding does not. So polynomials (least squares at Chebyshev points, one coefficient rounded after another),
their first coefficients in two parts and the effect of the reduction's remainder are good to 1e-19.
"""

from __future__ import annotations

import re

from symgen.runtime.code.llvm_text import constant, lanes_constant, lanes_suffix, lanes_type

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

_INTRINSICS = {"fma": 3, "rint": 1, "fabs": 1, "sin": 1, "cos": 1, "fmuladd": 3}
# Added to a whole number below 2^51, it leaves that in the last bits.
_TO_BITS = 1.5 * 2.0**52
_FEW = 8
_NOT_INLINE = re.compile(r"(define internal [^\n]*sincos\([^\n]*\)) noinline")


def declaration(function: str, lanes: int = 0) -> str:
    """Return the IR that declares one of the intrinsics that sine and cosine are made of."""
    kind = lanes_type(lanes)
    arguments = ", ".join([kind] * _INTRINSICS[function])
    return f"declare {kind} @llvm.{function}.{lanes_suffix(lanes)}({arguments})"


DECLARATIONS = tuple(declaration(name) for name in _INTRINSICS)


def sincos_function(name: str) -> str:
    """Return the LLVM IR of `void name(double x, ptr pair)`, which writes the sine and the cosine."""
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
{_near("%x", 0)}
%quadrant = fptosi double %n to i64
{_quadrant("i64", "i1", "", "double")}
store i64 %s.signed, ptr %pair, align 8
store i64 %c.signed, ptr %second, align 8
ret void
}}
"""


def lanes_sincos(name: str, lanes: int) -> tuple[str, set[str]]:
    """Return the LLVM IR of `{V, V} name(V x)` on vectors V of numbers, and what it declares.

    Each lane has the bits that it would have alone.
    """
    kind, flags, bits = lanes_type(lanes), f"<{lanes} x i1>", f"<{lanes} x i64>"
    lines, sines, cosines = [], "zeroinitializer", "zeroinitializer"
    for lane in range(lanes):
        lines += [
            f"%x.{lane} = extractelement {kind} %x, i32 {lane}",
            f"%s.{lane} = call double @llvm.sin.f64(double %x.{lane})",
            f"%c.{lane} = call double @llvm.cos.f64(double %x.{lane})",
            f"%ss.{lane} = insertelement {kind} {sines}, double %s.{lane}, i32 {lane}",
            f"%cc.{lane} = insertelement {kind} {cosines}, double %c.{lane}, i32 {lane}",
        ]
        sines, cosines = f"%ss.{lane}", f"%cc.{lane}"
    library = "\n".join(lines)
    text = f"""define internal {{{kind}, {kind}}} @{name}({kind} %x) noinline nounwind {{
entry:
%size = call {kind} @llvm.fabs.{lanes_suffix(lanes)}({kind} %x)
%near = fcmp ole {kind} %size, {lanes_constant(LARGEST, lanes)}
{_near("%x", lanes)}
%whole = fadd {kind} %n, {lanes_constant(_TO_BITS, lanes)}
%quadrant = bitcast {kind} %whole to {bits}
{_quadrant(bits, flags, "splat ", kind)}
%sines = bitcast {bits} %s.signed to {kind}
%cosines = bitcast {bits} %c.signed to {kind}
%far = xor {flags} %near, splat (i1 true)
%far.bits = bitcast {flags} %far to i{lanes}
%some = icmp ne i{lanes} %far.bits, 0
br i1 %some, label %library, label %done
library:
{library}
%s.mixed = select {flags} %near, {kind} %sines, {kind} {sines}
%c.mixed = select {flags} %near, {kind} %cosines, {kind} {cosines}
br label %done
done:
%s = phi {kind} [%sines, %entry], [%s.mixed, %library]
%c = phi {kind} [%cosines, %entry], [%c.mixed, %library]
%one = insertvalue {{{kind}, {kind}}} poison, {kind} %s, 0
%both = insertvalue {{{kind}, {kind}}} %one, {kind} %c, 1
ret {{{kind}, {kind}}} %both
}}
"""
    used = {declaration(f, lanes) for f in ("fma", "rint", "fabs", "fmuladd")}
    return text, used | {declaration("sin"), declaration("cos")}


def inlined_where_few(ir: str) -> str:
    """Return a module in which `lanes_sincos` is inlined, where few calls of it do not make functions much longer."""
    calls = len(re.findall(r"call [^\n]*sincos\(", ir))
    return _NOT_INLINE.sub(r"\1 alwaysinline", ir) if calls <= _FEW else ir


def _near(x: str, lanes: int) -> str:
    """Sine and cosine of the rest of an angle, and its quadrant `%n` as a number."""
    kind, suffix = lanes_type(lanes), lanes_suffix(lanes)

    def number(value: float) -> str:
        return lanes_constant(value, lanes)

    def fused(function: str, to: str, a: str, b: str, c: str) -> str:
        return f"{to} = call {kind} @llvm.{function}.{suffix}({kind} {a}, {kind} {b}, {kind} {c})"

    high, low = (number(value) for value in _HALF_PI)
    sixth, twenty_fourth = number(_SIXTH), number(_TWENTY_FOURTH)
    return f"""%turns = fmul {kind} {x}, {number(_TWO_OVER_PI)}
%n = call {kind} @llvm.rint.{suffix}({kind} %turns)
%m = fneg {kind} %n
{fused("fma", "%rest", "%m", high, x)}
{fused("fma", "%r", "%m", low, "%rest")}
%gone = fsub {kind} %rest, %r
{fused("fma", "%tail", "%m", low, "%gone")}
%z = fmul {kind} %r, %r
%zz = fmul {kind} %z, %z
%v = fmul {kind} %z, %r
{_polynomial("sp", _SINE, lanes)}
{_polynomial("cp", _COSINE, lanes)}
%hz = fmul {kind} %z, {number(0.5)}
%w = fsub {kind} {number(1.0)}, %hz
{fused("fmuladd", "%cosine.near", "%zz", twenty_fourth, "%w")}
{fused("fmuladd", "%sp.near", "%z", number(_SINE[1]), sixth)}
{fused("fmuladd", "%sine.near", "%v", "%sp.near", "%r")}
%s1 = fmul {kind} %tail, %cosine.near
{fused("fmuladd", "%s2", "%v", "%sp", "%s1")}
{fused("fmuladd", "%s3", "%v", sixth, "%s2")}
%sine = fadd {kind} %r, %s3
%w1 = fsub {kind} {number(1.0)}, %w
%w2 = fsub {kind} %w1, %hz
%c1 = fmul {kind} %tail, %sine.near
%c2 = fsub {kind} %w2, %c1
{fused("fmuladd", "%c3", "%zz", "%cp", "%c2")}
{fused("fmuladd", "%c4", "%zz", twenty_fourth, "%c3")}
%cosine = fadd {kind} %w, %c4"""


def _quadrant(bits: str, flags: str, splat: str, kind: str) -> str:
    """Which of the two is the sine, and with which sign: bits `%s.signed` and `%c.signed`."""

    def number(value: int) -> str:
        return f"{splat}(i64 {value})" if splat else str(value)

    return f"""%odd.bit = and {bits} %quadrant, {number(1)}
%odd = icmp ne {bits} %odd.bit, {number(0)}
%s.size = select {flags} %odd, {kind} %cosine, {kind} %sine
%c.size = select {flags} %odd, {kind} %sine, {kind} %cosine
%s.sign = shl {bits} %quadrant, {number(62)}
%up = add {bits} %quadrant, {number(1)}
%c.sign = shl {bits} %up, {number(62)}
%s.bit = and {bits} %s.sign, {number(-9223372036854775808)}
%c.bit = and {bits} %c.sign, {number(-9223372036854775808)}
%s.bits = bitcast {kind} %s.size to {bits}
%c.bits = bitcast {kind} %c.size to {bits}
%s.signed = xor {bits} %s.bits, %s.bit
%c.signed = xor {bits} %c.bits, %c.bit"""


def _polynomial(name: str, coefficients: tuple[float, ...], lanes: int) -> str:
    """A polynomial in z: its even and odd powers apart, which halves the time."""
    kind, lines = lanes_type(lanes), []
    fused = f"call {kind} @llvm.fmuladd.{lanes_suffix(lanes)}"
    for start, part in enumerate((f"{name}.even", f"{name}.odd")):
        own = [lanes_constant(value, lanes) for value in coefficients[start::2]]
        before = own[-1]
        for number in range(len(own) - 2, -1, -1):
            to = f"%{part}{number}"
            lines.append(f"{to} = {fused}({kind} {before}, {kind} %zz, {kind} {own[number]})")
            before = to
    even, odd = f"%{name}.even0", f"%{name}.odd0"
    lines.append(f"%{name} = {fused}({kind} {odd}, {kind} %z, {kind} {even})")
    return "\n".join(lines)
