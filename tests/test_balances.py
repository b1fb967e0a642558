"""Coordinates without inertia: solved by the balance of forces on them, or held by constraints alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from symgen import Model, dot
from symgen.errors import ModelError
from symgen.link import derive
from symgen.runtime.checks.health import health_of
from symgen.runtime.integrate.methods import METHODS

FORMS = [
    ("dop853", "projection"), ("dop853", "partition"), ("taylor", "projection"), ("radau5", "ggl"), ("bdf", "ggl"),
    ("gauss6", "projection"), ("generalized_alpha", "index3"),
]  # fmt: skip


def maxwell() -> Model:
    """A block on a spring in series with a damper that ends on a wall."""
    m = Model("maxwell")
    x, n = m.coordinate("x", unit="m", start=0.1), m.coordinate("n", unit="m", start=0.05)
    k, c = m.parameters(k="20 N/m", c="2 N*s/m")
    m.body("block", mass="1 kg", com=(x, 0))
    m.spring("spring", points=[(n, 0), ("x + 1.0", 0)], stiffness=k, length="1 m")
    m.dissipation(c / 2 * dot(n) ** 2)
    m.run(t_end=1.0)
    return m


def right(run, column: str, expected: float, limit: float) -> None:
    assert run.status == "success"
    assert run[column][-1] == pytest.approx(expected, abs=limit)
    assert not [entry for entry in health_of(run) if not entry.ok]


@pytest.mark.parametrize(("method", "form"), FORMS, ids=["-".join(pair) for pair in FORMS])
def test_a_node_between_spring_and_damper(method, form):
    def motion(t, y):
        pull = 20 * (y[0] - y[2])
        return [y[1], -pull, pull / 2]

    x, _, n = solve_ivp(motion, (0, 1), [0.1, 0, 0.05], rtol=1e-12, atol=1e-14).y[:, -1]
    steps = {} if METHODS[method].adaptive else {"step": 1e-3}
    run = derive(maxwell()).run(method=method, constraints=form, **steps)
    right(run, "x", x, 1e-7)
    right(run, "n", n, 1e-6)
    assert "without inertia, where the forces on it balance: n" in run.notes
    assert np.abs(run["lambda(n_balance)"]).max() < 1e-7
    assert run["dot(n)"][0] == pytest.approx(0.5)


@pytest.mark.parametrize(("method", "form"), [*FORMS, ("rattle4", "index3")])
def test_a_node_between_springs(method, form):
    """The second one hardens, so that the node's place is the root of a cubic."""
    m = Model("series")
    x = m.coordinate("x", unit="m", start=0.1)
    m.coordinate("n", unit="m", guess=0.05)
    m.body("block", mass=1, com=(x, 0))
    m.potential("20.0*(x - n)^2/2 + 20.0*n^2/2 + 300.0*n^4")
    m.run(t_end=1.0)

    def node(x):
        return brentq(lambda n: 20 * (n - x) + 20 * n + 1200 * n**3, -1, 1, xtol=1e-15)

    x = solve_ivp(lambda t, y: [y[1], -20 * (y[0] - node(y[0]))], (0, 1), [0.1, 0], rtol=1e-11, atol=1e-13).y[
        0, -1
    ]
    steps = {} if METHODS[method].adaptive else {"step": 1e-3}
    system = derive(m)
    run = system.run(method=method, constraints=form, **steps)
    right(run, "x", x, 1e-6)
    assert run["n"][0] == pytest.approx(node(0.1), abs=1e-13)
    assert system.linearise("equilibrium").A == pytest.approx(np.array([[0, 1], [-10, 0]]), abs=1e-9)


def test_linear_models_and_rest_know_nodes():
    linear = derive(maxwell()).linearise("equilibrium")
    assert np.sort_complex(np.linalg.eigvals(linear.A)) == pytest.approx(
        np.sort_complex(np.linalg.eigvals([[0, 0, 1], [10, -10, 0], [-20, 20, 0]])), abs=1e-9
    )


def test_forces_with_states_and_inputs_are_balanced():
    """A hydraulic piston without mass: a state pushes, a damper with a square law and an input resist."""
    m = Model("piston")
    s = m.coordinate("s", start=0.0)
    p = m.state("p", derivative="5 - p", start=1.0)
    u = m.input("u", polynomial=(0.1, 0.4))
    m.force(s, p + u - 2 * dot(s) - dot(s) ** 3)
    m.body("elsewhere", mass=1, com=(m.coordinate("y"), 0))
    m.run(t_end=1.0)
    run = derive(m).run(rtol=1e-9)

    def speed(force):
        return brentq(lambda v: 2 * v + v**3 - force, -5, 5, xtol=1e-15)

    def motion(t, y):
        return [speed(y[1] + 0.1 + 0.4 * t), 5 - y[1]]

    right(run, "s", solve_ivp(motion, (0, 1), [0, 1], rtol=1e-11, atol=1e-12).y[0, -1], 1e-7)


@pytest.mark.parametrize(
    ("build", "says"),
    [
        (
            lambda m, x, n, w: m.dissipation((dot(n) - dot(w)) ** 2),
            "n, w, which have no inertia, do not say how each",
        ),
        (
            lambda m, x, n, w: m.potential(3 * n * x + (w - x) ** 2),
            "on 'n', which has no inertia, do not say where",
        ),
        (lambda m, x, n, w: (m.force(n, -dot(x)), m.potential(w**2 + n**2)), "on 'n'.*do not say where"),
        (
            lambda m, x, n, w: (
                m.potential(w**2 + n**2 + (x - n) ** 2),
                m.friction("rub", speed=dot(x) - dot(n), force=1),
            ),
            r"\[friction.rub\]: dry friction acts on 'n', which has no inertia; give it a small mass",
        ),
        (
            lambda m, x, n, w: (m.potential(w**2 + n**2 + (x - n) ** 2), m.stop("end", gap=x + 1 - w)),
            r"\[stops.end\]: a stop acts on 'w', which has no inertia; give it a small mass",
        ),
    ],
    ids=["floating damper", "no stiffness", "of another's rate", "dry friction", "a stop"],
)
def test_what_forces_leave_open_is_refused(build, says):
    m = Model("open")
    x, n, w = (m.coordinate(name) for name in "xnw")
    m.body("block", mass=1, com=(x, 0))
    build(m, x, n, w)
    with pytest.raises(ModelError, match=says):
        derive(m)


def test_a_mechanism_without_inertia_goes_where_it_is_driven():
    """A crank that time turns, with rod and piston: no mass anywhere."""
    m = Model("kinematic")
    m.coordinate("a")
    m.coordinate("b", guess=-0.1)
    x = m.coordinate("x", guess=0.4)
    m.constraint("drive", "a - (0.3 + 2.0*t + sin(t))")
    m.constraint("along", "0.1*cos(a) + 0.3*cos(b) - x")
    m.constraint("across", "0.1*sin(a) + 0.3*sin(b)")
    m.output("speed", dot(x))
    m.run(t_end=3.0)
    system = derive(m)
    for method, form in (("dop853", "projection"), ("radau5", "ggl"), ("taylor", "projection")):
        run = system.run(method=method, constraints=form)
        angle = 0.3 + 2 * run.t + np.sin(run.t)
        rate = 2 + np.cos(run.t)
        assert run["x"] == pytest.approx(
            0.1 * np.cos(angle) + np.sqrt(0.09 - 0.01 * np.sin(angle) ** 2), abs=1e-7
        )
        slope = -0.1 * np.sin(angle) - 0.01 * np.sin(angle) * np.cos(angle) / np.sqrt(
            0.09 - 0.01 * np.sin(angle) ** 2
        )
        assert run["speed"] == pytest.approx(slope * rate, abs=1e-6)
        assert not [entry for entry in health_of(run) if not entry.ok]


def test_what_nothing_holds_needs_inertia():
    m = Model("nothing")
    m.coordinate("x")
    with pytest.raises(ModelError, match="nothing has kinetic energy"):
        m.describe()
