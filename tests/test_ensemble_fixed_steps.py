"""Members of fixed steps are doubted where they are off, and only there: the truth is in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import symgen
from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.ensemble import linspace, noise

_LIMIT, _MARGIN = 0.05, 0.2  # of a range; how near to that either verdict will do
_METHODS = {
    "verlet": 0.06, "rk4": 0.3, "verlet4": 0.5, "rattle": 0.06, "rattle4": 0.4, "gauss4": 0.4,
    "implicit_midpoint": 0.05, "generalized_alpha": 0.08, "euler": 1e-3,
}  # fmt: skip


def spring() -> runtime.System:
    """A mass of 1 kg on a spring, x = cos(w t), whose stiffness is a parameter."""
    m = Model("mass_on_spring")
    k = m.parameter("k", "1 N/m")
    x = m.coordinate("x", unit="m", start=1.0)
    m.body("mass", mass="1 kg", com=(x, 0))
    m.potential(k * x**2 / 2)
    return runtime.load(derive_text(m).text)


@pytest.mark.parametrize("method", _METHODS)
@pytest.mark.parametrize("frames", [None, 21])
def test_members_are_doubted_where_they_are_off(method, frames):
    t_end, step = 40.0, _METHODS[method]
    e = spring().ensemble(
        t_end, method=method, step=step, parameters={"k": linspace(0.02, 9.0, 41)}, frames=frames,
        keep=["x", "dot(x)"],
    )  # fmt: skip
    w, t = np.sqrt(e["k"])[:, None], e.t[None, :]
    x, v = (e[name].reshape(len(w), -1) for name in ("x", "dot(x)"))
    off = np.maximum(abs(x - np.cos(w * t)) / 2.0, abs(v + w * np.sin(w * t)) / (2.0 * w)).max(axis=1)
    sure = abs(off / _LIMIT - 1.0) > _MARGIN
    wrong = off > _LIMIT
    assert wrong[sure].any() and (~wrong)[sure].any()
    ok = e.verdicts.ok
    assert not (ok & wrong & sure).any()  # none is wrong and says nothing
    kept_energy = e.verdicts.energy_error < 1e-2
    assert (ok | wrong | ~sure | ~kept_energy).all()  # and none is right and doubted for its motion
    assert "smaller step" in " ".join(e.health.lines())


def test_what_explicit_steps_cannot_follow_is_held_against_half_the_step():
    """A spring of 1e10 N/m beside one of 1 N/m: implicit steps of a hundredth of the slow period go over it."""
    m = Model("stiff_and_slow")
    k = m.parameter("k", "1 N/m")
    x, y = m.coordinate("x", unit="m", start=1.0), m.coordinate("y", unit="m", start=1.0)
    for name, place in (("one", x), ("other", y)):
        m.body(name, mass="1 kg", com=(place, 0))
    m.potential(k * x**2 / 2 + 1e10 * (x - y) ** 2 / 2)
    system = runtime.load(derive_text(m).text)
    e = system.ensemble(40.0, method="generalized_alpha", step=0.1, parameters={"k": linspace(0.02, 9.0, 21)})
    w = np.sqrt(e["k"] / 2.0)
    off = abs(e["x"] - np.cos(w * 40.0)) / 2.0
    assert not e.verdicts.ok[off > 1.2 * _LIMIT].any() and (off > 1.2 * _LIMIT).sum() > 3
    assert e.verdicts.ok[w < 0.3].all()


def test_noise_is_that_of_the_member():
    system = symgen.load("cart_pole")
    name = system.inputs[0]["name"]
    e = system.ensemble(1.0, n=40, seed=3, method="rk4", step=0.005, inputs={name: noise("1 N", "50 ms")})
    assert e.health.ok, e.health.lines()


def test_verdicts_do_not_depend_on_the_other_members_or_threads():
    system = symgen.load("double_pendulum")
    given = {"method": "rk4", "step": 0.15, "start": {"theta1": linspace(0.5, 2.5, 200)}}
    one, two = (system.ensemble(4.0, threads=threads, **given).verdicts.ok for threads in (1, 2))
    assert 0 < one.sum() < 200 and (one == two).all()
    part = system.ensemble(
        4.0, **{**given, "start": {"theta1": np.linspace(0.5, 2.5, 200)[60:90]}}
    ).verdicts.ok
    assert (part == one[60:90]).all()


def test_accuracy_of_fixed_steps_is_that_of_half_the_step():
    e = spring().ensemble(40.0, method="verlet", step=0.06, parameters={"k": linspace(0.5, 4.0, 21)})
    w, found = np.sqrt(e["k"]), e.accuracy()
    x, v = abs(e["x"] - np.cos(w * 40.0)), abs(e["dot(x)"] + w * np.sin(w * 40.0))
    off = np.maximum(x, v / np.abs(w * np.sin(w * 40.0)).max())
    assert found["errors"][off > 0.01] == pytest.approx(off[off > 0.01], rel=0.3)
