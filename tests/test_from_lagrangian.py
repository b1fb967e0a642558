"""Models from SymPy's Lagrangians: accelerations against those that SymPy solves for, at random states."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from sympy import Heaviside, Symbol, cos, sin, symbols
from sympy.physics.mechanics import (
    LagrangesMethod,
    Lagrangian,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

from symgen import Model
from symgen.errors import ModelError

m, l, g, r, k, c = symbols("m l g r k c")
VALUES = {m: 1.3, l: 0.7, g: 9.81, r: 0.4, k: 30.0, c: 0.2}


def double_pendulum() -> LagrangesMethod:
    """Of SymPy's own tests (test_lagrange.py, test_simp_pen and test_dub_pen)."""
    q1, q2 = dynamicsymbols("q1 q2")
    u1, u2 = q1.diff(), q2.diff()
    N = ReferenceFrame("N")
    A, B = N.orientnew("A", "Axis", [q1, N.z]), N.orientnew("B", "Axis", [q2, N.z])
    A.set_ang_vel(N, u1 * N.z)
    B.set_ang_vel(N, u2 * N.z)
    O = Point("O")
    O.set_vel(N, 0)
    P = O.locatenew("P", l * A.x)
    R = P.locatenew("R", l * B.x)
    P.v2pt_theory(O, N, A)
    R.v2pt_theory(P, N, B)
    P1, P2 = Particle("P1", P, m), Particle("P2", R, m)
    P1.potential_energy = -m * g * l * cos(q1)
    P2.potential_energy = -m * g * l * (cos(q1) + cos(q2))
    return LagrangesMethod(Lagrangian(N, P1, P2), [q1, q2], forcelist=[(P, -c * u1 * N.x)], frame=N)


def rolling_disc() -> LagrangesMethod:
    """Of SymPy's documentation, 'A rolling disc using Lagrange's method'."""
    q1, q2, q3 = dynamicsymbols("q1 q2 q3")
    N = ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [q1, N.z])
    L = Y.orientnew("L", "Axis", [q2, Y.x])
    R = L.orientnew("R", "Axis", [q3, L.y])
    C = Point("C")
    C.set_vel(N, 0)
    disc_centre = C.locatenew("Dmc", r * L.z)
    disc_centre.v2pt_theory(C, N, R)
    moments = inertia(L, m / 4 * r**2, m / 2 * r**2, m / 4 * r**2)
    body = RigidBody("BodyD", disc_centre, R, m, (moments, disc_centre))
    body.potential_energy = m * g * r * cos(q2)
    return LagrangesMethod(Lagrangian(N, body), [q1, q2, q3])


def four_bar() -> LagrangesMethod:
    """Three bars that stand on the ground at (0, 0) and (l, 0) and are closed by two constraints."""
    q = dynamicsymbols("q1:4")
    N = ReferenceFrame("N")
    pin = Point("O")
    pin.set_vel(N, 0)
    particles, ends = [], [pin]
    for j, angle in enumerate(q):
        A = N.orientnew(f"A{j}", "Axis", [angle, N.z])
        end = ends[-1].locatenew(f"P{j}", (1 + j / 3) * l * A.x)
        end.v2pt_theory(ends[-1], N, A)
        ends.append(end)
        particles.append(Particle(f"B{j}", end, m))
        particles[-1].potential_energy = m * g * end.pos_from(pin).dot(N.y)
    closed = ends[-1].pos_from(pin) - l * N.x
    return LagrangesMethod(
        Lagrangian(N, *particles), q, hol_coneqs=[closed.dot(N.x), closed.dot(N.y)], frame=N
    )


def skate() -> LagrangesMethod:
    """A knife edge on a slope: held across its direction, by a velocity constraint."""
    x, y, a = dynamicsymbols("x y a")
    kinetic = m / 2 * (x.diff() ** 2 + y.diff() ** 2) + m * r**2 / 2 * a.diff() ** 2
    edge = x.diff() * sin(a) - y.diff() * cos(a)
    return LagrangesMethod(kinetic + m * g * x / 2, [x, y, a], nonhol_coneqs=[edge])


SYSTEMS = (double_pendulum, rolling_disc, four_bar, skate)


@pytest.mark.parametrize("make", SYSTEMS, ids=[f.__name__ for f in SYSTEMS])
def test_right_sides_are_those_of_sympy(make):
    """M a + G^T lambda = f is solved from SymPy's matrices with numbers, and from the generated module's rhs."""
    method = make()
    method.form_lagranges_equations()
    used = sorted(method.eom.free_symbols - {dynamicsymbols._t}, key=str)
    used = [x for x in used if x in VALUES]
    system = Model.from_sympy(make.__name__, method, parameters={x: VALUES[x] for x in used}).derive()
    q, u = list(method.q), [x.diff() for x in method.q]
    n, random = len(q), np.random.default_rng(3)
    for _ in range(5):
        state = random.uniform(0.3, 1.2, 2 * n)
        numbers = dict(zip([*u, *q], [*state[n:], *state[:n]], strict=True)) | VALUES
        matrix, right = (
            np.array(x.subs(numbers).evalf(30), dtype=float) for x in (method.mass_matrix, method.forcing)
        )
        if method.coneqs:
            rows = np.array(method._m_cd.subs(numbers).evalf(30), dtype=float)
            below = np.array(method._f_cd.subs(numbers).evalf(30), dtype=float)
            held = np.zeros((len(rows), len(rows)))
            matrix, right = np.block([[matrix[:, :n], rows.T], [rows, held]]), np.vstack([right, below])
        expected = np.linalg.solve(matrix, right).ravel()[:n]
        found = system.kernel("rhs")(0.0, state, system.parameter_values())[n : 2 * n]
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())


def test_a_lagrangian_with_forces_and_a_step():
    q = dynamicsymbols("q")
    L = m * q.diff() ** 2 / 2 - k * q**2 / 2
    force = -c * q.diff() + 3 * Heaviside(dynamicsymbols._t - 1)
    one = Model.from_lagrangian(
        "one", L, [q], parameters={m: 2, k: "8 N/m", c: 0.0}, forces={q: force}, start={q: 1.0}
    )
    run = one.derive().run(t_end=4.0, method="dop853", rtol=1e-10)
    assert run.ok
    late = np.maximum(run.t - 1, 0)
    np.testing.assert_allclose(run["q"], np.cos(2 * run.t) + 3 / 8 * (1 - np.cos(2 * late)), atol=1e-8)


def test_what_has_no_model_is_refused_by_name():
    q, other = dynamicsymbols("q other")
    L = m * q.diff() ** 2 / 2
    with pytest.raises(ModelError, match="parameter 'm' of the model 'a' has no value"):
        Model.from_lagrangian("a", L, [q])
    with pytest.raises(ModelError, match=r"other\(t\).*neither a coordinate"):
        Model.from_lagrangian("a", L + other, [q], parameters={m: 1})
    with pytest.raises(ModelError, match="neither a coordinate"):
        Model.from_lagrangian("a", L, [q], parameters={m: 1}, forces={q: q.diff().diff()})
    with pytest.raises(ModelError, match="no function of time"):
        Model.from_lagrangian("a", L, [Symbol("q")], parameters={m: 1})


def test_the_examples_of_the_docs_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    root = Path(__file__).resolve().parents[1]
    (tmp_path / "slider_crank.toml").write_bytes((root / "models" / "slider_crank.toml").read_bytes())
    page = (root / "docs" / "models.md").read_text(encoding="utf-8")
    example, back = re.findall(r"```python\n(.*?)```", page.partition("## Lagrangians of SymPy")[2], re.S)
    names: dict = {}
    exec(example, names)
    assert names["pendulum"].derive().run(t_end=0.1).ok
    exec(back, {})
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == re.search(r"M\[0, 1\]\) +# (.*)", back).group(1)
    assert "Derivative(phi(t), t)**2" in printed[1]
