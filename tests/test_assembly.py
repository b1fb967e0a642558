"""Consistent initial conditions: what stays, what moves, and what is refused by name."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import sympy

from symgen import Model
from symgen.runtime import System, load
from symgen.runtime.abi import SPARSE, array_sizes
from symgen.runtime.constraints.assembly import AssemblyError, assemble
from symgen.runtime.constraints.row_weights import row_weights
from symgen.runtime.errors import UnknownNameError

FIXTURES = Path(__file__).parent / "fixtures"
SLIDER_CRANK = {
    "coordinates": {"theta": (0.5, True, "rad"), "phi": (-0.2, False, "rad"), "x": (0.4, False, "m")},
    "rates": {"theta": (20.0, True), "phi": (0.0, False), "x": (0.0, False)},
    "holonomic": {
        "pin_x_closes": "0.1*cos(theta) + 0.3*cos(phi) - x",
        "pin_y_closes": "0.1*sin(theta) + 0.3*sin(phi)",
    },
}


def _text(expression: sympy.Expr) -> str:
    # The grammar has no powers.
    return re.sub(r"(y\[\d+\])\*\*2", r"(\1*\1)", sympy.pycode(expression)).replace("math.", "")


def build(
    coordinates: dict[str, tuple[float, bool, str]],
    holonomic: dict[str, str],
    rates: dict[str, tuple[float, bool]] | None = None,
    velocity: dict[str, str] | None = None,
    mass: list[float] | None = None,
) -> System:
    """Return a system whose constraints SymPy differentiates; only what assembly calls is right.

    Velocity constraints name rates `v_<coordinate>`.
    """
    velocity, names, t = velocity or {}, list(coordinates), sympy.Symbol("t")
    q = [sympy.Symbol(name) for name in names]
    v = [sympy.Symbol(f"v_{name}") for name in names]
    local = {symbol.name: symbol for symbol in (*q, *v, t)}
    phi = [sympy.sympify(text, local) for text in holonomic.values()]
    moving = [sum(f.diff(a) * b for a, b in zip(q, v)) + f.diff(t) for f in phi]
    moving += [sympy.sympify(text, local) for text in velocity.values()]
    jacobian = [f.diff(b) for f in moving for b in v]
    n, nh, nn = len(q), len(phi), len(velocity)
    places = {symbol: sympy.Symbol(f"y[{i}]") for i, symbol in enumerate((*q, *v))}

    def function(name: str, values: list) -> str:
        if name not in SPARSE:
            values = [*values, *[0.0] * (array_sizes(header, name)[1] - len(values))]
        lines = [
            f"    out[{i}] = {_text(sympy.sympify(value).xreplace(places))}"
            for i, value in enumerate(values)
            if value != 0 or name not in SPARSE
        ]
        body = "\n".join(lines or ["    out[0] = 0.0"])
        return f'@njit(error_model="numpy")\ndef {name}(t, y, p, out):\n{body}\n'

    masses = [1.0] * n if mass is None else mass
    diagonal = [masses[i] if i == j else 0 for i in range(n) for j in range(n)]
    given = rates or {name: (0.0, False) for name in names}
    header = {
        "abi": 1, "generator": "test", "source": "", "name": "test", "description": "",
        "nq": n, "nv": n, "nh": nh, "nn": nn, "nw": 0,
        "coordinates": [
            {"name": name, "unit": unit, "value": value, "enforced": enforced}
            for name, (value, enforced, unit) in coordinates.items()
        ],
        "rates": [
            {"name": name, "unit": "", "value": value, "enforced": enforced}
            for name, (value, enforced) in given.items()
        ],
        "parameters": [], "inputs": [], "constants": [], "outputs": [], "events": [], "bodies": [],
        "constraints": [
            *({"name": name, "kind": "holonomic"} for name in holonomic),
            *({"name": name, "kind": "velocity"} for name in velocity),
        ],
        "structure": dict.fromkeys(
            "conservative time_dependent constant_mass diagonal_mass velocity_dependent separable".split(),
            True,
        ),
        "operations": {}, "run": {},
    }  # fmt: skip
    unused = ("rhs", "forces", "energy", "residual", "gamma", "project")
    m = nh + nn
    states, zeros = [0] * (2 * n), [0] * m
    # M a - f - G^T lambda, and G a - gamma, by the state, a and lambda; the reader wants M's and G's entries there.
    blocks = [[*states, *diagonal[i * n : i * n + n], *(-g for g in jacobian[i::n])] for i in range(n)]
    blocks += [[*states, *jacobian[i * n : i * n + n], *zeros] for i in range(m)]
    functions = [
        *(function(name, []) for name in unused),
        function("mass_matrix", diagonal),
        function("residual_jacobian", [value for row in blocks for value in row]),
        function("constraint_residual", [*phi, *moving]),
        function("constraint_jacobian", jacobian),
    ]
    math = "from math import cos, sin, sqrt, log\n"
    return load(f"{math}from numba import njit\n\nMODEL = {header!r}\n\n\n" + "\n\n".join(functions))


def run(system: System, start=None, rate=None, t=0.0):
    return assemble(system, system.parameter_values(), start or {}, rate or {}, t)


def test_slider_crank_closes_to_round_off():
    assembly = run(build(**SLIDER_CRANK))
    theta, phi, x = assembly.q
    omega, phi_rate, x_rate = assembly.v
    expected_phi = -np.arcsin(np.sin(0.5) / 3)
    assert (theta, omega) == (0.5, 20.0)
    assert phi == pytest.approx(expected_phi, abs=2e-15)
    assert x == pytest.approx(0.1 * np.cos(0.5) + 0.3 * np.cos(expected_phi), abs=1e-15)
    expected_rate = -0.1 * np.cos(0.5) * 20.0 / (0.3 * np.cos(expected_phi))
    assert phi_rate == pytest.approx(expected_rate, rel=1e-14)
    assert x_rate == pytest.approx(-2.0 * np.sin(0.5) - 0.3 * np.sin(expected_phi) * expected_rate, rel=1e-14)
    assert [name for name, _, _ in assembly.moved] == ["phi", "x", "dot(phi)", "dot(x)"]
    assert assembly.moved[1] == ("x", 0.4, x)
    assert (assembly.notes, assembly.redundant, assembly.rank) == ([], [], 2)


def test_overrides_are_enforced():
    system = build(**SLIDER_CRANK)
    assembly = run(system, {"theta": -0.3}, {"dot(theta)": 5.0})
    assert (assembly.q[0], assembly.v[0]) == (-0.3, 5.0)
    assert assembly.q[1] == pytest.approx(np.arcsin(np.sin(0.3) / 3), abs=2e-15)


def test_guesses_that_fit_do_not_move():
    system = load(FIXTURES / "cartesian_pendulum.py")
    assembly = run(system, {"x": 0.3})
    assert assembly.q.tolist() == [0.3, -0.4]
    assert assembly.v.tolist() == [0.0, 0.0]
    assert assembly.moved == []


@pytest.mark.parametrize("mass", [[1.0, 1.0], [4.0, 1.0], [0.0, 1.0]], ids=["equal", "weighted", "massless"])
def test_guesses_move_as_little_as_possible(mass):
    system = build(
        {"x": (1.5, False, "m"), "y": (0.2, False, "m")}, {"ellipse": "x**2/4 + y**2 - 1"}, mass=mass
    )
    x, y = run(system).q
    weights = np.maximum(mass, 1e-10)  # what has no mass gives way
    angle = np.linspace(-np.pi, np.pi, 2_000_001)
    distance = weights[0] * (2 * np.cos(angle) - 1.5) ** 2 + weights[1] * (np.sin(angle) - 0.2) ** 2
    best = angle[np.argmin(distance)]
    assert x**2 / 4 + y**2 - 1 == pytest.approx(0, abs=1e-14)
    assert (x, y) == pytest.approx((2 * np.cos(best), np.sin(best)), abs=4e-6)


def test_rates_move_as_little_as_the_mass_says():
    coordinates = {"x": (1.0, True, "m"), "y": (0.0, True, "m")}
    rates = {"x": (1.0, False), "y": (0.0, False)}
    system = build(coordinates, {}, rates, {"skate": "v_x + v_y"}, mass=[3.0, 1.0])
    # Minimise 3 (vx - 1)² + vy² with vx + vy = 0.
    assert run(system).v == pytest.approx([0.75, -0.75], rel=1e-14)


def test_rheonomic_constraint_at_a_later_time():
    system = build({"x": (0.0, False, "m"), "y": (2.0, False, "m")}, {"driven": "x - 0.5*sin(3*t)"})
    assembly = run(system, t=0.4)
    assert assembly.q == pytest.approx([0.5 * np.sin(1.2), 2.0], rel=1e-15)
    assert assembly.v == pytest.approx([1.5 * np.cos(1.2), 0.0], rel=1e-15)


def test_restart_from_a_stationary_guess():
    # At x = 0 the Jacobian vanishes: no direction leads out of the guess.
    system = build({"x": (0.0, False, "m")}, {"far": "x**2 - 4"})
    assert abs(run(system).q[0]) == pytest.approx(2.0, rel=1e-14)


def test_far_guess_finds_the_loop():
    system = build(**SLIDER_CRANK)
    assembly = run(system, {"theta": 3.0})
    theta, phi, x = assembly.q
    assert abs(0.1 * np.cos(theta) + 0.3 * np.cos(phi) - x) < 1e-15
    assert abs(0.1 * np.sin(theta) + 0.3 * np.sin(phi)) < 1e-15
    assert abs(phi) < 0.1  # the branch that the guess is on


def test_enforced_contradiction_is_refused_by_name():
    system = load(FIXTURES / "cartesian_pendulum.py")
    with pytest.raises(AssemblyError, match=r"'rod' cannot hold .* x = 0.3, y = -0.41") as caught:
        run(system, {"x": 0.3, "y": -0.41})
    assert "values that fit are" in str(caught.value)


def test_only_the_contradicted_constraint_is_named():
    with pytest.raises(AssemblyError, match="constraint 'pin_y_closes' cannot hold") as caught:
        run(build(**SLIDER_CRANK), {"theta": 0.5, "phi": -0.5})
    assert "theta = 0.5, phi = -0.5" in str(caught.value)
    assert "x =" not in str(caught.value)


def test_out_of_reach_is_refused():
    with pytest.raises(AssemblyError, match=r"'pin_x_closes'.* x = 0\.7"):
        run(build(**SLIDER_CRANK), {"theta": 0.5, "x": 0.7})


def test_small_contradiction_is_repaired_with_a_note():
    system = load(FIXTURES / "cartesian_pendulum.py")
    assembly = run(system, {"x": 0.3, "y": -0.4 + 1e-8})
    x, y = assembly.q
    assert x * x + y * y == pytest.approx(0.25, abs=1e-16)
    # The nearest point of the circle lies along the radius.
    assert np.hypot(x - 0.3, y + 0.4 - 1e-8) == pytest.approx(8e-9, rel=1e-6)
    assert "repaired" in assembly.notes[0] and "x by" in assembly.notes[0]


def test_repair_prefers_guesses():
    coordinates = {"x": (1.0, True, "m"), "y": (1.0 + 1e-8, True, "m"), "z": (0.0, False, "m")}
    system = build(coordinates, {"same": "x - y", "follows": "z - x"})
    x, y, z = run(system).q
    assert (x, y) == pytest.approx((1.0 + 5e-9, 1.0 + 5e-9), abs=1e-15)
    assert z == x == y


def test_enforced_rates_that_contradict():
    system = load(FIXTURES / "cartesian_pendulum.py")
    with pytest.raises(AssemblyError, match=r"'rod' cannot hold .*rates dot\(x\) = 1, dot\(y\) = 1"):
        run(system, {"x": 0.3}, {"x": 1.0, "y": 1.0})
    assembly = run(system, {"x": 0.3}, {"x": 1.0, "y": 0.75 + 1e-9})
    assert 0.3 * assembly.v[0] - 0.4 * assembly.v[1] == pytest.approx(0, abs=1e-15)
    assert "dot(" in assembly.notes[0]


def test_redundant_constraint_is_named():
    system = load(FIXTURES / "redundant_pendulum.py")
    assembly = run(system)
    assert (assembly.redundant, assembly.rank) == (["rod_again"], 1)
    assert assembly.notes[0].startswith("redundant: rod_again (follows from rod)")


def test_redundancy_that_holds_only_on_the_manifold():
    # Off x = 1 the second constraint has a gradient of its own.
    system = build(
        {"x": (0.7, False, "m"), "y": (0.3, False, "m")}, {"wall": "x - 1", "wall_twice": "(x - 1)*(2 + y)"}
    )
    assembly = run(system)
    assert assembly.q == pytest.approx([1.0, 0.3], abs=1e-12)
    assert (assembly.redundant, assembly.rank) == (["wall_twice"], 1)


def test_momentary_singularity_is_not_redundancy():
    # A parallelogram stretched out flat: the Jacobian loses rank there, and nowhere near.
    system = build(
        {name: (0.0, False, "rad") for name in ("a", "b", "c")},
        {"x_closes": "cos(a) + 2*cos(b) - cos(c) - 2", "y_closes": "sin(a) + 2*sin(b) - sin(c)"},
    )
    assembly = run(system)
    assert (assembly.redundant, assembly.rank) == ([], 2)
    assert "singular configuration: the constraints have rank 1 there and 2 nearby" in assembly.notes[0]


@pytest.mark.parametrize("text, y", [("x*x - 2*x + 1 + y*y", 0.0), ("1 - cos(x - y)", 1.01)])
def test_a_constraint_without_a_gradient_is_refused_by_name(text, y):
    system = build({"x": (1.0, False, "m"), "y": (y, False, "m")}, {"point": text})
    with pytest.raises(AssemblyError, match="'point' cannot be kept: the gradient is zero wherever it holds"):
        run(system)


def test_branches_that_cross_at_the_start_are_not_refused():
    system = build({"x": (0.0, False, "m"), "y": (0.0, False, "m")}, {"cross": "x*y"})
    assert (run(system).redundant, run(system).rank) == ([], 1)


def test_contradictory_constraints_are_refused_by_name():
    system = build(
        {"x": (0.0, False, "m"), "y": (0.0, False, "m")}, {"one": "x - 1", "two": "x - 2", "fine": "y - 1"}
    )
    with pytest.raises(AssemblyError, match="constraints 'one', 'two' contradict each other") as caught:
        run(system)
    assert "fine" not in str(caught.value)


def test_a_constraint_that_nothing_moves_is_off_by_its_value():
    """Its derivative is round-off, by which its residual would be enormous."""
    system = build(
        {"x": (0.7, False, "m")},
        {"rod": "sin(x + 1.0) - cos(1.0)*sin(x) - sin(1.0)*cos(x) - 3", "fine": "x - 1"},
    )
    with pytest.raises(AssemblyError, match="constraint 'rod' cannot hold: off by -3 at"):
        run(system)


def test_contradiction_on_the_velocity_level():
    system = build({"x": (0.0, False, "m")}, {"slow": "x - sin(t)", "fast": "x - sin(2*t)"})
    with pytest.raises(AssemblyError, match="'slow', 'fast' contradict each other on the velocity level"):
        run(system)


def test_not_finite_constraint():
    system = build({"x": (-1.0, False, "m")}, {"logarithm": "log(x)"})
    with pytest.raises(AssemblyError, match="'logarithm' has no finite value at the start"):
        run(system)


@pytest.mark.parametrize("option", ["start", "rate"])
def test_unknown_name(option):
    with pytest.raises(UnknownNameError, match=rf"{option}: .*no coordinate 'tehta': did you mean 'theta'\?"):
        run(build(**SLIDER_CRANK), **{option: {"tehta": 1.0}})


def test_not_a_number():
    with pytest.raises(AssemblyError, match="theta is nan"):
        run(build(**SLIDER_CRANK), {"theta": float("nan")})


def test_without_constraints_nothing_moves():
    system = load(FIXTURES / "pendulum.py")
    assembly = run(system, {"theta": 0.25}, {"theta": 3.0})
    assert (assembly.q.tolist(), assembly.v.tolist(), assembly.moved) == ([0.25], [3.0], [])


ROD = """
name = "rod"
[parameters]
l = 1.0
g = 9.81
[coordinates]
x = { start = 0.6 }
y = { guess = -0.7 }
[bodies.bob]
mass = 1
com = ["x", "y"]
[gravity]
y = "-g"
[constraints]
rod = "x^2 + y^2 - l^2"
"""
CRANK = """
name = "crank"
[parameters]
r = 0.1
l = 0.3
[coordinates]
theta = { start = 0.5 }
phi = { guess = -0.2 }
x = { guess = 0.4 }
[bodies.piston]
mass = 1
com = ["x", 0]
[energy]
kinetic = "r^2*dot(theta)^2 + l^2*dot(phi)^2"
[constraints]
x_closes = "r*cos(theta) + l*cos(phi) - x"
y_closes = "r*sin(theta) + l*sin(phi)"
"""


@pytest.mark.parametrize("size", [1e-12, 1e-6, 1e-3, 1e6, 1e9])
def test_without_units_scales_follow_the_size_of_the_model(size):
    system = Model.from_toml(ROD).derive()
    values = {"parameters": {"l": size, "g": 9.81 * size}, "start": {"x": 0.6 * size}}
    run = system.run(t_end=1.0, method="dop853", atol=1e-10 * size, **values)
    assert run.ok
    assert run.q[0] / size == pytest.approx([0.6, -0.8], rel=1e-13)
    usual = system.run(t_end=1.0, method="dop853")
    assert run.q[-1] / size == pytest.approx(usual.q[-1], abs=1e-9)
    system = Model.from_toml(CRANK.replace("guess = 0.4", f"guess = {0.4 * size}")).derive()
    r, length = 0.1 * size, 0.3 * size
    theta, phi, x = assemble(system, np.array([r, length])).q
    assert phi == pytest.approx(-np.arcsin(np.sin(theta) / 3), rel=1e-13)
    assert x == pytest.approx(r * np.cos(theta) + length * np.cos(phi), rel=1e-14)


@pytest.mark.parametrize("unit", ["", "rad"])
def test_angles_of_many_turns_are_no_larger_than_others(unit):
    text = CRANK.replace("{ start", f'{{ unit = "{unit}", start').replace(
        "{ guess = -", f'{{ unit = "{unit}", guess = -'
    )
    system = Model.from_toml(text if unit else CRANK).derive()
    p = system.parameter_values()
    q = assemble(system, p).q
    turned = assemble(system, p, {"theta": 0.5 + 1000.0 * np.pi}).q
    assert turned[1:] == pytest.approx(q[1:], rel=1e-11)
    near, far = (row_weights(system, p, 0.0, place)[1] for place in (q, turned))
    assert far == pytest.approx(near, rel=0.2)


TINY = """
[parameters]
s = "1e-6 m"
[coordinates]
theta = { unit = "rad", start = 0.7 }
x = { unit = "m", guess = 1.0 }
y = { unit = "m", guess = 2.0 }
[bodies.crank]
mass = "1e-9 kg"
com = ["2*s*cos(theta)", "2*s*sin(theta)"]
[bodies.rod]
mass = "1e-9 kg"
com = ["x", "y"]
[constraints]
rod = "sqrt((x - 2*s*cos(theta))^2 + (y - 2*s*sin(theta))^2) - 3*s"
rocker = "(x - 3.2*s)^2 + y^2 - 6.25*s^2"
"""


@pytest.mark.parametrize(
    "guess",
    [
        (1.0, 2.0),
        (-0.03183241947600437, 0.0032345660439580615),
        (0.007765065078869217, -0.0030504545917489374),
        (0.0013689432746955773, -0.0009889029185810778),
        (-0.01885667818969243, 0.028282303181482473),
    ],
)
def test_a_far_guess_is_not_the_size_of_a_mechanism(guess):
    """It is the largest length of the model: what that makes of the sizes is no reason to refuse."""
    text = TINY.replace("guess = 1.0", f"guess = {guess[0]!r}").replace(
        "guess = 2.0", f"guess = {guess[1]!r}"
    )
    system = Model.from_toml(text).derive()
    theta, x, y = assemble(system, system.parameter_values()).q
    assert theta == 0.7
    assert np.hypot(x - 2e-6 * np.cos(0.7), y - 2e-6 * np.sin(0.7)) == pytest.approx(3e-6, rel=1e-9)
    assert np.hypot(x - 3.2e-6, y) == pytest.approx(2.5e-6, rel=1e-9)
