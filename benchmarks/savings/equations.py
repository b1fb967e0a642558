"""Savings of the derivation: what equations have no code for, or code that runs once."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

from savings.measure import (
    CALLS,
    Row,
    bundled,
    by_turns,
    calls,
    derived,
    difference,
    replaced,
    without_hoisting,
)
from symgen.derive.solve import dense_solve
from symgen.link import derive as system_of
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.model.model import Model
from symgen.runtime import System


def tied_masses(n: int) -> System:
    """Masses on a line, tied by springs and by inertia: M is constant and tridiagonal."""
    model = Model("tied_masses")
    model.parameters(m=0.5, k=100.0, c=0.1)
    x = [model.coordinate(f"x{i}", start=0.01 * (i % 5)) for i in range(n)]
    for before, after in zip([0, *x], x, strict=False):
        model.potential(f"k/2*(({after})-({before}))**2")
    for before, after in itertools.pairwise(x):
        model.kinetic(f"m/2*dot({before})**2 + c/4*(dot({before})+dot({after}))**2")
    model.kinetic(f"m/2*dot({x[-1]})**2")
    return system_of(model)


def hoisting() -> Iterator[Row]:
    """Work on parameters, the factors of a constant mass matrix among it."""
    once, factored = "work on parameters once", "constant M factored once"
    scenes = {
        "double_pendulum": (once, bundled("double_pendulum")),
        "cart_pole": (once, bundled("cart_pole")),
        "quarter_car": (once, bundled("quarter_car")),
        "seven_dof_arm": (once, bundled("seven_dof_arm")),
        "tied masses, 30": (factored, tied_masses(30)),
        "tied masses, 200": (factored, tied_masses(200)),
    }
    for scene, (saving, system) in scenes.items():
        values, seconds = calls(system, without_hoisting(system))
        yield Row(f"{scene}, rhs", saving, *seconds, difference(*values))


def precomputed() -> Iterator[Row]:
    """Precomputed parameters kept from one call to the next."""
    system = tied_masses(200)
    p, other = system.parameter_values(), system.parameter_values({"m": 0.6})
    first = system.precomputed(p)

    def kept() -> None:
        for _ in range(2 * CALLS):
            system.precomputed(p)

    def anew() -> None:
        for _ in range(CALLS):
            system.precomputed(other)
            system.precomputed(p)

    seconds = [total / (2 * CALLS) for total in by_turns(kept, anew)]
    yield Row("tied masses, 200", "precomputed p kept", *seconds, difference(first, system.precomputed(p)))


def gathered() -> Iterator[Row]:
    """Parameters collected in products."""
    for name in ("cart_pole", "pendulum_field", "quarter_car", "slider_crank", "andrews_squeezer"):
        systems = derived(name), derived(name, gathered=False)
        for function in ("rhs", "residual"):
            values, seconds = calls(*systems, function=function)
            yield Row(f"{name}, {function}", "parameters gathered in products", *seconds, difference(*values))


def articulated() -> Iterator[Row]:
    """Trees solved body by body."""
    values, seconds = calls(derived("humanoid_tree"), derived("humanoid_tree", articulated=False))
    yield Row("humanoid_tree, rhs", "M⁻¹f body by body", *seconds, difference(*values))


def structural_zeros() -> Iterator[Row]:
    """Zeros of matrices that are zero for all states: not written."""
    name = "residual_jacobian"
    for scene in ("spring_chain", "chain_absolute", "humanoid_tree"):
        system = bundled(scene)
        n = (system.nv + system.m) * (system.nq + 2 * system.nv + system.m)
        text = system.source.functions[name]
        zeros = "".join(f"    out[{k}] = 0.0\n" for k in range(n) if f"    out[{k}] = " not in text)
        full = System(replace(system.source, functions=system.source.functions | {name: text + zeros}))
        values, seconds = calls(system, full, function=name)
        yield Row(f"{scene}, {name}", "structural zeros not written", *seconds, difference(*values))


def sparse_factors() -> Iterator[Row]:
    """LDLᵀ of [M Gᵀ; G 0] by what is not zero, written out; without, the whole matrix is factored by loops."""
    for name in ("andrews_squeezer", "stewart_platform", "chain_absolute"):
        sparse = derived(name)
        with replaced(dense_solve, worthwhile=lambda n, n_entries: True):
            full = derived(name)
        (a, b), seconds = calls(sparse, full)
        accelerations = slice(sparse.nq, sparse.nq + sparse.nv)
        same = difference(a[:, accelerations], b[:, accelerations])
        yield Row(f"{name}, rhs", "sparse LDLᵀ", *seconds, same)


def carts(n: int, bent: bool) -> System:
    """Carts on a line, each two held at a distance; `bent` hides that such a constraint is linear."""
    model = Model("carts")
    model.parameters(m=0.5, k=100.0, d=0.3, none=0.0)
    x = [model.coordinate(f"x{i}", guess=0.3 * i) for i in range(n)]
    for before, after in zip([0, *x], x, strict=False):
        model.potential(f"k/2*(({after})-({before}))**2")
    for i, (a, b) in enumerate(zip(x[::2], x[1::2], strict=True)):
        model.constraint(f"rod{i}", f"{b} - {a} - d" + (f" + none*({b} - {a})**2" if bent else ""))
    for a in x:
        model.kinetic(f"m/2*dot({a})**2")
    return system_of(model)


def linear_constraints() -> Iterator[Row]:
    """Constraints that are linear in the coordinates: their Jacobian is constant, and so are all factors."""
    (a, b), seconds = calls(carts(12, False), carts(12, True))
    yield Row("12 carts in pairs, rhs", "constant constraint Jacobian", *seconds, difference(a, b))


def swings(n: int, coupled: bool) -> System:
    """Elastic pendulums on one spring, M in blocks of two; `coupled` hides that it is."""
    model = Model("swings")
    model.parameters(m=0.5, k=100.0, g=9.81, none=0.0)
    names = [
        (model.coordinate(f"a{i}", start=0.1 + 0.01 * i), model.coordinate(f"r{i}", start=1.0))
        for i in range(n)
    ]
    for i, (a, r) in enumerate(names):
        model.body(f"b{i}", mass="m", com=(f"{r}*sin({a})", f"-{r}*cos({a})"))
        model.kinetic(f"m/10*dot({a} + {r})**2")
        model.potential(f"k/2*({r} - 1)**2")
    for (a, _), (b, s) in itertools.pairwise(names):
        model.potential(f"k/20*({a} - {b})**2")
        if coupled:
            model.kinetic(none_times(a, s))
    model.gravity(y="-g")
    return system_of(model)


def none_times(a: object, b: object) -> str:
    """A kinetic energy that is none, as only its parameter says."""
    return f"none*dot({a})*dot({b})"


def block_mass() -> Iterator[Row]:
    """A mass matrix in blocks, each factored by itself."""
    values, seconds = calls(swings(12, False), swings(12, True))
    yield Row("12 elastic pendulums in a row, rhs", "M in blocks", *seconds, difference(*values))


def absent() -> Iterator[Row]:
    """Nothing for dissipation and inputs where there are none."""
    for name, rates in (("double_pendulum", ("theta1", "theta2")), ("pendulum", ("theta",))):
        lossy = load_model(find(name), {})
        lossy.parameter("no_loss", 0.0)
        lossy.dissipation(" + ".join(f"no_loss/2*dot({rate})**2" for rate in rates))
        (values, more), seconds = calls(bundled(name), system_of(lossy))
        same = difference(values, more[:, : values.shape[1]])
        yield Row(f"{name}, rhs", "no dissipation, no power", *seconds, same)
        driven = load_model(find(name), {})
        for rate in rates:
            driven.force(rate, driven.input(f"no_torque_{rate}", unit="N*m"))
        (values, more), seconds = calls(bundled(name), system_of(driven))
        same = difference(values, more[:, : values.shape[1]])
        yield Row(f"{name}, rhs", "no inputs", *seconds, same)


CASES = (
    hoisting, precomputed, gathered, articulated, structural_zeros, sparse_factors, linear_constraints, block_mass,
    absent,
)  # fmt: skip
