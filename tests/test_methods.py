"""What the records of methods say about them, held against what their steps do; tables that are made from them."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest
from method_tables import README, with_tables

from symgen.link import derive
from symgen.model.model import Model
from symgen.runtime import load
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.explicit.tableau import ErkTableau
from symgen.runtime.integrate.forms import FORMS, SUITED
from symgen.runtime.integrate.methods import METHODS, RECORDS
from symgen.runtime.loop_arrays import LoopArrays

FIXTURES = Path(__file__).parent / "fixtures"
EXPLICIT = [record for record in RECORDS if record.growth is not None]
OF_TABLEAUS = [record for record in EXPLICIT if record.family.endswith(("advance_erk", "advance_partition"))]
STIFF = [record for record in METHODS.values() if record.stiff]
# Growth by one step of 100 rad; methods for stiff motion that do not damp the fastest keep it.
_AT_MOST = 1.0 + 1e-6


def named(record):
    return f"{record.name}-{record.form}"


@functools.cache
def oscillator(damping):
    model = Model("oscillator")
    model.coordinate("x", start=1.0)
    model.kinetic("dot(x)**2/2")
    if damping < 1.0:
        model.potential("x**2/2")
    model.force("x", f"{-2 * damping if damping < 1.0 else -1.0}*dot(x)")
    return derive(model)


def one_step(system, record, h, state, most=1):
    """Take one step of length h, whatever its error is; or `most` steps that may be shorter."""
    arrays = LoopArrays(
        system, record, system.parameter_values(), 0.0, np.array(state, dtype=float), frame_times=np.zeros(0),
        rtol=1e6 if record.adaptive else 1e-10, atol=1e6 if record.adaptive else 1e-10, step=h,
        with_events=False,
    )  # fmt: skip
    arrays.control[at.H_MAX] = h
    assert arrays.advance(h, 50) == at.REACHED_STOP
    assert arrays.counters[at.STEPS] <= most
    return arrays.y[: system.nq + system.nv]


@pytest.mark.parametrize("damping", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("record", [r for r in EXPLICIT if r.form == "projection"], ids=named)
def test_growth_is_that_of_the_step(record, damping):
    system = oscillator(damping)
    if record.refusal(system):
        return
    for z in (0.5, 1.7, 3.1):
        matrix = np.column_stack([one_step(system, record, z, unit) for unit in np.eye(2)])
        grows = np.abs(np.linalg.eigvals(matrix))
        # Without a spring one eigenvalue belongs to the position, which stays: the step is judged by the other one.
        seen = grows.max() if damping < 1.0 else np.abs(matrix[1, 1])
        said = float(record.growth(np.array([z]), damping)[0])
        assert max(seen, 1.0) == pytest.approx(max(said, 1.0), rel=1e-9)


@pytest.mark.parametrize("damping", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("record", STIFF, ids=named)
def test_methods_for_stiff_motion_are_stable_at_any_step(record, damping):
    system = oscillator(damping)
    # Newton's iterations of `bdf` may ask for shorter ones.
    matrix = np.column_stack([one_step(system, record, 100.0, unit, most=50) for unit in np.eye(2)])
    assert np.abs(np.linalg.eigvals(matrix)).max() <= _AT_MOST


@pytest.mark.parametrize("record", [r for r in METHODS.values() if not r.adaptive], ids=named)
def test_symplectic_steps_keep_areas_and_others_do_not(record):
    system = load(FIXTURES / "pendulum.py")
    h, off, start = 0.1, 1e-2, np.array([1.5, 0.4])
    # In the plane of angle and angular velocity, as the inertia is constant.
    columns = [
        (one_step(system, record, h, start + off * unit) - one_step(system, record, h, start - off * unit))
        * (8.0 / (12.0 * off))
        - (
            one_step(system, record, h, start + 2 * off * unit)
            - one_step(system, record, h, start - 2 * off * unit)
        )
        / (12.0 * off)
        for unit in np.eye(2)
    ]
    area = np.linalg.det(np.column_stack(columns))
    if record.symplectic:
        assert area == pytest.approx(1.0, abs=1e-7)
    else:
        assert abs(area - 1.0) > 1e-6


@pytest.mark.parametrize("record", OF_TABLEAUS, ids=named)
def test_records_say_what_their_tableaus_do(record):
    tableau = record.coefficients(None)
    assert isinstance(tableau, ErkTableau)
    assert tableau.order == record.order
    assert tableau.n_stages - tableau.fsal == record.evaluations
    assert bool(tableau.estimate) == record.adaptive
    assert bool(tableau.stiff_bound) == record.adaptive
    if record.adaptive:
        # Where Hairer's test for stiffness sees the limit: not beyond it, and not far before it.
        z = np.array([0.9, 1.0, 1.05]) * tableau.stiff_bound
        assert (record.growth(z, 1.0)[:2] <= 1.0).all() and record.growth(z, 1.0)[2] > 1.0


def test_each_form_has_a_method_that_is_taken_for_it():
    assert set(SUITED) == set(FORMS)
    for form, methods in FORMS.items():
        assert [name for name, record in methods.items() if record.suits_form] == [SUITED[form]]


def test_tables_of_the_readme_are_those_of_the_records(request):
    text = README.read_text(encoding="utf-8")
    made = with_tables(text)
    if request.config.getoption("--update-golden"):
        README.write_text(made, encoding="utf-8")
        text = made
    assert made == text, "README.md: run pytest tests/test_methods.py --update-golden"
