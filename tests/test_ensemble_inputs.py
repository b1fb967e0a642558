"""Noise and other inputs over time in ensembles; designs of experiments, and the indices that follow from them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import linalg, stats

from symgen import load
from symgen.runtime.ensemble import choice, linspace, lognormal, noise, normal, triangular, uniform
from symgen.runtime.ensemble.batch import LaneBatch
from symgen.runtime.ensemble.method_choice import numbers_of_sample
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import make_plan
from symgen.runtime.ensemble.sampling import Column, Members
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs import Controller, Table

CART = Path(__file__).parents[1] / "models" / "cart_pole.toml"
OSCILLATOR = """
[parameters]
m = "2 kg"
c = "0.8 N*s/m"
k = "50 N/m"
[coordinates]
x = { unit = "m" }
[bodies.b]
mass = "m"
com = ["x", "0"]
[energy]
potential = "k*x^2/2"
dissipation = "c/2*dot(x)^2"
[forces]
x = "F"
[inputs]
F = { unit = "N" }
"""
UNDAMPED = OSCILLATOR.replace('dissipation = "c/2*dot(x)^2"', "")
OWN = OSCILLATOR.replace(
    'F = { unit = "N" }', 'F = { unit = "N", table = [[0, 1, 2], [0, 5, 0]], kind = "linear" }'
)
KICKED = """
[parameters]
when = "1 s"
[coordinates]
x = { unit = "m" }
[bodies.b]
mass = "2 kg"
com = ["x", "0"]
[forces]
x = "3*heaviside(t - when)"
"""
# y(x1, x2, x3) of Ishigami and Homma (1990) as an output of a model that stands still.
ISHIGAMI = """
[parameters]
x1 = 0.0
x2 = 0.0
x3 = 0.0
a = 7.0
b = 0.1
[coordinates]
s = { unit = "m" }
[bodies.b]
mass = "1 kg"
com = ["s", "0"]
[outputs]
y = "sin(x1) + a*sin(x2)^2 + b*x3^4*sin(x1) + 0*s"
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    def made(name):
        path = tmp_path_factory.getbasetemp() / f"{name.lower()}.toml"
        path.write_text(globals()[name])
        return load(path)

    return made


def test_noise_is_a_members_own(model):
    system = model("OSCILLATOR")
    asked = {"inputs": {"F": noise("3 N", "0.05 s")}, "parameters": {"k": 50.0}, "seed": 3}
    e = system.ensemble(1.0, n=6, **asked)
    assert len(set(e["x"])) == 6
    assert e["x"][:4].tobytes() == system.ensemble(1.0, n=4, threads=1, **asked)["x"].tobytes()
    for k in (0, 5):
        assert e.member(k).states[-1].tobytes() == np.array([e["x"][k], e["dot(x)"][k]]).tobytes()
    given = e.plan.inputs_of(5)["F"]
    run = system.run(1.0, inputs={"F": given}, parameters={"k": 50.0})
    assert abs(run["x"][-1] - e["x"][5]) < 1e-9
    assert system.ensemble(1.0, n=4, **{**asked, "seed": 4})["x"][0] != e["x"][0]


def test_a_method_is_chosen_by_members_with_their_own_noise(model, monkeypatch):
    """Where a trial of the sample gets to the end, it is where these members get to."""
    system, whole = model("OSCILLATOR"), LaneBatch.run
    trials = []

    def run(self, parameters, start, numbers=None, carried=None):
        result = whole(self, parameters, start, numbers, carried)
        trials.append((numbers, self.settings.method, self.settings.t_end, result.end))
        return result

    monkeypatch.setattr(LaneBatch, "run", run)
    asked = {"inputs": {"F": noise("3 N", "0.05 s")}, "parameters": {"k": 50.0}, "seed": 3}
    make_plan(system, EnsembleOptions(1.0, n=1000, **asked))
    monkeypatch.undo()
    numbers, method, t_end, ends = trials[0]
    assert numbers.tolist() == numbers_of_sample(1000) and method == "dop853"
    e = system.ensemble(t_end, n=int(numbers[1]) + 1, method=method, **asked)
    np.testing.assert_allclose(ends[:2, 0], e["x"][numbers[:2]], atol=1e-6)


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5", "rk4", "verlet"])
@pytest.mark.parametrize("kind", ["hold", "linear", "cubic"])
def test_lanes_with_inputs_do_not_change_members(model, method, kind):
    """Each has tables of its own; steps end where their pieces do."""
    system, step = model("OSCILLATOR"), 1 / 173 if method in ("rk4", "verlet") else None
    given = {"F": noise("3 N", "0.07 s", kind=kind)}
    e = system.ensemble(
        1.0, n=30, seed=3, inputs=given, method=method, step=step, parameters={"k": uniform(40, 60)},
        frames=[0.0, 0.07, 0.3, 0.7, 1.0], keep=["x", "dot(x)", "dot(dot(x))"],
    )  # fmt: skip
    assert not e.verdicts.singly.any()
    tolerance = {"rk4": 1e-6, "verlet": 1e-3}.get(method, 3e-7)
    for k in range(30):
        again = e.member(k, e.t)
        rows = np.searchsorted(again.t, e.t)
        for name in ("x", "dot(x)"):
            assert again[name][rows].tobytes() == e[name][k].tobytes()
        force = e.plan.inputs_of(k)["F"]
        run = system.run(
            1.0,
            inputs={"F": force},
            parameters={"k": float(e["k"][k])},
            t_eval=e.t,
            rtol=1e-10,
            method="dop853",
        )
        assert np.abs(run["x"] - e["x"][k]).max() < tolerance
        assert np.isclose(again.input_values[rows[1]], run.input_values[1], rtol=1e-12)
        # The equation, with the force as the table has it: at breaks that of the piece that begins.
        pieces = force.pieces()
        at = [pieces.piece_at(t) for t in e.t]
        value = [
            np.polyval(pieces.coefficients[i][::-1], t - pieces.knots[i])
            for i, t in zip(at, e.t, strict=True)
        ]
        expected = (np.array(value) - 0.8 * e["dot(x)"][k] - float(e["k"][k]) * e["x"][k]) / 2.0
        assert np.allclose(e["dot(dot(x))"][k], expected, atol=1e-9)


def test_series_that_begin_at_rest_are_exact(model):
    """With no rates yet to tell tolerances by, at the start and behind the piece that is zero; `auto` may choose it."""
    system, slow = model("OSCILLATOR"), {"m": np.linspace(2.0, 20.0, 64)}
    for table in (Table([0.0, 1.0, 2.0], [0.0, 5.0, 0.0]), Table([0.0, 0.9, 2.0], [0.0, 0.0, 5.0])):
        chosen = system.ensemble(2.0, inputs={"F": table}, parameters=slow, rtol=1e-12, keep=None)
        assert chosen.method == "taylor", chosen.notes
        e = system.ensemble(2.0, inputs={"F": table}, parameters=slow, method="taylor", rtol=1e-8)
        assert not e.verdicts.singly.any()
        assert e.verdicts.energy_error.max() < 1e-8
        for k in (0, 31, 63):
            given = {"inputs": {"F": table}, "parameters": {"m": float(slow["m"][k])}}
            run = system.run(2.0, method="dop853", rtol=1e-13, atol=1e-15, **given)
            assert abs(run["x"][-1] - e["x"][k]) < 1e-11


@pytest.mark.parametrize(("method", "near"), [("verlet4", 1e-9), ("verlet8", 1e-13), ("rattle4", 1e-9)])
def test_compositions_with_inputs(model, method, near):
    """With work, frames between steps, and a bend of the table that no step of the grid ends on."""
    system, step = model("UNDAMPED"), 1 / 173
    force, times = {"F": Table([0.0, 0.313, 1.0], [0.0, 3.0, -1.0])}, np.array([0.0, 0.1, 0.313, 0.77, 1.0])
    asked = {"n": 11, "seed": 2, "parameters": {"k": uniform(40, 60)}, "inputs": force, "method": method}
    e = system.ensemble(1.0, step=step, frames=times, **asked)
    ends = system.ensemble(1.0, step=step, **asked)
    assert not e.verdicts.singly.any(), e.notes
    assert np.array_equal(ends["x"], e["x"][:, -1])
    assert e.verdicts.energy_error.max() < 1e-8
    for k in (0, 10):
        again = e.member(k, times)
        assert np.array_equal(again.states, np.array([e["x"][k], e["dot(x)"][k]]).T)
        given = {"parameters": {"k": float(e["k"][k])}, "inputs": force, "t_eval": times}
        run = system.run(1.0, method=method, step=step, **given)
        exact = system.run(1.0, method="dop853", rtol=1e-13, atol=1e-15, **given)
        assert np.abs(run.states - again.states).max() < 1e-14
        assert np.abs(exact["x"] - e["x"][k]).max() < near


def test_members_are_at_times_of_their_own(model):
    """A jump in time whose place varies: each lands on its own."""
    system = model("KICKED")
    e = system.ensemble(2.0, n=24, seed=1, parameters={"when": uniform(0.5, 1.5)}, rtol=1e-10, atol=1e-12)
    assert not e.verdicts.singly.any(), e.notes
    left = 2.0 - e["when"]
    assert np.allclose(e["x"], 3.0 * left**2 / 2 / 2, rtol=1e-12)  # 3 N on 2 kg
    assert all(e.member(k).states[-1][0] == e["x"][k] for k in (0, 23))
    assert any(abs(e.member(0).step_log[:, 0] - e["when"][0]) < 1e-12)


def test_noise_has_the_variance_of_the_equation(model):
    """Lyapunov's equation for values that hold: the discrete one of the exact map from value to value."""
    system, deviation, period, t_end = model("OSCILLATOR"), 3.0, 0.1, 15.0
    e = system.ensemble(
        t_end,
        n=400,
        inputs={"F": noise(deviation, period)},
        parameters={"m": uniform(2, 2 + 1e-9)},
        rtol=1e-6,
    )
    a, b = np.array([[0.0, 1.0], [-25.0, -0.4]]), np.array([[0.0], [0.5]])
    both = linalg.expm(np.block([[a, b], [np.zeros((1, 3))]]) * period)
    covariance = linalg.solve_discrete_lyapunov(both[:2, :2], deviation**2 * both[:2, 2:] @ both[:2, 2:].T)
    for name, variance in zip(("x", "dot(x)"), np.diag(covariance)):
        assert abs(e[name].std() / np.sqrt(variance) - 1.0) < 4.0 / np.sqrt(2 * 400)


def test_what_a_model_says_of_inputs_holds_for_members(model):
    system = model("OWN")
    e = system.ensemble(2.0, n=3, parameters={"m": uniform(2, 3)})
    for k in range(3):
        assert abs(e["x"][k] - system.run(2.0, parameters={"m": float(e["m"][k])})["x"][-1]) < 1e-9
    constant = system.ensemble(2.0, parameters={"F": linspace(0.0, 1.0, 3)})
    assert abs(constant["x"][2] - system.run(2.0, inputs={"F": 1.0})["x"][-1]) < 1e-9


def test_other_inputs_are_those_of_single_runs(model):
    system = model("OSCILLATOR")
    push = Table([0.0, 0.5, 1.0], [0.0, 4.0, 0.0])
    brake = Controller(lambda t, x: -20.0 * x[1], period=0.1)
    for value in (push, brake, lambda t: 2.0 * np.sin(3.0 * t)):
        e = system.ensemble(1.0, inputs={"F": value}, n=2, parameters={"k": uniform(40, 60)})
        run = system.run(1.0, inputs={"F": value}, parameters={"k": float(e["k"][1])})
        assert abs(e["x"][1] - run["x"][-1]) < 1e-8
    e = system.ensemble(1.0, inputs={"F": uniform("1 N", "2 N")}, n=3)
    assert e.plan.settings is not None
    assert set(e.varied) == {"F"}


@pytest.mark.parametrize(
    ("inputs", "said"),
    [
        ({"G": 1.0}, "no input 'G'"),
        ({"F": noise(-1.0, 0.1)}, "not negative"),
        ({"F": noise(1.0, 0.0)}, "positive period"),
        ({"F": noise(1.0, 1e-12)}, "has 1e[+]12 values"),
        ({"F": noise("1 m", 0.1)}, "m"),
        ({"F": noise(1.0, 0.1, kind="pink")}, "pink"),
    ],
)
def test_wrong_inputs_are_refused(model, inputs, said):
    with pytest.raises(RuntimeModelError, match=said):
        model("OSCILLATOR").ensemble(1.0, n=2, inputs=inputs, parameters={"k": uniform(1, 2)})


@pytest.mark.parametrize(
    ("sampler", "said"),
    [
        (normal(1.0, -0.1), "deviation is negative"),
        (normal(0.0, 1e308), "beyond the range"),
        (uniform(2.0, 1.0), "above the upper one"),
        (uniform(-1e308, 1e308), "beyond the range"),
        (lognormal(-1.0, 0.1), "median is not positive"),
        (lognormal(0.0, 0.1), "median is not positive"),
        (lognormal(1.0, -0.1), "spread is negative"),
        (lognormal(1.0, 80.0), "beyond the range"),
        (lognormal(1.0, "0.1 N/m"), "number without a unit"),
        (triangular(0.0, 2.0, 1.0), "must rise"),
        (triangular(1.0, 1.0, 1.0), "must rise"),
        (triangular(-1e308, 0.0, 1e308), "beyond the range"),
        (choice(), "nothing to choose from"),
        (normal(float("nan"), 1.0), "must be finite"),
        (linspace(-1e308, 1e308, 3), "beyond the range"),
    ],
    ids=str,
)
def test_what_cannot_be_drawn_is_refused_by_name(model, sampler, said):
    with pytest.raises(RuntimeModelError, match=f"^(model '\\w+': )?k: .*{said}"):
        model("OSCILLATOR").ensemble(1.0, n=3, parameters={"k": sampler})


@pytest.mark.parametrize(("median", "spread"), [(1e-300, 1.0), (1e300, 1.0), (3.0, 60.0)])
def test_a_lognormal_law_is_finite_as_far_as_it_is_accepted(median, spread):
    sampler = lognormal(median, spread).in_si("k", float)
    drawn = Members([Column("k", "parameters", 0, sampler)], 100_000, 1).values(0, 100_000)["k"]
    assert np.isfinite(drawn).all()
    assert (drawn >= 0.0).all()


def test_a_line_of_more_values_than_are_kept_is_refused():
    with pytest.raises(RuntimeModelError, match="900000000 values; give a number from 1 to 10000000"):
        linspace(0.0, 1.0, 900_000_000)


SAMPLERS = {
    "normal": normal(2.0, 0.5), "uniform": uniform(-1.0, 3.0), "lognormal": lognormal(1.5, 0.3),
    "triangular": triangular(0.0, 0.2, 1.0), "choice": choice(1.0, 2.0, 5.0),
}  # fmt: skip


@pytest.mark.parametrize("kind", SAMPLERS)
def test_even_designs_have_the_distribution_of_draws(kind):
    """Quantiles of many draws, and of a Sobol' sequence a hundred times shorter, are the same."""
    sampler = SAMPLERS[kind].in_si(kind, float)
    columns = [Column(name, "parameters", 0, sampler) for name in ("a", "b")]
    drawn = Members(columns, 200_000, 1).values(0, 200_000)["a"]
    even = Members(columns, 2048, 1, "sobol")
    assert even.n == 2048
    shares = [0.05, 0.2, 0.45, 0.8, 0.97]
    found = [np.quantile(x, shares) for x in (drawn, even.values(0, 2048)["b"])]
    assert np.abs(found[0] - found[1]).max() < 0.02
    parts = np.concatenate([even.values(k, k + 512)["b"] for k in range(0, 2048, 512)])
    assert np.array_equal(parts, even.values(0, 2048)["b"])


def test_ishigami(model):
    """The closed form: V1 = (1 + b pi^4/5)^2/2, V2 = a^2/8, V13 = b^2 pi^8 (1/18 - 1/50)."""
    x = {name: uniform(-np.pi, np.pi) for name in ("x1", "x2", "x3")}
    a, b = 7.0, 0.1
    parts = {"1": 0.5 * (1 + b * np.pi**4 / 5) ** 2, "2": a**2 / 8, "13": b**2 * np.pi**8 * (1 / 18 - 1 / 50)}
    variance = sum(parts.values())
    first = np.array([parts["1"], parts["2"], 0.0]) / variance
    total = np.array([parts["1"] + parts["13"], parts["2"], parts["13"]]) / variance
    e = model("ISHIGAMI").ensemble(0.01, n=4096, seed=1, design="saltelli", parameters=x, keep=["y"])
    assert e.n == 4096 * 5
    found = e.sensitivity("y")
    assert found.names == ["x1", "x2", "x3"]
    assert np.abs(found.first - first).max() < 0.02
    assert np.abs(found.total - total).max() < 0.02
    assert ((found.total_low < total + 0.01) & (total - 0.01 < found.total_high)).all()
    assert found.lines()[0].startswith("x2")
    rows = (e["y"] - e["y"].mean()).reshape(-1, 5).T
    by_scipy = stats.sobol_indices(
        func={"f_A": rows[None, 0], "f_B": rows[None, 1], "f_AB": rows[2:, None]}, n=4096
    )
    assert np.abs(by_scipy.first_order - found.first).max() < 2e-3
    assert np.abs(by_scipy.total_order - found.total).max() < 2e-3
    sobol = pytest.importorskip("SALib.analyze.sobol")
    problem = {"num_vars": 3, "names": found.names, "bounds": [[-np.pi, np.pi]] * 3}
    rows = e["y"].reshape(-1, 5)[:, [0, 2, 3, 4, 1]].reshape(-1)  # SALib has B last
    other = sobol.analyze(problem, rows, calc_second_order=False, seed=1)
    assert np.abs(other["S1"] - found.first).max() < 2e-3
    assert np.abs(other["ST"] - found.total).max() < 2e-3
    drawn = model("ISHIGAMI").ensemble(0.01, n=8192, seed=1, parameters=x, keep=["y"]).sensitivity("y")
    assert np.abs(drawn.first - first).max() < 0.03
    assert drawn.total is None


def test_failed_members_take_their_row_with_them(model):
    x = {"x1": uniform(-1, 1), "x2": uniform(-1, 1)}
    e = model("ISHIGAMI").ensemble(0.01, n=64, design="saltelli", parameters=x, keep=["y"])
    e.series["y"][17] = np.nan
    assert e.sensitivity("y").left_out == 1
    assert e.sensitivity("y").n == 63


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"parameters": {"x1": linspace(0, 1, 3)}, "design": "saltelli"}, "what is drawn"),
        ({"parameters": {"x1": np.zeros(20)}, "design": "saltelli"}, "no arrays|what is drawn"),
        ({"parameters": {"x1": uniform(0, 1)}, "n": 10, "design": "latin"}, "design"),
        ({"parameters": {"x1": uniform(0, 1)}, "n": 1 << 30, "design": "sobol"}, "at most"),
    ],
)
def test_designs_that_cannot_be(model, options, said):
    with pytest.raises(RuntimeModelError, match=said):
        model("ISHIGAMI").ensemble(0.01, **options)
    e = model("ISHIGAMI").ensemble(0.01, n=100, parameters={"x1": uniform(0, 1), "x2": linspace(0, 1, 2)})
    with pytest.raises(RuntimeModelError, match="without grids"):
        e.sensitivity("s")
