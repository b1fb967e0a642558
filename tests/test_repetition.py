"""Long models from short ones: the text is that of a derivation in full, and what is not regular is derived in full."""

import ast
from functools import cache

import numpy as np
import pytest

from symgen import Model, runtime, sin
from symgen.derive import pipeline
from symgen.derive.scenes.repetition import repetition
from symgen.emit import stretched
from symgen.link import derive_text
from symgen.model.library import find, load
from symgen.runtime import module

N, LATE = 200, ("residual_jacobian",)


@cache
def chain():
    return load(find("chain_absolute"), {"N": str(N)})


@pytest.fixture(scope="module")
def long():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stretched, "FEWEST_BLOCKS", 100)
        return stretched.long_model(chain().describe(), "", LATE)


def test_functions_and_tables_are_those_of_a_derivation_in_full(long):
    """The same model with the same names, derived at its own length."""
    model = repetition(chain().describe(), 100).shortened(N)
    full = pipeline.derive(model, gathered=False, late=LATE)
    made = stretched.pieces(full, by_loops=True)
    assert long.pieces == made
    assert list(long.pieces.tables) == list(made.tables)
    assert long.counts == full.all_counts() and long.written == full.written_operations()
    assert full.findings == long.findings[: len(full.findings)]


def test_numbers_and_header_are_those_of_the_model(long):
    """Its own module has other sums first, as x10 stands before x9; its names and starts are the user's."""
    texts = long.text, derive_text(chain(), on_demand=True).text
    system, other = map(runtime.load, texts)
    mine, theirs = (module.read_module(text).header for text in texts)
    left_out = ("source", "operations", "hoisted")
    assert {k: v for k, v in mine.items() if k not in left_out} == {
        k: v for k, v in theirs.items() if k not in left_out
    }
    rng = np.random.default_rng(3)
    y = np.concatenate([rng.normal(size=system.nq), rng.normal(size=system.nv)])
    p = system.parameter_values()
    for name in ("rhs", "energy", "gamma", "project"):
        found, expected = (x.kernel(name)(0.0, y, p) for x in (system, other))
        assert np.abs(found - expected).max() <= 1e-10 * np.abs(expected).max(), name


def springs(n=20, change=None):
    """Masses on springs in a row, the first on the world; `change` makes them unequal."""
    model = Model("row")
    m = model.parameters(m=1.0)
    before = 0
    for i in range(n):
        x = model.coordinate(f"x{i}", guess=0.1 * i)
        other = change(model, i, x) if change else None
        model.body(f"b{i}", mass=m if other is None else other, com=(x, 0))
        model.constraint(f"c{i}", x - before - sin(x - before))
        before = x
    return model.describe()


def test_blocks_are_found():
    found = repetition(springs(), 10)
    assert (found.n_blocks, found.first, found.last) == (20, 1, 20)
    assert repetition(springs(), 21) is None
    short = found.shortened(12)
    assert len(short.coordinates) == len(short.bodies) == len(short.constraints) == 12
    again = repetition(short, 10)  # the cut is not to be seen
    assert (again.n_blocks, again.first, again.last) == (12, 1, 12)


def _heavier_in_the_middle(model, i, x):
    return model.parameters(m2=2.0) if i == 10 else None


def _own_mass(model, i, x):
    return model.parameters(**{f"m{i}": 1.0})


def _moved_by_the_first(model, i, x):
    if i:
        model.force(x, model.parameters(**{f"k{i}": 1.0}))


@pytest.mark.parametrize("change", [_heavier_in_the_middle, _own_mass, _moved_by_the_first])
def test_unequal_blocks_are_no_repetition(change):
    assert repetition(springs(change=change), 10) is None


def test_what_mentions_blocks_far_away_is_no_repetition():
    model = Model("ring")
    m = model.parameters(m=1.0)
    xs = [model.coordinate(f"x{i}") for i in range(20)]
    for i, x in enumerate(xs):
        model.body(f"b{i}", mass=m, com=(x, 0))
        model.constraint(f"c{i}", x - xs[i - 1] - sin(x))  # the first hangs on the last
    assert repetition(model.describe(), 10) is None


def test_irregular_numbers_are_refused():
    with pytest.raises(stretched.Irregular):
        stretched.polynomial(np.array([[0], [1], [8], [27]]))
    with pytest.raises(stretched.Irregular):
        stretched._texts(["a[3]", "a[4]", "a[5]", "b[6]"], 9)
    assert stretched._texts([f"x3 = y[{2 * n}] + 1.5e3*w[{n * n}]" for n in range(4)], 9) == (
        "x3 = y[18] + 1.5e3*w[81]"
    )
    tables = [np.r_[7, 3 * np.arange(n) + (np.arange(n) % 2), n] for n in (20, 24, 28, 32)]
    assert stretched._table(tables, 5) == (*np.r_[7, 3 * np.arange(40) + (np.arange(40) % 2), 40],)
    tables[2][11] += 1
    with pytest.raises(stretched.Irregular):
        stretched._table(tables, 5)


@pytest.mark.parametrize(
    "doc", ["plain", "is True, or None", 'says \\": True,\\" twice', "back\\\\slash", "a true one", "NaN"]
)
def test_large_headers_are_read_as_python_reads_them(doc):
    records = "".join(
        f'        {{"name": "x{k}", "value": {0.1 * k}, "enforced": {k % 2 == 0}, "doc": "{doc}"}},\n'
        for k in range(2800)
    )
    text = f'{{\n    "nq": 2800,\n    "coordinates": [\n{records}    ],\n    "late": [],\n}}'
    assert repr(module._literal(text)) == repr(ast.literal_eval(text))
