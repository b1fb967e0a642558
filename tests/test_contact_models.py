"""Stops, friction and contacts in model files: what is read, written and refused; complementarity by enumeration."""

from __future__ import annotations

import ctypes
import itertools
import json
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from symgen import Model, runtime
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.model.from_sympy import to_sympy
from symgen.runtime.constraints.kkt import lease_guard
from symgen.runtime.contact.coulomb import coulomb_forces, lemke
from symgen.runtime.contact.levels import Levels, NoSolution
from symgen.runtime.errors import ModuleError

FILE = """
name = "mixed"

[parameters]
k = "1e4 N/m"

[coordinates]
x = { unit = "m", start = 1.0 }

[bodies.b]
mass = "1 kg"
com = ["x", "0"]

[stops.wall]
gap = "x - 0.1"
restitution = 0.5

[friction.floor]
coordinate = "x"
force = "2 N"
static = "3 N"

[friction.oil]
speed = "dot(x) - 0.5"
force = "0.1 N"
smooth = "1e-3 m/s"

[contacts.pad]
gap = "2 - x"
stiffness = "k"
damping = 0.2
"""


def test_a_file_round_trips():
    model = Model.from_toml(FILE)
    again = Model.from_toml(model.to_toml())
    assert again.describe() == model.describe()
    assert again.to_toml() == model.to_toml()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('gap = "x - 0.1"', "", "gap"),
        ('gap = "x - 0.1"', 'gap = "dot(x)"', "cannot depend on a rate"),
        ("restitution = 0.5", "restitution = 1.5", "not from 0 to 1"),
        ("restitution = 0.5", 'restitution = "x"', "cannot depend on a coordinate"),
        ("restitution = 0.5", "bounce = 0.5", "unknown key 'bounce'"),
        ('speed = "dot(x) - 0.5"', 'speed = "dot(x)^2"', "not linear in the rates"),
        ('speed = "dot(x) - 0.5"', 'speed = "x"', "contains no rate"),
        ('coordinate = "x"', 'coordinate = "z"', "'z' is not declared"),
        ('coordinate = "x"', "", "one 'coordinate' or one 'speed'"),
        ('force = "2 N"\nstatic = "3 N"', 'force = "dot(x)"', "cannot depend on a rate"),
        ('static = "3 N"', 'static = "dot(x)"', "cannot depend on a rate"),
        ('force = "2 N"', "", "one 'force' or 'torque'"),
        ('smooth = "1e-3 m/s"', 'smooth = "0 m/s"', "not positive"),
        ('smooth = "1e-3 m/s"', 'smooth = 1e-3\nstatic = "1 N"', "never sticks"),
        ('stiffness = "k"', "", "'stiffness' is missing"),
        ('stiffness = "k"', 'stiffness = "k"\nexponent = 0.5', "at least 1"),
        ("damping = 0.2", "damping = 0.2\nfriction = 0.1", "'slip' is missing"),
        ("[friction.oil]", "[friction.wall]", "taken"),
        ("[stops.wall]", '[events.floor]\nwhen = "x"\n[stops.wall]', "'floor' is taken by an event"),
    ],
)
def test_what_makes_no_sense_is_refused(old, new, says):
    assert old in FILE
    with pytest.raises(ModelError, match=says):
        Model.from_toml(FILE.replace(old, new)).describe()


def test_limits_of_a_coordinate_are_two_stops():
    m = Model("limited")
    x = m.coordinate("x")
    m.body("b", mass=1.0, com=(x, 0))
    m.limit("x", x, -1, 2, 0.3)
    d = m.describe()
    assert [s.name for s in d.stops] == ["x_lower", "x_upper"]
    assert [to_sympy(s.gap).subs(x, 0) for s in d.stops] == [1, 2]


@pytest.fixture(scope="module")
def mixed():
    return derive_text(Model.from_toml(FILE)).text


def test_the_module_says_what_switches(mixed):
    system = runtime.load(mixed)
    assert system.settings == ("closed(wall)", "stuck(floor)", "sense(floor)")
    assert system.n_p == system.n_settable + 3 == 4
    assert [e["action"] for e in system.events] == ["stop", "friction"]
    assert system.closed.m == 2 and system.m == 0
    p = system.parameter_values()
    assert not p[system.n_settable :].any()


def test_a_switched_off_row_changes_nothing_and_a_closed_one_holds(mixed):
    system = runtime.load(mixed)
    state, p = np.array([0.1, 0.4]), system.parameter_values()
    p[-1] = 1.0
    free = system.kernel("rhs")(0.0, state, p)
    off = system.closed.kernel("rhs")(0.0, state, p)
    np.testing.assert_allclose(off[:3], free[:3], rtol=1e-14)
    np.testing.assert_array_equal(off[3:5], 0.0)
    p[-3] = 1.0
    on = system.closed.kernel("rhs")(0.0, state, p)
    assert on[1] == pytest.approx(0.0, abs=1e-14)
    assert on[3] == pytest.approx(-free[1])


def test_the_closed_residual_jacobian_is_the_derivative(mixed):
    system = runtime.load(mixed).closed
    p = system.parameter_values()
    p[-3:] = 1.0, 0.0, -1.0
    y = np.array([0.3, 0.7, -1.1, 2.0, 0.5])
    jacobian = system.kernel("residual_jacobian")(0.0, y, p).reshape(3, 5)
    for k in range(5):
        h = 1e-6
        up, down = y.copy(), y.copy()
        up[k] += h
        down[k] -= h
        column = (system.kernel("residual")(0.0, up, p) - system.kernel("residual")(0.0, down, p)) / (2 * h)
        np.testing.assert_allclose(jacobian[:, k], column, rtol=1e-6, atol=1e-6)


def test_a_module_whose_switches_do_not_fit_its_events_is_refused(mixed):
    with pytest.raises(ModuleError, match="switches"):
        runtime.load(mixed.replace('{"name": "wall", "kind": "stop"}', '{"name": "other", "kind": "stop"}'))


def test_events_in_the_result_name_the_stops(mixed, tmp_path):
    solution = runtime.load(mixed).run(t_end=1.0, method="dop853", rate={"x": -3.0}, at=[0.5])
    assert solution.ok
    from symgen.runtime.result_json import write_result

    write_result(solution, tmp_path / "result.json")
    result = json.loads((tmp_path / "result.json").read_text())
    assert next(event["name"] for event in result["events"]) == "wall"
    assert set(result["contact_forces"]) == {"wall", "floor"} == set(result["samples"][0]["contact_forces"])


def test_a_recording_is_checked_with_its_stops_and_frictions(mixed, tmp_path):
    from symgen.runtime.recording.verify import verify

    solution = runtime.load(mixed).run(t_end=1.0, method="dop853", rate={"x": -3.0})
    solution.save(tmp_path / "run.rrd")
    report = verify(tmp_path / "run.rrd")
    assert report.ok
    assert {"energy", "model", "equations", "motion"} <= {check.name for check in report.checks if check.ok}


def test_an_open_stop_is_no_singular_configuration(mixed):
    """Its row of zeros would send every evaluation down the path for dependent constraints."""
    closed = runtime.load(mixed).closed
    p = closed.parameter_values()
    p[closed.n_settable :] = [1.0, 0.0, 1.0]  # closed, and the friction slides
    lease = lease_guard(closed)
    lease.expect(p, 0.0, np.array([0.1]))
    assert lease.memory[-1] == 0.0
    project = ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 3)(lease.project)
    y, precomputed, out = np.array([0.1, 0.0]), closed.precomputed(p), np.zeros(2 + closed.nh + closed.m)
    project(0.0, y.ctypes.data, precomputed.ctypes.data, out.ctypes.data)
    assert lease.memory[-1] == 0.0
    np.testing.assert_allclose(out[:2], [0.1, 0.0], atol=1e-15)


def _solved(matrix, right):
    """The solution of a regular system of fractions, by elimination."""
    rows = [[*row, b] for row, b in zip(matrix, right, strict=True)]
    for k in range(len(rows)):
        pivot = next(i for i in range(k, len(rows)) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(len(rows)):
            if i != k:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k], strict=True)]
    return [row[-1] for row in rows]


def _by_enumeration(matrix, q):
    """All solutions, in fractions: exact whatever the condition, with any library for linear algebra."""
    matrix, q = [[Fraction(x) for x in row] for row in matrix], [Fraction(x) for x in q]
    n, found = len(q), []
    for active in itertools.product((False, True), repeat=n):
        on = [k for k in range(n) if active[k]]
        z = [Fraction(0)] * n
        for k, x in zip(
            on, _solved([[matrix[i][j] for j in on] for i in on], [-q[i] for i in on]), strict=True
        ):
            z[k] = x
        w = [sum(a * b for a, b in zip(row, z, strict=True)) + c for row, c in zip(matrix, q, strict=True)]
        if min(z) >= 0 and min(w) >= 0:
            found.append(np.array(z, dtype=float))
    return found


@pytest.mark.parametrize("seed", range(20))
def test_complementarity_agrees_with_enumeration(seed):
    """To the digits that the condition of the scaled matrix leaves; at seed 12 it is 1e10 before scaling."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 6))
    rows = random.normal(size=(n, n)) * 10.0 ** random.uniform(-3, 3, size=(n, 1))
    matrix, q = rows @ rows.T, random.normal(size=n) * np.sqrt(np.diag(rows @ rows.T))
    (exact,) = _by_enumeration(matrix, q)
    scale = np.sqrt(np.diag(matrix))
    condition = np.linalg.cond(matrix / np.outer(scale, scale))
    tolerance = 100.0 * np.finfo(float).eps * condition * np.abs(exact * scale).max()
    assert condition < 1e7
    np.testing.assert_allclose(lemke(matrix, q) * scale, exact * scale, rtol=0.0, atol=tolerance)


def test_dependent_rows_and_bounds():
    twice = np.ones((2, 2))
    z = lemke(twice, np.array([-1.0, -2.0]))
    assert np.all(z >= 0.0) and np.all(twice @ z + [-1.0, -2.0] >= -1e-14)
    with pytest.raises(NoSolution):
        lemke(np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([-1.0, -1.0]))
    here = SimpleNamespace(compliance=np.eye(3))
    levels = Levels(np.ones(2), np.zeros(2), [(None, np.zeros(0, dtype=int))] * 2)
    x, _ = coulomb_forces(here, np.array([9.0, -5.0, 0.5]), np.ones(3, dtype=bool), np.zeros(2), levels)
    np.testing.assert_allclose(x, [0.0, 1.0, -0.5])
