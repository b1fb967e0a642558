"""What fused and regrouped sums would gain in `rhs`, and do to its digits: `python benchmarks/contraction.py`.

Each bundled model's `rhs` is compiled as it is, with LLVM's flag `contract` (a product and the sum that it goes into
become one operation with one rounding), and with `reassoc` besides (sums are regrouped, which shortens chains of
operations that wait for each other). Processor time of a call, the least of many turns; and the largest error of a
result in units of the last digit of the largest of its kind, at five states of the model's own run, by the same text
carried out with fifty digits.
"""

from __future__ import annotations

import argparse
import math
import re
import time

import mpmath
import numpy as np

import symgen
from symgen.model import library
from symgen.runtime.code import compiler, engine
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.function_text import IN_CODE
from symgen.runtime.code.jitted import jitted
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.system import System

_FLAGS = {"as it is": "", "contract": "contract", "and reassoc": "contract reassoc nsz"}
_MOST_OPERATIONS = 4000
_TURNS, _SECONDS, _STATES, _SPAN = 10, 3e-3, 5, 1.0
_DIGITS = 50
_EXACT = {k: getattr(mpmath, k) for k in IN_CODE if hasattr(mpmath, k)}


@jitted
def repeat(address, t, y, p, out, n):
    """Call a kernel n times; each call waits for the one before, as stages of a step do."""
    for _ in range(n):
        call_kernel(address, t, y, p, out)
        y[0] += 0.0 * out[0]


def main() -> None:
    """Print a row for each model, then the geometric means."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", metavar="MODEL")
    parser.add_argument("--turns", type=int, default=_TURNS)
    options = parser.parse_args()
    print(
        f"{'model':24}{'ns':>8}" + "".join(f"{name:>24}" for name in list(_FLAGS)[1:]) + "    (time, error)"
    )
    ratios = []
    for name in options.models or sorted(library.bundled()):
        try:
            row = measure(name, options.turns)
        except (RuntimeModelError, KeyError, TypeError, NameError, ArithmeticError) as error:
            print(f"{name:24} not measured: {type(error).__name__}")
            continue
        if row is None:
            continue
        (ns, error), *others = row
        print(
            f"{name:24}{ns:8.1f}"
            + "".join(f"{t / ns:12.3f}{_over(e, error):12.2f}" for t, e in others)
            + f"    {error:.1f} ulp",
            flush=True,
        )
        ratios.append([(t / ns, _over(e, error)) for t, e in others])
    means = np.exp(np.log(np.maximum(ratios, 1e-3)).mean(axis=0))
    print(f"{'geometric mean':32}" + "".join(f"{t:12.3f}{e:12.2f}" for t, e in means))


def _over(error: float, before: float) -> float:
    """Return an error in parts of the one before; less than half a unit is none."""
    return max(error, 0.5) / max(before, 0.5)


def measure(name: str, turns: int) -> list[tuple[float, float]] | None:
    """Return for each way the nanoseconds of a call, and the error in units of the last digit; None of large models."""
    system = symgen.load(name)
    if system.operations["rhs"] > _MOST_OPERATIONS:
        return None
    solution = system.run(_SPAN, fps=(_STATES - 1) / _SPAN, split=False)
    source, p = system._kernel_source("rhs"), system.precomputed(solution.p)
    ir = source.lower_standalone("f")[0]
    codes = [_compiled(ir, flags) for flags in _FLAGS.values()]
    symbol = "f_precomputed" if "@f_precomputed(" in ir else "f"
    t, states = solution.t, solution.states
    exact = [_exactly(system, source, float(t[k]), states[k], solution.p) for k in range(len(t))]
    found = []
    for code in codes:
        worst = 0.0
        for k in range(len(t)):
            out = np.zeros(source.lengths.out)
            call_kernel(code.address("f"), float(t[k]), states[k].copy(), solution.p, out)
            worst = max(worst, _units(system, out, exact[k]))
        found.append(worst)
    arguments = float(t[-1]), states[-1].copy(), p, np.zeros(source.lengths.out)
    addresses = [code.address(symbol) for code in codes]
    n, least = 64, np.full(len(codes), np.inf)
    while _seconds(addresses[0], arguments, n) < _SECONDS:
        n *= 2
    for _ in range(turns):
        for k, address in enumerate(addresses):
            least[k] = min(least[k], _seconds(address, arguments, n) / n)
    return list(zip(1e9 * least, found, strict=True))


def _seconds(address: int, arguments: tuple, n: int) -> float:
    began = time.thread_time()
    repeat(address, *arguments, n)
    return time.thread_time() - began


def _compiled(ir: str, flags: str) -> engine.MachineCode:
    """Return a kernel with flags at its sums and products."""
    if flags:
        ir = re.sub(r"= (fadd|fsub|fmul|fneg) double", rf"= \1 {flags} double", ir)
    code = engine.MachineCode()
    code.add(compiler.compile_ir(ir), "f")
    return code


def _exactly(system: System, source: object, t: float, y: np.ndarray, p: np.ndarray) -> list:
    """Return what the text of `rhs` says with fifty digits."""
    code = source.code
    with mpmath.workdps(_DIGITS):
        names = {"__builtins__": {}, "range": range, **code.tables, **_EXACT}
        before = set(names)
        exec(compile(code.text, code.file, "exec"), names)
        (function,) = set(names) - before
        out = [mpmath.mpf(0)] * source.lengths.out
        names[function](mpmath.mpf(t), [mpmath.mpf(x) for x in y], [mpmath.mpf(x) for x in p], out)
    return out


def _units(system: System, out: np.ndarray, exact: list) -> float:
    """Return the largest error of accelerations, in units of the last digit of the largest of them."""
    own = range(system.nq, system.nq + system.nv)
    size = max((abs(float(exact[k])) for k in own), default=0.0)
    if not size > 0.0:
        return 0.0
    with mpmath.workdps(_DIGITS):
        return max(float(abs(exact[k] - mpmath.mpf(float(out[k])))) for k in own) / math.ulp(size)


if __name__ == "__main__":
    main()
