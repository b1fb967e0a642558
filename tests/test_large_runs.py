"""Runs of a model of 640 freedoms, whose Newton systems are sparse: choice of method, stops, going on after a stop."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from recorded import assert_same_recording, record
from scipy.optimize import brentq

from symgen import Model, dot, runtime
from symgen.link import derive_text
from symgen.runtime import size
from symgen.runtime.integrate.large_models import suited_to_size
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.recording.resume import Resumed

N, MIDDLE = 640, 320
DEPTH, RESTITUTION = 0.05, 0.7
K, C = 100.0, 1.0
PUSH = -np.exp(-(((np.arange(N) - MIDDLE) / 30.0) ** 2))
STARTS = {"start": {f"x{MIDDLE}": 0.0}, "rate": {f"x{i}": float(rate) for i, rate in enumerate(PUSH)}}
BOUNCING = {"method": "radau5", "rtol": 1e-8, "atol": 1e-10, **STARTS}
T_END = 0.25


@pytest.fixture(scope="module")
def text():
    """A line of masses on springs and dampers between two walls, one of them displaced and above a stop."""
    model = Model("line")
    m, k, c, depth, e = model.parameters(m=1.0, k=1e4, c=4e3, depth=1e3, e=RESTITUTION)
    x = [0, *(model.coordinate(f"x{i}", start=float(i == MIDDLE), rate=0.0) for i in range(N)), 0]
    for a in x[1:-1]:
        model.kinetic(m / 2 * dot(a) ** 2)
    for a, b in pairwise(x):
        model.potential(k / 2 * (b - a) ** 2)
        model.dissipation(c / 2 * (dot(b) - dot(a)) ** 2)
    model.stop("anvil", x[1 + MIDDLE] + depth, e)
    return derive_text(model).text


class Line:
    """n masses of 1 between walls, by their modes, which are sines: damping is in proportion to stiffness."""

    def __init__(self, n, k, c):
        j = np.arange(1, n + 1)
        self.shapes = np.sqrt(2.0 / (n + 1)) * np.sin(np.pi * np.outer(j, j) / (n + 1))
        squares = 4.0 * np.sin(np.pi * j / (2.0 * (n + 1))) ** 2
        half, root = c * squares / 2.0, np.sqrt((c * squares / 2.0) ** 2 - k * squares + 0j)
        self.rates = np.array([-half + root, -half - root])

    def parts(self, x, v):
        """The amplitudes of both exponentials of every mode that begins with (x, v)."""
        (r, s), x, v = self.rates, self.shapes @ x, self.shapes @ v
        return np.array([(v - s * x) / (r - s), (r * x - v) / (r - s)])

    def state(self, parts, t):
        """Positions and rates a time t later."""
        terms = parts * np.exp(self.rates * t)
        return self.shapes @ terms.sum(axis=0).real, self.shapes @ (self.rates * terms).sum(axis=0).real


LINE = Line(N, K, C)


def flight(x, v, longest):
    """How long it takes the middle to come down on the anvil (None: longer than it may), and the state then."""
    parts = LINE.parts(x, v)

    def height(s):
        return (LINE.shapes[MIDDLE] * parts * np.exp(LINE.rates * s)).sum().real + DEPTH

    fine = np.arange(1e-4, longest, 1e-3)
    below = np.flatnonzero([height(s) < 0.0 for s in fine])
    if not below.size:
        return None, LINE.state(parts, longest)
    s = brentq(height, *fine[below[0] - 1 : below[0] + 1], xtol=1e-14)
    return s, LINE.state(parts, s)


def bounces(t_end):
    """The times of the impacts, and the state at the end."""
    x, v, t, times = np.zeros(N), PUSH, 0.0, []
    while True:
        s, (x, v) = flight(x, v, t_end - t)
        if s is None:
            return times, x, v
        v[MIDDLE] *= -RESTITUTION
        t += s
        times.append(t)


def held(x, v, t):
    """Positions and rates a time t later, of masses whose middle lies on the anvil."""
    left, right = slice(0, MIDDLE), slice(MIDDLE + 1, N)
    j = np.arange(N)
    rest = -DEPTH * np.minimum((j + 1) / (MIDDLE + 1), (N - j) / (N - MIDDLE))
    moved, rates = rest.copy(), np.zeros(N)
    for side in (left, right):
        line = Line(len(j[side]), K, C)
        off, rates[side] = line.state(line.parts((x - rest)[side], v[side]), t)
        moved[side] += off
    return moved, rates


@pytest.mark.slow
def test_auto_takes_sparse_matrices_for_a_large_stiff_model(text):
    system, line = runtime.load(text), Line(N, 1e4, 4e3)
    assert size.is_large(system)
    run = system.run(t_end=1.0, rtol=1e-6, atol=1e-8)
    assert run.method == "radau9"
    assert any("stability limits the step of dop853" in note for note in run.notes)
    expected, _ = line.state(line.parts(np.eye(N)[MIDDLE], np.zeros(N)), 1.0)
    assert run.q[-1] == pytest.approx(expected, abs=2e-6)
    assert run.stats["steps"] < 300


def bounce(text, t_end=T_END, e=RESTITUTION, **more):
    parameters = {"k": K, "c": C, "depth": DEPTH, "e": e}
    return runtime.load(text).run(t_end=t_end, parameters=parameters, **BOUNCING, **more)


@pytest.fixture(scope="module")
def whole(text, tmp_path_factory):
    """A run with impacts, and its recording."""
    path = tmp_path_factory.mktemp("line") / "whole.rrd"
    return path, record(path, text, lambda **more: bounce(text, **more))


@pytest.mark.slow
def test_stops_throw_a_large_model_back(text, whole):
    _, run = whole
    assert suited_to_size(METHODS["radau5"], runtime.load(text)).family.endswith(":advance_radau_sparse")
    times, x, v = bounces(T_END)
    assert run.status == "success" and run.ok and len(times) == 3
    assert [event.action for event in run.events] == ["impact"] * len(times)
    assert [event.t for event in run.events] == pytest.approx(times, abs=1e-7)
    assert run.q[-1] == pytest.approx(x, abs=1e-7) and run.v[-1] == pytest.approx(v, abs=1e-5)


def test_stops_hold_a_large_model(text):
    """With the anvil closed there is one constraint more, and another pattern of Newton's systems."""
    run = bounce(text, e=0.0)
    t, (x, v) = flight(np.zeros(N), PUSH, T_END)
    v[MIDDLE] = 0.0
    x, v = held(x, v, T_END - t)
    assert run.ok and [event.t for event in run.events] == pytest.approx([t], abs=1e-8)
    assert run.q[-1] == pytest.approx(x, abs=1e-7) and run.v[-1] == pytest.approx(v, abs=1e-5)
    stretch, rate = (2 * s[MIDDLE] - s[MIDDLE - 1] - s[MIDDLE + 1] for s in (x, v))
    assert run["force(anvil)"][-1] == pytest.approx(K * stretch + C * rate, rel=1e-6)


def test_a_stopped_sparse_run_goes_on_bit_for_bit(text, whole, tmp_path):
    """It is stopped behind an impact: the checkpoint holds factors of sparse matrices, and what the impact did."""
    path, a = whole
    first, rest = tmp_path / "first.rrd", tmp_path / "rest.rrd"
    few = int((a.step_log[:, 0] < a.events[0].t).sum()) + 5
    b = record(first, text, lambda **more: bounce(text, max_steps=few, **more))
    assert a.events[0].t < b.t[-1] < a.t[-1]
    c = record(rest, text, Resumed(first).run)
    assert_same_recording(path, rest)
    assert c.stats == a.stats and c.energy.max_error == a.energy.max_error
