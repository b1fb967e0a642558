"""Equal subsystems side by side: the functions of one in loops over several, and the motion of each by itself."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model, cos, dot, sin
from symgen.link import derive
from symgen.runtime import solve
from symgen.runtime.integrate import layout as at
from symgen.runtime.subsystems import groups
from symgen.runtime.subsystems.decomposition import divide
from symgen.runtime.subsystems.groups import can_stand_side_by_side, side_by_side

FUNCTIONS = (
    "rhs",
    "mass_matrix",
    "forces",
    "energy",
    "residual",
    "residual_jacobian",
    "kinematics",
    "project",
)


def swings(n: int, damping: float = 0.0, lengths=None) -> Model:
    """Elastic pendulums of two coordinates, each with parameters and a start of its own, in one field of gravity."""
    m = Model("swings")
    g, u = m.parameter("g", 9.81), m.input("wind", default=0.02)
    for k in range(n):
        length = lengths[k] if lengths else 0.5 + 0.01 * k
        l, c = m.parameter(f"l{k}", length), m.parameter(f"c{k}", damping)
        theta = m.coordinate(f"theta{k}", start=0.5 + 0.02 * k, rate=0.1)
        r = m.coordinate(f"r{k}", start=length)
        x, y = r * sin(theta), -r * cos(theta)
        m.kinetic(0.1 * (dot(x) ** 2 + dot(y) ** 2) / 2)
        m.potential(0.1 * g * y + 20 / l * (r - l) ** 2)
        m.force(f"theta{k}", u * l)
        if damping:
            m.dissipation(c * dot(r) ** 2 / 2)
    return m


def tops(n: int) -> Model:
    """Bodies that turn about their centres."""
    m = Model("tops")
    for k in range(n):
        m.body(f"b{k}", mass=1.0, com=(0, 0, 0.1), inertia=(0.1, 0.2, m.parameter(f"i{k}", 0.15 + 0.01 * k)))
        m.joint(f"j{k}", "spherical", child=f"b{k}")
    m.gravity(z=-m.parameter("g", 9.81))
    return m


@pytest.fixture
def early(monkeypatch):
    """Groups, however short the run."""
    monkeypatch.setattr(groups, "_WORTH", dict.fromkeys(groups._WORTH, (0, 0)))


@pytest.mark.parametrize("model", [swings(3), swings(3, 0.5), tops(3)], ids=["free", "damped", "turning"])
def test_functions_of_each_member(model):
    """Each function of three side by side writes what that of one writes, member by member; sums are sums."""
    whole = derive(model)
    (kind,), _ = divide(whole)
    one, rng = kind.system, np.random.default_rng(3)
    assert can_stand_side_by_side(one)
    three = side_by_side(one, 3)
    nq, nv, n_own = one.nq, one.nv, len(one.parameters)
    p = whole.parameter_values()[kind.p]
    p = p * (1.0 + 0.1 * rng.random(p.shape))
    states = rng.normal(0.6, 0.1, (3, nq + 2 * nv))
    blocks = np.split(states, [nq, nq + nv], axis=1)
    y, joint_p = (
        np.concatenate([b.ravel() for b in blocks]),
        np.concatenate([p[:, :n_own].ravel(), p[:, n_own:].ravel()]),
    )
    for name in FUNCTIONS:
        if not one.has(name):
            continue
        length = len(y) if name.startswith("residual") else 3 * (nq + nv)
        own_length = length // 3
        found = three.kernel(name)(0.0, y[:length], joint_p)
        own = [one.kernel(name)(0.0, states[k, :own_length], p[k]) for k in range(3)]
        assert _joined(name, own, one) == pytest.approx(found, rel=1e-13, abs=1e-13), name


def _joined(name: str, own: list[np.ndarray], one) -> np.ndarray:
    """What three members write, as one model of them does."""
    nq, nv = one.nq, one.nv
    if name == "energy":
        return np.sum(own, axis=0)
    if name == "mass_matrix":
        return _diagonal([x.reshape(nv, nv) for x in own]).ravel()
    if name == "residual_jacobian":
        parts = np.split(np.array([x.reshape(nv, -1) for x in own]), [nq, nq + nv], axis=2)
        return np.hstack([_diagonal(part) for part in parts]).ravel()
    if name == "kinematics":
        matrix = _diagonal([x[: nq * nv].reshape(nq, nv) for x in own])
        return np.concatenate(
            [matrix.ravel(), _diagonal([x[nq * nv :].reshape(nq, nq) for x in own]).ravel()]
        )
    cuts = [nq, nq + nv] if name in ("rhs", "project") else []
    parts = [part.ravel() for part in np.split(np.array(own), cuts, axis=1)]
    if name == "rhs" and one.nw:
        parts[2] = parts[2].sum(keepdims=True)
    return np.concatenate(parts)


def _diagonal(blocks) -> np.ndarray:
    rows, columns = blocks[0].shape
    result = np.zeros((len(blocks) * rows, len(blocks) * columns))
    for k, block in enumerate(blocks):
        result[k * rows : (k + 1) * rows, k * columns : (k + 1) * columns] = block
    return result


@pytest.mark.parametrize(("method", "damping"), [("dop853", 0.0), ("dop853", 0.3), ("taylor", 0.0)])
def test_each_moves_as_by_itself(early, monkeypatch, method, damping):
    """The oracle integrates each by itself at tolerances a thousand times as tight."""
    system = derive(swings(19, damping))
    options = {"t_end": 4.0, "method": method, "split": True}
    found = solve(system, rtol=1e-8, atol=1e-10, **options)
    members = [s for s in found.parts.found if isinstance(s, groups.Group)]
    assert [len(s.titles) for s in members] == [8, 8]
    assert len(found.parts.found) == 2 + 3
    assert any(note.startswith("subsystems: 16 of 19 in 2 groups") for note in found.notes)
    monkeypatch.setattr(groups, "grouped", list)
    monkeypatch.setattr("symgen.runtime.subsystems.simulate.grouped", lambda found: list(found))
    alone = solve(system, rtol=1e-8, atol=1e-10, **options)
    assert all(len(s.titles) == 1 for s in alone.parts.found)
    exact = solve(system, rtol=1e-11, atol=1e-13, **options)
    errors = [np.abs(run.q - exact.q).max(axis=0) for run in (found, alone)]
    assert errors[0].max() < 4.0 * errors[1].max() and errors[0].max() < 1e-6
    assert found.energy.max_error < 1e-7
    title, error = found.parts.worst_energy()
    assert error < 1e-7 and "subsystem of theta" in title.replace("subsystems", "subsystem")


def test_who_joins(early):
    """Those of like speed, eight at a time; not what rests, what is too fast for the others, or twins."""
    lengths = [0.5 + 0.001 * k for k in range(8)] + [0.005, 0.5 + 0.0005, 0.5 + 0.0015, 0.5015]
    system = derive(swings(12, lengths=lengths))
    start = {"theta11": 0.7, "theta10": 0.7}
    found = solve(system, t_end=0.5, method="dop853", split=True, start=start).parts.found
    joined = [s for s in found if isinstance(s, groups.Group)]
    (group,) = joined
    assert len(group.titles) == 8 and "subsystem of theta8" not in group.titles
    twins = next(s for s in found if len(s.columns) == 2)
    assert twins.titles == ["subsystem of theta10", "subsystem of theta11"]
    rates = [member.choice.rate for member in group.members]
    assert max(rates) <= 1.2 * min(rates) and group.choice.rate == max(rates)


def test_what_rests_is_left_alone(early):
    m = Model("resting")
    for k in range(10):
        x = m.coordinate(f"x{k}", start=0.0 if k == 4 else 0.1 + 0.01 * k)
        m.kinetic(dot(x) ** 2 / 2)
        m.potential(m.parameter(f"k{k}", 4.0) * x**2 / 2)
    found = solve(derive(m), t_end=3.0, method="dop853", split=True)
    by_title = {title: s for s in found.parts.found for title in s.titles}
    assert by_title["subsystem of x4"].run.n_steps == 0
    assert isinstance(by_title["subsystem of x0"], groups.Group)
    np.testing.assert_allclose(found["x5"], 0.15 * np.cos(2 * found.t), atol=1e-6)


def test_short_runs_do_without():
    """A kernel for several takes longer to compile than a short run takes."""
    found = solve(derive(swings(16)), t_end=0.2, method="dop853", split=True)
    assert len(found.parts.found) == 16


def test_samples_and_energies_of_all(early):
    """Groups land on times and count energies as single subsystems do."""
    system = derive(swings(17, 0.3))
    options = {"t_end": 1.0, "method": "dop853", "rtol": 1e-10, "atol": 1e-12, "at": [0.3, 0.7]}
    found, one = solve(system, split=True, **options), solve(system, split=False, **options)
    assert sorted(len(s.titles) for s in found.parts.found) == [1, 8, 8]
    for ours, theirs in zip(found.samples, one.samples, strict=True):
        assert ours.t == theirs.t
        np.testing.assert_allclose(ours.q, theirs.q, atol=1e-8)
        assert ours.energy == pytest.approx(theirs.energy, rel=1e-8)
    assert found.energy.max_error < 1e-8


def test_a_failure_names_the_group(early):
    m = Model("failing")
    for k in range(8):
        x = m.coordinate(f"x{k}", start=1.0 + 0.01 * k)
        m.kinetic(dot(x) ** 2 / 2)
        m.force(x, m.parameter(f"b{k}", 1.0) * x**3)
    found = solve(derive(m), t_end=5.0, method="dop853", split=True)
    assert found.status == "failed"
    assert found.message.startswith("8 subsystems side by side, the first of them the subsystem of x0: ")


def test_tolerances_where_another_method_takes_over(early):
    """Series are judged by their largest term, `dop853` by a mean over the group: only that needs tighter ones."""
    found = solve(derive(swings(8)), t_end=0.5, method="auto", split=True)
    (group,) = found.parts.found
    control = group.run.arrays.control
    assert group.choice.method.name == "taylor" and control[at.RTOL] == found.rtol
    group.run._fall_back()
    assert group.run.method.name == "dop853"
    assert control[at.RTOL] == pytest.approx(found.rtol / np.sqrt(8.0))
