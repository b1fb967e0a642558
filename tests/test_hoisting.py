"""Work that depends on parameters only is found, gathered, and done once per set of parameters; results stay."""

from __future__ import annotations

import re

import numpy as np
import pytest
from lowered import assert_same_bits
from mechanisms import CONSTRAINED, FREE
from random_expressions import evaluate

from symgen import Model, cos, dot, runtime, sin
from symgen.derive.graph import hoist
from symgen.derive.graph.graph import Graph
from symgen.derive.graph.hoist import gather
from symgen.derive.graph.nodes import INPUT, PARAM, Q, T
from symgen.derive.pipeline import derive
from symgen.link import derive_text
from symgen.model.library import find, load
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.errors import ModuleError


def chain(n: int = 4) -> Model:
    """Masses on a line, coupled by a full constant mass matrix and springs."""
    m = Model("chain")
    a, k = m.parameters(a=0.3, k=20.0)
    x = [m.coordinate(f"x{i}", start=0.1 * i) for i in range(n)]
    m.kinetic(sum(dot(q) ** 2 for q in x) / 2 + a / 2 * sum(i * dot(q) for i, q in enumerate(x, 1)) ** 2)
    m.potential(k / 2 * sum(q**2 for q in x))
    return m


def swing() -> Model:
    m = Model("swing")
    mass, l, g, u = *m.parameters(m=0.5, l=0.7, g=9.81), m.input("u", default=0.2)
    theta = m.coordinate("theta", start=0.4, rate=0.0)
    m.gravity(y=-g)
    m.body("bob", mass=mass, com=(l * sin(theta), -l * cos(theta)))
    m.force(theta, u * u * mass * l)
    m.run(t_end=0.5)
    return m


@pytest.mark.parametrize("n", [4, 30])
def test_a_constant_mass_matrix_is_factored_once(n):
    """What is left of the solve is its two triangles: n(n-1) products and differences, n scalings."""
    system = chain(n).derive()
    text = system.source.functions["rhs"]
    body = text[text.index("    q_x0 = ") :]
    assert system.structure["constant_mass"] and "/" not in body and "_ldl(" not in body
    found = derive_text(chain(n))
    assert found.operations["rhs"] - found.once["rhs"] <= 2 * n * n + n
    p, y = system.parameter_values({"a": 0.7}), np.linspace(0.1, 0.9, 2 * n)
    row = np.zeros(2 * n)
    call_kernel(system.kernel("rhs").precomputed_address, 0.0, y, system.precomputed(p), row)
    weights = np.arange(1.0, n + 1)
    mass = np.eye(n) + 0.7 * np.outer(weights, weights)
    np.testing.assert_allclose(row[n:], np.linalg.solve(mass, -20.0 * y[:n]), rtol=1e-9)


def test_what_depends_on_inputs_and_time_is_not_hoisted():
    text = swing().derive().source.functions["rhs"]
    hoisted = re.findall(r"^    c\d+ = (.*)$", text, re.MULTILINE)
    assert hoisted and not any(re.search(r"\b(u_|q_|v_|t\b|x\d)", line) for line in hoisted)
    assert text.index("c0 = ") < text.index("q_theta = ") < text.index("u_u = p[3]")


def test_other_parameters_are_computed_anew():
    """A run with changed parameters is the run of a model with these values."""
    model = swing()
    system, changed = model.derive(), {"m": 0.8, "l": 1.3, "u": -0.4}
    other = derive_text(model).text
    for name, value in changed.items():
        other = re.sub(rf'("name": "{name}", "unit": "", "value": )[-0-9.]+', rf"\g<1>{value}", other)
    runs = [system.run(parameters=changed), runtime.load(other).run()]
    assert_same_bits(runs[0].q, runs[1].q)
    assert np.abs(runs[0].q[-1] - system.run().q[-1]).max() > 1e-2


def test_every_way_to_call_keeps_to_the_contract():
    """Kernels take the short p wherever a user calls them, whatever was prepared before."""
    system, y = swing().derive(), np.array([0.3, -0.2])
    kernel = system.kernel("rhs")
    for values in ({}, {"l": 0.2}, {"m": 3.0, "g": 1.6}):
        p = system.parameter_values(values)
        precomputed = system.precomputed(p)
        assert len(p) == system.n_p == 4 and len(precomputed) == system.n_precomputed > 4
        expected = np.zeros(2 + system.nw)
        system.python_function("rhs")(0.0, y, p, expected)
        assert_same_bits(kernel(0.0, y, p), expected)
        for address, passed in (
            (kernel.address, p),
            (kernel.address, precomputed),
            (kernel.precomputed_address, precomputed),
        ):
            out = np.zeros(len(expected))
            call_kernel(address, 0.0, y, passed, out)
            assert_same_bits(out, expected)
        out = np.zeros(len(expected))
        system.numba("rhs")(0.0, y, p, out)
        assert_same_bits(out, expected)


def test_nothing_to_hoist_changes_nothing():
    m = Model("plain")
    m.kinetic(dot(m.coordinate("x")) ** 2 / 2)
    system = m.derive()
    p = system.parameter_values()
    assert system.source.header["hoisted"] == {} and len(system.precomputed(p)) == 0
    kernel = system.kernel("rhs")
    assert kernel.address == kernel.precomputed_address


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        (
            '"rhs": {n},\n        "mass',
            '"rhs": {more},\n        "mass',
            "hoisted values, but the header says",
        ),
        ("c0 = ", "c0 = y[0] + ", "only p\\[i\\] can be read"),
    ],
)
def test_a_header_that_lies_is_refused(old, new, cause):
    text = derive_text(swing()).text
    n = runtime.load(text).source.header["hoisted"]["rhs"]
    head, functions = text.split("@njit", 1)
    wrong = head[head.index('"hoisted"') :].replace(old.format(n=n), new.format(more=n + 1))
    functions = functions.replace(old, new, 1)
    system = runtime.load(head[: head.index('"hoisted"')] + wrong + "@njit" + functions)
    with pytest.raises(ModuleError, match=cause):
        system.kernel("rhs")


@pytest.mark.parametrize("build", (*FREE, *CONSTRAINED), ids=lambda f: f.__name__)
def test_gathering_saves_and_changes_nothing_but_rounding(build):
    program = derive(build())
    g, head = program.graph, program.header
    rng = np.random.default_rng(5)
    for f in program.functions:
        new = gather(g, f.outputs)
        assert hoist.count(g, new)[2] <= hoist.count(g, f.outputs)[2]
        variables = {n: rng.uniform(0.2, 0.9) for n in g.reachable([*f.outputs, *new]) if g.op[n] == "var"}
        variables |= {
            n: head["parameters"][g.args[n][1]]["value"] for n in variables if g.args[n][0] == PARAM
        }
        before, after = (np.array(evaluate(g, list(x), variables)) for x in (f.outputs, new))
        scale = np.maximum(1.0, np.abs(before))
        finite = np.isfinite(before)
        assert np.all(np.abs(after - before)[finite] <= 1e-8 * scale[finite]), f.name


def test_gathering_by_hand():
    g = Graph()
    p, r, u, x, t = g.var(PARAM, 0), g.var(PARAM, 1), g.var(INPUT), g.var(Q), g.var(T)
    product = g.mul(p, g.mul(t, g.mul(r, x)))
    assert gather(g, (product,)) == (g.mul(g.mul(p, r), g.mul(t, x)),)
    shared = g.mul(r, x)
    kept = g.mul(t, shared)
    assert gather(g, (kept, shared)) == (kept, shared)  # pulling r out of `kept` would cost a product
    assert gather(g, (g.div(g.mul(r, x), p),)) == (g.mul(g.mul(g.div(g.one, p), r), x),)
    assert gather(g, (g.mul(u, x), g.add(p, r))) == (g.mul(u, x), g.add(p, r))


def test_entries_that_gathering_shows_to_be_zero_are_not_written():
    """The disc's angular momenta: terms with one parameter each cancel once their parameters are gathered."""
    text = derive_text(load(find("rolling_disc"))).text
    assert "out[22]" not in text[text.index("def mass_matrix") : text.index("def forces")]
    assert "= 0.0\n" not in text[text.index("def mass_matrix") : text.index("def forces")]
