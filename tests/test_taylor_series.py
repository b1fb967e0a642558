"""Taylor coefficients from the text of functions: every function's series, both emitters, derivatives recognised."""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest

from symgen import Model
from symgen import load as load_model
from symgen.runtime import load
from symgen.runtime.code import compiler, engine
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.ensemble.arrays import aligned
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.taylor import code as coding
from symgen.runtime.taylor import inverse, loops
from symgen.runtime.taylor.code import DECLARATIONS, Registers, sincos_function
from symgen.runtime.taylor.kernel import MAX_ORDER, sum_kernel
from symgen.runtime.taylor.loops import rolled_kernel, unrolled_kernel
from symgen.runtime.taylor.motion import read_motion
from symgen.runtime.taylor.plan import Plan

ROOT = Path(__file__).resolve().parents[1]
OSCILLATOR = (ROOT / "tests" / "fixtures" / "oscillator.py").read_text(encoding="utf-8")
EMITTERS = {"unrolled": unrolled_kernel, "rolled": rolled_kernel}
ORDER, N_ROWS = 16, 30
# Vectors are no arguments that Python passes.
AT_ZERO = """
define void @at_zero(double %t, ptr %y, ptr %p, ptr %out) {
call void @lanes(<8 x double> zeroinitializer, ptr %y, ptr %p, ptr %out)
ret void
}
"""
FORCE = "p[3] * sin(p[4] * t) + p[8] - p[1] * y[1] - p[2] * y[0]"
RATE = "(w0 - p[2] * y[0]) / p[0]"

FUNCTIONS = {
    "sin(t + 1.0)*cos(3.0*t)": lambda t: mpmath.sin(t + 1) * mpmath.cos(3 * t),
    "tan(0.3*t)": lambda t: mpmath.tan(mpmath.mpf("0.3") * t),
    "atan2(t, 1.0 + t*t)": lambda t: mpmath.atan2(t, 1 + t * t),
    "exp(-(t*t))": lambda t: mpmath.exp(-t * t),
    "log(2.0 + sin(t))": lambda t: mpmath.log(2 + mpmath.sin(t)),
    "sqrt(1.0 + t*t)": lambda t: mpmath.sqrt(1 + t * t),
    "pow(t, 3.0) - pow(2.0 + t, -2.0)": lambda t: t**3 - (2 + t) ** -2,
    "pow(1.0 + t, 1.7)": lambda t: (1 + t) ** 1.7,
    "pow(1.5, t) + pow(1.0 + t, t)": lambda t: 1.5**t + (1 + t) ** t,
    "2.0/sqrt(1.0 + t*t)*(0.5/sqrt(1.0 + t*t)/sqrt(1.0 + t*t))": lambda t: (1 + t * t) ** mpmath.mpf("-1.5"),
    "(1.0 + t*t)/sqrt(2.0 + t)*(0.5/sqrt(2.0 + t))": lambda t: (1 + t * t) / (4 + 2 * t),
    "(sqrt(2.0 + t) - 3.0)*(t/sqrt(2.0 + t))": lambda t: t - 3 * t / mpmath.sqrt(2 + t),
    "pow(pow(t - 2.0, 2.0), 0.5) + pow(t - 2.0, -3.0)": lambda t: abs(t - 2) + (t - 2) ** -3,
    "1.0/(1.0 + t*t) - t/3.0": lambda t: 1 / (1 + t * t) - t / 3,
}


def with_force(expression: str):
    """A unit mass that moves by x'' = expression of t."""
    text = OSCILLATOR.replace(FORCE, expression).replace(RATE, expression)
    assert text != OSCILLATOR
    return load(text.replace("p[3] * sin(p[4] * t) + p[8] - p[1] * y[1]", f"({expression})"))


def kernel(ir: str, symbol: str):
    """A compiled kernel of arrays; it keeps its own code."""
    code = engine.MachineCode()
    address = code.add(compiler.compile_ir(ir), symbol)
    prototype = ctypes.CFUNCTYPE(
        None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, use_errno=False
    )
    function = prototype(address)

    def call(t, y, p, out, _owner=code):
        function(t, y.ctypes.data, p.ctypes.data, out.ctypes.data)

    return call


def coefficients(system, t, y, emitter, order=ORDER):
    """The rows of q, v, w at (t, y), and the pivot ratio."""
    ir, _ = EMITTERS[emitter](Plan(read_motion(system)), "taylor", system.ny, order, N_ROWS)
    out = np.full(N_ROWS * system.ny + 1, np.nan)
    out[0] = order
    kernel(ir, "taylor")(t, y, system.parameter_values(), out)
    return out[:-1].reshape(N_ROWS, system.ny), out[-1]


def start(system):
    consistent = assemble(system, system.parameter_values(), None, None, 0.0)
    return np.concatenate([consistent.q, consistent.v, np.zeros(system.nw)])


def as_lanes(rows):
    """An array of members side by side, where vectors are loaded from."""
    placed = aligned(rows.size)
    placed[:] = rows.ravel()
    return placed


@pytest.mark.parametrize("emitter", EMITTERS)
@pytest.mark.parametrize("expression", FUNCTIONS)
def test_series_of_functions(expression, emitter):
    system, t0 = with_force(expression), 0.7
    rows, _ = coefficients(system, t0, np.array([0.2, 0.3, 0.0]), emitter)
    with mpmath.workdps(40):
        exact = mpmath.taylor(FUNCTIONS[expression], mpmath.mpf(t0), ORDER - 2)
    expected = np.array([float(c) / (k + 1) for k, c in enumerate(exact)])
    scale = np.maximum.accumulate(np.abs(expected)[::-1])[
        ::-1
    ]  # what cancels in a coefficient shows in its neighbours
    assert (
        np.max(np.abs(rows[1:ORDER, 1] - expected) / np.maximum(scale, 1e-3 * np.abs(expected).max())) < 1e-12
    )
    np.testing.assert_allclose(rows[2 : ORDER + 1, 0] * np.arange(2, ORDER + 1), rows[1:ORDER, 1], rtol=1e-15)


@pytest.mark.parametrize("emitter", EMITTERS)
@pytest.mark.parametrize(
    "name",
    [
        "pendulum",
        "double_pendulum",
        "cart_pole",
        "spinning_top",
        "slider_crank",
        "rolling_disc",
        "free_rigid_body",
        "outer_solar_system",
        "stiff_spring_pendulum",
        "pendulum_field",
        "quarter_car",
    ],
)
def test_series_solve_the_equations(name, emitter):
    """At a distance where 25 terms are exact to round-off, the series has the slope that `rhs` computes."""
    system = load(ROOT / "generated" / f"{name}.py")
    y, t0, order = start(system), 0.3, 25
    y[: system.nq + system.nv] += 0.0 if system.m or system.nq > system.nv else 0.1
    rows, pivot = coefficients(system, t0, y, emitter, order)
    assert 0.01 < pivot <= 1.0
    n, terms = system.nq + system.nv, np.arange(order)
    sizes = np.abs(rows[order - 6 : order, system.nq : n]).max(axis=1) + 1e-300
    h = 0.2 * np.min(sizes ** (-1.0 / np.arange(order - 6, order)))
    state = np.array([np.polyval(rows[order - 1 :: -1, i], h) for i in range(n)])
    slope = np.array([np.polyval((terms[:, None] * rows[:order])[:0:-1, i], h) for i in range(system.ny)])
    expected = system.kernel("rhs")(t0 + h, state, system.parameter_values())[: system.ny]
    np.testing.assert_allclose(slope, expected, rtol=1e-11, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["four_bar", "pendulum_dae", "cart_pole"])
def test_emitters_agree(name):
    system = load(ROOT / "generated" / f"{name}.py")
    y = start(system)
    (one, ratio), (other, same) = (coefficients(system, 0.0, y, emitter) for emitter in EMITTERS)
    sizes = np.maximum(np.abs(one[: ORDER - 1]).max(axis=1, keepdims=True), 1e-200)
    assert np.max(np.abs(one - other)[: ORDER - 1] / sizes) < 1e-12
    assert ratio == pytest.approx(same, rel=1e-12)


@pytest.mark.parametrize(
    "name",
    ["stiff_spring_pendulum", "free_rigid_body", "damped_spring_pendulum", "cart_pole"],
)
def test_orders_written_out_have_the_bits_of_the_loop(name, monkeypatch):
    system = load(ROOT / "generated" / f"{name}.py")
    kernels, texts, most_written, most_inlined = [], [], loops._MOST_WRITTEN_OUT, coding._SHORT
    for most in (0, most_written):
        monkeypatch.setattr(loops, "_MOST_WRITTEN_OUT", most)
        for short in (0, most_inlined):  # the loop in pieces that call each other, and as one function
            monkeypatch.setattr(coding, "_SHORT", short)
            ir, _ = rolled_kernel(Plan(read_motion(system)), "taylor", system.ny, MAX_ORDER, N_ROWS)
            texts.append(ir)
            kernels.append(kernel(ir, "taylor"))
    assert ["alwaysinline" in text for text in texts] == [False, True, False, True]
    assert ["taylor.few(" in text for text in texts] == [False, False, False, True]
    costs = {text[text.index("taylor.costs") :].partition("\n")[0] for text in texts}
    assert len(costs) == 1  # the order follows from them
    random = np.random.default_rng(1)
    for order in range(8, MAX_ORDER + 1):
        y = random.uniform(-1.5, 1.5, system.ny)
        p = random.uniform(0.5, 1.5, system.n_p)
        rows = np.zeros((len(kernels), N_ROWS * system.ny + 1))
        rows[:, 0] = order
        for call, out in zip(kernels, rows, strict=True):
            call(0.3, y, p, out)
        for out in rows[1:]:
            np.testing.assert_array_equal(out.view(np.int64), rows[0].view(np.int64))


@pytest.mark.parametrize(
    "name, options", [("n_pendulum", {"N": "9", "rods": "false"}), ("andrews_squeezer", {})]
)
def test_the_inverse_of_a_long_chain_solves_as_its_operations_do(name, options, monkeypatch):
    system = load_model(name, **options)
    kernels = []
    for largest in (inverse._LARGEST, 0):
        monkeypatch.setattr(inverse, "_LARGEST", largest)
        ir, _ = rolled_kernel(Plan(read_motion(system)), "taylor", system.ny, MAX_ORDER, N_ROWS)
        assert ("@taylor.product(" in ir) == (largest > 0)
        kernels.append(kernel(ir, "taylor"))
    p = system.parameter_values()
    start = assemble(system, p, {}, {}, 0.0)
    y = np.concatenate([start.q, start.v, np.zeros(system.ny - system.nq - system.nv)])
    rows = np.zeros((2, N_ROWS * system.ny + 1))
    rows[:, 0] = ORDER
    p = system.precomputed(p) if system.n_precomputed else p
    for call, out in zip(kernels, rows, strict=True):
        call(0.1, y, p, out)
    found, expected = rows[:, : ORDER * system.ny].reshape(2, ORDER, system.ny)
    sizes = np.abs(expected).max(axis=1, keepdims=True)
    assert np.all(sizes > 0.0)
    np.testing.assert_allclose(found / sizes, expected / sizes, rtol=0, atol=1e-11)


def test_short_solutions_have_no_inverse():
    system = load(ROOT / "generated" / "heavy_top_absolute.py")
    ir, _ = rolled_kernel(Plan(read_motion(system)), "taylor", system.ny, MAX_ORDER, N_ROWS)
    assert "@taylor.product(" not in ir


def test_terms_of_a_sum_wait_for_half_of_the_others_at_most():
    system = load(ROOT / "generated" / "pendulum.py")
    ir, _ = unrolled_kernel(Plan(read_motion(system)), "taylor", system.ny, MAX_ORDER, N_ROWS)
    waits: dict[str, int] = {}
    for line in ir.splitlines():
        if "call <2 x double> @llvm.fmuladd" in line:
            name, _, right = line.partition(" = ")
            waits[name] = 1 + waits.get(right.rpartition(" ")[2].rstrip(")"), 0)
    assert MAX_ORDER // 4 < max(waits.values()) <= MAX_ORDER // 2


def test_a_product_of_another_piece_is_rounded_before_it_is_added():
    code = coding.Code("parts")
    code.begin_piece()
    product = code.mul(code.load("y", 0), code.load("y", 1))
    code.begin_piece()
    code.store("out", 0, code.add(product, code.load("y", 2)))
    calls = [f"call void @{piece.name}({coding.PASSED}, i64 0)" for piece in code.pieces]
    call, out = kernel(code.text("\n".join([*calls, "ret void"]), (0.0, 0.0, 0.0)), "parts"), np.zeros(1)
    call(0.0, np.array([1.0 + 2.0**-30, 1.0 + 2.0**-30, -1.0 - 2.0**-29]), np.zeros(1), out)
    assert out[0] == 0.0  # 2^-60 in one operation


def test_gravity_between_two_bodies_needs_seven_products():
    """Three squares, one power of their sum, and its products with three differences, for each of fifteen pairs."""
    assert read_motion(load(ROOT / "generated" / "outer_solar_system.py")).n_convolutions == 15 * 7


@pytest.mark.parametrize("name, products", [("double_pendulum", 8), ("n_pendulum", 20), ("pendulum_dae", 4)])
def test_accelerations_are_recognised_as_derivatives(name, products):
    """Chains need a sine, a cosine and two products for each link: their accelerations are derivatives of these."""
    assert read_motion(load(ROOT / "generated" / f"{name}.py")).n_convolutions == products


def test_what_is_nearly_a_derivative_is_not_taken_for_one():
    name = ROOT / "generated" / "double_pendulum.py"
    text = name.read_text(encoding="utf-8")
    head, residual = text.split("def residual(")
    body, rest = residual.split("def residual_jacobian(")
    changed = body.replace(" - v_theta1*(v_theta1", " - 1.0000000001*v_theta1*(v_theta1")
    assert changed != body
    system = load("def residual(".join([head, "def residual_jacobian(".join([changed, rest])]))
    assert read_motion(system).n_convolutions > 8


def sine_and_cosine():
    """The compiled function: (angle, -, -, pair)."""
    call = "define void @f(double %t, ptr %y, ptr %p, ptr %out) {\ncall void @pair(double %t, ptr %out)\nret void\n}\n"
    return kernel("\n".join([*DECLARATIONS, sincos_function("pair"), call]), "f")


@pytest.mark.parametrize("low, high", [(0.3, 0.4), (0.79, 0.9), (0.9, 1.0), (2.0, 2.4)])
def test_errors_of_sines_and_cosines_have_no_mean(low, high):
    """A mean error adds up in a long run, where rounding does not. Rounding has a deviation of 3.2e-17 at most."""
    function, n = sine_and_cosine(), 5000
    angles = np.random.default_rng(1).uniform(low, high, n)
    pair, empty, total = np.zeros(2), np.zeros(1), [mpmath.mpf(0), mpmath.mpf(0)]
    with mpmath.workdps(30):
        for angle in angles:
            function(angle, empty, empty, pair)
            total[0] += mpmath.mpf(pair[0]) - mpmath.sin(angle)
            total[1] += mpmath.mpf(pair[1]) - mpmath.cos(angle)
    assert abs(total[0]) / n < 4 * 3.2e-17 / np.sqrt(n) and abs(total[1]) / n < 4 * 3.2e-17 / np.sqrt(n)


def test_sines_and_cosines():
    """Below one unit in the last place; near zeros, below what the angle itself is known to by far."""
    function = sine_and_cosine()
    rng = np.random.default_rng(0)
    angles = [
        0.0,
        -1e-9,
        *rng.uniform(-4.0, 4.0, 400),
        *rng.uniform(-1e4, 1e4, 200),
        *rng.uniform(-2e9, 2e9, 50),
    ]
    angles += [k * np.pi / 2 * (1.0 + 1e-15 * s) for k in range(-40, 41) for s in (-1, 0, 1)]
    pair, empty = np.zeros(2), np.zeros(1)
    with mpmath.workdps(40):
        for angle in angles:
            function(angle, empty, empty, pair)
            for value, exact in zip(pair, (mpmath.sin(angle), mpmath.cos(angle)), strict=True):
                assert abs(value - exact) <= max(np.spacing(abs(float(exact))), 1e-32 * abs(angle))


def test_sines_and_cosines_of_large_angles():
    """Up to the largest number; the third angle is the one nearest to a multiple of pi/2 of all (Muller 1997)."""
    function, rng = sine_and_cosine(), np.random.default_rng(0)
    angles = [np.nextafter(1e9, 2e9), sys.float_info.max, 6381956970095103 * 2.0**797, 2.0**30, 2.0**53 + 2]
    angles += [*(10.0 ** rng.uniform(9.001, 308.0, 400) * rng.choice([-1, 1], 400))]
    angles += [float(mpmath.mpf(int(k)) * mpmath.pi / 2) for k in rng.integers(10**9, 10**15, 100)]
    pair, empty = np.zeros(2), np.zeros(1)
    with mpmath.workdps(400):
        for angle in angles:
            function(angle, empty, empty, pair)
            for value, exact in zip(pair, (mpmath.sin(angle), mpmath.cos(angle)), strict=True):
                assert abs(value - exact) <= np.spacing(abs(float(exact)))
    for angle in (np.inf, -np.inf, np.nan):
        function(angle, empty, empty, pair)
        assert np.isnan(pair).all()


@pytest.mark.parametrize("order", [6, 9, 16])
@pytest.mark.parametrize("n_y", [1, 2, 3, 7, 12, 13])
def test_sums(order, n_y):
    rng = np.random.default_rng(n_y)
    series, carry, h = rng.standard_normal((order + 2, n_y)), 1e-17 * rng.standard_normal(n_y), 0.37
    series[order + 1] = 0.0
    out = np.zeros(3 * n_y)
    out[0] = order
    kernel(sum_kernel("total", n_y), "total")(h, series.ravel(), carry, out)
    total, lost, slope = out.reshape(3, n_y)
    with mpmath.workdps(40):
        for i in range(n_y):
            terms = [mpmath.mpf(c) * mpmath.mpf(h) ** k for k, c in enumerate(series[:, i])]
            exact = mpmath.fsum(terms) + mpmath.mpf(carry[i])
            size = float(max(abs(term) for term in terms[1:]))
            assert abs(mpmath.mpf(total[i]) + mpmath.mpf(lost[i]) - exact) < 4e-16 * order * size
            assert abs(lost[i]) <= np.spacing(abs(total[i]))
    exact = sum(k * series[k] * h ** (k - 1) for k in range(1, order + 1))
    np.testing.assert_allclose(slope, exact, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(
    "expression, cause",
    [("fabs(t)", "fabs"), ("copysign(1.0, t)", "copysign"), ("(1.0 if t < 2.0 else 3.0)", "choice")],
)
def test_what_has_no_series_is_refused_by_name(expression, cause):
    system = with_force(expression)
    with pytest.raises(RuntimeModelError, match=f"(?s)oscillator.*{cause}.*dop853"):
        system.run(t_end=1.0, method="taylor")


def test_choices_of_parameters_alone_are_served():
    system = with_force("(2.0 if p[0] < 3.0 else 4.0) * t")
    rows, _ = coefficients(system, 0.0, np.zeros(3), "unrolled")
    np.testing.assert_array_equal(rows[1:5, 1], [0.0, 1.0, 0.0, 0.0])


def test_round_off_is_not_taken_for_one():
    """A free body whose products of inertia leave 2^-61: modulo the Mersenne prime 2^61 - 1 that was the number 1."""
    m = Model("free")
    inertia = [
        0.44217187500000005,
        0.595171875,
        0.702875,
        0.0170625,
        -0.019468750000000003,
        0.0015312499999999998,
    ]
    m.body(
        "bus",
        mass=6.4,
        com=[0.021875000000000002, 0.021874999999999995, 0.010937499999999998],
        inertia=inertia,
    )
    m.joint("f", "free", "bus", rate=[0, 0, 0, 0.3, 1, -0.4])
    system = m.derive()
    ends = [
        system.run(t_end=0.5, method=method, rtol=1e-10, atol=1e-12).states[-1]
        for method in ("taylor", "dop853")
    ]
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


@pytest.mark.parametrize("length", [2, 4])
@pytest.mark.parametrize("name", ["double_pendulum", "outer_solar_system"])
def test_registers_do_not_change_members(name, length):
    """What registers hold decides how fast members are, not what they come to."""
    system, lanes = load((ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8")), 8
    random = np.random.default_rng(1)
    y = start(system)[:, None] + random.uniform(-1e-3, 1e-3, (system.ny, lanes))
    p = np.repeat(system.parameter_values()[:, None], lanes, axis=1)
    found = []
    for registers in (None, Registers(length, 16)):
        ir, _ = rolled_kernel(
            Plan(read_motion(system)), "lanes", system.ny, MAX_ORDER, N_ROWS, lanes, registers
        )
        found.append(aligned((N_ROWS * system.ny + 1) * lanes))
        found[-1][0] = ORDER
        kernel(ir + AT_ZERO, "at_zero")(0.0, as_lanes(y), as_lanes(p), found[-1])
    np.testing.assert_array_equal(*found)
    rows = found[0][: (ORDER + 1) * system.ny * lanes].reshape(-1, lanes)
    assert np.ptp(rows[-system.ny :], axis=1).max() > 0.0
