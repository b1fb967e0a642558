"""What lifting gains: operations and ns of `rhs`, and of series of order 16, by the matrix and as it is chosen.

    python benchmarks/equations.py [FAMILY …] [--calls N]

Both forms of a model are called by turns, in processor time; the least of nine rounds counts.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections.abc import Callable
from unittest import mock

import numpy as np

from symgen import Model, cos, dot, runtime, sin
from symgen.derive.solve import choice
from symgen.link import derive_text
from symgen.runtime.code import stand_ins
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.taylor.kernel import N_ROWS, taylor_addresses

ROUNDS, ORDER = 9, 16.0


def chain(n: int, space: bool = False, closed: bool = False) -> Model:
    """Point masses on rods of 1 m, by absolute angles; in space by two angles each."""
    model = Model("chain", gravity=(0, "-9.81"))
    m, l = model.parameters(m=1.0, l=1.0)
    x, y, z = 0, 0, 0
    for k in range(n):
        a = model.coordinate(f"a{k}", guess=6.2 * k / (n + 1) if closed else 0.4 + 0.1 * k)
        b = model.coordinate(f"b{k}", guess=0.3) if space else 0
        x, y, z = x + l * sin(a) * cos(b), y - l * cos(a) * cos(b), z + l * sin(b)
        model.body(f"bob{k}", mass=m, com=(x, y, z) if space else (x, y))
    if closed:
        model.constraint("closes_x", x - 0.9)
        model.constraint("closes_y", y - 0.2)
    return model


def rods(n: int) -> Model:
    """Rods by relative angles."""
    model = Model("rods", gravity=(0, "-9.81"))
    m, l = model.parameters(m=1.0, l=1.0)
    x, y, turn = 0, 0, 0
    for k in range(n):
        turn = turn + model.coordinate(f"q{k}", start=0.1 * k)
        half = l / 2 * sin(turn), -l / 2 * cos(turn)
        model.body(f"rod{k}", mass=m, inertia=m * l**2 / 12, com=(x + half[0], y + half[1]), angle=turn)
        x, y = x + 2 * half[0], y + 2 * half[1]
    return model


def windows(n: int) -> Model:
    """Four-bars side by side in natural coordinates, those of the pins: uniform rods of 1 m."""
    model = Model("windows", gravity=(0, "-9.81"))
    m, g = model.parameters(m=1.0, g=9.81)
    pins = [
        (model.coordinate(f"x{k}", guess=k + 0.3), model.coordinate(f"y{k}", guess=0.95))
        for k in range(n + 1)
    ]
    for k, (x, y) in enumerate(pins):
        model.kinetic(m * (dot(x) ** 2 + dot(y) ** 2) / 6)
        model.potential(m * g * y / 2)
        model.constraint(f"rocker{k}", (x - k) ** 2 + y**2 - 1)
    for k, ((x, y), (other_x, other_y)) in enumerate(itertools.pairwise(pins)):
        model.kinetic(m * (dot(x) ** 2 + dot(x) * dot(other_x) + dot(other_x) ** 2) / 6)
        model.kinetic(m * (dot(y) ** 2 + dot(y) * dot(other_y) + dot(other_y) ** 2) / 6)
        model.potential(m * g * (y + other_y) / 2)
        model.constraint(f"coupler{k}", (other_x - x) ** 2 + (other_y - y) ** 2 - 1)
    return model


FAMILIES: dict[str, tuple[Callable[[int], Model], tuple[int, ...]]] = {
    "chain": (chain, (8, 10, 20, 50)),
    "chain in space": (lambda n: chain(n, space=True), (5, 10, 20)),
    "loop": (lambda n: chain(n, closed=True), (10, 20, 50)),
    "rods": (rods, (10, 20, 50)),
    "windows, natural coordinates": (windows, (5, 10, 20, 40)),
}


@jitted
def repeat(address, t, y, p, out, n, first):
    """Call a kernel n times, with the first number that it is given in `out`."""
    for _ in range(n):
        out[0] = first
        call_kernel(address, t, y, p, out)


class Form:
    """One form of a model, loaded and compiled."""

    def __init__(self, model: Model) -> None:
        self.system = system = runtime.load(derive_text(model).text)
        q, v, _, _ = system.initial_state()
        rng = np.random.default_rng(0)
        self.y = np.concatenate([q, v, np.zeros(system.nw)]) + 1e-3 * rng.normal(size=system.ny)
        self.p = system.precomputed(system.parameter_values())
        self.kernel = system.kernel("rhs")
        self.addresses = {"rhs": self.kernel.precomputed_address, "series": taylor_addresses(system)[0]}
        self.out = np.zeros((N_ROWS + 1) * system.ny + 1)

    def seconds(self, what: str, calls: int) -> float:
        start = time.process_time()
        repeat(np.uint64(self.addresses[what]), 0.0, self.y, self.p, self.out, calls, ORDER)
        return (time.process_time() - start) / calls


def main() -> None:
    stand_ins.at_once = True  # what runs come to, however short they are here
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("families", nargs="*", help=f"of {', '.join(FAMILIES)}; all by default")
    parser.add_argument("--calls", type=int, default=2000)
    chosen = parser.parse_args()
    print("| model | operations of `rhs` | ns | series of order 16, µs |\n|---|---:|---:|---:|")
    for name, (build, sizes) in FAMILIES.items():
        for n in sizes if not chosen.families or name in chosen.families else ():
            print(row(f"{name}, {n}", build, n, chosen.calls), flush=True)


def row(title: str, build: Callable[[int], Model], n: int, calls: int) -> str:
    """A line of the table: by the matrix → as it is chosen."""
    with mock.patch.object(choice, "FEWEST_RATES", 10**9):
        by_matrix = Form(build(n))
    forms = by_matrix, Form(build(n))
    cells = [" → ".join(str(form.system.operations["rhs"]) for form in forms)]
    of_series = ("series", 1e6, max(1, calls // 10), ".3g")
    for what, scale, n_calls, digits in (("rhs", 1e9, calls, ".0f"), of_series):
        times: tuple[list[float], list[float]] = ([], [])
        for form in forms:
            form.seconds(what, 2)
        for _ in range(ROUNDS):
            for form, found in zip(forms, times, strict=True):
                found.append(form.seconds(what, n_calls))
        cells.append(" → ".join(f"{min(found) * scale:{digits}}" for found in times))
    return f"| {title} | {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
