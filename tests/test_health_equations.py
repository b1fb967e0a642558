"""The health check `equations`: a module whose functions disagree is flagged by name; right ones never are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from symgen import Model, dot, link, runtime, sin, sqrt, t
from symgen.runtime.checks.equations import equations
from symgen.runtime.constraints.drift import constraint_drift

GENERATED = Path(__file__).parent.parent / "generated"


def forged(name, function, place, factor=1.001):
    """A bundled module with one result of one function changed."""
    lines = (GENERATED / f"{name}.py").read_text(encoding="utf-8").split("\n")
    at = lines.index(f"def {function}(t, y, p, out):")
    k = next(k for k in range(at, len(lines)) if lines[k].startswith(f"    out[{place}] = "))
    left, right = lines[k].split(" = ", 1)
    lines[k] = f"{left} = {factor}*({right})"
    return runtime.load("\n".join(lines))


def found(system, **options):
    (entry,) = equations(system.run(**{"t_end": 1.0, "method": "dop853", **options}))
    return entry


@pytest.mark.parametrize(
    ("name", "function", "place", "says"),
    [
        ("double_pendulum", "rhs", 3, ("`rhs`", "the equation of dot(theta2)")),
        ("double_pendulum", "rhs", 0, ("`rhs`", "the rate of theta1")),
        ("double_pendulum", "mass_matrix", 3, ("`mass_matrix`", "the equation of dot(theta2)")),
        ("double_pendulum", "residual", 1, ("`residual`", "the equation of dot(theta2)")),
        ("pendulum_dae", "rhs", 4, ("`rhs`", "")),
        ("free_rigid_body", "rhs", 0, ("`rhs`", "the rate of turn_qw")),
    ],
)
def test_flags_functions_that_disagree(name, function, place, says):
    entry = found(forged(name, function, place))
    assert not entry.ok and entry.value > 1e-5
    assert all(word in entry.says for word in says)


def test_flags_a_run_that_does_not_move():
    """What 100 links in relative angles did: the accelerations were never stored."""
    entry = found(forged("n_pendulum", "rhs", 7, 0.0))
    assert not entry.ok and entry.value > 0.1


def at_rest(stiffness):
    """A mass that hangs in balance on a stiff spring far from the origin: terms cancel to round-off."""
    model = Model("hanging", gravity=(0, "-9.81"))
    k, m, l = model.parameters(k=stiffness, m=1.0, l=1.0e3)
    y = model.coordinate("y", start=-1.0e3 - 9.81 / stiffness)
    model.body("mass", mass=m, com=(0, y))
    model.potential(k * (y + l) ** 2 / 2)
    return link.derive(model)


def nearly_parallel(angle):
    """A point on two wires that make a small angle: G is nearly singular, and reactions are large."""
    model = Model("wires", gravity=(0, 0, "-9.81"))
    a = model.parameter("a", angle)
    x, y, z = (model.coordinate(c, start=0.0) for c in "xyz")
    model.body("bead", mass="1 kg", com=(x, y, z))
    model.constraint("first", y + 1e-3 * x**2)
    model.constraint("second", y + sin(a) * z)
    return link.derive(model)


def light(mass):
    """Two masses, one a speck."""
    model = Model("speck")
    m = model.parameter("m", mass)
    x, y = model.coordinate("x", start=1.0), model.coordinate("y", start=2.0)
    model.kinetic(dot(x) ** 2 / 2 + m * dot(y) ** 2 / 2)
    model.potential(1e3 * (x - 1) ** 2 + m * (y - x) ** 2)
    return link.derive(model)


@pytest.mark.parametrize("model", [
    at_rest(1e2), at_rest(1e9), at_rest(1e14), nearly_parallel(1e-2), nearly_parallel(1e-6), light(1e-3), light(1e-14),
], ids=lambda s: f"{s.name} {s.parameter_values()[0]:g}")  # fmt: skip
def test_round_off_is_no_error(model):
    entry = found(model, t_end=0.1, method="rk4", step=0.01)
    assert entry.ok, entry.says


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("spinning_top", {}),
        ("heavy_top_absolute", {}),
        ("n_four_bar", {"method": "dop853"}),
        ("door_stop", {}),
        ("rough_road", {}),
        ("pendulum_field", {"method": "taylor"}),
    ],
)
def test_right_runs_pass(name, options):
    entry = found(runtime.load(GENERATED / f"{name}.py"), **options)
    assert entry.ok and entry.value < 1e-9, entry.says


def rods_given_twice():
    """A point on a rod that shakes, and one that hangs from it; the second rod is given in two ways."""
    model = Model("rods", gravity=(0, "-9.81"))
    x, y, u, w = (model.coordinate(c, guess=g) for c, g in zip("xyuw", (0.6, -0.2, 1.2, 0.3), strict=True))
    model.body("first", mass=1.0, com=(x, y))
    model.body("second", mass=0.5, com=(u, w))
    model.constraint("rod", (x - sin(3 * t) / 5) ** 2 + y**2 - 0.5)
    model.constraint("other", (u - x) ** 2 + (w - y) ** 2 - 0.6)
    model.constraint("again", sqrt((u - x) ** 2 + (w - y) ** 2) - sqrt(0.6))
    return link.derive(model)


@pytest.mark.parametrize(
    ("system", "options"),
    [
        (lambda: runtime.load(GENERATED / "bricard.py"), {"method": "rk4", "t_end": 5.0}),
        (rods_given_twice, {"method": "bs32", "rtol": 1e-4, "t_end": 2.0}),
    ],
    ids=["bricard", "rods"],
)
def test_constraints_that_depend_on_each_other_may_drift(system, options):
    """Off the constraints no accelerations fit all of them; that is no fault of the functions."""
    run = system().run(constraints="baumgarte", **options)
    (entry,) = equations(run)
    assert max(drift.relative for drift in constraint_drift(run).values()) > 1e-7
    assert entry.ok and entry.value < 1e-10, entry.says


def test_flags_functions_of_redundant_constraints_that_drift():
    entry = found(forged("bricard", "residual", 3), method="rk4", constraints="baumgarte")
    assert not entry.ok and entry.value > 1e-5


def test_costs_little():
    """In processor time, of a run of a second; health itself is worked out when it is asked for."""
    import time

    solution = runtime.load(GENERATED / "double_pendulum.py").run(t_end=1.0, method="dop853")
    list(equations(solution))
    start = time.process_time()
    for _ in range(10):
        list(equations(solution))
    assert (time.process_time() - start) / 10 < 0.01


def test_states_that_are_not_finite_are_left_to_others():
    solution = runtime.load(GENERATED / "double_pendulum.py").run(t_end=1.0, method="dop853")
    solution.q[-1] = np.nan
    (entry,) = equations(solution)
    assert entry.ok
