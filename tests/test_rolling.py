"""Large functions in loops: the same numbers as operation by operation, in every form of the code; what is short."""

from __future__ import annotations

import ctypes
import functools

import numpy as np
import pytest

from symgen import Model, dot, runtime
from symgen.derive.graph.graph import Graph
from symgen.derive.graph.nodes import PARAM, Q
from symgen.derive.rolling import FEWEST, may_be_short, schedule
from symgen.derive.rolling import find as find_clusters
from symgen.derive.scenes.subsystems import derive
from symgen.derive.solve import factorise
from symgen.emit import module as function_text
from symgen.emit.module import emit
from symgen.model.library import find, load
from symgen.runtime.abi import array_sizes
from symgen.runtime.code.angles import side_by_side


def springs(n=9):
    """A row of masses on springs, each with parameters of its own, so that what follows from these differs in each."""
    model = Model("row")
    before = 0
    for k in range(n):
        m, c = model.parameters(**{f"m{k}": 1.0 + 0.1 * k, f"c{k}": 20.0 + k})
        x = model.coordinate(f"x{k}", start=0.1 * k)
        model.kinetic(m / 2 * dot(x) ** 2)
        model.potential(c / 2 * (x - before) ** 2)
        model.dissipation(c**2 / (m * c + 1) * dot(x) ** 2)
        before = x
    return model.describe()


def bundled(name, n):
    return load(find(name), {"N": str(n)}).describe()


MODELS = {
    "chain": lambda: bundled("chain_absolute", 8),
    "lattice": lambda: bundled("lattice", 4),
    "masses on springs": springs,
    "pendulums in absolute angles": lambda: bundled("n_pendulum", 7),
    "pendulums, solved by lifting": lambda: bundled("n_pendulum", 14),
}


PIVOT_RATIO_LAST = ("rhs",)


@pytest.fixture(scope="module", params=list(MODELS))
def pair(request):
    """A model written out, and with everything in loops and its constraints in fronts."""
    description = MODELS[request.param]()
    plain = runtime.load(emit(derive(description)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(function_text, "SMALLEST_ROLLED", 0)
        patch.setattr(function_text, "SMALLEST_IN_TURNS", 0)
        patch.setattr(function_text, "SMALLEST_WITH_FRONTS", 0)
        patch.setattr(factorise, "FEWEST_IN_FRONTS", 2)
        patch.setattr(factorise, "LEAST_IN_FRONTS", 0)
        rolled = runtime.load(emit(derive(description)))
    return plain, rolled


def test_same_numbers_in_every_form(pair):
    """Beside the text that is written out; Python and machine code, whole and prepared, agree to the bit."""
    plain, rolled = pair
    p = plain.parameter_values()
    rng = np.random.default_rng(4)
    for name in plain.source.functions:
        n_y, n_out = array_sizes(plain.source.header, name)
        y = rng.uniform(-1.0, 1.0, n_y)
        expected, by_python = plain.kernel(name)(0.3, y, p), np.zeros(n_out)
        rolled.python_function(name)(0.3, y, p, by_python)
        kernel = rolled.kernel(name)
        scale = np.abs(expected).max()
        values = slice(None)
        if name in PIVOT_RATIO_LAST:  # which depends on the order of elimination
            values = slice(-1)
            assert by_python[-1] == pytest.approx(expected[-1], rel=0.1), name
        assert by_python[values] == pytest.approx(expected[values], rel=1e-9, abs=1e-11 * scale), name
        # Sines that are found side by side are our own, and off by one unit of the last digit (test_angles.py).
        off = 1e-12 if side_by_side(kernel.source.code.form) else 0.0
        for by_code in (kernel(0.3, y, p), _precomputed(rolled, kernel, y, p)):
            np.testing.assert_allclose(by_code, by_python, rtol=off, atol=0.01 * off * scale, err_msg=name)


def _precomputed(system, kernel, y, p):
    p, out = system.precomputed(p), np.zeros(kernel.out_size)
    call = ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 3)(kernel.precomputed_address)
    call(0.3, y.ctypes.data, p.ctypes.data, out.ctypes.data)
    return out


def test_numba_compiles_the_same_text():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(function_text, "SMALLEST_WITH_FRONTS", 0)
        patch.setattr(factorise, "FEWEST_IN_FRONTS", 2)
        patch.setattr(factorise, "LEAST_IN_FRONTS", 0)
        system = runtime.load(emit(derive(bundled("chain_absolute", 5))))
    y = np.random.default_rng(0).uniform(-1.0, 1.0, 30)
    out = np.zeros(system.kernel("rhs").out_size)
    system.njit_function("rhs")(0.0, y, system.parameter_values(), out)
    assert np.array_equal(out, system.kernel("rhs")(0.0, y, system.parameter_values()))


@functools.cache
def chain_of(n):
    return runtime.load(emit(derive(bundled("chain_absolute", n)))).source


@pytest.mark.parametrize("name", ["rhs", "project", "residual", "residual_jacobian", "energy", "poses"])
def test_text_does_not_grow_with_a_chain(name):
    lengths = [chain_of(n).functions[name] for n in (150, 190)]
    assert abs(lengths[0].count("\n") - lengths[1].count("\n")) <= 10
    assert "for k in range" in lengths[0]


def test_a_long_sum_is_made_in_a_loop():
    g = Graph()
    terms = [g.call("sin", g.var(Q, k)) for k in range(40)]
    total = g.zero
    for k, term in enumerate(terms):
        total = g.sub(total, term) if k % 2 else g.add(total, term)
    (found,) = find_clusters(g, [(0, g.mul(g.const(0.5), total))]).sums.values()
    assert sorted(found) == sorted(((-1) ** k, term) for k, term in enumerate(terms))


def test_a_recurrence_is_one_loop_in_its_order():
    """Each member reads what the one before made: they stay together, ascending."""
    g = Graph()
    a, kept = g.var(Q, 0), []
    for k in range(30):
        a = g.call("sin", g.mul(g.add(a, g.var(Q, k)), g.var(PARAM, 0)))
        kept.append(a)
    found = schedule(g, find_clusters(g, list(enumerate(kept))))
    largest = max((group for stage in found.stages for group in stage), key=lambda group: len(group.members))
    roots = [member.root for member in largest.members]
    assert len(roots) >= 28
    assert roots == sorted(roots)


def in_order(found):
    """Members with what they need, as the text goes through them: groups of one stage and length in one loop."""
    for stage in found.stages:
        loops: dict[int, list] = {}
        for group in stage:
            if len(group.members) < FEWEST:
                yield from zip(group.members, group.needs, strict=True)
            else:
                loops.setdefault(len(group.members), []).append(group)
        for groups in loops.values():
            for members in zip(*([*zip(g.members, g.needs, strict=True)] for g in groups), strict=True):
                yield from members


def two_kinds(n, skip=()):
    """Two kinds of step that read each other in turn; some of one kind are left out."""
    g = Graph()
    a, b, kept = g.var(Q, 0), g.var(Q, 1), []
    for k in range(n):
        a = g.call("sin", g.mul(a, b))
        b = b if k in skip else g.call("cos", g.mul(a, b))
        kept += [a, b]
    return schedule(g, find_clusters(g, list(enumerate(kept)))), set(kept)


@pytest.mark.parametrize("skip", [(), (3,), (9, 20, 21), (1, 4, 6, 9, 11, 14, 16, 19, 21, 24, 26, 29)])
def test_circles_are_gone_through_in_turns(skip):
    """Two kinds of step that read each other are one loop where they take turns, in whatever rhythm."""
    found, kept = two_kinds(30, skip)
    made: set[int] = set()
    for member, needs in in_order(found):
        assert made.issuperset(needs)
        assert member.root not in made
        made.add(member.root)
    assert made >= kept
    assert found.is_short()


def test_short_circles_are_taken_apart():
    found, kept = two_kinds(FEWEST - 1)
    assert all(len(group.members) < FEWEST for stage in found.stages for group in stage)
    assert {member.root for member, _ in in_order(found)} >= kept


def test_a_lifted_solve_is_two_loops():
    """Forwards and back through a chain whose mass matrix is full: its text does not grow, its numbers are the same."""
    texts, values = {}, []
    for n, smallest in ((24, 0), (32, 0), (32, 10**9)):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(function_text, "SMALLEST_ROLLED", smallest)
            patch.setattr(function_text, "SMALLEST_IN_TURNS", smallest)
            system = runtime.load(emit(derive(bundled("n_pendulum", n))))
        texts[n, smallest] = system.source.functions["rhs"]
        if n == 32:
            y = np.random.default_rng(1).uniform(-2.0, 2.0, 64)
            # By Python: machine code takes sines of straight-line code several at a time, by digits of their own.
            row = np.zeros(system.kernel("rhs").out_size)
            system.python_function("rhs")(0.0, y, system.parameter_values(), row)
            values.append(row)
            assert system.kernel("rhs")(0.0, y, system.parameter_values()) == pytest.approx(row, rel=1e-10)
    assert abs(texts[24, 0].count("\n") - texts[32, 0].count("\n")) <= 10
    assert 10 * len(texts[32, 0]) < 3 * len(texts[32, 10**9])
    assert np.array_equal(*values)


def test_an_index_that_falls_needs_no_table():
    g = Graph()
    written = [(40 - k, g.call("sin", g.var(Q, k))) for k in range(20)]
    (largest,) = (group for stage in schedule(g, find_clusters(g, written)).stages for group in stage)
    assert largest.places == sorted(largest.places)


def test_what_does_not_repeat_is_not_short():
    g = Graph()
    x = g.var(Q, 0)
    different = [g.mul(g.const(2.0 + k), g.call("sin", g.mul(g.const(3.0 + k), x))) for k in range(12)]
    clusters = find_clusters(g, list(enumerate(different)))
    assert not schedule(g, clusters).is_short() and not may_be_short(g, clusters)
    equal = [g.call("sin", g.mul(g.const(3.0), g.var(Q, k))) for k in range(3 * FEWEST)]
    clusters = find_clusters(g, list(enumerate(equal)))
    assert schedule(g, clusters).is_short() and may_be_short(g, clusters)


@pytest.mark.parametrize("name", ["quadruped", "stewart_platform", "n_four_bar"])
def test_a_first_look_refuses_no_function_that_is_short_in_loops(name):
    program = derive(load(find(name), {}).describe())
    looked, short = [], []
    for function in program.functions:
        clusters = find_clusters(program.graph, function.written())
        looked.append(may_be_short(program.graph, clusters))
        short.append(schedule(program.graph, clusters).is_short())
    assert all(a or not b for a, b in zip(looked, short, strict=True))
    assert any(short) and not all(looked)
