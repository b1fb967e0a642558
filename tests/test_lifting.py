"""Systems that are solved as they are made of velocities: against dense solves, SymPy, and their own other form."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from lagrange import Reference

from symgen import Model, cos, dot, runtime, sin
from symgen.derive.derivation import Derivation
from symgen.derive.solve import choice
from symgen.derive.solve.rows import Substitution
from symgen.link import derive, derive_text
from symgen.model.library import bundled, find, load
from symgen.runtime.system import System
from symgen.runtime.taylor.kernel import N_ROWS, taylor_addresses


@pytest.fixture
def forced(monkeypatch):
    """Lift whatever can be lifted, whether it gains or not."""
    monkeypatch.setattr(choice, "FEWEST_RATES", 1)
    monkeypatch.setattr(choice, "FEWEST_COUPLED", 0.0)
    monkeypatch.setattr(choice, "GAIN", 0.0)


def chain(n: int, space: bool = False, closed: bool = False, relative: bool = False) -> Model:
    """Rods one after another, plane or with two angles each; masses and lengths are parameters of each."""
    model = Model("chain", gravity=(0, "-9.81"))
    x, y, z, before = 0, 0, 0, 0
    for k in range(n):
        m, l = model.parameters(**{f"m{k}": 1.0 + 0.1 * k, f"l{k}": 0.5 + 0.05 * k})
        a = model.coordinate(f"a{k}", guess=0.3 + 0.5 * k)
        b = model.coordinate(f"b{k}", guess=0.2) if space else 0
        turn = a + before if relative else a
        dx, dy, dz = l * sin(turn) * cos(b), -l * cos(turn) * cos(b), l * sin(b)
        if space:
            model.body(f"rod{k}", mass=m, com=(x + dx / 2, y + dy / 2, z + dz / 2))
        else:
            model.body(f"rod{k}", mass=m, inertia=m * l**2 / 12, com=(x + dx / 2, y + dy / 2), angle=turn)
        x, y, z, before = x + dx, y + dy, z + dz, turn
    if closed:
        model.constraint("closes_x", x - 0.4)
        model.constraint("closes_y", y + 0.3)
    return model


FAMILIES: dict[str, tuple[Callable[[int], Model], int]] = {
    "plane": (chain, 12),
    "space": (lambda n: chain(n, space=True), 6),
    "closed": (lambda n: chain(n, closed=True), 12),
    "relative": (lambda n: chain(n, relative=True), 12),
    "closed, relative": (lambda n: chain(n, closed=True, relative=True), 12),
}


def is_lifted(model: Model) -> bool:
    pivots = Derivation(model.describe()).factors.pivots
    return any(isinstance(step, Substitution) for step in pivots)


def left_over(system: System, y: np.ndarray, p: np.ndarray) -> float:
    """The largest residual of `rhs` in [M -Gᵀ; G 0] (a, λ) = (f, γ), row by row in parts of its terms."""
    nv, m = system.nv, system.m
    row = system.kernel("rhs")(0.0, y, p)
    M, f = system.kernel("mass_matrix")(0.0, y, p).reshape(nv, nv), system.kernel("forces")(0.0, y, p)
    G, gamma = np.zeros((0, nv)), np.zeros(0)
    if m:
        G = system.kernel("constraint_jacobian")(0.0, y, p).reshape(m, nv)
        gamma = system.kernel("gamma")(0.0, y, p)
    whole = np.block([[M, -G.T], [G, np.zeros((m, m))]])
    x = np.concatenate([row[system.nq : system.nq + nv], row[system.ny : system.ny + m]])
    right = np.concatenate([f, gamma])
    return float((np.abs(whole @ x - right) / (np.abs(whole) @ np.abs(x) + np.abs(right))).max())


@pytest.mark.parametrize("family", FAMILIES)
def test_long_chains_are_lifted_and_leave_no_residual(family):
    build, n = FAMILIES[family]
    assert is_lifted(build(n))
    system = derive(build(n))
    rng = np.random.default_rng(3)
    for _ in range(5):
        y = rng.normal(size=system.nq + system.nv)
        assert left_over(system, y, system.parameter_values()) < 2e-15


def in_many_digits(text: str) -> Callable:
    """The `rhs` of a module, carried out with mpmath."""
    body = text[text.index("def rhs(") : text.index("\n\n\n", text.index("def rhs("))]
    body = re.sub(r"(?<![\w.])(\d+\.\d+(?:e[+-]?\d+)?)", r'mpf("\1")', body)
    space = {"sin": mpmath.sin, "cos": mpmath.cos, "mpf": mpmath.mpf}
    exec(body, space)
    return space["rhs"]


@pytest.mark.parametrize("posture", ["random", "straight", "folded"])
@pytest.mark.parametrize("spread", [0.0, 3.0])
def test_masses_and_lengths_may_differ_by_orders_of_magnitude(monkeypatch, posture, spread):
    """Accelerations against 60 digits, with the errors of the form by the matrix as the measure."""
    n, rng = 12, np.random.default_rng(4)
    lifted = derive_text(chain(n)).text
    monkeypatch.setattr(choice, "FEWEST_RATES", 10**9)
    by_matrix = derive_text(chain(n)).text
    systems, exactly = [runtime.load(lifted), runtime.load(by_matrix)], in_many_digits(by_matrix)
    errors = []
    for _ in range(10):
        p = systems[0].parameter_values()
        p[0::2] = 10.0 ** rng.uniform(-2 * spread, 2 * spread, n)
        p[1::2] = 10.0 ** rng.uniform(-spread, spread, n)
        angles = {
            "random": rng.uniform(-3, 3, n),
            "straight": np.full(n, 0.7) + 1e-9 * rng.normal(size=n),
            "folded": 0.7 + np.pi * (np.arange(n) % 2),
        }[posture]
        y, out = np.concatenate([angles, rng.normal(size=n)]), [0.0] * (2 * n)
        with mpmath.workdps(60):
            exactly(mpmath.mpf(0), [mpmath.mpf(float(x)) for x in y], [mpmath.mpf(float(x)) for x in p], out)
        exact = np.array([float(x) for x in out[n:]])
        errors.append(
            [np.abs(s.kernel("rhs")(0.0, y, p)[n:] - exact).max() / np.abs(exact).max() for s in systems]
        )
    own, others = np.array(errors).T
    assert np.median(own) <= 2 * np.median(others) and own.max() <= 6 * others.max()


@pytest.mark.parametrize("family", FAMILIES)
def test_operations_grow_as_the_number_of_links(family):
    build, _ = FAMILIES[family]
    first, second, third = (derive(build(n)).operations["rhs"] for n in (12, 18, 24))
    assert third - second == second - first


@pytest.mark.parametrize("family", ["plane", "closed", "closed, relative"])
def test_small_ones_are_sympys(forced, family):
    """Accelerations against `LagrangesMethod`, multipliers by G M⁻¹ Gᵀ of its matrices."""
    model = FAMILIES[family][0](3)
    assert is_lifted(model)
    system, reference = derive(model), Reference(model.describe())
    rng, m = np.random.default_rng(8), system.m
    y = rng.normal(size=system.nq + system.nv)
    M, f = reference.equations(0.0, y)
    row = system.kernel("rhs")(0.0, y, system.parameter_values())
    lam = np.zeros(0)
    if m:
        G, gamma = reference.G(0.0, y), reference.gamma(0.0, y)
        lam = np.linalg.solve(G @ np.linalg.solve(M, G.T), gamma - G @ np.linalg.solve(M, f))
        f = f + G.T @ lam
    np.testing.assert_allclose(row[system.nq : system.nq + system.nv], np.linalg.solve(M, f), rtol=1e-9)
    np.testing.assert_allclose(row[system.ny : system.ny + m], lam, rtol=1e-9)


# Massless coordinates, quaternions, stops and friction, constraints that move with time, dependent ones.
_BOTH = [
    name
    for name in sorted(bundled())
    if name not in ("lattice", "humanoid_tree", "engine_mounts", "stewart_platform", "wheel_set")
]


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if k % 3 else []) for k, name in enumerate(_BOTH)]
)
def test_both_forms_of_bundled_models_agree(monkeypatch, name):
    usual = derive(load(find(name)))
    for constant, value in (("FEWEST_RATES", 1), ("FEWEST_COUPLED", 0.0), ("GAIN", 0.0)):
        monkeypatch.setattr(choice, constant, value)
    lifted = derive(load(find(name)))
    compare(usual, lifted)
    if usual.switches:
        for row in usual.closed.switched:
            compare(usual.closed, lifted.closed, row)


@pytest.mark.parametrize(("name", "option"), [("chain_absolute", "N"), ("lattice", "N")])
def test_series_of_lifted_systems(forced, name, option):
    """A factor of 1 was taken out of sums without end, and what took a node's place came after its readers."""
    system = derive(load(find(name), {option: "2"}))
    y0 = np.concatenate([system.initial_state()[0], system.initial_state()[1]])
    runs = [system.run(t_end=0.05, method=method, rtol=1e-10, atol=1e-12) for method in ("taylor", "dop853")]
    ends = [np.concatenate([run.q[-1], run.v[-1]]) for run in runs]
    assert np.abs(ends[0] - ends[1]).max() < 1e-8 * np.abs(ends[1] - y0).max()


def test_what_fronts_cost_is_counted():
    """Full matrices with many constraints: lifting is looked at, and the other form is done by fronts."""
    from tests.stress.sizes import check

    found = check("ring", 8, "fronts")
    assert found.verdict == "right", found.says


def compare(usual: System, lifted: System, closed: int | None = None) -> None:
    """Hold `rhs` and `project` against each other in random states; one switched constraint may hold."""
    p, (q, v, _, _) = usual.parameter_values(), usual.initial_state()
    if closed is not None:
        p[usual.switched[closed]] = 1.0
    rng = np.random.default_rng(5)
    for _ in range(3):
        y = np.concatenate([q, v]) + 0.2 * rng.standard_normal(usual.nq + usual.nv)
        for k in usual.quaternions:
            y[k : k + 4] /= np.linalg.norm(y[k : k + 4])
        for function in ("rhs", "project"):
            if usual.has(function):
                expected, found = (s.kernel(function)(0.3, y, p) for s in (usual, lifted))
                n = len(expected) - (function == "rhs" and usual.m > 0)  # the ratio is one of another order
                assert np.abs(found - expected)[:n].max() <= 1e-12 * np.abs(expected[:n]).max()


def test_coordinates_without_inertia_are_left_to_their_constraints(forced):
    """Massless sliders on springs beside the ends of rods: they go in pairs with what holds them."""
    model = Model("sliders", gravity=(0, "-9.81"))
    x, y, before = 0, 0, None
    for k in range(4):
        a = model.coordinate(f"a{k}", guess=0.4 * k)
        x, y = x + 0.5 * sin(a), y - 0.5 * cos(a)
        model.body(f"bob{k}", mass=1.0 + k, com=(x, y))
        s = model.coordinate(f"s{k}", guess=0.1)
        model.potential(5.0 * (s - 0.1 * k) ** 2)
        model.dissipation(0.2 * dot(s) ** 2)
        model.constraint(f"on{k}", s - x - 0.3 * y if before is None else s - x * y + before)
        before = s
    assert is_lifted(model)
    system = derive(model)
    state = np.random.default_rng(2).normal(size=system.nq + system.nv)
    assert left_over(system, state, system.parameter_values()) < 1e-14


def test_small_models_and_those_that_gain_nothing_keep_the_matrix():
    assert not is_lifted(chain(4))
    assert not is_lifted(load(find("chain_absolute")))
    assert not is_lifted(load(find("spring_chain")))


def test_series_and_stages_agree():
    system = derive(chain(12))
    ends = [system.run(t_end=0.2, method=m, rtol=1e-11, atol=1e-12) for m in ("taylor", "dop853")]
    np.testing.assert_allclose(ends[0].q[-1], ends[1].q[-1], atol=1e-9)


def without_solve(text: str) -> str:
    """A module as versions before `solve` wrote it."""
    start = text.index('@njit(error_model="numpy")\ndef solve(')
    text = text[:start] + text[text.index("@njit", start + 5) :]
    return re.sub(r'^\s*"solve": .*\n', "", text, flags=re.MULTILINE)


@pytest.mark.parametrize("closed", [False, True])
def test_series_are_those_of_modules_without_the_function_for_right_hand_sides(closed):
    text = derive_text(chain(9, closed=closed)).text
    series = []
    for module in (text, without_solve(text)):
        system = runtime.load(module)
        q, v, _, _ = system.initial_state()
        address, _, *_ = taylor_addresses(system)
        out = np.zeros(N_ROWS * system.ny + 1)
        out[0] = 12.0
        p = system.precomputed(system.parameter_values())
        kernel = ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 3)(int(address))
        kernel(0.0, *(x.ctypes.data for x in (np.concatenate([q, v]), p, out)))
        series.append(out[: 13 * system.ny].reshape(13, -1))
        if closed:
            row = system.kernel("rhs")(0.0, np.concatenate([q, v]), system.parameter_values())
            assert out[-1] == pytest.approx(row[-1], rel=1e-9)
    assert [("solve" in module) for module in (text, without_solve(text))] == [True, False]
    for with_it, without in zip(*series, strict=True):
        assert np.abs(with_it - without).max() <= 1e-11 * np.abs(without).max()


@pytest.mark.parametrize("family", FAMILIES)
def test_any_right_hand_side_is_solved_for(family):
    build, n = FAMILIES[family]
    system = derive(build(n))
    p, rng = system.parameter_values(), np.random.default_rng(1)
    y, right = rng.normal(size=system.nq + system.nv), rng.normal(size=system.nv + system.m)
    found = system.kernel("solve")(0.0, np.concatenate([y, right]), p)
    M = system.kernel("mass_matrix")(0.0, y, p).reshape(system.nv, -1)
    G = system.kernel("constraint_jacobian")(0.0, y, p).reshape(system.m, -1) if system.m else M[:0]
    whole = np.block([[M, -G.T], [G, np.zeros((system.m, system.m))]])
    expected = np.linalg.solve(whole, right)
    assert np.abs(found[: len(right)] - expected).max() <= 1e-10 * np.abs(expected).max()
    if system.m:
        assert min(found[len(right) :]) == pytest.approx(system.kernel("rhs")(0.0, y, p)[-1], rel=1e-9)


def test_subsystems_of_which_only_some_are_lifted_have_the_function_together():
    model = chain(9)
    for k in range(2):
        x = model.coordinate(f"x{k}", start=0.3)
        model.kinetic(dot(x) ** 2 * (1 + k) / 2)
        model.potential(3 * x**2)
    system = derive(model)
    assert len(system.source.header["subsystems"]) > 1
    ends = [system.run(t_end=0.2, method=m, rtol=1e-11, atol=1e-12) for m in ("taylor", "dop853")]
    np.testing.assert_allclose(ends[0].q[-1], ends[1].q[-1], atol=1e-9)
    split = system.run(t_end=0.2, method="taylor", rtol=1e-11, atol=1e-12, split=True)
    np.testing.assert_allclose(split.q[-1], ends[1].q[-1], atol=1e-9)


def test_first_order_states_beside_a_chain_keep_their_own_derivatives(monkeypatch):
    model = Model("driven", gravity=(0, "-9.81"))
    x, y, angles = 0, 0, []
    for k in range(9):
        a = model.coordinate(f"a{k}", start=0.1 * k)
        x, y = x + 0.3 * sin(a), y - 0.3 * cos(a)
        model.body(f"bob{k}", mass=1.0 + 0.1 * k, com=(x, y))
        angles.append(a)
    torque = model.state("torque", derivative=(2 - dot(angles[0]) + sin(angles[1])) / 0.1, start=0.5)
    model.force(angles[0], torque)
    assert is_lifted(model)
    lifted = derive(model)
    monkeypatch.setattr(choice, "FEWEST_RATES", 10**9)
    compare(derive(model), lifted)
    ends = [lifted.run(t_end=0.2, method=m, rtol=1e-11, atol=1e-12) for m in ("taylor", "dop853")]
    np.testing.assert_allclose(ends[0].v[-1], ends[1].v[-1], atol=1e-8)
