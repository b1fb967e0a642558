"""Sine and cosine as LLVM IR, of a number or of a vector of numbers, to the same bits.

The angle is reduced by multiples of pi/2 in two parts (Cody and Waite), exactly, since a fused multiply-add does not
round the product; the sums are ordered as in fdlibm (k_sin.c, k_cos.c). The error is below one unit in the last place
(near zeros, below 1e-32 of the angle).

What grows in a long run is not that error but its mean over neighbouring angles: steps through the same angles add it
up, and rounding does not. So polynomials (least squares at Chebyshev points, one coefficient rounded after another),
their first coefficients in two parts and the effect of the reduction's remainder are good to 1e-19.

Larger angles are multiplied by as many digits of 2/pi as decide their place in a turn (Payne and Hanek 1983), in
integers, so that all processors and graphics processors find the same bits there, too.
"""

from __future__ import annotations

import functools
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

_INTRINSICS = {"fma": 3, "rint": 1, "fabs": 1, "fmuladd": 3}
_DECLARE_SHIFT = "declare i64 @llvm.fshl.i64(i64, i64, i64)"
_N_WORDS = 20  # of 2/pi, behind one of zeros: the largest angles need bits 972 to 1164
# Added to a whole number below 2^51, it leaves that in the last bits.
_TO_BITS = 1.5 * 2.0**52
_FEW = 8
_NOT_INLINE = re.compile(r"(define internal [^\n]*sincos\([^\n]*\)) noinline")


def declaration(function: str, lanes: int = 0) -> str:
    """Return the IR that declares one of the intrinsics that sine and cosine are made of."""
    kind = lanes_type(lanes)
    arguments = ", ".join([kind] * _INTRINSICS[function])
    return f"declare {kind} @llvm.{function}.{lanes_suffix(lanes)}({arguments})"


DECLARATIONS = (*(declaration(name) for name in _INTRINSICS), _DECLARE_SHIFT)


def sincos_function(name: str) -> str:
    """Return the LLVM IR of `void name(double x, ptr pair)`, which writes the sine and the cosine."""
    return f"""define internal void @{name}(double %x, ptr noalias %pair) noinline nounwind {{
entry:
%second = getelementptr inbounds double, ptr %pair, i64 1
%size = call double @llvm.fabs.f64(double %x)
%near = fcmp ole double %size, {constant(LARGEST)}
br i1 %near, label %reduce, label %far
far:
call void @{name}.far(double %x, ptr %pair)
ret void
reduce:
{_reduced("%x", 0)}
{_sums(0)}
%quadrant = fptosi double %n to i64
{_quadrant("i64", "i1", "", "double")}
store i64 %s.signed, ptr %pair, align 8
store i64 %c.signed, ptr %second, align 8
ret void
}}
{_far(f"{name}.far")}"""


def lanes_sincos(name: str, lanes: int) -> tuple[str, set[str]]:
    """Return the LLVM IR of `{V, V} name(V x)` on vectors V of numbers, and what it declares.

    Each lane has the bits that it would have alone.
    """
    kind, flags, bits = lanes_type(lanes), f"<{lanes} x i1>", f"<{lanes} x i64>"
    lines, sines, cosines = [], "zeroinitializer", "zeroinitializer"
    for lane in range(lanes):
        lines += [
            f"%x.{lane} = extractelement {kind} %x, i32 {lane}",
            f"call void @{name}.far(double %x.{lane}, ptr %pair)",
            f"%s.{lane} = load double, ptr %pair, align 8",
            f"%c.{lane} = load double, ptr %second, align 8",
            f"%ss.{lane} = insertelement {kind} {sines}, double %s.{lane}, i32 {lane}",
            f"%cc.{lane} = insertelement {kind} {cosines}, double %c.{lane}, i32 {lane}",
        ]
        sines, cosines = f"%ss.{lane}", f"%cc.{lane}"
    one_by_one = "\n".join(lines)
    text = f"""define internal {{{kind}, {kind}}} @{name}({kind} %x) noinline nounwind {{
entry:
%pair = alloca [2 x double], align 8
%second = getelementptr inbounds double, ptr %pair, i64 1
%size = call {kind} @llvm.fabs.{lanes_suffix(lanes)}({kind} %x)
%near = fcmp ole {kind} %size, {lanes_constant(LARGEST, lanes)}
{_reduced("%x", lanes)}
{_sums(lanes)}
%whole = fadd {kind} %n, {lanes_constant(_TO_BITS, lanes)}
%quadrant = bitcast {kind} %whole to {bits}
{_quadrant(bits, flags, "splat ", kind)}
%sines = bitcast {bits} %s.signed to {kind}
%cosines = bitcast {bits} %c.signed to {kind}
%far = xor {flags} %near, splat (i1 true)
%far.bits = bitcast {flags} %far to i{lanes}
%some = icmp ne i{lanes} %far.bits, 0
br i1 %some, label %each, label %done
each:
{one_by_one}
%s.mixed = select {flags} %near, {kind} %sines, {kind} {sines}
%c.mixed = select {flags} %near, {kind} %cosines, {kind} {cosines}
br label %done
done:
%s = phi {kind} [%sines, %entry], [%s.mixed, %each]
%c = phi {kind} [%cosines, %entry], [%c.mixed, %each]
%one = insertvalue {{{kind}, {kind}}} poison, {kind} %s, 0
%both = insertvalue {{{kind}, {kind}}} %one, {kind} %c, 1
ret {{{kind}, {kind}}} %both
}}
{_far(f"{name}.far")}"""
    used = {declaration(f, lanes) for f in _INTRINSICS} | {declaration(f) for f in ("fma", "fmuladd")}
    return text, used | {_DECLARE_SHIFT}


# What functions of single runs call to find sines side by side: one code for all functions of a process. By width.
SHARED_SINCOS = {f"symgen.sincos{width}": width for width in (4, 8)}


def shared_sincos(name: str) -> str:
    """Return the LLVM IR of a module that defines one of `SHARED_SINCOS`."""
    text, declared = lanes_sincos(name, SHARED_SINCOS[name])
    return "\n".join([*sorted(declared), text.replace("define internal {", "define {", 1)])


def standing_alone(ir: str) -> str:
    """Return a module that calls `SHARED_SINCOS` with their definitions in it."""
    for name in SHARED_SINCOS:
        declared = re.search(rf"^declare [^\n]*@{re.escape(name)}\([^\n]*\n", ir, re.MULTILINE)
        if declared:
            text, needs = lanes_sincos(name, SHARED_SINCOS[name])
            more = "".join(f"{line}\n" for line in sorted(needs) if f"{line}\n" not in ir)
            ir = ir.replace(declared.group(), more) + text
    return ir


def inlined_where_few(ir: str) -> str:
    """Return a module in which `lanes_sincos` is inlined, where few calls of it do not make functions much longer."""
    calls = len(re.findall(r"call [^\n]*sincos\(", ir))
    return _NOT_INLINE.sub(r"\1 alwaysinline", ir) if calls <= _FEW else ir


def _fused(lanes: int, function: str, to: str, a: str, b: str, c: str) -> str:
    """`to = a b + c`, by fma, or by fmuladd, which only rounds once where that is fast."""
    kind, suffix = lanes_type(lanes), lanes_suffix(lanes)
    return f"{to} = call {kind} @llvm.{function}.{suffix}({kind} {a}, {kind} {b}, {kind} {c})"


def _reduced(x: str, lanes: int) -> str:
    """The rest of an angle, `%r` and `%tail`, and its quadrant `%n` as a number."""
    kind, suffix = lanes_type(lanes), lanes_suffix(lanes)
    high, low = (lanes_constant(value, lanes) for value in _HALF_PI)
    return f"""%turns = fmul {kind} {x}, {lanes_constant(_TWO_OVER_PI, lanes)}
%n = call {kind} @llvm.rint.{suffix}({kind} %turns)
%m = fneg {kind} %n
{_fused(lanes, "fma", "%rest", "%m", high, x)}
{_fused(lanes, "fma", "%r", "%m", low, "%rest")}
%gone = fsub {kind} %rest, %r
{_fused(lanes, "fma", "%tail", "%m", low, "%gone")}"""


def _sums(lanes: int) -> str:
    """`%sine` and `%cosine` of `%r` + `%tail`."""
    kind, fused = lanes_type(lanes), functools.partial(_fused, lanes, "fmuladd")

    def number(value: float) -> str:
        return lanes_constant(value, lanes)

    sixth, twenty_fourth = number(_SIXTH), number(_TWENTY_FOURTH)
    return f"""%z = fmul {kind} %r, %r
%zz = fmul {kind} %z, %z
%v = fmul {kind} %z, %r
{_polynomial("sp", _SINE, lanes)}
{_polynomial("cp", _COSINE, lanes)}
%hz = fmul {kind} %z, {number(0.5)}
%w = fsub {kind} {number(1.0)}, %hz
{fused("%cosine.near", "%zz", twenty_fourth, "%w")}
{fused("%sp.near", "%z", number(_SINE[1]), sixth)}
{fused("%sine.near", "%v", "%sp.near", "%r")}
%s1 = fmul {kind} %tail, %cosine.near
{fused("%s2", "%v", "%sp", "%s1")}
{fused("%s3", "%v", sixth, "%s2")}
%sine = fadd {kind} %r, %s3
%w1 = fsub {kind} {number(1.0)}, %w
%w2 = fsub {kind} %w1, %hz
%c1 = fmul {kind} %tail, %sine.near
%c2 = fsub {kind} %w2, %c1
{fused("%c3", "%zz", "%cp", "%c2")}
{fused("%c4", "%zz", twenty_fourth, "%c3")}
%cosine = fadd {kind} %w, %c4"""


def _far(name: str) -> str:
    """The IR of `void name(double x, ptr pair)` for angles beyond LARGEST.

    x = M 2^E with a whole number M below 2^53. Bits of 2/pi of a weight above 2^(1 - E) make whole turns; the 192 from
    there on, as a whole number P, give 2/pi x = M P 2^-190, but for whole turns and 2^-137. So the upper two bits of
    M P mod 2^192 are the quadrant, and what follows is the place in it.
    """
    table = ", ".join(f"i64 {word}" for word in _two_over_pi())
    kinds, parts = f"[{_N_WORDS + 1} x i64]", []
    for k, word in enumerate(("a", "b", "c", "d")):
        parts += [
            f"%at.{word} = add i64 %word, {k}",
            f"%place.{word} = getelementptr inbounds i64, ptr @{name}.digits, i64 %at.{word}",
            f"%given.{word} = load i64, ptr %place.{word}, align 8",
        ]
    for word, following in (("a", "b"), ("b", "c"), ("c", "d")):
        parts += [
            f"%{word} = call i64 @llvm.fshl.i64(i64 %given.{word}, i64 %given.{following}, i64 %shift)",
            f"%{word}.long = zext i64 %{word} to i128",
            f"%{word}.product = mul i128 %m.long, %{word}.long",
        ]
    for k, weight in enumerate((2.0**-32, 2.0**-64, 2.0**-96, 2.0**-128)):
        parts += [
            f"%digits.{k}.long = lshr i128 %place.size, {96 - 32 * k}",
            f"%digits.{k} = trunc i128 %digits.{k}.long to i32",
            f"%number.{k} = uitofp i32 %digits.{k} to double",
            f"%f{k} = fmul double %number.{k}, {constant(weight)}",
        ]
    digits, product, numbers = "\n".join(parts[:12]), "\n".join(parts[12:21]), "\n".join(parts[21:])
    high, low = (constant(value) for value in _HALF_PI)
    return f"""@{name}.digits = internal constant {kinds} [{table}], align 8
define internal void @{name}(double %x, ptr noalias %pair) noinline nounwind {{
entry:
%second = getelementptr inbounds double, ptr %pair, i64 1
%x.bits = bitcast double %x to i64
%exponent.there = lshr i64 %x.bits, 52
%exponent = and i64 %exponent.there, 2047
%finite = icmp ult i64 %exponent, 2047
%large = icmp ugt i64 %exponent, 1051
%good = and i1 %finite, %large
br i1 %good, label %reduce, label %none
none:
store double 0x7FF8000000000000, ptr %pair, align 8
store double 0x7FF8000000000000, ptr %second, align 8
ret void
reduce:
%fraction = and i64 %x.bits, 4503599627370495
%m.whole = or i64 %fraction, 4503599627370496
%first = sub i64 %exponent, 1013
%word = lshr i64 %first, 6
%shift = and i64 %first, 63
{digits}
%m.long = zext i64 %m.whole to i128
{product}
%a.up = shl i128 %a.product, 64
%c.high = lshr i128 %c.product, 64
%upper = add i128 %a.up, %b.product
%sum = add i128 %upper, %c.high
%quadrant.long = lshr i128 %sum, 126
%quadrant.below = trunc i128 %quadrant.long to i64
%c.low = trunc i128 %c.product to i64
%under = lshr i64 %c.low, 62
%under.long = zext i64 %under to i128
%place.up = shl i128 %sum, 2
%place = or i128 %place.up, %under.long
%is.late = icmp slt i128 %place, 0
%late = zext i1 %is.late to i64
%quadrant.size = add i64 %quadrant.below, %late
%place.back = sub i128 0, %place
%place.size = select i1 %is.late, i128 %place.back, i128 %place
{numbers}
%upper.f = fadd double %f0, %f1
%upper.off = fsub double %upper.f, %f0
%upper.lost = fsub double %f1, %upper.off
%lower.f = fadd double %f2, %f3
%lower.all = fadd double %upper.lost, %lower.f
%f = fadd double %upper.f, %lower.all
%f.off = fsub double %f, %upper.f
%f.lost = fsub double %lower.all, %f.off
%r.size = fmul double %f, {high}
%r.back = fneg double %r.size
{_fused(0, "fma", "%r.lost", "%f", high, "%r.back")}
%f.low = fmul double %f, {low}
%lost.high = fmul double %f.lost, {high}
%tail.parts = fadd double %f.low, %lost.high
%tail.size = fadd double %r.lost, %tail.parts
%negative = icmp slt i64 %x.bits, 0
%turned = xor i1 %negative, %is.late
%r.turned = fneg double %r.size
%tail.turned = fneg double %tail.size
%r = select i1 %turned, double %r.turned, double %r.size
%tail = select i1 %turned, double %tail.turned, double %tail.size
%quadrant.back = sub i64 0, %quadrant.size
%quadrant = select i1 %negative, i64 %quadrant.back, i64 %quadrant.size
{_sums(0)}
{_quadrant("i64", "i1", "", "double")}
store i64 %s.signed, ptr %pair, align 8
store i64 %c.signed, ptr %second, align 8
ret void
}}
"""


@functools.lru_cache(maxsize=1)
def _two_over_pi() -> tuple[int, ...]:
    """The binary digits of 2/pi in words of 64, behind one of zeros; pi by Machin's formula."""
    guard = 64
    one = 1 << (64 * _N_WORDS + guard)

    def arc_tangent_of_inverse(n: int) -> int:
        total, power, k = 0, one // n, 1
        while power:
            total += power // k if k % 4 == 1 else -(power // k)
            power //= n * n
            k += 2
        return total

    pi = 4 * (4 * arc_tangent_of_inverse(5) - arc_tangent_of_inverse(239))
    digits = 2 * one * one // pi >> guard
    return 0, *(digits >> (64 * k) & (2**64 - 1) for k in range(_N_WORDS - 1, -1, -1))


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
