"""The kernel that sums a series at the end of a step, and its derivative there."""

from __future__ import annotations

_WIDTHS = (8, 4, 2, 1)


def sum_kernel(symbol: str, n_y: int) -> str:
    """Return the LLVM IR of `f(h, series, carry, out)`, which reads the order of the series from out[0].

    `out` receives the sum (n_y values), what rounding loses in it, and the derivative of the sum. `carry` is what
    rounding has lost before. Even and odd terms are summed apart (Horner in h²), which halves the time; a series of
    odd order must be followed by a row of zeros.
    """
    parts, start = [], 0
    while start < n_y:
        width = next(w for w in _WIDTHS if w <= n_y - start)
        parts.append(_part(start, width, n_y))
        start += width
    declarations = sorted({line for part in parts for line in part[0]})
    body = "\n".join(part[1] for part in parts)
    return f"""{chr(10).join(declarations)}
define void @{symbol}(double %h, ptr noalias %series, ptr noalias %carry, ptr noalias %out) nounwind {{
entry:
%order.at = load double, ptr %out, align 8
%order = fptosi double %order.at to i64
%up = add i64 %order, 1
%top = and i64 %up, -2
%top.at = sitofp i64 %top to double
%hh = fmul double %h, %h
br label %part0
{body}
part{n_y}:
ret void
}}
"""


def _part(start: int, width: int, n_y: int) -> tuple[list[str], str]:
    """Components from `start` on, `width` of them as a vector: declarations and code."""
    kind = f"<{width} x double>" if width > 1 else "double"
    name = f"v{width}f64" if width > 1 else "f64"
    zero = "zeroinitializer" if width > 1 else "0.0"
    s = str(start)

    def splat(value: str, to: str) -> str:
        if width == 1:
            return f"{to} = fadd double {value}, -0.0"
        zeros = ", ".join("i32 0" for _ in range(width))
        return (
            f"{to}.i = insertelement {kind} poison, double {value}, i32 0\n"
            f"{to} = shufflevector {kind} {to}.i, {kind} poison, <{width} x i32> <{zeros}>"
        )

    def fma(to: str, a: str, b: str, c: str) -> str:
        return f"{to} = call {kind} @llvm.fmuladd.{name}({kind} {a}, {kind} {b}, {kind} {c})"

    def load(to: str, array: str, offset: str) -> str:
        return (
            f"{to}.a = getelementptr inbounds double, ptr %{array}, i64 {offset}\n"
            f"{to} = load {kind}, ptr {to}.a, align 8"
        )

    def store(value: str, offset: int) -> str:
        return (
            f"{value}.to = getelementptr inbounds double, ptr %out, i64 {offset}\n"
            f"store {kind} {value}, ptr {value}.to, align 8"
        )

    lines = [
        f"part{s}:",
        splat("%h", f"%h{s}"),
        splat("%hh", f"%hh{s}"),
        f"br label %loop{s}",
        f"loop{s}:",
        f"%k{s} = phi i64 [%top, %part{s}], [%next{s}, %loop{s}]",
        f"%f{s} = phi double [%top.at, %part{s}], [%fnext{s}, %loop{s}]",
        *(f"%{x}{s} = phi {kind} [{zero}, %part{s}], [%{x}n{s}, %loop{s}]" for x in ("e", "o", "de", "do")),
        f"%row{s} = mul i64 %k{s}, {n_y}",
        f"%even{s} = add i64 %row{s}, {start}",
        f"%odd{s} = sub i64 %even{s}, {n_y}",
        load(f"%x{s}", "series", f"%even{s}"),
        load(f"%z{s}", "series", f"%odd{s}"),
        splat(f"%f{s}", f"%fe{s}"),
        f"%below{s} = fsub double %f{s}, 1.0",
        splat(f"%below{s}", f"%fo{s}"),
        fma(f"%en{s}", f"%e{s}", f"%hh{s}", f"%x{s}"),
        fma(f"%on{s}", f"%o{s}", f"%hh{s}", f"%z{s}"),
        f"%xk{s} = fmul {kind} %x{s}, %fe{s}",
        f"%zk{s} = fmul {kind} %z{s}, %fo{s}",
        fma(f"%den{s}", f"%de{s}", f"%hh{s}", f"%xk{s}"),
        fma(f"%don{s}", f"%do{s}", f"%hh{s}", f"%zk{s}"),
        f"%next{s} = sub i64 %k{s}, 2",
        f"%fnext{s} = fsub double %f{s}, 2.0",
        f"%last{s} = icmp sle i64 %next{s}, 0",
        f"br i1 %last{s}, label %end{s}, label %loop{s}",
        f"end{s}:",
        load(f"%y{s}", "series", s),
        load(f"%c{s}", "carry", s),
        fma(f"%mean{s}", f"%en{s}", f"%h{s}", f"%on{s}"),
        fma(f"%rise{s}", f"%mean{s}", f"%h{s}", f"%c{s}"),
        f"%sum{s} = fadd {kind} %y{s}, %rise{s}",
        f"%back{s} = fsub {kind} %sum{s}, %y{s}",
        f"%kept{s} = fsub {kind} %sum{s}, %back{s}",
        f"%low{s} = fsub {kind} %y{s}, %kept{s}",
        f"%high{s} = fsub {kind} %rise{s}, %back{s}",
        f"%lost{s} = fadd {kind} %low{s}, %high{s}",
        fma(f"%slope{s}", f"%den{s}", f"%h{s}", f"%don{s}"),
        store(f"%sum{s}", start),
        store(f"%lost{s}", n_y + start),
        store(f"%slope{s}", 2 * n_y + start),
        f"br label %part{start + width}",
    ]
    return [f"declare {kind} @llvm.fmuladd.{name}({kind}, {kind}, {kind})"], "\n".join(lines)
