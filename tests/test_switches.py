"""`where`, `floor` and `heaviside` of time and of the state: runs against closed forms, in every adaptive method."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

import symgen
from symgen import Model, runtime
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.model.expressions import parse
from symgen.runtime import solve
from symgen.runtime.integrate.methods import METHODS
from tests.stress.broken_forces import broken
from tests.stress.jumping_forces import KINDS, try_many
from tests.stress.scenario import FLAGGED, REFUSED, RIGHT

ADAPTIVE = [name for name, method in METHODS.items() if method.adaptive]


@dataclass(frozen=True)
class Case:
    """A unit mass on a line: its force, start and rate, its motion; whether the state switches."""

    force: str
    start: float
    rate: float
    exact: Callable[[np.ndarray], np.ndarray]


def staircase(t: np.ndarray) -> np.ndarray:
    """x'' = floor(t)."""
    return sum(np.maximum(t - k, 0.0) ** 2 / 2 for k in range(1, 9))


def two_springs(t: np.ndarray) -> np.ndarray:
    """x'' = -x where x > 0, -4 x elsewhere, from 1 at rest."""
    s = np.mod(t, 1.5 * np.pi)
    return np.where(s < np.pi / 2, np.cos(s), np.where(s < np.pi, 0.5 * np.sin(2 * s), -np.sin(np.pi - s)))


def loaded_spring(t: np.ndarray) -> np.ndarray:
    """x'' = -x + 2 heaviside(t - 1.3)."""
    return np.cos(t) + np.where(t > 1.3, 2 * (1 - np.cos(t - 1.3)), 0.0)


def weighed(t: np.ndarray) -> np.ndarray:
    """x'' = -9.81 until 1 and from 2.5 on, from 0 with rate 10."""
    s = np.clip(t - 1, 0, 1.5)
    u = np.maximum(t - 2.5, 0)
    first = np.minimum(t, 1)
    at_one, rate = 10 - 9.81 / 2, 10 - 9.81
    return np.where(t <= 1, 10 * first - 9.81 * first**2 / 2, at_one + rate * (s + u) - 9.81 * u**2 / 2)


def bang_bang(t: np.ndarray) -> np.ndarray:
    """x'' = -sign(x) from 1 at rest."""
    quarter = np.sqrt(2.0)
    s = np.mod(t, 4 * quarter)
    far = -1 + (s - 2 * quarter) ** 2 / 2
    return np.where(np.abs(s - 2 * quarter) < quarter, far, 1 - np.minimum(s, 4 * quarter - s) ** 2 / 2)


def stairs_down(t: np.ndarray) -> np.ndarray:
    """x'' = floor(x) from 1.5 at rest: constant accelerations 1, 2, 3 between whole numbers."""
    result, x, v, begin = np.array(t, dtype=float), 1.5, 0.0, 0.0
    for n in range(1, 60):
        a, way = float(n), n + 1 - x
        last = (np.sqrt(v * v + 2 * a * way) - v) / a
        inside = (t >= begin) & (t <= begin + last)
        result[inside] = x + v * (t[inside] - begin) + a * (t[inside] - begin) ** 2 / 2
        x, v, begin = n + 1.0, v + a * last, begin + last
    return result


def saw(t: np.ndarray) -> np.ndarray:
    """x'' = mod(t, 1.5)."""
    return t**3 / 6 - sum(1.5 * np.maximum(t - 1.5 * k, 0.0) ** 2 / 2 for k in range(1, 6))


def ramp(t: np.ndarray) -> np.ndarray:
    """x'' = smoothstep(1, 2, t)."""
    s, after = np.clip(t - 1, 0, 1), np.maximum(t - 2, 0)
    return s**4 / 4 - s**5 / 10 + after / 2 + after**2 / 2


CASES = {
    "mod of time": Case("mod(t, 1.5)", 0.0, 0.0, saw),
    "smoothstep of time": Case("smoothstep(1, 2, t)", 0.0, 0.0, ramp),
    "floor of time": Case("floor(t)", 0.0, 0.0, staircase),
    "heaviside of time": Case("-x + 2*heaviside(t - 1.3)", 1.0, 0.0, loaded_spring),
    "where of time": Case("where(t < 1 or t >= 2.5, -9.81, 0)", 0.0, 10.0, weighed),
    "where of the state": Case("where(x < 0, -4*x, -x)", 1.0, 0.0, two_springs),
    "heaviside of the state": Case("1 - 2*heaviside(x)", 1.0, 0.0, bang_bang),
    "floor of the state": Case("floor(x)", 1.5, 0.0, stairs_down),
}  # fmt: skip


def mass(force: str | sympy.Expr, start: float = 1.0, rate: float = 0.0) -> Model:
    m = Model("mass")
    x = m.coordinate("x", start=start, rate=rate)
    m.body("b", mass=1.0, com=(x, 0))
    m.force(x, force)
    return m


@functools.cache
def system(name: str) -> runtime.System:
    case = CASES[name]
    return runtime.load(derive_text(mass(case.force, case.start, case.rate)).text)


@pytest.mark.parametrize("method", ADAPTIVE)
@pytest.mark.parametrize("name", CASES)
def test_adaptive_methods_land_on_every_switch(name, method):
    """At a loose tolerance, parabolas are exact: no step goes over a switch."""
    case = CASES[name]
    t_end = 3.2 if name == "floor of the state" else 8.5
    run = solve(system(name), t_end, method=method, rtol=1e-8)
    assert run.ok, run.message
    far = 1e-5 if method == "bdf" else 1e-7
    np.testing.assert_allclose(run["x"], case.exact(run.t), atol=far * np.ptp(run["x"]))


@pytest.mark.parametrize("method", ["dop853", "radau5", "dopri5"])
@pytest.mark.parametrize(
    "name", ["floor of time", "where of time", "heaviside of the state", "floor of the state"]
)
def test_a_loose_tolerance_does_not_blur_parabolas(name, method):
    # A floor is held for four steps of it, so that one step of the method must not pass more.
    run = solve(system(name), 3.2, method=method, rtol=3e-4 if name == "floor of the state" else 1e-3)
    assert run.ok
    np.testing.assert_allclose(run["x"], CASES[name].exact(run.t), atol=1e-10)


@pytest.mark.parametrize("method", ["rk4", "verlet", "gauss4"])
@pytest.mark.parametrize("name", ["floor of time", "heaviside of time", "where of time"])
def test_fixed_steps_are_cut_short_at_switches_of_time(name, method):
    run = solve(system(name), 8.5, method=method, step=0.01)
    far = 1e-4 if method == "verlet" else 1e-7
    np.testing.assert_allclose(run["x"], CASES[name].exact(run.t), atol=far * np.ptp(run["x"]))


def test_fixed_steps_run_over_switches_of_the_state():
    run = solve(system("where of the state"), 8.5, method="rk4", step=1e-3)
    np.testing.assert_allclose(run["x"], two_springs(run.t), atol=1e-4)


@pytest.mark.parametrize(
    "name", [k for k, kind in KINDS.items() if any(f in kind.force for f in ("where", "floor", "heav"))]
)
@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_many_switches_against_closed_forms(name, method):
    counts = try_many(name, method, 2, seed=11)
    assert counts[RIGHT] >= 5 and counts[RIGHT] + counts[FLAGGED] == 6


@pytest.mark.parametrize("name", ["condition without value", "chosen without value", "floor without value"])
@pytest.mark.parametrize("method", ["auto", "rk4", "radau5"])
def test_conditions_without_value_are_no_result(name, method):
    assert broken(name, method).verdict in (FLAGGED, REFUSED)


def test_gravity_that_switches_with_height():
    """A potential of two slopes, as Piecewise: periods of the two parabolas."""
    m = Model("thrown")
    y = m.coordinate("y", start=0.0, rate=6.0)
    m.body("ball", mass=2.0, com=(0, y))
    m.potential(sympy.Piecewise((2 * 3 * y, y < 1), (2 * (3 + 12 * (y - 1)), True)))
    run = m.derive().run(t_end=2.0, method="dop853", rtol=1e-9)
    assert run.ok and run.health
    rise = (6 - np.sqrt(36 - 6)) / 3  # to y = 1 under 3 m/s^2, then 12 m/s^2
    rate = np.sqrt(30.0)
    turn = rise + rate / 12
    late = np.abs(run.t - turn)
    below = turn - rise
    x = np.where(
        late < below, 1 + rate**2 / 24 - 6 * late**2, 1 - rate * (late - below) - 1.5 * (late - below) ** 2
    )
    np.testing.assert_allclose(run["y"], x, atol=1e-9)


def test_what_is_not_chosen_does_not_spoil_a_run():
    """A Hertz contact, whose force is a root of a negative number off the ground; a flow through an orifice."""
    contact = mass("where(x < 0, 1000*(-x)^1.5, 0) - 9.81")
    for method in ("dop853", "radau5", "bdf"):
        run = contact.derive().run(t_end=2.0, method=method, rtol=1e-8)
        assert run.ok, run.message
        x, v = run.q[:, 0], run.v[:, 0]
        energy = v**2 / 2 + 9.81 * x + 400 * np.maximum(-x, 0) ** 2.5
        np.testing.assert_allclose(energy, 9.81, atol=1e-4)
        orifice = mass("-sign(x)*sqrt(abs(x))").derive().run(t_end=10.0, method=method, rtol=1e-8)
        assert orifice.ok, orifice.message
        np.testing.assert_allclose(
            orifice.v[:, 0] ** 2 / 2 + np.abs(orifice["x"]) ** 1.5 / 1.5, 1 / 1.5, atol=1e-4
        )


def test_a_distance_is_no_root_of_a_negative_number():
    """A rope in the plane, slack below its length: its condition is held, so that a loose run is as sharp."""
    m = Model("rope")
    x, y = m.coordinate("x", start=0.5), m.coordinate("y", rate=1.0)
    m.body("b", mass=1.0, com=(x, y))
    m.definition("r", "sqrt(x^2 + y^2)")
    m.force(x, "where(r > 1, -50*(r - 1)*x/r, 0)")
    m.force(y, "where(r > 1, -50*(r - 1)*y/r, 0)")
    text = derive_text(m).text
    assert "1e+300" in text
    loose, sharp = (
        solve(runtime.load(text), 5.0, method="dop853", rtol=rtol, atol=rtol * 1e-2) for rtol in (1e-6, 1e-11)
    )
    np.testing.assert_allclose(loose["x"][-1], sharp["x"][-1], atol=1e-4)


def test_motion_along_a_switch_is_refused_by_name():
    run = mass("where(dot(x) > 0, -1, 1) - 0.3", rate=1.0).derive().run(t_end=5.0, method="dop853")
    assert run.status == "failed" and "from both sides" in run.message
    assert "0 < dot(x) in the force on x" in run.message


def cell_by_cell(width, forces, t_end):
    """x'' = forces[k modulo their number] - 2 x while x is in cell k of a width, from x = 0.05 with a rate of 1."""
    t, y, k = 0.0, [0.05, 1.0], 0
    while True:
        ends = [lambda t, y, at=(k + side) * width: y[0] - at for side in (0, 1)]
        ends[0].direction, ends[1].direction = -1, 1
        ends[0].terminal = ends[1].terminal = True
        force = forces[k % len(forces)]
        run = solve_ivp(
            lambda t, y, f=force: [y[1], f - 2 * y[0]],
            (t, t_end),
            y,
            "DOP853",
            events=ends,
            rtol=1e-12,
            atol=1e-14,
        )
        t, y = run.t[-1], run.y[:, -1]
        if run.status == 0:
            return y
        k += 1 if len(run.t_events[1]) else -1


@pytest.mark.parametrize("method", [*ADAPTIVE])
@pytest.mark.parametrize(
    ("force", "width", "forces"),
    [
        ("where(mod(x, b) < b/2, 1, -1)", 0.15, (1.0, -1.0)),
        ("where(mod(x, b) < b/3, 2, where(mod(x, b) < 2*b/3, -1, 0.5))", 0.1, (2.0, -1.0, 0.5)),
        ("2*floor(2*mod(x, b)/b) - 1", 0.15, (-1.0, 1.0)),
        ("where(x - b*floor(x/b) < b/2, sign(b/4 - mod(x, b)), 0.5)", 0.075, (1.0, -1.0, 0.5, 0.5)),
    ],
)
def test_a_choice_is_made_anew_where_what_it_compares_jumps(force, width, forces, method):
    """A sawtooth of the way: a choice jumps past zero as another one goes over, at no crossing of its own."""
    system = Model.from_toml(
        f"""
        [parameters]
        b = 0.3
        [coordinates]
        x = {{ start = 0.05, rate = 1 }}
        [bodies.block]
        mass = 1
        com = ["x", 0]
        [forces]
        x = "{force} - 2*x"
        """
    ).derive()
    run = system.run(t_end=2.5, rtol=1e-9, atol=1e-11, method=method)
    assert run.status == "success" and run.ok
    assert [run["x"][-1], run["dot(x)"][-1]] == pytest.approx(cell_by_cell(width, forces, 2.5), abs=1e-5)


def test_chatter_between_choices_that_are_made_of_each_other_is_refused_by_name():
    """At a rate of 1 the floor in it jumps, and with it the sign: below they push up, above they push down."""
    m = Model("chatter")
    x = m.coordinate("x", rate=0.98)
    m.body("block", mass=1, com=(x, 0))
    m.force(x, "sign(mod(dot(x), 0.5) - 0.2)")
    run = m.derive().run(t_end=1.0, method="dop853")
    assert run.status == "failed" and "from both sides at t = 0.02 s" in run.message


def test_loads_definitions_and_events_take_them():
    m = Model("wind", gravity=(0, "-9.81 m/s^2"))
    x, y = m.coordinate("x", unit="m"), m.coordinate("y", unit="m", rate=20.0)
    top = m.parameter("top", "10 m")
    m.definition("is_high", "heaviside(y - top)")
    m.body("ball", mass="1 kg", com=(x, y))
    m.load("wind", point=(x, y), force=("where(y > top and dot(y) < 0, 3, 0)", 0))
    m.output("steps", "floor(y/top) + is_high")
    assert top is not None
    run = m.derive().run(t_end=2.5, method="dop853", rtol=1e-10)
    assert run.ok
    turn = 20 / 9.81
    low = turn + np.sqrt(2 * (20**2 / (2 * 9.81) - 10) / 9.81)
    blown = np.clip(run.t - turn, 0, low - turn)
    np.testing.assert_allclose(
        run["x"], 1.5 * blown**2 + 3 * (low - turn) * np.maximum(run.t - low, 0), atol=1e-8
    )


@pytest.mark.parametrize(
    "force, message",
    [
        ("where(x < v0, k*x, 0)", "cannot be compared"),
        ("where(x < l, k*x, l)", "branches of one choice"),
        ("k*l*floor(x)", "'floor' takes a pure number"),
        ("k*mod(x, t)", "cannot be compared|'floor' takes a pure number"),
        ("k*x*smoothstep(l, t, x)", "cannot be added|units do not match"),
        ("k*mod(x, l)*smoothstep(0, l, x)*x", "units do not match"),
        ("where(x, k*x, 0)", "needs a condition here"),
        ("k*x*(x < l)", "a condition is no value"),
        ("where(x == l, k*x, 0)", "'=' has no place"),
        ("where(x < y, k*x, 0)", "'y' is not declared"),
    ],
)
def test_wrong_conditions_are_refused(force, message):
    m = Model("units")
    x = m.coordinate("x", unit="m")
    m.parameter("l", "1 m")
    m.parameter("v0", "1 m/s")
    m.parameter("k", "1 N/m")
    m.body("b", mass="1 kg", com=(x, 0))
    with pytest.raises(ModelError, match=message):
        m.force(x, force)
        derive_text(m)


def test_a_model_comes_back_from_its_file():
    m = mass("where(x < 0 and not dot(x) > 1, -floor(x), heaviside(x - 1))")
    text = m.to_toml()
    assert derive_text(Model.from_toml(text)).text == derive_text(m).text


def test_models_without_them_have_no_new_line():
    text = derive_text(mass("-x")).text
    assert '"jump"' not in text and "numpy import" not in text


def test_they_are_printed(tmp_path):
    from symgen.cli.latex import to_latex
    from symgen.cli.report_equations import to_mathml

    x = sympy.Symbol("x")
    choice = symgen.where((x < 0) | ~(x < 2), symgen.floor(x), symgen.heaviside(x))
    latex, mathml = to_latex(choice), to_mathml(choice)
    assert r"\begin{cases}" in latex and r"\lfloor" in latex and r"\theta\left(x\right)" in latex
    assert ("if " in mathml and "floor" in mathml.lower()) or "⌊" in mathml


def test_mod_and_smoothstep_of_numbers():
    values = {"mod(7.5, 2)": 1.5, "mod(-1, 3)": 2, "mod(1, -3)": -2, "smoothstep(0, 2, 0.5)": 0.15625,
              "smoothstep(0, 2, -1)": 0, "smoothstep(0, 2, 3)": 1, "smoothstep(2, 0, 0.5)": 0.84375}  # fmt: skip
    assert {text: float(parse(text).expression) for text in values} == values
    with pytest.raises(ModelError, match="'mod' has no value"):
        parse("mod(1, 0)")
    x = sympy.Symbol("x")
    assert symgen.mod(x, 2) == parse("mod(x, 2)").expression
